"""Open-loop replay of recorded flights: proof that a change of the code changes no command (docs/development.md)."""
