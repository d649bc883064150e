"""Scenes drawn over the whole documented range of their keys, flown, and judged by the truth."""
