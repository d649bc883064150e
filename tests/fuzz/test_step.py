"""Steps with hostile inputs by the million, checked one by one; run by ``pytest -m slow``.

``IBVS_QP_FUZZ_CALLS`` is the number of steps of the controllers with hostile inputs, a tenth of it that of the pilots;
the good ones in between come on top. ``IBVS_QP_FUZZ_SEED`` is the first seed.
"""

from __future__ import annotations

import os
import random
import warnings

import numpy as np
import pytest
from hostile import Mutator
from hostile_flight import RECOVERY, Flight, Violation
from hostile_subjects import CONTROLLERS, PILOTS

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]

CALLS = int(os.environ.get("IBVS_QP_FUZZ_CALLS", "1000000"))
SEED = int(os.environ.get("IBVS_QP_FUZZ_SEED", "0"))
#: Steps of the pilots per step of the controllers.
PILOT_SHARE = 0.1
#: Of a subject's hostile steps those with believable wrong values: no check refuses them, and no twin agrees.
LIES = (False, True)
#: Longest burst of hostile steps, share of hostile ones in it, and bursts after which the flight recovers.
BURST, HOSTILE, RECOVERED = 200, 0.9, 0.3
#: Median difference after a recovery [N], of subjects without observers and integrals. Estimates of contact and
#: stiffness keep what they learnt: 0.051 N in a tenth of the campaign.
TYPICAL = 0.06


def campaign(flight: Flight, hostile_calls: int) -> list[float]:
    """Flights with bursts of hostile inputs; differences from the undisturbed flight after the recoveries [N]."""
    choices, differences = flight.mutator.random, []
    while flight.hostile_calls < hostile_calls:
        if flight.left < BURST + 2 * RECOVERY:
            flight.restart()
        flight.good(choices.randrange(1, 10), reused=choices.random() < 0.2)
        for _ in range(choices.randrange(1, BURST)):
            if choices.random() < HOSTILE:
                flight.hostile()
            else:
                flight.good()
        if choices.random() < RECOVERED and not flight.lied:
            differences.append(flight.agrees())
    return differences


def run(name: str, lies: bool, hostile_calls: int) -> None:
    subject = (CONTROLLERS | PILOTS)[name]
    flight = Flight(subject, Mutator(random.Random(SEED), lies))
    with np.errstate(all="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            differences = campaign(flight, hostile_calls)
        except Violation as violation:
            pytest.fail(f"{name}, lies={lies}, seed {SEED}, call {flight.calls}: {violation}")
    print(f"{name}, lies={lies}: {flight.calls} steps, {flight.hostile_calls} of them with hostile inputs", end="")
    if differences and subject.agreed is not None:
        print(f"; recovered to {np.median(differences):.1g} N, at most {max(differences):.1g} N", end="")
        assert not subject.bare or np.median(differences) < TYPICAL
    print()


@pytest.mark.parametrize("lies", LIES)
class TestPrograms:
    @pytest.mark.parametrize("name", [name for name in CONTROLLERS if name.startswith("qp")])
    def test_controller(self, name: str, lies: bool) -> None:
        run(name, lies, CALLS // len(CONTROLLERS) // len(LIES))


@pytest.mark.parametrize("lies", LIES)
class TestOthers:
    @pytest.mark.parametrize("name", [name for name in CONTROLLERS if not name.startswith("qp")])
    def test_controller(self, name: str, lies: bool) -> None:
        run(name, lies, CALLS // len(CONTROLLERS) // len(LIES))


@pytest.mark.parametrize("lies", LIES)
class TestPilots:
    @pytest.mark.parametrize("name", PILOTS)
    def test_pilot(self, name: str, lies: bool) -> None:
        run(name, lies, round(PILOT_SHARE * CALLS) // len(PILOTS) // len(LIES))
