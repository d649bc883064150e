"""Monitors: each watches one quantity and says in words what is wrong with it; empty while nothing is."""
