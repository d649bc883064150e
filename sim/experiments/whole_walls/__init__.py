"""Whole walls of 5 to 20 strokes, and flights with faults in vision: flown in parts, judged by the truth."""
