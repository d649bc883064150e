"""A recorded flight in the same scene: a run of `paint`, or an MCAP log of an own loop, of a bag or of `paint`."""

from __future__ import annotations

import math
import threading
import webbrowser
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
from ibvs_qp.interfaces.log import read_log, replayed
from ibvs_qp.interfaces.log.header import recorded_controller
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.supervision.assured import Assured
from sim.evaluate.explanation import flown_config
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.live.charts import Charts
from sim.live.explaining import WhatIf, markdown
from sim.live.rows import NUMBERS, READ
from sim.live.scene import LiveScene
from sim.live.site import address, stop
from sim.world.scene import Scene

#: Rows in the charts, at most [-]; ticks of an MCAP log that are read, at most [-]: an hour.
_MOST_ROWS, _MOST_TICKS = 3000, 900_000
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

    Args:
        file: A run folder, or an MCAP log.

    Raises:
        IbvsQpError: When it cannot be read, or has no flight under the QP law.
    """

    def __init__(self, file: Path) -> None:
        self.scene, self.limits = Scene(), tuple[str, ...]()
        if file.is_dir() and not (file / "log.mcap").exists():
            self._of_run(load_run(file).get("qp"), file)
        else:
            self._of_mcap(file / "log.mcap" if file.is_dir() else file)

    def _allot(self, ticks: int, rotors: int) -> None:
        widths = {**dict.fromkeys(NUMBERS, 1), **READ, "thrusts": rotors, "actual": rotors, "price": len(self.limits)}
        ends = np.cumsum([0, *widths.values()]).tolist()
        self.places = {name: slice(*ends[index : index + 2]) for index, name in enumerate(widths)}
        self.rows = np.full((ticks, ends[-1]), np.nan)
        self.rows[:, self.places["quaternion"]] = (1.0, 0.0, 0.0, 0.0)
        self.rows[:, self.places["state"]] = 0.0

    def _put(self, name: str, values: Any) -> None:
        self.rows[:, self.places[name]] = np.reshape(values, (len(self.rows), -1))

    def _of_run(self, trace: Trace | None, file: Path) -> None:
        if trace is None or "program" not in trace.arrays:
            raise ConfigError(f"{file} has no flight under the QP law")
        self.config, self.scene, self.points = flown_config(trace), trace.scene, trace.arrays["program"].astype(float)
        self.limits, arrays = trace.limits, trace.arrays
        self._allot(len(trace.t), trace.thrusts.shape[1])
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
        flight = read_log(file)
        flown = recorded_controller(flight.facts)
        law = flown.controller if isinstance(flown, Assured) else flown
        if not isinstance(law, HybridController):
            raise ConfigError(f"{file} was not flown under the QP law")
        self.config, self.limits = PilotConfig(controller=law.config), law.problem.row_names
        place = {name: index for index, name in enumerate(self.limits)}
        found, step = [], law.setpoints.step
        views = step.outputs | step.inputs
        for _, command in replayed(flight, flown):
            if command is None or len(found) >= _MOST_TICKS:
                continue
            prices = np.zeros(len(self.limits))
            for limit in command.active_limits:
                prices[place[limit.name]] = limit.price
            push = views["contact.push"].item(), (views["push_reference"] * views["contact.ramp"]).item()
            distance = views["contact.distance"].item()
            found.append((command, prices, push, distance, views["attitude"].copy(), step.point.copy()))
        if not found:
            raise ConfigError(f"{file} has no tick of a controller up to its first gap")
        self._allot(len(found), law.config.vehicle.geometry.count)
        commands, prices, pushes, distances, attitudes, points = zip(*found, strict=True)
        stamps = np.array([command.stamp_ns for command in commands])
        tip = np.array(law.config.vehicle.tip_position_m)
        positions = [
            _position(distance, attitude, tip) for distance, attitude in zip(distances, attitudes, strict=True)
        ]
        self.points = np.array(points)
        self._put("t", 1e-9 * (stamps - stamps[0]))
        self._put("felt", [push for push, _ in pushes])
        self._put("push", [push for push, _ in pushes])
        self._put("commanded", [reference for _, reference in pushes])
        self._put("state", [_STATES.index(str(command.safety)) for command in commands])
        self._put("step_us", [1e6 * command.solve_time_s for command in commands])
        self._put("reach", [command.reach_margin for command in commands])
        self._put("thrusts", [command.thrusts for command in commands])
        self._put("actual", [command.thrusts for command in commands])
        self._put("price", prices)
        self._put("quaternion", attitudes)
        self._put("position", positions)
        self._put("tip", [(-distance, *(0.0, 0.0)) for distance in distances])
        self._put("friction", np.zeros((len(found), 2)))


def _position(distance: float, attitude: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Where the body's origin is for a tip straight before the origin of the board, world NED [m], (3,)."""
    return np.array([-distance, 0.0, 0.0]) - rotation_from_quaternion(attitude) @ tip


class LogServer:
    """A recorded flight in the browser: a slider chooses the tick.

    Args:
        file: The log.
        server: viser's server.

    Raises:
        IbvsQpError: When the log cannot be read.
    """

    def __init__(self, file: Path, server: viser.ViserServer) -> None:
        self._flight, self._server = LoggedFlight(file), server
        flight = self._flight
        self._what_if = WhatIf(straightened(flight.config.controller))
        self._scene = LiveScene(server, flight.scene, flight.config)
        vehicle, gui = flight.config.controller.vehicle, server.gui
        self._limits = np.array(vehicle.thrust_min), np.array(vehicle.thrust_max)
        last = len(flight.rows) - 1
        tick = gui.add_slider(
            "tick", 0, last, 1, 0, hint=f"Tick of {file}; one is {flight.config.controller.tick_s:g} s."
        )
        tabs = gui.add_tab_group()
        with tabs.add_tab("Why"):
            self._why = gui.add_markdown("")
        with tabs.add_tab("Charts"):
            charts = Charts(gui, flight.places, flight.limits, self._what_if.rotors, kept_s=math.inf)
        charts.add(flight.rows[:: max(len(flight.rows) // _MOST_ROWS, 1)])
        charts.show()
        tick.on_update(lambda _: self.show(tick.value))
        self.show(0)

    def show(self, tick: int) -> None:
        """Show a tick."""
        flight = self._flight
        frame = {"row": flight.rows[tick], "ghost": None, "limits": self._limits, "running": False}
        self._scene.show(frame, flight.places)
        explained = self._what_if.explain(flight.points[tick])
        head = f"**Tick {tick}, t = {flight.rows[tick, 0]:.3f} s**"
        self._why.content = head + "\n\n" + markdown(explained, None, self._what_if.rotors)

    def run(self, browser: bool, ready: Callable[[str], None]) -> None:
        """Serve until Ctrl-C."""
        ready(address(self._server))
        if browser:
            webbrowser.open(address(self._server))
        try:
            threading.Event().wait()
        finally:
            stop(self._server)
