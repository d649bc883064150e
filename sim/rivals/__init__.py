"""Rival control laws for the comparison: strict priorities, and prediction; no part of the shipped controller.

They fly as the `controller` of `sim.flight.options.FlightOptions`, as a law of the user's does.
"""

#: Strict priorities, and model-predictive control.
LEXICOGRAPHIC, MPC = "sim.rivals.lexicographic:LexicographicController", "sim.rivals.mpc:MpcController"
