"""The painting strategy: what to do next, as references for the controller."""
