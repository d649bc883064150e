"""Sensor models: truth in, what a real IMU, force/torque sensor and camera deliver out."""
