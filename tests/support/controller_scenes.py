"""Walls, lines, measurements and a packed program for the controller's tests, from geometry written independently."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from law_only import evaluate_law
from scipy.spatial.transform import Rotation

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.attitude import UNFILTERED_HZ
from ibvs_qp.frames import R_BODY_CAMERA, cross, down_in_body
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature, LineReference, Measurement, Reference
from ibvs_qp.model.setpoints import Setpoints

TICK_NS = 4_000_000
#: The box that no command may leave, whatever is measured [N].
FLOOR, CEILING = 1.2, 52.56
#: Where the line fit is certain: tests of geometry want no weights in between.
CERTAIN = np.zeros((2, 2))
DEFAULT = ControllerConfig()  # once: it validates a hundred settings


def without_rotors(config: ControllerConfig = DEFAULT) -> ControllerConfig:
    """The configuration without leads, row filters and attitude filter: rows are the printed formulas.

    The lead of the push stays, which those formulas have. `test_rotor_rows` proves the rest.
    """
    names = [gain.name for gain in dataclasses.fields(config.gains)]
    off = {name: 0.0 for name in names if name.endswith(("_lead_s", "_filter_s")) and name != "push_lead_s"}
    return dataclasses.replace(
        config,
        gains=dataclasses.replace(config.gains, **off),
        angular_rate=dataclasses.replace(config.angular_rate, attitude_bandwidth_hz=UNFILTERED_HZ),
    )


def attitude(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """Quaternion (w, x, y, z) of B in I from Tait-Bryan angles z-y-x [rad]."""
    x, y, z, w = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
    return np.array([w, x, y, z])


def body_to_world(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return Rotation.from_quat([x, y, z, w]).as_matrix()


class Wall:
    """A wall as the body sees it: unit normal into it, distance of the tip along it, axes under gravity."""

    def __init__(
        self,
        quaternion: np.ndarray,
        distance: float,
        turn: float = 0.0,
        config: ControllerConfig | None = None,
        lean: float = 0.0,
    ) -> None:
        """``turn`` and ``lean`` are angles of the normal about and below the horizon [rad]."""
        vehicle = (config or DEFAULT).vehicle
        self.tip, self.camera = np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)
        rotation = body_to_world(quaternion)
        self.distance = distance
        self.gravity = rotation.T @ np.array([0.0, 0.0, 1.0])
        level = np.array([math.cos(turn), math.sin(turn), 0.0])
        self.normal = math.cos(lean) * rotation.T @ level + math.sin(lean) * self.gravity
        self.right = np.array(cross(self.gravity, self.normal)) / math.cos(lean)
        self.down = np.array(cross(self.normal, self.right))
        self.foot = self.tip + distance * self.normal

    @property
    def plane(self) -> tuple[float, float, float, float]:
        """(A, B, C, D) with D = -1 in the camera."""
        depth = float(self.normal @ (self.foot - self.camera))
        a, b, c = R_BODY_CAMERA.T @ self.normal / depth
        return float(a), float(b), float(c), -1.0

    def points(self, offset: float, angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Two points, in B, of the line at a signed distance from the foot along (cos, sin) in (right, down)."""
        across = math.cos(angle) * self.right + math.sin(angle) * self.down
        along = np.array(cross(self.normal, across))
        middle = self.foot + offset * across
        return middle - 0.2 * along, middle + 0.2 * along

    def line(
        self, offset: float, angle: float, role: str, *, flip: bool = False, weight: float = 1.0, **extra: object
    ) -> LineFeature:
        """That line in the image; `flip` writes the same line with the other sign."""
        rays = [R_BODY_CAMERA.T @ (point - self.camera) for point in self.points(offset, angle)]
        rho, theta = image_line(*rays)
        c, s = math.cos(angle), math.sin(angle)
        across = R_BODY_CAMERA.T @ (c * self.right + s * self.down)
        if bool(math.cos(theta) * across[0] + math.sin(theta) * across[1] < 0.0) != flip:
            rho, theta = -rho, theta + math.pi
        fields = {"covariance": CERTAIN} | extra
        return LineFeature(rho=rho, theta=theta, role=role, weight=weight, **fields)  # type: ignore[arg-type]


def moved_by_turn(setpoints: Setpoints, angular_acceleration: np.ndarray) -> np.ndarray:
    """Acceleration of the tip along n by a turn of a body whose wall leans: n.d (d x r) . alpha, times n, (3,)."""
    gravity, tip = down_in_body(setpoints.step.inputs["attitude"]), setpoints.config.vehicle.tip_position_m
    along = setpoints.normal @ gravity * np.dot(gravity, np.cross(angular_acceleration, tip))
    return setpoints.normal * along


