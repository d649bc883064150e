"""Between this controller and other systems: parameters of autopilots, motor commands."""
