"""The camera's motion: from the body's, from points of the surface, and velocity by optical flow."""
