"""Closed-loop simulation: plant, sensors, camera, flights, metrics, report and command line."""
