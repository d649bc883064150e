"""Ways in and out of the controller: logs, ROS bags, PX4 over DDS, and the C library."""
