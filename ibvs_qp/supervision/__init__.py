"""Supervision of a flight: monitors, the state machine of the reactions, and flight after the loss of a rotor."""
