"""The surface in the picture: its plane, its samples and where it ends."""
