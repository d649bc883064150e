"""Checks of all inputs: measurements, references, sensor frames and their time stamps."""
