"""Quadratic programs of recorded ticks: stretches of a flight, so that a warm start has something to start from."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.qp.evaluator import Evaluator
from ibvs_qp.qp.problem import QpTemplate
from sim.bench.ticks import Tick, flown_ticks
from sim.experiments.scenes import near_wall
from sim.notebook.tuning.snippet import SnippetJob

#: Push asked for in the recorded press [N]; the rotors reach 30.4 N.
HARD_PUSH_N = 35.0


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Consecutive ticks of one flight.

    Attributes:
        template: The program that all ticks share.
        stacked: Parameters of every tick, (N, parameters).
        limited: Whether a limit binds at a tick, (N,).
        t: Time since the first recorded tick of the flight [s], (N,).
    """

    template: QpTemplate
    stacked: np.ndarray
    limited: np.ndarray
    t: np.ndarray

    def evaluators(self) -> Iterable[Evaluator]:
        """The program of every tick in turn; the same object with other values."""
        data = Evaluator(self.template)
        for row in self.stacked:
            data.stacked[:] = row
            data.evaluate()
            yield data

    def part(self, begin: int, end: int) -> Stretch:
        """Ticks from begin to end."""
        cut = slice(begin, end)
        return dataclasses.replace(self, stacked=self.stacked[cut], limited=self.limited[cut], t=self.t[cut])

    def busy(self, count: int) -> Stretch:
        """The `count` consecutive ticks of which about half are limited: with the transition between both.

        Raises:
            ValueError: When there are not so many ticks.
        """
        if count > len(self.limited):
            raise ValueError(f"{count} ticks asked for, {len(self.limited)} recorded")
        total = np.concatenate(([0], np.cumsum(self.limited)))
        share = (total[count:] - total[:-count]) / count
        begin = int(np.abs(share - 0.5).argmin())
        return self.part(begin, begin + count)


def packed(ticks: Iterable[Tick], config: ControllerConfig | None = None) -> Stretch:
    """Programs that a controller solves while it steps through the ticks of one flight.

    Args:
        ticks: Measurements and references in order.
        config: The controller's; the default flies the Tarot T960.
    """
    controller = HybridController(config)
    rows, limited, stamps = [], [], []
    for measurement, reference in ticks:
        command = controller.step(measurement, reference)
        data = controller.engine.data
        rows.append(data.stacked.copy())
        limited.append(bool(data.violation[0] > 0.0))
        stamps.append(command.stamp_ns)
    t = 1e-9 * (np.array(stamps) - stamps[0])
    return Stretch(template=controller.template, stacked=np.array(rows), limited=np.array(limited), t=t)


def hard_press(ticks: int, seed: int = 0) -> Stretch:
    """A press beyond reach from just before the wall; nobody reduces the push.

    Args:
        ticks: Ticks flown; the rotors meet their idle floor after about 1270, 1 s after the touch.
        seed: Of the flight.
    """
    scene = near_wall(paint={"push_n": HARD_PUSH_N})
    job = SnippetJob(hold_s=ticks * ControllerConfig().tick_s, slide_s=0.0)
    return packed(itertools.islice(flown_ticks(scene, seed, job, (), reach_check=False), ticks))
