"""What the monitors see of one tick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.safety.policy import Fault


class Response(Protocol):
    """Signals of the controller's last step (`ibvs_qp.estimation.response`)."""

    @property
    def inertial_push(self) -> float:
        """Push on the wall without the force sensor [N]."""
        ...

    @property
    def wind_spread(self) -> float:
        """Standard deviation of the unexplained force along the wall [N]."""
        ...

    @property
    def carried_weight(self) -> float:
        """Weight that something else than the rotors carries [N]."""
        ...

    @property
    def missing_thrust(self) -> np.ndarray:
        """Thrust that every rotor misses [N], (n,)."""
        ...

    @property
    def missing_noise(self) -> float:
        """Its standard deviation while the rotors follow [N]."""
        ...

    @property
    def motor_thrusts(self) -> np.ndarray:
        """Thrusts behind the motors' lag and the filter of `missing_thrust` [N], (n,)."""
        ...


@dataclass(slots=True, kw_only=True)
class Tick:
    """One tick as its caller shows it; stamps in the caller's monotonic time, -1 for never.

    Attributes:
        stamp_ns: Time of the tick.
        imu_ns: Stamp of the oldest of attitude, gyro and accelerometer, each the last accepted one.
        wrench_ns, plane_ns, image_ns, lines_ns: Stamps of the last accepted samples, and of the last with a line.
        inertial: Attitude, gyro and accelerometer as measured; anything that differs from sample to sample.
        wrench: Force sample as measured, likewise.
        down: Unit gravity in B, (3,).
        rate: Angular velocity [rad/s], (3,).
        speed: Estimated speed [m/s], NaN if unknown.
        height: Change of height since the start [m], NaN if unknown.
        contact: Wall and contact.
        press: Whether the reference presses.
        push_reference: Push reference within reach [N].
        outcome: Of the controller's step.
        faults: Faults that the caller found; the monitors add theirs.
        has_camera: Whether there must be pictures and a plane some time after the first tick.
        plane_doubt: Why the last picture has no sound plane; empty after one, or where unknown.
    """

    stamp_ns: int
    imu_ns: int
    wrench_ns: int
    plane_ns: int
    image_ns: int
    lines_ns: int = -1
    inertial: object
    wrench: object
    down: Sequence[float]
    rate: Sequence[float]
    speed: float
    height: float
    contact: ContactState
    press: bool
    push_reference: float
    outcome: Outcome
    faults: dict[Fault, str]
    has_camera: bool = False
    plane_doubt: str = ""
