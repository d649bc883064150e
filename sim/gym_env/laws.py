"""Control laws with an action: the thrusts of a shipped law plus a residual, or thrusts alone.

Thrusts leave neither limits nor thrust rate of the vehicle. As for any own law, thrusts that are not finite become a
hold.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.analytic import PaperController
from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.reporting import clip, clipped_command
from ibvs_qp.qp.solver import AcceptedSolution


class ActedLaw(CheckedLaw):
    """A law with an action.

    Attributes:
        action: Residual or thrusts of the next step [N], (n,).
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.action = np.zeros(config.vehicle.geometry.count)
        super().__init__(config)


class ResidualQp(ActedLaw, HybridController):
    """The QP law plus a residual; a tick that no solver solves has the thrusts of the fallback alone."""

    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        if np.isfinite(self.action).all():
            return super()._command(measurement, reference, rejected)
        return clipped_command(self.setpoints, measurement, reference, self.action, Outcome.SOLVED, rejected)

    def _explained(self, measurement: Any, reference: Any, solution: AcceptedSolution, rejected: Any) -> Command:
        if self.action.any():
            solution = dataclasses.replace(solution, thrusts=clip(self.setpoints, solution.thrusts + self.action))
        return super()._explained(measurement, reference, solution, rejected)


class ResidualPaper(ActedLaw, PaperController):
    """The analytic law plus a residual, before its allocator."""

    def thrusts(self, measurement: Measurement, reference: Reference) -> np.ndarray:
        """Thrusts before the limits [N], (n,)."""
        return super().thrusts(measurement, reference) + self.action


class ThrustLaw(ActedLaw, PaperController):
    """Thrusts alone; allocator, which clips in the presets, and set-points are those of the analytic law."""

    def thrusts(self, measurement: Measurement, reference: Reference) -> np.ndarray:
        """Thrusts before the limits [N], (n,)."""
        return self.action.copy()
