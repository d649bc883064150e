"""Files of the simulator: inputs from outside are bounded, written files are complete or absent."""
