"""The picture of a curved wall as if the wall were unrolled onto its tangent plane at the tip: edges are straight."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame

#: Distance of the rays that are followed to the wall; the map between them is interpolated [px].
NODE_PX = 16


def wall_axes(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors along the wall, right and down in the picture, in C, (3,) each; ``normal`` points into the wall."""
    right = np.array((1.0, 0.0, 0.0)) - normal * normal[0]
    right /= math.sqrt(float(right @ right))
    return right, np.cross(normal, right)


def principal(curvature: np.ndarray) -> tuple[float, float]:
    """The curvature of larger size [1/m], and the angle of its direction from right to down [rad].

    Args:
        curvature: Entries (right right, right down, down down) of the curvature [1/m], (3,), > 0 for a bulge.
    """
    a, b, d = curvature.tolist()
    mean, half = 0.5 * (a + d), math.hypot(0.5 * (a - d), b)
    sign = 1.0 if mean >= 0.0 else -1.0
    angle = 0.5 * math.atan2(2.0 * b, a - d)
    return mean + sign * half, angle if sign > 0.0 else angle + 0.5 * math.pi


def unrolled(frame: RgbdFrame, plane: np.ndarray, curvature: np.ndarray, tip: np.ndarray) -> RgbdFrame:
    r"""The frame before the tangent plane: colours and depths of the places at which its rays meet the unrolled wall.

    A place at a along the direction of a curvature :math:`\kappa` and b across it, from the point T where the tip meets
    the wall, lies at

    .. math:: T + \frac{\sin \kappa a}{\kappa} e_1 + b e_2 + \frac{1 - \cos \kappa a}{\kappa} n

    Args:
        frame: Colour and depth.
        plane: (a, b, c) of the tangent plane, 1/Z = a x + b y + c [1/m], (3,).
        curvature: Entries (right right, right down, down down) [1/m], (3,).
        tip: The tip in C [m], (3,).
    """
    height, width = frame.depth.shape
    fx, fy, cx, cy = frame.intrinsics
    # Nodes start one cell before the picture: OpenCV's resize puts pixel j at node (j + 0.5) / cell - 0.5.
    v, u = (np.mgrid[: height // NODE_PX + 3, : width // NODE_PX + 3] - 0.5) * NODE_PX - 0.5
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones_like(u)), axis=-1)
    kappa, angle = principal(curvature)
    size = math.sqrt(float(plane @ plane))
    normal = plane / size
    right, down = wall_axes(normal)
    first = math.cos(angle) * right + math.sin(angle) * down
    second = math.cos(angle) * down - math.sin(angle) * right
    touched = tip + normal * (1.0 / size - float(normal @ tip))
    flat = rays / (rays @ plane)[..., None]
    along, across = (flat - touched) @ first, (flat - touched) @ second
    turn = kappa * along
    places = (
        touched
        + (np.sin(turn) / kappa)[..., None] * first
        + across[..., None] * second
        + ((1.0 - np.cos(turn)) / kappa)[..., None] * normal
    )
    nodes = places[..., :2] / places[..., 2:] * (fx, fy) + (cx, cy)
    maps = cv2.convertMaps(_dense(nodes, height, width), np.empty(0, np.float32), cv2.CV_16SC2)
    nearer = _dense(flat[..., 2] / places[..., 2], height, width)
    rgb = cv2.remap(frame.rgb, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    depth = cv2.remap(frame.depth, maps[0], np.empty(0, np.float32), cv2.INTER_NEAREST)  # holes (0) must not mix
    return dataclasses.replace(frame, rgb=rgb, depth=depth * nearer)


def _dense(nodes: np.ndarray, height: int, width: int) -> np.ndarray:
    rows, columns = (NODE_PX * count for count in nodes.shape[:2])
    dense = cv2.resize(nodes.astype(np.float32), (columns, rows), interpolation=cv2.INTER_LINEAR)
    return dense[NODE_PX : NODE_PX + height, NODE_PX : NODE_PX + width]
