"""Calibration errors of the camera: mount position, mount attitude and focal length."""

from __future__ import annotations

import dataclasses

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.small_turns import multiply, small_turn
from sim.world.scene import CameraScene


class Miscalibration:
    """Pose from which a nominal camera takes the picture of the miscalibrated one.

    The camera's own view of arm and brush stays nominal: a few degrees move it by less than the blur of its outline.

    Args:
        scene: Errors of the mount (body axes) and of the focal length.
        vehicle: Where the camera should be.
        rendered: Whether there are pictures; only they have a focal length.

    Raises:
        ConfigError: When a focal error is set without pictures.
    """

    def __init__(self, scene: CameraScene, vehicle: VehicleParams, rendered: bool) -> None:
        if scene.focal_error and not rendered:
            raise ConfigError("camera.focal_error needs pictures; fly it with --features rendered")
        self._camera = np.array(vehicle.camera_position_m)
        self._shift = np.array(scene.mount_error_m)
        self._turn = small_turn(np.radians(scene.mount_error_deg).tolist())
        self._focal = 1.0 + scene.focal_error
        self._none = not (np.any(self._shift) or any(scene.mount_error_deg))

    def pose(self, position: np.ndarray, quaternion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and quaternion (4,) of the body to hand to the camera."""
        if self._none:
            return position, quaternion
        turned = np.array(multiply(quaternion.tolist(), self._turn))
        real = position + rotation_from_quaternion(quaternion) @ (self._camera + self._shift)
        return real - rotation_from_quaternion(turned) @ self._camera, turned

    def picture(self, frame: RgbdFrame) -> RgbdFrame:
        """The picture with the reported focal lengths."""
        if self._focal == 1.0:
            return frame
        fx, fy, cx, cy = frame.intrinsics
        return dataclasses.replace(frame, intrinsics=(fx * self._focal, fy * self._focal, cx, cy))
