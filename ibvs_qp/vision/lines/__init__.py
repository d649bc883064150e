"""Lines: search, sub-pixel fit, score, tracks and guides."""
