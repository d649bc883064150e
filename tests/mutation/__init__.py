"""Guards, the tests that fail without them, and the run that shows it."""
