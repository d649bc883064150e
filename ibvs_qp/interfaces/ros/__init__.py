"""ROS messages and bags to sensor frames, and back; needs the extra ``ros``, but no ROS installation."""
