"""Solvers of the program by `solver.name`: one file each, with its class as ``SOLVER``."""