def image_line(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """(rho, theta) of the image of the line through two points in C."""
    a, b, c = cross(first / first[2], second / second[2])
    return -c / math.hypot(a, b), math.atan2(b, a)


def measured(tick: int, **changes: object) -> Measurement:
    """A level hover half a metre from a wall, with whatever is to be different."""
    stamp = (tick + 1) * TICK_NS
    fields: dict[str, object] = {
        "stamp_ns": stamp,
        "attitude": np.array([1.0, 0.0, 0.0, 0.0]),
        "angular_velocity": np.zeros(3),
        "specific_force": np.array([0.0, 0.0, -9.81]),
        "contact_wrench": np.zeros(6),
        "wrench_stamp_ns": stamp,
        "plane": Wall(np.array([1.0, 0.0, 0.0, 0.0]), 0.3).plane,
        "plane_stamp_ns": stamp,
        "velocity": np.zeros(3),
    }
    return Measurement(**(fields | changes))  # type: ignore[arg-type]


def line_references(count: int, depth: float = 0.5) -> tuple[LineReference, ...]:
    both = (
        LineReference(rho=(0.05 - 0.08) / depth, theta=0.5 * math.pi, role=HORIZONTAL),
        LineReference(rho=-0.05 / depth, theta=0.0, role=VERTICAL),
    )
    return both[:count]


def random_tick(
    rng: np.random.Generator, lines: int, tick: int = 0, heading: float = 0.0, flip: bool = False, lean: float = 0.0
) -> tuple[Measurement, Reference]:
    """A vehicle somewhere near its wall, moving, with the lines and references of a painting vehicle.

    `heading` turns the whole scene about gravity: nothing that the vehicle sees changes with it.
    """
    roll, pitch, turn = (rng.normal(size=3) * (0.01, 0.01, 0.03)).tolist()
    quaternion = attitude(roll, pitch, heading)
    wall = Wall(quaternion, float(rng.uniform(0.0, 0.08)), heading + turn, lean=lean)
    features = (
        wall.line(rng.normal(0.05, 0.02), 0.5 * math.pi + rng.normal(0, 0.02), HORIZONTAL, flip=flip),
        wall.line(rng.normal(-0.05, 0.02), rng.normal(0, 0.02), VERTICAL, flip=flip),
    )
    wrench = np.concatenate((rng.normal(0.0, 1.0, 3), rng.normal(0.0, 0.2, 3)))
    measurement = measured(
        tick,
        attitude=quaternion,
        angular_velocity=rng.normal(0.0, 0.05, 3),
        specific_force=-9.81 * wall.gravity + rng.normal(0.0, 0.1, 3),
        contact_wrench=wrench,
        plane=wall.plane,
        velocity=rng.normal(0.0, 0.05, 3),
        lines=features[:lines],
    )
    reference = Reference(push_force=5.0, contact=True, lines=line_references(lines), velocity=rng.normal(0.0, 0.05, 2))
    return measurement, reference


def pack(
    controller: HybridController,
    measurement: Measurement,
    reference: Reference,
    *,
    share: float | None = None,
    last: np.ndarray | None = None,
    window: tuple[float, float] = (-1e4, 1e4),
) -> None:
    """Fill the program of one tick, with lambda, last thrusts and thrust window as the test wants them."""
    setpoints = controller.setpoints
    setpoints.last = np.full(controller.config.vehicle.geometry.count, 11.3) if last is None else last
    setpoints.floor[:], setpoints.ceiling[:] = window
    setpoints.update(measurement, reference)
    inputs = setpoints.step.inputs
    inputs["thrust_step"][0], inputs["commanded"][0] = 1e6, 0.0
    if share is not None:
        inputs["contact_weight"][0] = share
    evaluate_law(setpoints, controller.problem.values)  # once more, from the same states


def exact_thrusts(controller: HybridController) -> np.ndarray:
    """Thrusts of the packed program by the exact solver."""
    data = controller.engine.data
    solution = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    assert solution is not None
    return solution[0][: controller.config.vehicle.geometry.count]


def dense(controller: HybridController) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Full P, q, A, l, u of the packed program."""
    data, problem = controller.engine.data, controller.problem
    upper, a = problem.p_pattern.copy(), problem.a_pattern.copy()
    upper.data, a.data = data.p.copy(), data.a.copy()
    p = upper.toarray()
    return p + np.triu(p, 1).T, data.q.copy(), a.toarray(), data.lower.copy(), data.upper.copy()
