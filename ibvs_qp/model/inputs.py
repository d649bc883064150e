"""Inputs of the law at the present, as symbols: reference, lines and gains; body and contact are the estimators'.

`ibvs_qp.model.tick` computes them from the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ibvs_qp.config import ControllerConfig, Gains, LimitSettings, SolverSettings, Weights
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
        roll, pitch: Attitude [rad]; zero unless the vehicle has lost a rotor.
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


def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind) if field.name != "index")


#: Scalar inputs of the reference and of every line.
TARGET, LINE = _names(Target), _names(Line)
#: Outputs of every line, "line_0.error" and so on (`ibvs_qp.tasks.line.LineState`).
LINE_OUTPUTS = (
    "error rate integral rho_error rho_rate analytic_command angle_error angle_rate angle_command weight".split()
)


#: Settings that decide which equations there are: constants of the program.
STRUCTURAL = ("trim_deg", "view_rotation", "hard_barriers")
#: Settings that are inputs of the tick: gains, weights, and bounds, slack weights and switches of the limits.
RUN_TIME = {
    "gains": _names(Gains),
    "weights": _names(Weights),
    "limits": tuple(name for name in _names(LimitSettings) if name not in STRUCTURAL),
}


def equations(config: ControllerConfig) -> ControllerConfig:
    """The configuration that determines the equations: inputs of the tick have their defaults."""
    switches = [name for name in RUN_TIME["limits"] if name.endswith("_barrier")]
    limits = LimitSettings(**{name: getattr(config.limits, name) for name in (*STRUCTURAL, *switches)})
    return replace(config, gains=Gains(), weights=Weights(), limits=limits, solver=SolverSettings())


def setting_inputs(signals: Signals, section: str) -> Any:
    """Symbols of a section of the settings under the names of its fields: they may change at run time."""
    return SimpleNamespace(**{name: signals.input(f"{section}.{name}") for name in RUN_TIME[section]})


def setting_values(config: ControllerConfig) -> dict[str, float]:
    """Values of all settings that may change at run time, by the names of their inputs."""
    sections = ((section, getattr(config, section), names) for section, names in RUN_TIME.items())
    return {f"{section}.{name}": getattr(values, name) for section, values, names in sections for name in names}
