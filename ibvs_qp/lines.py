"""Line errors at the tip: pairing, sign, integral and wanted image acceleration, shared by both laws."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import align_line, camera_twist_matrix, to_camera
from ibvs_qp.measurement import LineFeature, LineReference
from ibvs_qp.vision.interaction import line_interaction_matrix

#: Bound of the integral of a line error, as the image acceleration it commands [1/s^2].
INTEGRAL_BOUND = 0.6
#: Rate filter when no velocity is known [s].
RATE_FILTER = 0.08
#: Errors enter the law only up to this size [normalised]; a far line is approached at a steady pace.
ERROR_BOUND = 0.10
#: Lines farther than this from the optical axis are refused: the interaction matrix degenerates [normalised].
RHO_BOUND = 1.5


@dataclass(slots=True)
class LineTerm:
    """One paired line: where it is, its error at the tip and what is wanted of it."""

    role: str
    rho: float
    theta: float
    tip_x: float
    tip_y: float
    error: float
    error_rate: float
    angle_error: float
    angle_rate: float
    integral: float
    weight: float
    rho_error: float
    rho_rate: float
    matrix: np.ndarray


class LineErrors:
    """Pairs measured lines with references by role, then order, and keeps one integral per pair."""

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        vehicle = config.vehicle
        self._twist = camera_twist_matrix(np.array(vehicle.camera_position_m))
        self._tip_camera = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
        self.reset()

    def reset(self) -> None:
        """Forget integrals and rates."""
        self._integrals: dict[tuple[str, int], float] = {}
        self._last: dict[tuple[str, int], tuple[float, float]] = {}

    def update(
        self,
        lines: tuple[LineFeature, ...],
        references: tuple[LineReference, ...],
        plane: np.ndarray,
        normal_camera: np.ndarray,
        distance: float,
        twist: np.ndarray | None,
        reference_velocity: np.ndarray,
        integrate: bool,
        dt: float,
    ) -> list[LineTerm]:
        """Errors of every reference that has a line.

        Args:
            lines: Measured lines.
            references: Wanted lines.
            plane: (A, B, C, D) of the wall in C, (4,).
            normal_camera: Unit normal into the wall in C, (3,).
            distance: Tip to wall [m].
            twist: Body twist with the motion along the normal removed, or None when the velocity is unknown, (6,).
            reference_velocity: Wanted velocity in B [m/s], (3,).
            integrate: Whether integrals may move.
            dt: Time since the last tick [s].
        """
        terms: list[LineTerm] = []
        order: dict[str, int] = {}
        by_role = {role: [line for line in lines if line.role == role] for role in ("horizontal", "vertical")}
        foot = self._tip_camera + distance * normal_camera
        for reference in references[: self._config.line_slots]:
            place = order.get(reference.role, 0)
            order[reference.role] = place + 1
            candidates = by_role.get(reference.role, [])
            if place >= len(candidates):
                continue
            line = candidates[place]
            if not abs(line.rho) < RHO_BOUND:
                continue
            key = (reference.role, place)
            terms.append(self._term(key, line, reference, plane, foot, twist, reference_velocity, integrate, dt))
        for key in [key for key in self._last if order.get(key[0], 0) <= key[1]]:
            self._last.pop(key)
            self._integrals.pop(key, None)
        return terms

    def _term(
        self,
        key: tuple[str, int],
        line: LineFeature,
        reference: LineReference,
        plane: np.ndarray,
        foot: np.ndarray,
        twist: np.ndarray | None,
        reference_velocity: np.ndarray,
        integrate: bool,
        dt: float,
    ) -> LineTerm:
        rho, theta = align_line(line.rho, line.theta, reference.theta)
        c, s = math.cos(theta), math.sin(theta)
        x_t, y_t = float(foot[0] / foot[2]), float(foot[1] / foot[2])
        nominal = float(self._tip_camera[1]) / float(foot[2])
        wanted = reference.rho - nominal * math.sin(reference.theta)
        error = rho - (x_t * c + y_t * s) - wanted
        matrix = line_interaction_matrix(rho, theta, (plane[0], plane[1], plane[2], plane[3])) @ self._twist
        row = matrix[0] + (x_t * s - y_t * c) * matrix[1]
        if twist is not None:
            rate = float(row @ twist) - float(row[:3] @ reference_velocity)
            rho_rate = float(matrix[0] @ twist) - float(matrix[0][:3] @ reference_velocity)
            angle_rate = float(matrix[1] @ twist)
        else:
            last_error, last_rate = self._last.get(key, (error, 0.0))
            rate = last_rate + min(1.0, dt / RATE_FILTER) * ((error - last_error) / max(dt, 1e-4) - last_rate)
            angle_rate, rho_rate = 0.0, rate
        self._last[key] = (error, rate)
        integral = self._integrals.get(key, 0.0)
        bounded = min(max(error, -ERROR_BOUND), ERROR_BOUND)
        if integrate and self._config.gains.line_ki > 0.0:
            bound = INTEGRAL_BOUND / self._config.gains.line_ki
            integral = min(max(integral + dt * bounded * line.weight, -bound), bound)
        self._integrals[key] = integral
        variance = float(line.covariance[0, 0]) if line.covariance is not None else 0.0
        sigma = self._config.weights.line_sigma
        weight = line.weight / (1.0 + max(variance, 0.0) / (sigma * sigma))
        return LineTerm(
            role=reference.role,
            rho=rho,
            theta=theta,
            tip_x=x_t,
            tip_y=y_t,
            error=bounded,
            error_rate=rate,
            angle_error=theta - reference.theta,
            angle_rate=angle_rate,
            integral=integral,
            weight=weight,
            rho_error=min(max(rho - reference.rho, -ERROR_BOUND), ERROR_BOUND),
            rho_rate=rho_rate,
            matrix=matrix,
        )
