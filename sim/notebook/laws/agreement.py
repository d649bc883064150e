"""The program in the paper's profile against the paper's law: equal in the limit, and where they are not, why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibvs_qp.analytic import RANK_TOLERANCE, analytic_thrusts
from ibvs_qp.config import ControllerConfig, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.step_function import Setpoints

#: Lambda from which a tick counts as full contact, and below which as free flight.
FULL, FREE = 0.999, 0.001


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Largest thrust difference at one weight of the line rows [N]: median and worst over ticks.

    Attributes:
        weight: Of the line rows, over the wishes of their null space.
        free: (median, worst) in free flight.
        contact: (median, worst) in full contact, law as printed.
        selected: (median, worst) in full contact, the pushing direction taken out of L before its inversion.
    """

    weight: float
    free: tuple[float, float]
    contact: tuple[float, float]
    selected: tuple[float, float]


def paper_profile(weight: float) -> ControllerConfig:
    r"""The program that the paper's law solves in the limit of a growing weight of the line rows.

    Every wish of the null space has weight 1 on the mass-weighted acceleration's own scale, effort almost none, there
    are no barriers and lines are judged at the image centre.
    """
    mass = ControllerConfig().vehicle.mass_kg
    wishes = {"level": 1.0, "yaw": 1.0, "velocity": 1.0, "push": 1.0 / mass**2}
    weights = Weights(line=weight, effort=1e-9, smoothness=0.0, line_sigma=1.0, **wishes)
    return ControllerConfig(weights=weights, line_profile="paper", barriers=False)


def selected_thrusts(terms: Setpoints) -> np.ndarray:
    r"""Thrusts of the analytic law with :math:`(L S)^\dagger` in the place of :math:`S L^\dagger` [N], (n,).

    S takes the share lambda of the pushing direction out. The printed law inverts L with that direction in it and
    drops what it gave; here the lines are told beforehand that it is not theirs. For lambda 0 or 1 only.
    """
    config, share = terms.config, terms.contact_weight
    gains, vehicle = config.gains, config.vehicle
    mass = np.concatenate((np.full(3, vehicle.mass_kg), np.asarray(vehicle.inertia_kg_m2)))
    along = (share * terms.push_command + (1.0 - share) * terms.standoff_command) / vehicle.mass_kg
    wish = terms.normal * along + terms.right * terms.velocity_command[0] + terms.down * terms.velocity_command[1]
    acceleration = np.concatenate((wish, terms.angular))
    selection = np.eye(6)
    selection[:3, :3] -= share * np.outer(terms.normal, terms.normal)
    if terms.lines:
        level = min(terms.lines, key=lambda line: abs(line.rho))
        rows = [line.matrix[0] for line in terms.lines] + [level.matrix[1]]
        wanted = [-(gains.line_kp * n.rho_error + gains.line_kd * n.rho_rate + gains.line_ki * n.integral)
                  for n in terms.lines]  # fmt: skip
        wanted.append(-(gains.theta_kp * level.angle_error + gains.theta_kd * level.angle_rate))
        matrix = np.vstack(rows) @ selection
        inverse = np.linalg.pinv(matrix, rcond=RANK_TOLERANCE)
        acceleration = acceleration + inverse @ (np.array(wanted) - matrix @ acceleration)
    return terms.inverse @ (mass * acceleration - terms.bias_wrench)


def agreement(
    ticks: Sequence[tuple[Measurement, Reference]], weights: Sequence[float], every: int = 5
) -> list[Agreement]:
    """Replay ticks through the program at several weights and compare with the law at the same set-points.

    Args:
        ticks: In order, of one flight.
        weights: Of the line rows.
        every: Ticks between comparisons.
    """
    return [_at(ticks, weight, every) for weight in weights]


def _at(ticks: Sequence[tuple[Measurement, Reference]], weight: float, every: int) -> Agreement:
    controller = HybridController(paper_profile(weight))
    terms, found = controller.setpoints, {"free": [], "contact": [], "selected": []}
    for index, (measurement, reference) in enumerate(ticks):
        controller.step(measurement, reference)
        if index % every or not terms.lines:
            continue
        program, share = controller.engine.data.free, terms.contact_weight
        printed = float(np.abs(program - analytic_thrusts(terms)).max())
        if share < FREE:
            found["free"].append(printed)
        elif share > FULL:
            found["contact"].append(printed)
            found["selected"].append(float(np.abs(program - selected_thrusts(terms)).max()))
    pairs = {
        name: (float(np.median(values)), max(values)) if values else (np.nan, np.nan) for name, values in found.items()
    }
    return Agreement(weight=weight, **pairs)
