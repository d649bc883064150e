"""A recorded flight in the same scene: a run of `paint`, or an MCAP log of an own loop, of a bag or of `paint`."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import viser

from ibvs_qp.command import SafetyState
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.supervision.assured import Assured
from sim.evaluate.explanation import flown_config
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.live.charts import Charts
from sim.live.explaining import WhatIf
from sim.live.panel import Why
from sim.live.rows import NUMBERS, READ
from sim.live.scene import LiveScene
from sim.live.site import address, guarded, open_browser, stop
from sim.world.scene import Scene

#: Rows in the charts, at most [-]; rows and inputs of an MCAP log that are kept, at most [bytes].
_MOST_ROWS, _MOST_BYTES = 3000, 1e9
_STATES = tuple(str(state) for state in SafetyState)


class LoggedFlight:
    """Rows and programs of a recorded flight under the QP law.

    Attributes:
        places: Columns of `rows` by name, as of `sim.live.rows`.
        rows: (N, width).
        points: Inputs of every tick's program, (N, P).
        config: Configuration flown.
        scene: The truth, or the default one for a log without it.
        limits: Names of the limits.
        seed: Of the errors of the vehicle.
        note: The limit at which the log is cut; empty for a whole one.

    Args:
        file: A run folder, or an MCAP log.

    Raises:
        IbvsQpError: When it cannot be read, or has no flight under the QP law.
    """

    def __init__(self, file: Path) -> None:
        self.scene, self.limits, self.seed, self.note = Scene(), tuple[str, ...](), 0, ""
        if file.is_dir() and not (file / "log.mcap").exists():
            self._of_run(load_run(file).get("qp"), file)
        else:
            self._of_mcap(file / "log.mcap" if file.is_dir() else file)

    def _allot(self, ticks: int, rotors: int) -> None:
        widths = {**dict.fromkeys(NUMBERS, 1), **READ, "thrusts": rotors, "actual": rotors, "price": len(self.limits)}
        ends = np.cumsum([0, *widths.values()]).tolist()
        self.places = {name: slice(*ends[index : index + 2]) for index, name in enumerate(widths)}
        self.rows = np.zeros((ticks, ends[-1]))  # takes memory where it is written

    def _put(self, name: str, values: Any) -> None:
        self.rows[:, self.places[name]] = np.reshape(values, (len(self.rows), -1))

    def _of_run(self, trace: Trace | None, file: Path) -> None:
        if trace is None or "program" not in trace.arrays:
            raise ConfigError(f"{file} has no flight under the QP law")
        self.config, self.scene, self.points = flown_config(trace), trace.scene, trace.arrays["program"]
        self.limits, self.seed, arrays = trace.limits, trace.seed, trace.arrays
        self._allot(len(trace.t), trace.thrusts.shape[1])
        for unknown in ("asked", "path_mm"):
            self.rows[:, self.places[unknown]] = np.nan
        for name, array in {
            "t": "t", "commanded": "push_reference", "felt": "push_measured", "push": "push_true", "phase": "phase",
            "outcome": "outcome", "step_us": "step_us", "reach": "reach_margin", "position": "position", "tip": "tip",
            "quaternion": "attitude", "friction": "friction_true", "thrusts": "thrusts", "actual": "thrusts_actual",
            "price": "limit_price",
        }.items():  # fmt: skip
            self._put(name, arrays[array])
        self._put("roll", np.degrees(arrays["euler"][:, 0]))
        self._put("pitch", np.degrees(arrays["euler"][:, 1]))

    def _of_mcap(self, file: Path) -> None:
        from ibvs_qp.interfaces.log import read_log, replayed  # needs the extra log
        from ibvs_qp.interfaces.log.header import recorded_controller

        flight = read_log(file)
        flown = recorded_controller(flight.facts)
        law = flown.controller if isinstance(flown, Assured) else flown
        if not isinstance(law, HybridController):
            raise ConfigError(f"{file} was not flown under the QP law")
        self.config, self.limits = PilotConfig(controller=law.config), law.problem.row_names
        step, vehicle = law.setpoints.step, law.config.vehicle
        self._allot(0, vehicle.geometry.count)
        most = int(_MOST_BYTES / (8 * (self.rows.shape[1] + step.point.size)))
        self._allot(most, vehicle.geometry.count)
        self.points, count, first_ns = np.zeros((most, step.point.size)), 0, 0
        limit, views = {name: index for index, name in enumerate(self.limits)}, step.outputs | step.inputs
        tip = np.array(vehicle.tip_position_m)
        for _, command in replayed(flight, flown):
            if command is None:
                continue
            if count == most:
                self.note = f"only the first {most} ticks are shown: the memory for a log is {_MOST_BYTES / 1e9:g} GB"
                break
            first_ns = first_ns or command.stamp_ns
            push, distance, attitude = views["contact.push"].item(), views["contact.distance"].item(), views["attitude"]
            prices = np.zeros(len(self.limits))
            for active in command.active_limits:
                prices[limit[active.name]] = active.price
            row, self.points[count] = self.rows[count], step.point
            row[: len(NUMBERS)] = np.nan
            for name, values in {
                "t": 1e-9 * (command.stamp_ns - first_ns), "felt": push, "push": push,
                "commanded": (views["push_reference"] * views["contact.ramp"]).item(),
                "state": _STATES.index(str(command.safety)), "step_us": 1e6 * command.solve_time_s,
                "reach": command.reach_margin, "thrusts": command.thrusts, "actual": command.thrusts,
                "price": prices, "quaternion": attitude, "position": _position(distance, attitude, tip),
                "tip": (-distance, 0.0, 0.0),
            }.items():  # fmt: skip
                row[self.places[name]] = values
            count += 1
        if not count:
            raise ConfigError(f"{file} has no tick of a controller up to its first gap")
        self.rows, self.points = self.rows[:count], self.points[:count]


def _position(distance: float, attitude: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Where the body's origin is for a tip straight before the origin of the board, world NED [m], (3,)."""
    return np.array([-distance, 0.0, 0.0]) - rotation_from_quaternion(attitude) @ tip


