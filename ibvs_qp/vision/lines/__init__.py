"""Lines: search, sub-pixel fit, judgement, tracks and guides."""
