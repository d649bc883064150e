"""Pixels of a real camera and points of the ideal one are inverse to each other."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.frames import rotation_from_vector
from ibvs_qp.vision.picture.camera import Lens

INTRINSICS = (520.0, 515.0, 322.0, 238.0)
LENSES = {
    "none": (),
    "narrow": (0.12, -0.25, 0.001, -0.0008, 0.1),
    "wide": (-0.3, 0.1, 0.0, 0.001, -0.015),
    "rational": (0.4, -0.1, 0.0, 0.0, 0.02, 0.7, -0.05, 0.01),
}


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.4)])
def test_there_and_back(name: str, turn: tuple[float, float, float]) -> None:
    lens = Lens(LENSES[name], rotation_from_vector(turn))
    columns, rows = np.meshgrid(np.linspace(0.0, 639.0, 9), np.linspace(0.0, 479.0, 7))
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 2)
    points = lens.ideal(pixels, INTRINSICS)
    assert np.abs(lens.pixels(points, INTRINSICS) - pixels).max() < 2e-3
    plain = (pixels - INTRINSICS[2:]) / INTRINSICS[:2]
    assert (np.abs(points - plain).max() > 0.01) == (not lens.none)


def test_a_pixel_beyond_the_lens_model_has_no_ray() -> None:
    folded = Lens((0.1, -0.15, 0.001, -0.001, 0.0))  # r (1 + 0.1 r^2 - 0.15 r^4) is never above 1
    assert np.isnan(folded.ideal(np.array([[320.0 + 900.0, 240.0]]), INTRINSICS)).all()
    assert np.isfinite(folded.ideal(np.array([[500.0, 240.0]]), INTRINSICS)).all()
