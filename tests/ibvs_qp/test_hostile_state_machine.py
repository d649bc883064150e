"""Good and hostile inputs in any order: every step is safe, and half a second later all is well."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from hostile import Mutator
from hostile_flight import RECOVERY, Flight
from hostile_subjects import CONTROLLERS, PILOTS
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test

LAWS = ("qp, bare", "analytic, bare", "assured", "assured, bare")
#: Recorded ticks of a flight.
TICKS = 450
SUBJECTS = {name: replace((CONTROLLERS | PILOTS)[name], ticks=TICKS) for name in (*LAWS, *PILOTS)}
#: Longest burst of one rule [ticks].
BURST = 12
#: Flights per subject, and rules per flight.
EXAMPLES, RULES = 5, 8
CHOICES = st.randoms(use_true_random=False)


class HostileFlight(RuleBasedStateMachine):
    """One flight of a subject."""

    name = ""

    def __init__(self) -> None:
        super().__init__()
        self.flight = Flight(SUBJECTS[self.name], Mutator(random.Random(0), lies=False))
        self.lied = False

    def _hostile(self, choices: random.Random, ticks: int, lies: bool) -> None:
        self.flight.mutator, self.lied = Mutator(choices, lies), self.lied or lies
        for _ in range(ticks):
            self.flight.hostile()

    @property
    def room(self) -> bool:
        return self.flight.left > 2 * RECOVERY

    @precondition(lambda self: self.room)
    @rule(ticks=st.integers(1, 30), reused=st.booleans())
    def good(self, ticks: int, reused: bool) -> None:
        self.flight.good(ticks, reused)

    @precondition(lambda self: self.room)
    @rule(choices=CHOICES, ticks=st.integers(1, BURST))
    def refused(self, choices: random.Random, ticks: int) -> None:
        self._hostile(choices, ticks, lies=False)

    @precondition(lambda self: self.room)
    @rule(choices=CHOICES, ticks=st.integers(1, BURST))
    def lies(self, choices: random.Random, ticks: int) -> None:
        self._hostile(choices, ticks, lies=True)

    @precondition(lambda self: self.room)
    @rule()
    def nothing(self) -> None:
        with np.errstate(all="raise"):
            self.flight.step((None,) if self.flight.subject.pilot else (None, None))
        self.flight.disturbed = True

    @rule()
    def restart(self) -> None:
        self.flight.restart()
        self.lied = False

    def teardown(self) -> None:
        if not self.lied and self.flight.subject.agreed is not None:
            self.flight.agrees()
        elif self.flight.subject.agreed is not None:
            command = self.flight.good(RECOVERY)
            assert command.mode != "hold", "good inputs are flown again"


@pytest.mark.slow
@pytest.mark.parametrize("name", SUBJECTS)
def test_whatever_comes_in_what_comes_out_is_safe(name: str) -> None:
    machine = type(HostileFlight)(name, (HostileFlight,), {"name": name})
    limits = settings(
        max_examples=EXAMPLES,
        stateful_step_count=RULES,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    run_state_machine_as_test(machine, settings=limits)  # type: ignore[arg-type]
