"""For 05_solvers: recorded ticks through many solvers, accuracy against time."""
