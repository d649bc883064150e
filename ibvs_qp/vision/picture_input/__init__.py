"""From the raw pictures of an RGB-D camera to the registered, rectified picture that perception takes."""
