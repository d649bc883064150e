"""Settings of an RGB-D camera are refused by name, value, unit and range."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.frames import rotation_from_vector
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

BESIDE: dict[str, Any] = {"depth_intrinsics": (400.0, 400.0, 319.5, 239.5), "depth_translation_m": (0.015, 0.0, 0.0)}
VECTOR = (0.02, -0.3, 0.1)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"distortion": (0.1, 0.2)}, r"distortion = \(0.1, 0.2\) is refused: so many coefficients: 0, 4, 5, 8, 12, 14"),
        ({"distortion": (0.1, np.nan, 0.0, 0.0)}, r"distortion = .* allowed is \[-100, 100\]"),
        ({"color_bits": 7}, r"color_bits = 7 is refused: allowed is \[8, 16\]"),
        ({"depth_units_per_metre": 0.5}, r"depth_units_per_metre = 0.5 is refused: allowed is \[1, 1e\+06\]"),
        ({**BESIDE, "depth_intrinsics": (400.0,)}, r"depth_intrinsics = \(400.0,\) px is refused: so many numbers"),
        (
            {**BESIDE, "depth_intrinsics": (0.0, 400.0, 319.5, 239.5)},
            r"depth_intrinsics = .* px is refused: focal lengths must be above 1 px",
        ),
        ({**BESIDE, "depth_translation_m": ()}, "depth_translation_m is missing"),
        ({**BESIDE, "depth_translation_m": (15.0, 0.0, 0.0)}, r"depth_translation_m = .* m is refused: .* \[-1, 1\] m"),
        ({**BESIDE, "depth_rotation": (0.0, 0.1)}, r"depth_rotation = .* so many numbers: 0, 3, 9"),
        ({**BESIDE, "depth_rotation": (1.0, 0, 0, 0, 1.0, 0, 0, 0, -1.0)}, "depth_rotation = .* right-handed unit"),
        ({**BESIDE, "depth_rotation": (1.0, 0, 0, 0, 1.0, 0, 0, 0, 0.9)}, "depth_rotation = .* right-handed unit"),
        ({**BESIDE, "depth_distortion": (0.1,)}, "depth_distortion = .* so many coefficients"),
        (
            {"depth_rotation": VECTOR},
            "depth_intrinsics are missing: depth_rotation is for depth",
        ),
    ],
)
def test_a_wrong_setting_is_named(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        RgbdCameraSettings(**wrong)


def test_a_rotation_is_a_vector_or_a_matrix() -> None:
    matrix = rotation_from_vector(VECTOR)
    by_vector = RgbdCameraSettings(**BESIDE, depth_rotation=VECTOR)
    by_matrix = RgbdCameraSettings(**BESIDE, depth_rotation=tuple(matrix.ravel().tolist()))
    assert np.array_equal(by_vector.depth_to_color, matrix) and np.array_equal(by_matrix.depth_to_color, matrix)
    assert not by_vector.registered and RgbdCameraSettings().registered
