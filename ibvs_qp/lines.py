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
    plane: tuple[float, float, float, float]
    twist_map: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """Interaction matrix in body axes, (2, 6): made when read, the program builds its own rows."""
        return line_interaction_matrix(self.rho, self.theta, self.plane) @ self.twist_map


@dataclass(slots=True)
class CameraMotion:
    """Twist of the camera as plain numbers, in C; the reference moves without turning."""

    velocity: tuple[float, float, float]
    turn: tuple[float, float, float]
    reference: tuple[float, float, float]
    known: bool


class LineErrors:
    """Pairs measured lines with references by role, then order, and keeps one integral per pair."""

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        vehicle = config.vehicle
        self._twist = camera_twist_matrix(np.array(vehicle.camera_position_m))
        tip_camera = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
        self._tip_down = float(tip_camera[1])
        self.reset()

    def reset(self) -> None:
        """Forget integrals and rates."""
        self._integrals: dict[tuple[str, int], float] = {}
        self._last: dict[tuple[str, int], tuple[float, float]] = {}

    def update(
        self,
        lines: tuple[LineFeature, ...],
        references: tuple[LineReference, ...],
        plane: tuple[float, float, float, float],
        foot: tuple[float, float, float],
        motion: CameraMotion,
        integrate: bool,
        dt: float,
    ) -> list[LineTerm]:
        """Errors of every reference that has a line.

        Args:
            lines: Measured lines.
            references: Wanted lines.
            plane: (A, B, C, D) of the wall in C with D = -1.
            foot: The tip's wall point in C [m].
            motion: Twist of the camera without the motion along the normal, and the wanted velocity.
            integrate: Whether integrals may move.
            dt: Time since the last tick [s].
        """
        terms: list[LineTerm] = []
        order: dict[str, int] = {}
        by_role = {role: [line for line in lines if line.role == role] for role in ("horizontal", "vertical")}
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
            terms.append(self._term(key, line, reference, plane, foot, motion, integrate, dt))
        for key in [key for key in self._last if order.get(key[0], 0) <= key[1]]:
            self._last.pop(key)
            self._integrals.pop(key, None)
        return terms

    def _term(
        self,
        key: tuple[str, int],
        line: LineFeature,
        reference: LineReference,
        plane: tuple[float, float, float, float],
        foot: tuple[float, float, float],
        motion: CameraMotion,
        integrate: bool,
        dt: float,
    ) -> LineTerm:
        rho, theta = align_line(line.rho, line.theta, reference.theta)
        c, s = math.cos(theta), math.sin(theta)
        x_t, y_t = foot[0] / foot[2], foot[1] / foot[2]
        wanted = reference.rho - self._tip_down / foot[2] * math.sin(reference.theta)
        error = rho - (x_t * c + y_t * s) - wanted
        if motion.known:
            # Plain numbers: the rows of `line_interaction_matrix` times a twist, without arrays.
            a, b, z, _ = plane
            l_theta, l_rho = b * c - a * s, -(a * rho * c + b * rho * s + z)
            vx, vy, vz = motion.velocity
            wx, wy, wz = motion.turn
            rx, ry, rz = motion.reference
            along, wanted_along = c * vx + s * vy - rho * vz, c * rx + s * ry - rho * rz
            rho_rate = l_rho * (along - wanted_along) + (1.0 + rho * rho) * (s * wx - c * wy)
            turn = -rho * (c * wx + s * wy) - wz
            angle_rate = l_theta * along + turn
            rate = rho_rate + (x_t * s - y_t * c) * (angle_rate - l_theta * wanted_along)
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
            plane=plane,
            twist_map=self._twist,
        )
