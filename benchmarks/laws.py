"""Processor time of a step of every law of the experiment `fair`, in the same flight; a table in Markdown.

Run as ``python benchmarks/laws.py --seconds 20``. Each law paints the same scene in the world `datasheet` for so long,
one after the other in one process, in the interpreted and in the compiled backend. Compare ratios of one run.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from typing import Any

import numpy as np

import ibvs_qp
from sim.evaluate.table import markdown
from sim.experiments.comparison import opponent_name
from sim.experiments.page import QP
from sim.experiments.variants import VARIANTS
from sim.flight.closed_loop import ClosedLoop
from sim.flight.options import FlightOptions
from sim.world.random_scene import EVALUATION, random_scene
from sim.world.worlds import DEFAULT_WORLD, in_world

LAWS = (QP, ("paper", "standard"), ("paper", "box"), ("qp", "mpc"))
#: Ticks left out at the beginning [-]: set-up.
FIRST = 250


def step_us(law: str, variant: str, backend: str, seconds: float) -> np.ndarray:
    """Processor times of the steps of a law [us]."""
    config, changed = VARIANTS[variant].apply(ibvs_qp.preset(law)), VARIANTS[variant].controller
    config = dataclasses.replace(config, controller=config.controller.on_backend(backend))
    scene = in_world(random_scene(0, EVALUATION), DEFAULT_WORLD)
    loop = ClosedLoop(scene, FlightOptions(law=law, features="geometric", controller=changed, video=False), config)
    times, controller = list[int](), loop.pilot.controller
    inner = controller.step

    def timed(*inputs: Any, **named: Any) -> Any:
        begin = time.process_time_ns()
        command = inner(*inputs, **named)
        times.append(time.process_time_ns() - begin)
        return command

    controller.step = timed  # type: ignore[method-assign]
    while loop.going and loop.time_s < seconds:
        loop.sense()
        loop.advance()
    loop.close()
    return np.array(times[FIRST:]) * 1e-3


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="time of every flight [s] (default 20)")
    seconds, rows = parser.parse_args().seconds, []
    for law, variant in LAWS:
        cells = [opponent_name(law, variant) if (law, variant) != QP else "QP"]
        for backend in ("python", "compiled"):
            if VARIANTS[variant].controller and backend == "compiled":
                cells += ["–", "–"]  # a law of its own class has no compiled backend
                continue
            found = step_us(law, variant, backend, seconds)
            cells += [f"{np.median(found):.0f}", f"{np.percentile(found, 99):.0f}"]
        rows.append(cells)
    heads = ("law", "Python, median [us]", "99 %", "compiled, median [us]", "99 %")
    print(markdown(heads, rows, left={0}), end="")


if __name__ == "__main__":
    main()
