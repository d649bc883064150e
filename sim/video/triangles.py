"""Triangles of the geoms of a MuJoCo model, with normals and colours."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

#: Corners of a round geom's outline, and of a quarter circle of its caps.
_ROUND, _QUARTER = 20, 2


@dataclass(frozen=True)
class Triangles:
    """A surface: V corners, T triangles."""

    points: np.ndarray  # (V, 3) [m]
    normals: np.ndarray  # outward unit normals, (V, 3)
    colours: np.ndarray  # red, green, blue 0..1, (V, 3)
    indices: np.ndarray  # corners of every triangle, int32 (T, 3)

    @classmethod
    def joined(cls, parts: list[Triangles]) -> Triangles:
        """Several surfaces as one."""
        starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
        indices = [part.indices + start for part, start in zip(parts, starts, strict=True)]
        return cls(
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.colours for part in parts]),
            np.concatenate(indices).astype(np.int32),
        )


def geom_triangles(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Triangles | None:
    """Surface of a sphere, capsule, cylinder or box in the world; None for another kind.

    Args:
        model: The model.
        data: Its state with poses of the geoms.
        geom: Index of the geom.
    """
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    kind = kinds(int(model.geom_type[geom]))
    if kind == kinds.mjGEOM_BOX:
        points, normals, indices = _box(size)
    elif kind == kinds.mjGEOM_CYLINDER:
        radius, half = size[:2]
        bottom = [(0, -half, 0, -1), (radius, -half, 0, -1), (radius, -half, 1, 0)]
        points, normals, indices = _revolved([*bottom, (radius, half, 1, 0), (radius, half, 0, 1), (0, half, 0, 1)])
    elif kind in (kinds.mjGEOM_CAPSULE, kinds.mjGEOM_SPHERE):
        radius, half = size[0], (size[1] if kind == kinds.mjGEOM_CAPSULE else 0.0)
        angles = np.linspace(0.0, 0.5 * np.pi, _QUARTER + 1)
        cap = [(radius * np.cos(a), half + radius * np.sin(a), np.cos(a), np.sin(a)) for a in angles]
        points, normals, indices = _revolved([(r, -z, n, -m) for r, z, n, m in reversed(cap)] + cap)
    else:
        return None
    rotation = data.geom_xmat[geom].reshape(3, 3)
    colours = np.tile(model.geom_rgba[geom, :3].astype(float), (len(points), 1))
    return Triangles(points @ rotation.T + data.geom_xpos[geom], normals @ rotation.T, colours, indices)


def _revolved(profile: list[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Surface of revolution about z of a profile of (radius, z, normal's radial part, its z), from below."""
    outline = np.array(profile)
    angles = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    across = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    points, normals = (
        np.concatenate(
            [np.column_stack((across * radial, np.full(_ROUND, axial))) for radial, axial in outline[:, columns]]
        )
        for columns in ((0, 1), (2, 3))
    )
    ring, after = np.arange(_ROUND), (np.arange(_ROUND) + 1) % _ROUND
    indices = []
    for lower in range(len(profile) - 1):
        a, b = lower * _ROUND + ring, lower * _ROUND + after
        c, d = a + _ROUND, b + _ROUND
        indices += [np.column_stack((a, b, d)), np.column_stack((a, d, c))]
    return points, normals, np.concatenate(indices)


def _box(half: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, normals, indices = [], [], []
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    for axis in range(3):
        for side in (-1.0, 1.0):
            face = np.zeros((4, 3))
            face[:, (axis + 1) % 3], face[:, (axis + 2) % 3], face[:, axis] = square[:, 0] * side, square[:, 1], side
            start = 4 * len(points)
            points.append(face * half)
            normals.append(np.tile(side * np.eye(3)[axis], (4, 1)))
            indices += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return np.concatenate(points), np.concatenate(normals), np.array(indices)
