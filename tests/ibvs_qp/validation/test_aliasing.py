"""A caller may use its input arrays again and write into the answers: no bit of any later command changes."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from recorded_inputs import arrays_in, overwrite, recording

from ibvs_qp.analytic import PaperController
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from tests.replay.cases import CASES

LAWS = [HybridController, PaperController]
TICKS = 150


@pytest.mark.parametrize("law", LAWS)
def test_controllers_keep_no_array_of_the_caller_and_give_none_of_their_own(law: Callable[[], Any]) -> None:
    reused, clean, flight = law(), law(), recording("rotor_loss")
    weak = np.linspace(10.0, 40.0, 6)
    for tick in range(1000, 1000 + TICKS):
        seen, wanted = copy.deepcopy((flight.measurements[tick], flight.references[tick]))
        object.__setattr__(seen, "thrust_max", weak.copy())
        expected = clean.step(seen, wanted)
        command = reused.step(seen, wanted)
        np.testing.assert_array_equal(command.thrusts, expected.thrusts)
        tasks = tuple(expected.tasks)
        assert overwrite((seen, wanted)) >= 8
        assert overwrite((command.thrusts, command.wrench, command.unallocated_wrench)) == 3
        assert tuple(command.tasks) == tasks, "evaluated when they are read"
        if tick % 7 == 0:  # a tick on what is remembered
            assert np.array_equal(reused.step(None, None).thrusts, clean.step(None, None).thrusts)


@pytest.mark.parametrize("law", LAWS)
def test_a_buffer_written_after_the_tick_does_not_fly(law: Callable[[], Any]) -> None:
    """Not even through the reference that stays in force when the next one is refused."""
    flight = recording("rotor_loss")
    one, two, tilt = law(), law(), np.zeros(2)
    for tick in range(TICKS):
        seen = flight.measurements[tick]
        command = one.step(seen, Reference(tilt=tilt) if tick == 0 else None)  # type: ignore[arg-type]
        tilt[:] = 50.0
        np.testing.assert_array_equal(command.thrusts, two.step(seen, Reference()).thrusts)


@pytest.mark.parametrize(("case", "first", "ticks"), [("rotor_loss", 700, 300), ("paint_qp", 0, 120)])
def test_a_pilot_keeps_no_array_of_the_caller(case: str, first: int, ticks: int) -> None:
    """With features, and with pictures, which cameras write into the same buffer again and again."""
    reused, clean, flight = CASES[case].pilot(), CASES[case].pilot(), recording(case)
    lists = [np.full(6, 2.0), np.full(6, 40.0)]
    reused.thrust_limits = lists[0], lists[1]
    clean.thrust_limits = np.full(6, 2.0), np.full(6, 40.0)
    overwrite(lists)
    pictures = 0
    for tick in range(first, first + ticks):
        frame = copy.deepcopy(flight.frames[tick])
        expected, command = clean.step(frame), reused.step(frame)
        np.testing.assert_array_equal(command.thrusts, expected.thrusts)
        pictures += frame.image is not None or frame.features is not None
        overwrite((frame, command.thrusts, command.wrench, command.unallocated_wrench))
        for limits in arrays_in(reused.thrust_limits):
            assert not limits.flags.writeable
    assert pictures > 3
