"""Inputs of the law at the present, as symbols: reference, lines and gains; body and contact are the estimators'.

`ibvs_qp.model.tick` computes them from the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ibvs_qp.config import Gains
from ibvs_qp.symbolic.signals import Signals

#: Gain of an integral in the division that bounds it: one of zero has a bound as well.
LEAST_GAIN = 1e-6


@dataclass(frozen=True, kw_only=True)
class Target:
    """The reference.

    Attributes:
        push: Push force [N].
        standoff: Tip to wall out of contact [m].
        velocity_right, velocity_down: In the wall plane [m/s].
        press: 1 to press the wall.
        roll, pitch: Attitude [rad]; zero but for a vehicle that lost a rotor.
        travel_right, travel_down: Velocity planned at this push [m/s].
        trim_roll, trim_pitch: Attitude of a level hover with a limited rotor [rad].
    """

    push: ca.SX
    standoff: ca.SX
    velocity_right: ca.SX
    velocity_down: ca.SX
    press: ca.SX
    roll: ca.SX
    pitch: ca.SX
    travel_right: ca.SX
    travel_down: ca.SX
    trim_roll: ca.SX
    trim_pitch: ca.SX

    @classmethod
    def of(cls, signals: Signals) -> Target:
        """Declare the inputs."""
        return cls(**{name: signals.input(f"reference.{name}") for name in TARGET})


@dataclass(frozen=True, kw_only=True)
class Line:
    """One measured line and its reference; rows of an absent line have weight zero.

    Attributes:
        index: Of the line; its reference keeps it from step to step.
        present: 1 if measured; vertical: 1 for a vertical line, 0 for a horizontal one.
        rho, theta: Of the line, its sign aligned with the reference.
        rho_reference, theta_reference: Of the reference.
        confidence: Weight of the feature, 0 to 1; variance: of rho.
    """

    index: int
    present: ca.SX
    vertical: ca.SX
    rho: ca.SX
    theta: ca.SX
    rho_reference: ca.SX
    theta_reference: ca.SX
    confidence: ca.SX
    variance: ca.SX

    @classmethod
    def of(cls, signals: Signals, index: int) -> Line:
        """Declare the inputs of one line."""
        return cls(index=index, **{name: signals.input(f"line_{index}.{name}") for name in LINE})


#: Scalar inputs of the reference and of every line.
TARGET, LINE = (tuple(field.name for field in fields(kind) if field.name != "index") for kind in (Target, Line))
#: Outputs of every line, "line_0.error" and so on (`ibvs_qp.tasks.line.LineState`).
LINE_OUTPUTS = (
    "error rate integral rho_error rho_rate analytic_command angle_error angle_rate angle_command weight".split()
)


def gain_inputs(signals: Signals) -> Any:
    """Symbols of the gains under the names of `Gains`: they may change at run time."""
    return SimpleNamespace(**{field.name: signals.input(f"gains.{field.name}") for field in fields(Gains)})
