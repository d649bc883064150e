"""Checks of what comes in: measurements, references, sensor frames and their time stamps."""
