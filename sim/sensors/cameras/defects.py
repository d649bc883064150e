"""Errors of a real camera in its pictures, the same for every back end; none of them in the ideal world."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import camera_twist_matrix
from sim.sensors.cameras.arm import VehicleLayer
from sim.sensors.cameras.depth_defects import DepthDefects
from sim.sensors.cameras.exposure import ExposureSteps, line_kernel, vibration_sigma_px
from sim.sensors.cameras.warp import PictureWarp
from sim.sensors.image_motion import image_velocity
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Blur of the ideal lens: the binomial kernel (1, 2, 1) / 4, and its standard deviation [px].
_LENS, _LENS_SIGMA_PX = (3, 3), math.sqrt(0.5)
#: Kernels reach this many standard deviations.
_REACH = 2.5


class CameraDefects:
    """Errors in the order of the light: motion of the scene, vehicle, lens, exposure; noise follows them.

    Arm and brush move with the camera: the shutter and the blur by motion leave them as they are.

    Args:
        scene: Gives the errors.
        vehicle: Where the camera is.
        intrinsics: (fx, fy, cx, cy) [px].
        seed: Seed of the flight.

    Attributes:
        depth: Errors of the depth.
    """

    def __init__(
        self, scene: Scene, vehicle: VehicleParams, intrinsics: tuple[float, float, float, float], seed: int
    ) -> None:
        errors, shape = scene.errors.camera, (scene.camera.height, scene.camera.width)
        self._to_camera, self._focal = camera_twist_matrix(np.array(vehicle.camera_position_m)), intrinsics[0]
        self._exposure_s, self._blurred = errors.exposure_s, np.empty((*shape, 3), np.uint8)
        self._warp = PictureWarp(intrinsics, shape, errors.distortion_k1, errors.rolling_shutter_s)
        shaken = vibration_sigma_px(self._focal, scene.errors.gyro.vibration_rad_s, errors.exposure_s)
        extra = math.hypot(errors.defocus_px, shaken)
        self._sigma_px = math.hypot(_LENS_SIGMA_PX, extra) if extra else 0.0
        side = 2 * math.ceil(_REACH * self._sigma_px) + 1
        self._kernel = (side, side) if extra else _LENS
        self._steps = ExposureSteps(errors.exposure_steps, stream(seed, "camera exposure"))
        self.depth = DepthDefects(scene.errors.depth, self._focal, self._warp, stream(seed, "depth registration"))

    def moved(self, picture: np.ndarray, plane: np.ndarray, twist_body: np.ndarray | None) -> np.ndarray:
        """The scene without the vehicle, uint8 (H, W, 3), as a moving camera sees it.

        Args:
            picture: As a resting one sees it.
            plane: (a, b, c) of the board, 1/Z = a x + b y + c in camera coordinates [1/m].
            twist_body: Velocity of the body's origin [m/s] and angular velocity [rad/s] in B, (6,), or None at rest.
        """
        twist = None if twist_body is None else self._to_camera @ twist_body
        picture = self._warp.picture(picture, plane, twist)
        if self._exposure_s and twist is not None:
            u, v = (self._focal * self._exposure_s * float(rate) for rate in image_velocity(0.0, 0.0, plane, twist))
            picture = cv2.filter2D(picture, -1, line_kernel(u, v), self._blurred, borderType=cv2.BORDER_REPLICATE)
        return picture

    def layer(self, layer: VehicleLayer) -> VehicleLayer:
        """The vehicle as the lens shows it in the colours; its depth stays."""
        names = ("picture", "mask", "propellers")
        return dataclasses.replace(layer, **{name: self._warp.layer(getattr(layer, name)) for name in names})

    def expose(self, picture: np.ndarray, stamp_ns: int, exposed: np.ndarray) -> None:
        """Write the picture behind the lens and with its brightness into ``exposed``; both uint8 (H, W, 3)."""
        cv2.GaussianBlur(picture, self._kernel, self._sigma_px, exposed)
        factor = self._steps.factor(stamp_ns)
        if factor != 1.0:
            cv2.convertScaleAbs(exposed, exposed, factor)
