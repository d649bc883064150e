"""Stability of the contact: vehicle, wall, force feedback and impedance as one linear loop."""
