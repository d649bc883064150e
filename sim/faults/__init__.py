"""Faults in flight: of sensors, plant, clock and solver."""
