"""Sensor models of IMU, force/torque sensor, camera and line perception."""
