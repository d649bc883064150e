"""Set-points into the named parameters of the quadratic program: weights, shares and states of the barriers."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ControllerConfig, Weights
from ibvs_qp.model.height import height_wish
from ibvs_qp.model.lines import turn_share
from ibvs_qp.model.signals import Signals


def held_sideways_weight(weights: Weights) -> float:
    """Weight of the sideways velocity row while friction holds the tip: that of height, where it is the larger.

    The vehicle swings about a held tip, and this row damps the swing. A push that stays asked for beyond reach keeps
    taking from every row by its weight: at the weight of a sliding vehicle 35 N make the yaw grow to 5 deg in 10 s.
    """
    return max(weights.velocity, weights.height) if weights.velocity else 0.0


def program_parameters(signals: Signals, config: ControllerConfig) -> dict[str, ca.SX]:
    """Values of the program's parameters by name, as the shipped tasks and limits ask for them.

    Lambda blends linearly: the push row counts with lambda, the stand-off row with 1 - lambda; how far the lines count
    on the body's turn is `turn_share`. In the paper profile the lines lose the pushing direction with lambda
    instead of always, and the velocity rows count in full beside them, as a null-space wish does.
    """
    out, weights = signals.outputs, config.weights
    share, rate = signals.input("contact_weight"), signals.input("angular_velocity", 3)
    yaw = out["angles"][2]
    paper = config.line_profile == "paper"
    free = ca.SX.ones(2) if paper else out["free"]
    held = 0.0 if paper else out["held"] * (held_sideways_weight(weights) - weights.velocity)
    own = 1.0 - out["tilted"]  # a vehicle that lost a rotor moves by tilting, and cannot hold yaw
    values = {
        "turn_share": ca.SX(1.0) if paper else turn_share(signals, config),
        "normal_share": share if paper else ca.SX(1.0),
        "push": ca.vertcat(out["push_command"], weights.push * share),
        "standoff": ca.vertcat(out["standoff_command"], weights.push * (1.0 - share) * own),
        "level": ca.vertcat(out["angular"][0], out["angular"][1], weights.level),
        "yaw": ca.vertcat(out["angular"][2], weights.yaw),
        "velocity_right": ca.vertcat(out["velocity_command"][0], (weights.velocity + held) * free[0] * own),
        "velocity_down": ca.vertcat(out["velocity_command"][1], weights.velocity * free[1]),
        "height": height_wish(signals, config),
        "tilt_state": ca.vertcat(out["tilt_error"], out["tilt_rate"]),
        "yaw_state": ca.vertcat(yaw * own, rate[2] * own),
    }
    return out | values
