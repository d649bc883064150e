"""Files of the simulator: what is read from outside is bounded, what is written is complete or absent."""
