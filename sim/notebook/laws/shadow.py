"""One flight under the QP law with the analytic law beside it: at every tick both answer the same set-points."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ibvs_qp.analytic import analytic_thrusts
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference
from sim.flight.closed_loop import FlightOptions, World, make_pilot, pilot_config
from sim.notebook.laws.flights import WallTask

#: A flight that lasts longer is cut [ticks].
LONGEST_TICKS = 4000
#: Phases that are not looked at.
_OVER = ("retreat", "done")


@dataclass(frozen=True, kw_only=True)
class ShadowFlight:
    """Both laws tick by tick; the QP's thrusts were flown.

    Attributes:
        ticks: Measurement and reference of every tick, N of them.
        effectiveness: B, (6, n).
        t: Time [s], (N,).
        contact_weight: Lambda, (N,).
        lines: Lines in use, (N,).
        limited: Whether a limit of the program binds, (N,).
        qp_free: Thrusts of the program without limits [N], (N, n).
        qp: With limits: flown.
        law_free: Thrusts of the analytic law before clipping [N], (N, n).
        law: After clipping to the same window.
        push: True push [N], (N,).
        asked: Push asked for [N], (N,).
    """

    ticks: list[tuple[Measurement, Reference]]
    effectiveness: np.ndarray
    t: np.ndarray
    contact_weight: np.ndarray
    lines: np.ndarray
    limited: np.ndarray
    qp_free: np.ndarray
    qp: np.ndarray
    law_free: np.ndarray
    law: np.ndarray
    push: np.ndarray
    asked: np.ndarray

    def wrench_given_up(self, law: str) -> np.ndarray:
        """Wrench with limits minus wrench without, of "qp" or "paper" [N, N m], (N, 6)."""
        flown, free = (self.qp, self.qp_free) if law == "qp" else (self.law, self.law_free)
        return (flown - free) @ self.effectiveness.T


@functools.lru_cache(maxsize=16)
def shadow_flight(task: WallTask) -> ShadowFlight:
    """Fly a task under the QP law, ask the analytic law at every tick, same gains and set-points; remembered."""
    options = FlightOptions(law="qp", seed=task.seed, features="geometric", video=False)
    config = pilot_config(task.scene, options, task.pilot("qp"))
    pilot, world = make_pilot(task.scene, options, config, task.job), World(task.scene, options, config)
    controller = pilot.controller
    assert isinstance(controller, HybridController)
    data, terms, ticks = controller.engine.data, controller.setpoints, []
    names = ("t", "contact_weight", "lines", "limited", "qp_free", "qp", "law_free", "law", "push", "asked")
    rows: dict[str, list] = {name: [] for name in names}
    while not world.plant.crashed and len(ticks) < LONGEST_TICKS:
        frame = world.sense()
        command = pilot.step(frame)
        if pilot.painter.finished or pilot.painter.phase in _OVER:
            break
        if pilot.measurement is not None:
            law_free = analytic_thrusts(terms)
            law = np.clip(law_free, terms.lower, terms.upper)
            limited = bool(data.violation[0] > 0.0)
            values = (1e-9 * frame.stamp_ns, terms.contact_weight, len(terms.lines), limited, data.free.copy())
            values += (command.thrusts, law_free, law, world.plant.contact_normal_force, terms.push_reference)
            for name, value in zip(names, values, strict=True):
                rows[name].append(value)
            ticks.append((pilot.measurement, pilot.reference))
        world.act(command.thrusts)
    arrays = {name: np.array(values) for name, values in rows.items()}
    return ShadowFlight(ticks=ticks, effectiveness=terms.effectiveness, **arrays)
