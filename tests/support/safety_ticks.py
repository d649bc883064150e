"""Inputs of the monitors: a quiet contact at 5 N unless changed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact import no_contact
from ibvs_qp.supervision.monitors import Tick

TICK_NS = 4_000_000
CONTACT = no_contact(ControllerConfig())._replace(
    known=True, distance=-0.003, push=5.0, in_contact=True, time_since_touch=3.0, contact_weight=1.0
)


@dataclass
class StubResponse:
    """Set-points of a vehicle that follows its model."""

    inertial_push: float = 5.0
    carried_weight: float = 0.0
    wind_spread: float = 0.0
    missing_noise: float = 0.1
    missing_thrust: np.ndarray = field(default_factory=lambda: np.zeros(6))
    motor_thrusts: np.ndarray = field(default_factory=lambda: np.full(6, 11.3))
    floor: np.ndarray = field(default_factory=lambda: np.full(6, 1.2))
    last: np.ndarray = field(default_factory=lambda: np.full(6, 11.0))


def quiet_tick(number: int, **changes: Any) -> Tick:
    """Tick of a number from 0: every input is new and differs from the one before."""
    now = number * TICK_NS
    values: dict[str, Any] = {
        "stamp_ns": now,
        "imu_ns": now,
        "wrench_ns": now,
        "plane_ns": now,
        "image_ns": now,
        "inertial": number,
        "wrench": number,
        "down": (0.0, 0.0, 1.0),
        "rate": (0.0, 0.0, 0.0),
        "speed": 0.1,
        "height": 0.0,
        "contact": CONTACT,
        "press": True,
        "push_reference": 5.0,
        "outcome": Outcome.SOLVED,
        "faults": {},
    }
    return Tick(**(values | changes))
