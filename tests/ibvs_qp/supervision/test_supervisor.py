"""The supervisor's state machine, by table: faults and times in, states out."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ibvs_qp.command import SafetyState
from ibvs_qp.supervision.faults import POLICY, Fault, Rule
from ibvs_qp.supervision.supervision import Supervisor

NOMINAL, DEGRADED, RETREAT, HOVER, DESCEND, TERMINATED = SafetyState
SEVERITY = {state: index for index, state in enumerate(SafetyState)}
TICK = 0.004


def states(fault: Fault, *times: float) -> list[SafetyState]:
    """States at some times of a fault that begins at zero and stays."""
    machine = Supervisor()
    return [machine.update(time, {fault: ""}) for time in times]


@pytest.mark.parametrize(
    ("fault", "timeline"),
    [
        (Fault.INPUTS, [(0.0, DEGRADED), (0.2, RETREAT), (100.0, RETREAT)]),
        (Fault.WRENCH_STALE, [(0.0, NOMINAL), (0.02, DEGRADED), (0.1, RETREAT), (100.0, RETREAT)]),
        (Fault.WRENCH_FROZEN, [(0.0, RETREAT)]),
        (Fault.PUSH_UNFELT, [(0.0, RETREAT)]),
        (Fault.PUSH_HIGH, [(0.0, RETREAT)]),
        (Fault.IMAGE_STALE, [(0.0, DEGRADED), (0.49, DEGRADED), (0.5, RETREAT), (3.0, HOVER), (4.0, DESCEND)]),
        (Fault.LINES_STALE, [(0.0, DEGRADED), (2.9, DEGRADED), (3.0, RETREAT), (100.0, RETREAT)]),
        (Fault.IMAGE_FROZEN, [(0.0, DEGRADED), (0.5, RETREAT), (3.0, HOVER), (4.0, DESCEND)]),
        (Fault.PLANE_STALE, [(0.0, DEGRADED), (0.5, RETREAT), (3.0, HOVER), (4.0, DESCEND)]),
        (Fault.FILTER_REFUSES, [(0.0, DEGRADED), (1.9, DEGRADED), (2.0, RETREAT)]),
        (Fault.NO_ATTITUDE, [(0.0, DEGRADED), (0.2, TERMINATED)]),
        (Fault.IMU_STALE, [(0.0, DEGRADED), (0.2, RETREAT), (3.0, DESCEND)]),
        (Fault.IMU_FROZEN, [(0.0, DEGRADED), (0.2, RETREAT), (3.0, DESCEND)]),
        (Fault.ROTOR, [(0.0, RETREAT)]),
        (Fault.NO_HOVER, [(0.0, DESCEND)]),
        (Fault.SOLVER, [(0.0, DEGRADED), (0.3, RETREAT)]),
        (Fault.TILT, [(0.0, RETREAT)]),
        (Fault.FLIP, [(0.0, NOMINAL), (0.2, TERMINATED)]),
        (Fault.RATE, [(0.0, RETREAT)]),
        (Fault.SPEED, [(0.0, RETREAT)]),
        (Fault.HEIGHT, [(0.0, HOVER)]),
        (Fault.WALL_GONE, [(0.0, RETREAT)]),
        (Fault.CONTACT_LOST, [(0.0, RETREAT)]),
        (Fault.MISSION_TIME, [(0.0, RETREAT)]),
    ],
)
def test_every_fault_leads_to_its_states_at_its_times(fault: Fault, timeline: list[tuple[float, SafetyState]]) -> None:
    times, expected = zip(*timeline, strict=True)
    assert states(fault, *times) == list(expected)


def test_every_fault_has_a_rule_whose_stages_grow_in_time_and_severity() -> None:
    assert set(POLICY) == set(Fault)
    for fault, rule in POLICY.items():
        delays, stages = zip(*rule.stages, strict=True)
        assert list(delays) == sorted(delays), fault
        assert [SEVERITY[state] for state in stages] == sorted(SEVERITY[state] for state in stages), fault


def test_the_recovery_time_is_no_time_of_the_fault() -> None:
    machine = Supervisor()
    machine.update(0.0, {Fault.IMAGE_STALE: ""})
    machine.update(0.45, {Fault.IMAGE_STALE: ""})
    assert machine.update(0.6, {}) is DEGRADED
    assert machine.update(1.0, {}) is NOMINAL


def test_the_most_severe_fault_counts_and_is_the_reason() -> None:
    machine = Supervisor()
    machine.update(0.0, {Fault.INPUTS: "axes", Fault.TILT: "13 deg"})
    assert machine.state is RETREAT and machine.reasons == ("tilt: 13 deg",)


def test_degraded_ends_with_its_fault_after_the_recovery_time() -> None:
    machine = Supervisor()
    assert machine.update(0.0, {Fault.PLANE_STALE: ""}) is DEGRADED
    assert machine.update(0.4, {}) is DEGRADED, "a fault that flickers must not flicker the state"
    assert machine.update(0.6, {}) is NOMINAL and machine.reasons == ()


def test_a_flickering_fault_counts_as_one() -> None:
    machine = Supervisor()
    seen = [machine.update(k * TICK, {Fault.IMAGE_STALE: ""} if k % 2 else {}) for k in range(250)]
    changes = sum(a is not b for a, b in itertools.pairwise(seen))
    assert changes == 2 and seen[-1] is RETREAT, "nominal to degraded to retreat"


@pytest.mark.parametrize("state", [RETREAT, HOVER, DESCEND, TERMINATED])
def test_from_a_retreat_on_nothing_leads_back(state: SafetyState) -> None:
    machine = Supervisor({**POLICY, Fault.TILT: Rule(((0.0, state),))})
    machine.update(0.0, {Fault.TILT: ""})
    for k in range(1, 10_000):
        assert machine.update(k * TICK, {}) is state
    assert machine.reasons


def test_a_milder_fault_does_not_soften_a_state() -> None:
    machine = Supervisor()
    machine.update(0.0, {Fault.NO_HOVER: ""})
    assert machine.update(1.0, {Fault.IMAGE_STALE: ""}) is DESCEND


def test_a_finished_retreat_hovers_and_a_landing_terminates() -> None:
    machine = Supervisor()
    assert machine.update(0.0, {}, retreated=True, landed=True) is NOMINAL, "both mean nothing before"
    machine.update(0.1, {Fault.TILT: ""})
    assert machine.update(0.2, {}, landed=True) is RETREAT
    assert machine.update(0.3, {}, retreated=True) is HOVER
    assert machine.update(0.4, {}, landed=True) is HOVER
    machine.update(0.5, {Fault.NO_HOVER: ""})
    assert machine.update(0.6, {}, landed=True) is TERMINATED
    assert machine.update(0.7, {Fault.INPUTS: ""}) is TERMINATED


def test_time_that_goes_back_neither_raises_nor_softens() -> None:
    machine = Supervisor()
    machine.update(10.0, {Fault.IMAGE_STALE: ""})
    assert machine.update(0.0, {Fault.IMAGE_STALE: ""}) is DEGRADED


@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.sets(st.sampled_from(list(Fault)), max_size=3)), max_size=40))
def test_severity_never_falls_below_a_retreat_and_every_state_has_a_reason(
    ticks: list[tuple[float, set[Fault]]],
) -> None:
    machine, time, worst = Supervisor(), 0.0, NOMINAL
    for step, faults in ticks:
        time += step
        state = machine.update(time, dict.fromkeys(faults, "detail"))
        assert (state is NOMINAL) == (machine.reasons == ())
        if SEVERITY[worst] >= SEVERITY[RETREAT]:
            assert SEVERITY[state] >= SEVERITY[worst]
        worst = max(worst, state, key=SEVERITY.__getitem__)
