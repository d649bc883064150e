"""What the log has of every tick; each class is a protobuf message of the same name (`ibvs_qp.recording.messages`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.command import Command, SafetyState
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.measurement import Measurement, Reference

#: Kinds of a `ControllerInput`: a step of the controller, thrusts of the supervisor in its place, and a reset.
STEP, SUPERVISOR, RESET = "step", "supervisor", "reset"


@dataclass(frozen=True, kw_only=True)
class ControllerInput:
    """Exact inputs of the controller at one tick, for replay.

    Attributes:
        tick: Number of the tick, from 0; a gap means lost ticks.
        call: `STEP`, `SUPERVISOR` or `RESET`.
        measurement: As the controller got it.
        reference: As the controller got it.
        contact: Wall and contact as a pilot estimates them; None where the controller estimates them.
        fixed_thrusts: Thrusts of the supervisor [N], (n,), before box and rate limit.
    """

    tick: int
    call: str
    measurement: Measurement | None = None
    reference: Reference | None = None
    contact: ContactState | None = None
    fixed_thrusts: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class ControlTick:
    """One tick, for plots.

    Attributes:
        tick: Number of the tick.
        stamp_ns: Its time.
        phase: Phase of a pilot's strategy; empty without a pilot.
        safety: State of the supervisor; nominal without one.
        safety_reasons: Why it is in that state.
        rejected: Inputs that were refused, by pilot and controller.
        push_n: Filtered push [N].
        push_reference_n: Push reference within reach [N].
        distance_m: Tip to wall [m].
        thrust_low_n: Lower thrust limits in force [N], (n,).
        thrust_high_n: Upper thrust limits in force [N], (n,).
        step_us: Duration of the step [us].
        dropped: Entries that were not logged so far, because the writer was late.
        command: Command of the law, or of what replaced it.
    """

    tick: int
    stamp_ns: int
    phase: str
    safety: SafetyState
    safety_reasons: tuple[str, ...]
    rejected: tuple[str, ...]
    push_n: float
    push_reference_n: float
    distance_m: float
    thrust_low_n: np.ndarray
    thrust_high_n: np.ndarray
    step_us: float
    dropped: int
    command: Command
