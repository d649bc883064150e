"""A controller whose thrusts are those of the C library; Python evaluates its set-points at them."""

from __future__ import annotations

import dataclasses

import numpy as np
from c_library import instance

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference

#: By ``ibvs_outcome``; the last is OSQP's active set, solved exactly.
OUTCOMES = (
    Outcome.SOLVED,
    Outcome.INACCURATE_ACCEPTED,
    Outcome.CAPPED_ACCEPTED,
    Outcome.ANALYTIC_FALLBACK,
    Outcome.HOLD,
    Outcome.SOLVED,
)


class CFlown(HybridController):
    """Flies an instance of the library, which estimates contact by itself.

    Args:
        config: The configuration.
        single: Whether its numbers are floats.
    """

    def __init__(self, config: ControllerConfig, single: bool) -> None:
        self._own = instance(config, single)
        super().__init__(config)

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._own.reset()

    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        before = self.setpoints.last
        command = super()._command(measurement, reference, rejected)
        own = self._own.step(measurement, reference)
        self.setpoints.last = before
        unallocated = np.array(own.unallocated_wrench, float)
        thrusts = np.array(own.thrusts, float)
        self.setpoints.note(thrusts, float(np.abs(unallocated).max()))
        wrench = self.setpoints.effectiveness @ thrusts
        outcome = OUTCOMES[own.outcome]
        return dataclasses.replace(
            command, thrusts=thrusts, wrench=wrench, unallocated_wrench=unallocated, outcome=outcome
        )
