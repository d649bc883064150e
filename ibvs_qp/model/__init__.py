"""What all tasks share: vehicle, wall, contact, disturbance and reach as symbols, and the compiled step function."""
