"""A flight of a million ticks with random faults needs no more memory and time per tick than at its beginning.

``IBVS_QP_SOAK_TICKS`` is the number of ticks of the controller; a pilot flies a tenth of it.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hostile import Mutator
from hostile_flight import Flight, Subject
from hostile_subjects import CONTROLLERS, PILOTS

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]

TICKS = int(os.environ.get("IBVS_QP_SOAK_TICKS", "1000000"))
#: Share of the ticks before the memory is measured, and of ticks with hostile inputs.
WARM_UP, HOSTILE = 0.2, 0.2
#: Growth that is allowed: of resident memory [bytes], of objects of Python, and of the time per tick.
MEMORY, BLOCKS, TIME = 1_000_000, 2_000, 1.15
#: Parts of the soak between two measurements: a leak shows in each, a larger heap after one large array in one.
PARTS = 10
#: Percentile of the times per tick that other processes do not change.
UNDISTURBED = 25
STATUS = Path("/proc/self/status")


def resident() -> int:
    """Memory of the process's own [bytes], swapped parts included; pages of libraries come and go."""
    gc.collect()
    if not STATUS.exists():
        return 0
    rows = dict(line.split(":", 1) for line in STATUS.read_text().splitlines())
    return 1024 * sum(int(rows[name].split()[0]) for name in ("RssAnon", "VmSwap"))


def fly(flight: Flight, hostile: bool) -> None:
    if flight.left == 0:
        flight.rewind()
    if hostile:
        flight.hostile()
    else:
        flight.good()


def slowdown(old: Flight, new: Flight) -> float:
    """Time of a tick of one that flew long over that of a new one, tick by tick: a busy machine slows down both.

    Both begin anew, for the time of a tick depends on what flies: a clock that leapt, a retreat.
    """
    old.restart()
    times: tuple[list[float], list[float]] = [], []
    for _ in range(2 * old.subject.ticks):
        for flight, found in zip((old, new), times, strict=True):
            if flight.left == 0:
                flight.rewind()
            inputs, begin = flight.recorded(), time.thread_time()
            flight.flown.step(*inputs)
            found.append(time.thread_time() - begin)
            flight.tick += 1
    of_old, of_new = (float(np.percentile(found, UNDISTURBED)) for found in times)
    return of_old / of_new


def soak(subject: Subject, ticks: int) -> str:
    """The recorded ticks again and again under one clock that goes on, a fifth of them hostile; growth in words."""
    mutator, choices = Mutator(random.Random(0), lies=True), random.Random(1)
    flight, held = Flight(subject, mutator), []
    marks = {round((WARM_UP + (1.0 - WARM_UP) * part / PARTS) * ticks) for part in range(PARTS)}
    for tick in range(ticks):
        if tick in marks:
            held.append((resident(), sys.getallocatedblocks()))
        fly(flight, choices.random() < HOSTILE)
    held.append((resident(), sys.getallocatedblocks()))
    memory, blocks = (PARTS * float(median) for median in np.median(np.diff(held, axis=0), axis=0))
    slower = slowdown(flight, Flight(subject, mutator, subject.make()))
    grown = f"{ticks} ticks: {memory:.0f} bytes and {blocks:.0f} objects more, {slower:.2f} of the time of a new one"
    assert memory < MEMORY and blocks < BLOCKS and slower < TIME, f"{grown}; memory and objects: {held}"
    return grown


def in_own_process(subject: Subject, ticks: int) -> None:
    """The soak with a heap of its own: one with holes of other tests grows by what it would put into them."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        print(pool.submit(soak, subject, ticks).result())


def test_controller() -> None:
    in_own_process(CONTROLLERS["qp"], TICKS)


def test_pilot() -> None:
    in_own_process(PILOTS["pilot"], TICKS // 10)
