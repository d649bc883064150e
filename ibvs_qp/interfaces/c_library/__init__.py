"""The controller as a self-contained C library."""
