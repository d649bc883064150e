"""Scenes drawn over the whole documented range of their keys, flown, and checked by the truth."""
