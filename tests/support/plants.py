"""Plants put somewhere by hand."""

from __future__ import annotations

import math

import numpy as np

from sim.world.mujoco_frames import FLIP
from sim.world.plant import Plant


def at_rest(plant: Plant, position: np.ndarray, rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Plant:
    """Put a plant somewhere, turned by a rotation vector (FRD)."""
    half = 0.5 * float(np.linalg.norm(rotation))
    axis = np.asarray(rotation) / max(2.0 * half, 1e-12)
    plant.data.qpos[:3] = FLIP * position
    plant.data.qpos[3:] = [math.cos(half), *(FLIP * axis * math.sin(half))]
    plant.data.qvel[:] = 0.0
    plant._read()
    return plant
