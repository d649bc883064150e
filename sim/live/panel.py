"""The side panel: settings, disturbances, time, explanation and saving, for one writer and any number of watchers."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from ibvs_qp.config.errors import IbvsQpError, out_of_range
from ibvs_qp.config.gains import Gains, Weights
from ibvs_qp.config.limits import LimitSettings
from ibvs_qp.config.solver import SOLVERS, SolverSettings
from ibvs_qp.model.inputs import RUN_TIME
from ibvs_qp.pilot.painting.config import PaintingConfig
from sim.live.disturbances import BUTTONS, faults
from sim.live.explaining import CEILING, WhatIf, markdown
from sim.live.process import FASTEST, SLOWEST
from sim.live.rows import KEPT_S
from sim.live.site import guarded

#: Sections in the panel: title, class, and names of the fields.
_SECTIONS = {
    "weights": ("Weights", Weights),
    "limits": ("Limits", LimitSettings),
    "gains": ("Gains", Gains),
}
_TASK = ("push_n", "speed_m_s")
#: A positive range of more than this factor has a slider of decades [-]; steps of a linear one [-].
_DECADES_FROM, _STEPS = 100.0, 500
#: Decades of a slider whose range begins at 0, and how near to its left end the value is 0 [-].
_RANGE, _END = 9, 1.005
#: Factors on a value of an explained tick, in decades, and fastest repetition of a message to one browser [s].
_WHAT_IF_DECADES, _NOTICE_S = 2.0, 1.0

#: Parts of the scene that are shown or not: label, attribute of the scene, whether at the beginning, and hint.
_VIEWS = (
    ("analytic law (ghost)", "show_ghost", True, "The analytic law, flying the same seed."),
    ("attainable push", "show_reach", False, "Forces that the tip can hold, as a polytope."),
)

#: Sends a command to the flight.
Send = Callable[..., None]


def _check(handle: Any) -> None:
    """Refuse a value that the widget does not offer; the browser rounds by less than a step."""
    if isinstance(handle, viser.GuiSliderHandle):
        low, high = handle.min - handle.step, handle.max + handle.step
        if not low <= handle.value <= high:  # nor NaN
            raise out_of_range(handle.label, handle.value, "", f"allowed is {handle.min:g} to {handle.max:g}")
    elif isinstance(handle, viser.GuiDropdownHandle) and handle.value not in handle.options:
        raise out_of_range(handle.label, handle.value, "", f"allowed is one of {', '.join(handle.options)}")


class Control:
    """A slider, switch or choice of one setting; a wide positive range is in decades, its label shows the value."""

    def __init__(self, gui: viser.GuiApi, name: str, field: dataclasses.Field[Any], value: Any) -> None:
        meta, self.name = field.metadata, name
        unit = f" [{meta['unit']}]" if meta["unit"] else ""
        self._label = f"{field.name.removesuffix('_n').removesuffix('_m_s').replace('_', ' ')}{unit}"
        why = f" Why: {meta['why']}." if meta.get("why") else ""
        hint = f"{name}{unit}: {meta['doc']}.{why}"
        low, high = meta.get("low", -math.inf), meta.get("high", math.inf)
        ranged = not isinstance(value, bool) and 0.0 <= low < high < math.inf
        self._low, self._least = low, low if low > 0.0 or not ranged else high * 10.0**-_RANGE
        self._decades = ranged and high / self._least >= _DECADES_FROM and (low > 0.0 or high >= _DECADES_FROM)
        if isinstance(value, bool):
            self.handle: Any = gui.add_checkbox(self._label, value, hint=hint)
        elif self._decades:
            self._label = self._label.removesuffix(unit)
            ends = math.log10(self._least), math.log10(high)
            self.handle = gui.add_slider(self._text(value), *ends, 0.01, self._shown(value), hint=hint)
        elif math.isfinite(low) and math.isfinite(high):
            step = 10.0 ** math.floor(math.log10((high - low) / _STEPS))
            shown = min(max(float(value), low), high)
            self.handle = gui.add_slider(self._label, float(low), float(high), step, shown, hint=hint)
        else:
            self.handle = gui.add_number(self._label, float(value), hint=hint)

    @property
    def value(self) -> Any:
        """Value of the setting."""
        if not self._decades:
            return self.handle.value
        value = 10.0**self.handle.value
        return float(f"{value:.4g}") if value > self._least * _END else self._low

    def show(self, value: Any) -> None:
        """Show a value without sending it."""
        if self.value != value:
            self.handle.value = self._shown(value)
        if self._decades:
            self.handle.label = self._text(value)

    def _shown(self, value: Any) -> Any:
        return math.log10(max(value, self._least)) if self._decades else value

    def _text(self, value: float) -> str:
        return f"{self._label} = {value:.4g}"


class Panel:
    """The panel.

    Args:
        server: viser's server.
        send: Sends a command to the flight.
        settings: Values of all settings.
        what_if: Explains ticks.
        save: Called by the button.
        view: Called with the name of a part of the scene, and whether it is shown.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        send: Send,
        settings: dict[str, Any],
        what_if: WhatIf,
        save: Callable[[], None],
        view: Callable[[str, bool], None],
    ) -> None:
        self._server, self._send, self._what_if, self._save = server, send, what_if, save
        self._settings, self._controls = settings, dict[str, Control]()
        self._writer: int | None = None
        self._updating = threading.Lock()  # viser has a pool of threads
        self._noticed: dict[int, float] = {}
        self._ticks = self._first = 0
        self.tick_s, self._point = 0.004, None
        gui = server.gui
        self._status = gui.add_markdown("Starting ...")
        self._time()
        tabs = gui.add_tab_group()
        with tabs.add_tab("Tune"):
            self._tune()
        with tabs.add_tab("Disturb"):
            self._disturb()
        self.charts_tab = tabs.add_tab("Charts")
        with tabs.add_tab("Why"):
            self._why()
        with tabs.add_tab("View"):
            for label, name, shown, hint in _VIEWS:
                box = gui.add_checkbox(label, shown, hint=hint)
                self._input(box, lambda name=name, box=box: view(name, box.value))
        with tabs.add_tab("Save"):
            self._button("Save preset, session and log", self._save)
            self.saved = gui.add_markdown("Nothing is saved yet.")
        self._events = gui.add_markdown("")
        self._lines: list[str] = []
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._left)

    # One writer.

    def _came(self, client: viser.ClientHandle) -> None:
        if self._writer is None:
            self._writer = client.client_id

    def _left(self, client: viser.ClientHandle) -> None:
        if self._writer == client.client_id:
            self._writer = min((each for each in self._server.get_clients() if each != client.client_id), default=None)

    def _writes(self, event: Any) -> bool:
        """Whether an event is the writer's; a watcher gets at most one notice a second."""
        if event.client is None:
            return False
        if event.client_id == self._writer:
            return True
        self._notify(event.client, "Watching", "Another browser holds the controls; it passes them on when it closes.")
        return False

    def _notify(self, client: viser.ClientHandle, title: str, text: str) -> None:
        now = time.monotonic()
        if now - self._noticed.get(client.client_id, 0.0) > _NOTICE_S:
            self._noticed[client.client_id] = now
            client.add_notification(title, text, auto_close_seconds=5.0)

    def _button(self, label: str, act: Callable[[], None], hint: str | None = None) -> Any:
        button = self._server.gui.add_button(label, hint=hint)
        button.on_click(guarded(lambda event: act() if self._writes(event) else None))
        return button

    def _input(self, handle: Any, act: Callable[[], None] = lambda: None) -> Any:
        """An input of the writer's: the value of a watcher, and one that is refused, is put back."""
        last = [handle.value]

        def back() -> None:
            handle.value = last[0]

        def update(event: Any) -> None:
            if event.client is None:  # set by the server
                last[0] = handle.value
                return
            with self._updating:
                if not self._writes(event):
                    back()
                    return
                _check(handle)
                act()
                last[0] = handle.value

        handle.on_update(guarded(update, back))
        return handle

    # Parts of the panel.

    def _time(self) -> None:
        gui, send = self._server.gui, self._send
        moves = gui.add_button_group("time", ("Run", "Pause", "1 tick", "25 ticks"))
        acts = {
            "Run": lambda: send("run", True),
            "Pause": lambda: send("run", False),
            "1 tick": lambda: send("step", 1),
            "25 ticks": lambda: send("step", 25),
        }
        moves.on_click(guarded(lambda event: acts[moves.value]() if self._writes(event) else None))
        low, high = math.log10(SLOWEST), math.log10(FASTEST)
        rate = gui.add_slider("speed x 1", low, high, 0.05, 0.0, hint="Simulated over real time, in decades.")

        def pace() -> None:
            rate.label = f"speed x {10.0**rate.value:.2g}"
            send("rate", 10.0**rate.value)

        self._input(rate, pace)
        self._back = self._input(
            gui.add_slider(
                "back [s]", 0.0, KEPT_S, 0.1, 0.0, hint="Time before now, of the rewind and of the explained tick."
            )
        )
        self._button(
            "Rewind and fork", lambda: send("rewind", self._cursor()),
            "Pause at that tick; from there the flight may go another way, beside the trace before.",
        )  # fmt: skip

    def _cursor(self) -> int:
        return max(self._ticks - round(self._back.value / self.tick_s), self._first)

    def _tune(self) -> None:
        gui = self._server.gui
        fields = {field.name: field for field in dataclasses.fields(PaintingConfig)}
        with gui.add_folder("Task"):
            for name in _TASK:
                self._add("task", name, name, fields[name])
            solver = next(field for field in dataclasses.fields(SolverSettings) if field.name == "name")
            self._solver = gui.add_dropdown(
                "solver", SOLVERS, initial_value=self._settings["solver.name"], hint=solver.metadata["doc"]
            )
            self._input(self._solver, lambda: self._change("set", {"solver.name": self._solver.value}))
        for section, (title, kind) in _SECTIONS.items():
            fields = {field.name: field for field in dataclasses.fields(kind)}
            with gui.add_folder(title, expand_by_default=section == "weights"):
                for name in RUN_TIME[section]:
                    self._add("set", f"{section}.{name}", f"{section}.{name}", fields[name])

    def _add(self, kind: str, name: str, key: str, field: dataclasses.Field[Any]) -> None:
        control = self._controls[name] = Control(self._server.gui, name, field, self._settings[name])
        self._input(control.handle, lambda: self._change(kind, {key: control.value}))

    def _change(self, kind: str, values: dict[str, Any]) -> None:
        self._send("change", kind, values, time.monotonic())

    def _disturb(self) -> None:
        gui, rotors = self._server.gui, self._what_if.rotors
        rotor = self._input(
            gui.add_dropdown("rotor", rotors, initial_value=rotors[0], hint="Rotor that is lost or weak.")
        )
        for label in BUTTONS:
            self._button(label, lambda label=label: self._strike(label, rotor.value))

    def _strike(self, label: str, rotor: str) -> None:
        for values in faults(label, rotor):
            self._change("fault", values)

    def _why(self) -> None:
        gui = self._server.gui
        self._button(
            "Explain the tick", lambda: self._send("point", self._cursor()), "The tick that the slider back points at."
        )
        names = tuple(name for name in self._settings if name.startswith(("weights.", "limits.")))
        names = tuple(name for name in names if not isinstance(self._settings[name], bool))
        self._what = gui.add_dropdown("instead", (CEILING, *names), initial_value="weights.push")
        self._factor = gui.add_slider(
            "factor x 1", -_WHAT_IF_DECADES, _WHAT_IF_DECADES, 0.02, 0.0, hint="On its value at that tick, in decades."
        )
        self._text = gui.add_markdown(
            "Pause, and explain a tick: fractions of the cost, prices of limits, lost wrench."
        )
        for handle in (self._what, self._factor):
            self._input(handle, self.explain)

    # From the flight.

    def explain(self, tick: int | None = None, point: np.ndarray | None = None) -> None:
        """Explain a tick, or the last one explained with another value."""
        if point is not None:
            self._point, self._tick = point, tick
        if self._point is None:
            return
        factor, name = 10.0**self._factor.value, self._what.value
        self._factor.label = f"factor x {factor:.3g}"
        flown = self._what_if.explain(self._point)
        own = self._what_if.settings(self._point)
        value = factor * (own[name] if name != CEILING else self._what_if.ceiling(self._point))
        head = f"**Tick {self._tick}, t = {(self._tick or 0) * self.tick_s:.3f} s**"
        try:
            now = flown if self._factor.value == 0.0 else self._what_if.explain(self._point, {name: value})
            head += "" if now is flown else f", {name} = {value:.4g}"
            self._text.content = head + "\n\n" + markdown(now, flown, self._what_if.rotors)
        except IbvsQpError as error:
            self._text.content = f"{head}\n\n{error}"

    def show_settings(self, settings: dict[str, Any]) -> None:
        """Show the settings in force."""
        self._settings = dict(settings)
        for name, control in self._controls.items():
            control.show(settings[name])
        self._solver.value = settings["solver.name"]

    def changed(self, change: dict[str, Any], waited: int) -> None:
        """A change is in force."""
        self._settings |= {name: value for name, value in change["values"].items() if name in self._settings}
        for name in change["values"].keys() & self._controls.keys():
            self._controls[name].show(self._settings[name])
        values = ", ".join(f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
                           for name, value in change["values"].items())  # fmt: skip
        self.note(f"tick {change['tick']}: {values} (acts after {waited} ticks)")

    def refused(self, text: str, settings: dict[str, Any]) -> None:
        """A change was refused."""
        self.note(f"refused: {text}")
        self.show_settings(settings)
        if (client := self._server.get_clients().get(self._writer or 0)) is not None:
            self._notify(client, "Refused", text)

    def note(self, text: str) -> None:
        """Show a line under the panel."""
        self._lines = [*self._lines, text][-8:]
        self._events.content = "\n".join(f"- {line}" for line in self._lines)

    def frame(self, frame: dict[str, Any], phase: str, state: str) -> None:
        """Show where the flight stands."""
        self._ticks, self._first = frame["ticks"], frame["first"]
        for time_s, kind, text in frame["events"]:
            self.note(f"{time_s:.2f} s {kind}: {text}")
        flown = f"x {frame['speed']:.2f}" if frame["running"] else frame["over"] or "paused"
        late = f", {100.0 * frame['late']:.2f} % of ticks late" if frame["running"] else ""
        status = f"**{frame['ticks'] * self.tick_s:.2f} s** {flown}, phase **{phase}**, supervisor **{state}**{late}"
        if self._status.content != status:
            self._status.content = status
