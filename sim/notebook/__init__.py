"""What the notebooks in notebooks/ call: flights, figures, controls, and the copies for reading.

A cell only calls; whatever decides or computes lives here or further down, where it is tested and typed.
"""
