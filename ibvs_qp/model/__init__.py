"""Common to all tasks: vehicle, wall, contact, disturbance and reach as symbols, and the compiled step function."""
