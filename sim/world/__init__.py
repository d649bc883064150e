"""The true world: board, wall, wind, vehicle and contact in MuJoCo, and the canvas that is painted."""
