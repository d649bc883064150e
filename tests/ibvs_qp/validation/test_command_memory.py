"""Whatever a caller reaches through a command, no write into it reaches the controller."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from controller_scenes import measured
from recorded_inputs import recording
from references import good_reference

from ibvs_qp.analytic import PaperController
from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.pilot import Pilot
from ibvs_qp.supervision.assured import Assured

LAWS = {
    "qp": HybridController,
    "qp, free of rows": lambda: HybridController(ControllerConfig(thrust_rows=False)),
    "analytic": PaperController,
    "assured": lambda: Assured(HybridController()),
    "assured, analytic": lambda: Assured(PaperController()),
}


def arrays_of(value: Any, seen: set[int] | None = None) -> Iterator[np.ndarray]:
    """Every array that attributes and containers reach; functions and their owners are not entered."""
    seen = set() if seen is None else seen
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, dict | list | tuple | set | frozenset):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from arrays_of(entry, seen)
    elif type(value).__module__.startswith("ibvs_qp") and hasattr(value, "__dict__"):
        yield from arrays_of(value.__dict__, seen)


def check(command: Command, owner: Any) -> int:
    """Number of the command's arrays; none that can be written is a part of the owner.

    A pilot holds the command of its last tick until the next begins, and does not read it then.
    """
    reached, held = list(arrays_of(command)), getattr(owner, "_commanded", None)
    own = list(arrays_of(owner, {id(held)}))
    for array in reached:
        shared = array.flags.writeable and any(np.shares_memory(array, other) for other in own)
        assert not shared, f"{array} of the command is the controller's"
    assert len(own) > 20
    return len(reached)


@pytest.mark.parametrize("law", LAWS)
def test_of_a_controller(law: str) -> None:
    controller: Any = LAWS[law]()
    blind = measured(4, attitude=None)
    for measurement in (measured(0), measured(1), None, measured(3), blind):
        command = controller.step(measurement, good_reference())
        assert check(command, controller) >= 3
        assert (command.outcome is Outcome.HOLD) == (measurement is None)


def test_of_a_pilot() -> None:
    pilot = Pilot()
    for frame in [*recording("rotor_loss").frames[:40], None]:
        assert check(pilot.step(frame), pilot) >= 3


def test_what_a_caller_writes_into_the_reports_does_not_fly() -> None:
    controller = HybridController()
    commands = [controller.step(measured(tick), good_reference()) for tick in range(3)]
    tasks: Any = commands[-1].tasks
    with pytest.raises(ValueError, match="read-only"):
        tasks.thrusts[:] += 30.0