class LogServer:
    """A recorded flight in the browser: a slider chooses the tick.

    Args:
        flight: The flight.
        server: viser's server.
    """

    def __init__(self, flight: LoggedFlight, server: viser.ViserServer) -> None:
        self._flight, self._server = flight, server
        self._what_if = WhatIf(straightened(flight.config.controller))
        self._scene = LiveScene(server, flight.scene, flight.config, flight.seed)
        gui, last = server.gui, len(flight.rows) - 1
        hint = f"Tick of the log; one is {flight.config.controller.tick_s:g} s."
        tick = gui.add_slider("tick", 0, last, 1, 0, hint=hint)
        if flight.note:
            gui.add_markdown(flight.note)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Why"):
            self._why = Why(gui, self._what_if, lambda each, act: each.on_update(guarded(lambda _: act())))
        with tabs.add_tab("Charts"):
            charts = Charts(gui, flight.places, flight.limits, self._what_if.rotors, kept_s=math.inf, fork=False)
        charts.add(flight.rows[:: max(len(flight.rows) // _MOST_ROWS, 1)])
        charts.show()
        self.show(0)
        tick.on_update(guarded(lambda _: self.show(tick.value)))

    def show(self, tick: int) -> None:
        """Show a tick, the last one for a later one."""
        flight = self._flight
        tick = min(max(tick, 0), len(flight.rows) - 1)
        limits = self._what_if.limits(flight.points[tick])
        frame = {"row": flight.rows[tick], "ghost": None, "limits": limits, "running": False}
        self._scene.show(frame, flight.places)
        self._why.explain(tick, flight.rows[tick, 0], flight.points[tick])

    def run(self, browser: bool, ready: Callable[[str], None]) -> None:
        """Serve until Ctrl-C."""
        ready(address(self._server))
        if browser:
            open_browser(self._server)
        try:
            threading.Event().wait()
        finally:
            stop(self._server)
