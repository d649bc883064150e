"""The video of a flight: the vehicle from outside, camera pictures, push; H.264 and animated WebP."""
