"""Mono and 16-bit pictures and units of depth."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.picture.camera import RgbdCamera
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

INTRINSICS = (100.0, 100.0, 49.5, 39.5)
GREY = np.arange(80 * 100, dtype=np.uint16).reshape(80, 100) % 251


def picture(rgb: np.ndarray, depth: np.ndarray, **settings: float) -> RgbdFrame:
    frame = RgbdFrame(rgb=rgb, depth=depth, intrinsics=INTRINSICS, stamp_ns=1)
    return RgbdCamera(RgbdCameraSettings(**settings)).picture(frame)  # type: ignore[arg-type]


METRES = np.full((80, 100), 0.75, np.float32)


@pytest.mark.parametrize(
    ("rgb", "bits"),
    [
        (GREY.astype(np.uint8), 16),
        (GREY.astype(np.uint8)[..., None], 16),
        (GREY << 8, 16),
        (GREY << 2, 10),
        (np.stack([GREY << 8] * 3, axis=-1), 16),
        ((GREY << 8).astype(">u2"), 16),
    ],
)
def test_mono_and_16_bits_become_three_channels_of_8(rgb: np.ndarray, bits: int) -> None:
    found = picture(rgb, METRES, color_bits=bits)
    assert frame_problem(found) is None
    assert np.array_equal(found.rgb, np.stack([GREY] * 3, axis=-1).astype(np.uint8))


def test_a_value_beyond_the_bits_in_use_is_white() -> None:
    assert (picture(np.full((80, 100), 2000, np.uint16), METRES, color_bits=10).rgb == 255).all()


@pytest.mark.parametrize("kind", [np.uint16, ">u2", np.int32, np.float32, np.float64])
def test_depth_of_a_stated_unit_becomes_metres(kind: type) -> None:
    depth = np.full((80, 100), 3750).astype(kind)
    found = picture(np.zeros((80, 100, 3), np.uint8), depth, depth_units_per_metre=5000.0)
    assert frame_problem(found) is None and found.depth.dtype == np.float32
    assert np.allclose(found.depth, 0.75, rtol=1e-6)


def test_integers_without_a_unit_are_refused() -> None:
    found = picture(np.zeros((80, 100, 3), np.uint8), np.full((80, 100), 750, np.uint16))
    assert frame_problem(found) == "depth picture of type uint16, metres in floating point are needed"


@pytest.mark.parametrize("rgb", ["none", np.zeros(5), np.zeros((80, 100, 2), np.uint8), np.zeros((80, 100), complex)])
def test_what_is_no_picture_is_left_for_the_checks(rgb: object) -> None:
    assert frame_problem(picture(rgb, METRES)) is not None  # type: ignore[arg-type]
