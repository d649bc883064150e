"""Parts of the estimator on their own, tick by tick."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from symbolic_block import Block

from ibvs_qp.config import LONGEST_TICK, ControllerConfig, EstimationConfig, VehicleParams
from ibvs_qp.estimation.contact import contact_state, read_contact
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.estimator import WallContact
from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.estimation.tick_history import TickHistory, sample_interval
from ibvs_qp.estimation.wall_distance import Plane, Tick
from ibvs_qp.estimation.wall_lines import MeasuredLine, WallAxes
from ibvs_qp.estimation.wall_lines import wall_line as symbolic_wall_line
from ibvs_qp.estimation.wall_motion import SLOTS, STATES, WallMotion, predicted_motion
from ibvs_qp.measurement import VERTICAL, FeatureFrame, LineFeature, Measurement

VEHICLE = VehicleParams()
DIRECTIONS = ("normal", "right", "down", "gravity")
TIP_FROM_CAMERA = np.subtract(VEHICLE.tip_position_m, VEHICLE.camera_position_m).tolist()


class ContactEstimator(WallContact):
    """Wall and contact by inertial data, contact wrench and planes; `Estimator` without its other estimates."""

    def __init__(self, config: ControllerConfig) -> None:
        super().__init__(config)
        self._doubt, self._plane_ns, self._stamp, self._wrench_ns = False, -1, -1, -1

        def build(signals):
            scalar = signals.input
            inertial = {name: signals.input(name, 3) for name in ("rate", "force", "down")}
            tick = Tick(**inertial, **{name: signals.input(name) for name in ("dt", "elapsed", "force_known", "doubt")})
            plane = Plane(scalar("new"), scalar("age"), signals.input("plane", 4))
            history = MotionHistory(signals, tick.elapsed, tick.rate, tick.acceleration, config.tick_s)
            wrench, interval, press = signals.input("wrench", 6), scalar("interval"), scalar("press")
            found = contact_state(signals, config, tick, history, plane, wrench, interval, press)
            return ca.vertcat(*found.values())

        self._block = Block(build)
        self._block.step.inputs["plane"][:] = 0.0, 0.0, 1.0, -1.0

    @property
    def touch_threshold(self) -> float:
        """Filtered push that counts as touch [N]."""
        settings = self._config.contact
        return max(settings.touch_force_n, settings.touch_sigmas * self.state.push_noise)

    def doubt(self) -> None:
        """Ticks are missing for an unknown time."""
        self._doubt = True

    def update(
        self,
        *,
        stamp_ns: int,
        specific_force: Any,
        contact_wrench: Any = (0.0,) * 6,
        wrench_stamp_ns: int = 0,
        plane: Sequence[float] | None,
        plane_stamp_ns: int,
        angular_velocity: Any = (0.0, 0.0, 0.0),
        down: Sequence[float] = (0.0, 0.0, 1.0),
        press: bool = False,
    ) -> ContactState:
        """One tick; wrench and plane count once, when their stamps are new."""
        elapsed = self._config.tick_s if self._stamp < 0 else 1e-9 * (stamp_ns - self._stamp)
        new, interval = plane is not None and plane_stamp_ns > self._plane_ns, 0.0
        if wrench_stamp_ns > self._wrench_ns:
            interval, self._wrench_ns = sample_interval(wrench_stamp_ns, self._wrench_ns), wrench_stamp_ns
        self._stamp, doubt, self._doubt = stamp_ns, self._doubt, False
        inputs: dict[str, Any] = {"plane": plane, "age": 1e-9 * (stamp_ns - plane_stamp_ns)} if new else {}
        values = self._block(
            dt=min(elapsed, LONGEST_TICK),
            elapsed=elapsed,
            rate=angular_velocity,
            force=(0.0, 0.0, 0.0) if specific_force is None else specific_force,
            force_known=specific_force is not None,
            down=down,
            doubt=doubt,
            new=new,
            wrench=contact_wrench,
            interval=interval,
            press=press,
            **inputs,
        ).tolist()
        self.state, self.surface_offset = read_contact(values), values[-2]
        if new:
            self._plane_ns = plane_stamp_ns
        if values[-1]:
            self.plane_ns = plane_stamp_ns
        return self.state

    def measure(self, measurement: Measurement, press: bool = False) -> ContactState:
        """One tick of a measurement of a level vehicle."""
        return self.update(
            stamp_ns=measurement.stamp_ns,
            angular_velocity=measurement.angular_velocity,
            specific_force=measurement.specific_force,
            contact_wrench=measurement.contact_wrench,
            wrench_stamp_ns=measurement.wrench_stamp_ns,
            plane=measurement.plane,
            plane_stamp_ns=measurement.plane_stamp_ns,
            press=press,
        )


class PlaneMotion(WallMotion):
    """Motion in the wall plane with its prediction."""

    def __init__(self, tick_s: float = 0.004) -> None:
        self._ticks = TickHistory(np.zeros(STATES), tick_s)

        def build(signals):
            vector = {name: signals.input(name, 3) for name in DIRECTIONS}
            return predicted_motion(
                signals.input("state", STATES),
                ca.reshape(signals.input("rates", 2 * SLOTS), 2, SLOTS).T,
                WallAxes(**vector),
                VEHICLE.tip_position_m,
                dt=signals.input("dt"),
                force=signals.input("force", 3),
                rate=signals.input("rate", 3),
                shrinks=ca.DM.eye(2),  # a flat wall
            )

        self._predict = Block(build)
        super().__init__(TIP_FROM_CAMERA, self._ticks, EstimationConfig())

    def reset(self) -> None:
        super().reset()
        self._ticks.reset()

    def predict(self, stamp_ns: int, axes: WallAxes, force: Any, rate: Any, dt: float, density: float) -> None:
        """One tick."""
        directions = {name: getattr(axes, name) for name in DIRECTIONS}
        state, rates = self._ticks.newest, self.rates.ravel()
        row = self._predict(state=state, rates=rates, dt=dt, force=force, rate=rate, **directions)
        self.remember(stamp_ns, row, dt, density)

    def see(self, frame: FeatureFrame, axes: WallAxes, distance: float) -> None:
        """Correct with a frame of a wall with these axes at capture."""
        self.correct(frame, axes.normal, axes.gravity, distance)


def wall_line(line: LineFeature, axes: WallAxes, distance: float) -> dict[str, float]:
    """Place of an image line on the wall, by the names of `MeasuredLine`, and its surface side."""
    ends = np.zeros((2, 2)) if line.segment is None else line.segment
    pairs = [(ca.SX(x), ca.SX(y)) for x, y in ends.tolist()]
    vertical = ca.SX(float(line.role == VERTICAL))
    normal, right, down, gravity = (ca.SX(np.array(getattr(axes, name), float)) for name in DIRECTIONS)
    found = symbolic_wall_line(
        ca.SX(line.rho),
        ca.SX(line.theta),
        vertical,
        pairs,
        WallAxes(normal, right, down, gravity),
        TIP_FROM_CAMERA,
        ca.SX(distance),
    )
    values = {name: float(ca.DM(value)) for name, value in zip(MeasuredLine._fields, found, strict=True)}
    assert math.isfinite(sum(values.values()))
    return values | {"surface_side": values["sign"] * line.surface_side}
