"""A view with the guide below the topmost line: brush in row 2, its own fresh edge above the guide."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from tests.support.truth.scenes import LIGHT, PAINTS, TruthScene, turned

#: Largest relative change of the light across half a row-2 view: the colour gate between board and wall in flight
#: is 42 grey levels, a tenth of a white board's colour.
_ROW_2_SHADING = 0.08


def row_2_scene(seed: int) -> TruthScene:
    """Brush in row 2, guide ahead of it inside its footprint, fresh edge above.

    Row 1 is painted along the whole board, row 2 behind the brush only: to the left, as it is painted to the right.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x7232]))
    focal, width, height = 625.2, 640, 480
    paint = PAINTS[rng.integers(len(PAINTS))]
    # the tip's image lies 0.08 m above the principal point at 0.5 m; the brush is 0.08 m wide, rows 0.072 m apart
    jitter = rng.normal(0.0, 1.0, 3) * (0.003, 0.002, 0.003)
    turns = np.radians(rng.normal(0.0, 1.0, 3) * (0.4, 0.5, 0.4))
    row_2 = -0.08
    row_1 = row_2 + 0.072
    strokes = (
        ((-0.8, row_1 - 0.04, 0.8, row_1 + 0.04), paint),
        ((-0.8, row_2 - 0.04, 0.0, row_2 + 0.04), paint),
    )
    # board frame: row 1 runs 0.05 m above the bottom edge
    size = (1.6, 0.5)
    middle = row_1 + 0.05 - 0.5 * size[1]
    moved = tuple(
        ((left, top - middle, right, bottom - middle), color) for (left, top, right, bottom), color in strokes
    )
    return TruthScene(
        size_m=size,
        gap_m=0.05,
        rotation=turned(*map(float, turns)),
        translation=np.array([jitter[0], middle + jitter[1], 0.5 + jitter[2]]),
        board_color=LIGHT[rng.integers(3)],
        strokes=moved,
        arm=True,
        camera=(width, height, focal),
        shading=float(rng.uniform(0.0, _ROW_2_SHADING)),
        seed=seed,
    )


def attitude_of(scene: TruthScene) -> np.ndarray:
    """Quaternion (w, x, y, z) of the body for a camera that looks along the body's x axis at an upright board."""
    # world: x into the board, y right, z down; board frame: x right, y down, z into the board
    world_of_board = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    body = world_of_board @ scene.rotation.T @ R_BODY_CAMERA.T
    angle = math.acos(min(1.0, max(-1.0, 0.5 * (np.trace(body) - 1.0))))
    axis = np.array([body[2, 1] - body[1, 2], body[0, 2] - body[2, 0], body[1, 0] - body[0, 1]])
    size = float(np.linalg.norm(axis))
    axis = axis / size if size > 1e-12 else np.array([1.0, 0.0, 0.0])
    return np.concatenate(([math.cos(0.5 * angle)], math.sin(0.5 * angle) * axis))
