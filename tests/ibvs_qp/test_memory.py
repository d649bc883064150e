"""A controller that flies for an hour needs no more memory than after its first minute."""

from __future__ import annotations

import gc
import os
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from controller_scenes import CEILING, TICK_NS
from references import good_reference
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement

#: Growth that is allowed per tick [bytes]: 1 MB in 10^6 ticks.
PER_TICK = 1.0
#: Ticks of the recorded approach and press, and how often they are flown again.
RECORDED, LAPS = 500, 100
#: Resident memory comes and goes in pages; growth that is taken for that [bytes].
RESIDENT = 250_000
#: Open loop, a weak rotor's ticks take OSQP to its cap in 17 of 65,000; DAQP solves most of those.
SOLUTIONS = (Outcome.SOLVED, Outcome.INACCURATE_ACCEPTED, Outcome.CAPPED_ACCEPTED, Outcome.EXACT_FALLBACK)
STATM = Path("/proc/self/statm")


def recorded() -> list[Measurement]:
    """An approach and a press in closed loop; for a while one rotor is weak and one line is broken."""
    controller = HybridController()
    vehicle, found = SmallVehicle(controller.config, distance=0.03), []
    weak = np.full(6, CEILING)
    weak[2] = 11.0
    for tick in range(RECORDED):
        seen = vehicle.measure(2, thrust_max=weak) if 200 <= tick < 300 else vehicle.measure(2)
        if 350 <= tick < 360:
            seen = replace(seen, lines=(replace(seen.lines[0], rho=float("nan")), *seen.lines[1:]))
        found.append(seen)
        vehicle.fly(controller.step(seen, good_reference()).thrusts)
    return found


class Flight:
    """The recorded ticks again and again under one clock that goes on: a reset would set up the solver anew."""

    def __init__(self, law: type) -> None:
        self.law, self.ticks, self.lap = law(ControllerConfig()), recorded(), 0

    def fly(self, laps: int) -> None:
        wish = good_reference()
        for _ in range(laps):
            shift = self.lap * RECORDED * TICK_NS
            self.lap += 1
            for index, seen in enumerate(self.ticks):
                stamp = seen.stamp_ns + shift
                seen = replace(seen, stamp_ns=stamp, wrench_stamp_ns=stamp, plane_stamp_ns=stamp)
                command = self.law.step(seen, wish)
                assert command.outcome in SOLUTIONS
                if index % 50 == 0:
                    assert command.tasks is not None and command.active_limits is not None  # made when read
        gc.collect()


def growth(of: Callable[[], int], run: Callable[[], None]) -> int:
    before = of()
    run()
    return of() - before


@pytest.mark.slow
@pytest.mark.parametrize("law", [HybridController, PaperController])
def test_memory_does_not_grow_with_the_ticks(law: type) -> None:
    flight = Flight(law)
    flight.fly(4)
    tracemalloc.start()
    try:
        flight.fly(2)
        traced = growth(lambda: tracemalloc.get_traced_memory()[0], lambda: flight.fly(LAPS // 10))
    finally:
        tracemalloc.stop()
    assert traced <= PER_TICK * RECORDED * LAPS / 10  # Python's and numpy's own memory, to the byte
    if STATM.exists():  # all of it, that of the solvers and of the compiled tick too
        page = os.sysconf("SC_PAGE_SIZE")
        flight.fly(LAPS // 2)  # the allocator's pools fill once: 0.4 MB in 40,000 ticks, then nothing
        resident = growth(lambda: int(STATM.read_text().split()[1]) * page, lambda: flight.fly(LAPS))
        print(f"{law.__name__}: {traced} bytes traced, {resident} bytes resident")
        assert resident <= RESIDENT
