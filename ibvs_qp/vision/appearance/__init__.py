"""What board and paint look like, in the light that falls on them."""
