"""Settings of an RGB-D camera: lenses, unit of the depth, pose of a depth camera that is not registered to colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.settings import setting, validate
from ibvs_qp.frames import rotation_from_vector

#: Numbers of coefficients of OpenCV's lens models.
DISTORTION_SIZES = (0, 4, 5, 8, 12, 14)
#: Allowed numbers of entries.
_COUNTS = (
    ("distortion", DISTORTION_SIZES, "so many coefficients"),
    ("depth_distortion", DISTORTION_SIZES, "so many coefficients"),
    ("depth_intrinsics", (0, 4), "so many numbers (fx fy cx cy)"),
    ("depth_rotation", (0, 3, 9), "so many numbers"),
    ("depth_translation_m", (0, 3), "so many numbers"),
)
#: Shortest focal length [px].
_SHORTEST_PX = 1.0
#: Largest entry of R R' - I of a rotation matrix: four decimal places are enough.
_ROTATION_ERROR = 1e-3


@dataclass(frozen=True, kw_only=True)
class RgbdCameraSettings:
    """How the pictures of a camera are to be read; the defaults leave a registered, rectified picture as it is."""

    distortion: tuple[float, ...] = setting(
        (),
        "coefficients of the colour lens, k1 k2 p1 p2 k3 ... of OpenCV's calibrateCamera; none for rectified pictures",
        low=-100.0,
        high=100.0,
    )
    color_bits: int = setting(16, "bits in use of a 16-bit colour or mono picture", low=8, high=16)
    depth_units_per_metre: float = setting(
        1.0, "values of the depth picture per metre; 1000 for the usual 16-bit millimetres", low=1.0, high=1e6
    )
    depth_intrinsics: tuple[float, ...] = setting(
        (),
        "fx fy cx cy of the depth camera, pixel centres at integers; none for depth registered to colour",
        unit="px",
        low=-1e5,
        high=1e5,
    )
    depth_distortion: tuple[float, ...] = setting(
        (), "coefficients of the depth camera's lens, as distortion", low=-100.0, high=100.0
    )
    depth_rotation: tuple[float, ...] = setting(
        (),
        "rotation from the depth camera's axes to the colour camera's: a vector [rad] (3) or a matrix by rows (9)",
        low=-6.3,
        high=6.3,
    )
    depth_translation_m: tuple[float, ...] = setting(
        (), "depth camera's centre in the colour camera's axes (right, down, front)", unit="m", low=-1.0, high=1.0
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        for name, counts, content in _COUNTS:
            value, allowed = getattr(self, name), f"{content}: {', '.join(map(str, counts))}"
            if len(value) not in counts:
                raise out_of_range(name, value, "px" if name == "depth_intrinsics" else "", allowed)
        if self.depth_intrinsics and min(self.depth_intrinsics[:2]) <= _SHORTEST_PX:
            allowed = f"focal lengths must be above {_SHORTEST_PX:g} px"
            raise out_of_range("depth_intrinsics", self.depth_intrinsics, "px", allowed)
        if not self.registered and not self.depth_translation_m:
            raise ConfigError("depth_translation_m is missing: depth_intrinsics are of a separate depth camera")
        for name in ("depth_distortion", "depth_rotation", "depth_translation_m"):
            if self.registered and getattr(self, name):
                raise ConfigError(f"depth_intrinsics are missing: {name} is for depth that is not registered to colour")
        if len(self.depth_rotation) == 9 and not _is_rotation(np.array(self.depth_rotation).reshape(3, 3)):
            allowed = f"rows and columns must be right-handed unit vectors to {_ROTATION_ERROR:g}"
            raise out_of_range("depth_rotation", self.depth_rotation, "", allowed)

    @property
    def registered(self) -> bool:
        """Whether every pixel of the depth picture belongs to the colour pixel at the same place."""
        return not self.depth_intrinsics

    @property
    def depth_to_color(self) -> np.ndarray:
        """Rotation from the depth camera's axes to the colour camera's, (3, 3)."""
        if len(self.depth_rotation) == 9:
            return np.array(self.depth_rotation).reshape(3, 3)
        return rotation_from_vector(self.depth_rotation or (0.0, 0.0, 0.0))


def _is_rotation(matrix: np.ndarray) -> bool:
    error = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return bool(error <= _ROTATION_ERROR and np.linalg.det(matrix) > 0.0)
