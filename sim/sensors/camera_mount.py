"""The true pose and focal length of the camera, where the cameras draw from the nominal ones."""

from __future__ import annotations

import dataclasses

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.quaternion import multiply
from sim.world.true_vehicle import TrueVehicle, turn_quaternion


class CameraMount:
    """Pose of the body at which a camera at the nominal place has the view of the true one.

    The camera's own view of arm and brush is that of the nominal mount: a few degrees of error move it by less than
    the blur of its outline.

    Attributes:
        vehicle: The vehicle to give to a camera: true, except for the place of the camera.

    Args:
        true: The vehicle that flies.
        nominal: The vehicle of the controller.
    """

    def __init__(self, true: TrueVehicle, nominal: VehicleParams) -> None:
        self.vehicle = dataclasses.replace(
            nominal,
            geometry=true.geometry,
            tip_position_m=true.tip_position_m,
            force_torque_position_m=true.force_torque_position_m,
        )
        self._nominal, self._true = np.array(nominal.camera_position_m), np.array(true.camera_position_m)
        self._turn, self._focal = turn_quaternion(true.camera_turn_deg), true.focal_ratio
        self._back = rotation_from_quaternion(self._turn).T
        self._turned = any(true.camera_turn_deg)
        nominal_turn = turn_quaternion(nominal.camera_turn_deg)
        self._nominal_axes = rotation_from_quaternion(nominal_turn) if any(nominal.camera_turn_deg) else None
        self._none = not self._turned and np.array_equal(self._nominal, self._true)

    def pose(self, position: np.ndarray, quaternion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and quaternion (4,) of the body to hand to the camera."""
        if self._none:
            return position, quaternion
        turned = np.array(multiply(quaternion.tolist(), self._turn))
        real = position + rotation_from_quaternion(quaternion) @ self._true
        return real - rotation_from_quaternion(turned) @ self._nominal, turned

    def velocity(self, velocity: np.ndarray) -> np.ndarray:
        """Velocity of the body in B [m/s], (3,), in axes of B turned like the camera."""
        return self._back @ velocity if self._turned else velocity

    def features(self, frame: FeatureFrame | None) -> FeatureFrame | None:
        """Features with the velocity in B, as perception reports it by the nominal mount."""
        axes = self._nominal_axes
        if frame is None or axes is None or frame.velocity is None:
            return frame
        return dataclasses.replace(
            frame, velocity=axes @ frame.velocity, velocity_covariance=axes @ frame.velocity_covariance @ axes.T
        )

    def picture(self, frame: RgbdFrame) -> RgbdFrame:
        """The picture with the reported focal lengths."""
        if self._focal == 1.0:
            return frame
        fx, fy, cx, cy = frame.intrinsics
        return dataclasses.replace(frame, intrinsics=(fx * self._focal, fy * self._focal, cx, cy))
