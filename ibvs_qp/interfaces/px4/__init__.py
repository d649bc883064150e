"""Bridge to PX4 over DDS, without ROS; experimental, needs the extra ``dds``."""
