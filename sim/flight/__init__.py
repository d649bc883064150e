"""One closed-loop flight: world, sensors and pilot, its faults, log and trace."""
