"""Whole walls of 5 to 20 strokes, and flights with faults in vision: flown in parts, with goals by the true state."""
