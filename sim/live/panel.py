"""The side panel: settings, disturbances, time, explanation and saving, for one writer and any number of watchers."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from ibvs_qp.config.errors import ConfigError, IbvsQpError, out_of_range
from ibvs_qp.config.gains import Gains, Weights
from ibvs_qp.config.limits import LimitSettings
from ibvs_qp.config.solver import SOLVERS, SolverSettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.model.inputs import RUN_TIME
from ibvs_qp.pilot.painting.config import PaintingConfig
from sim.live.disturbances import BUTTONS, OF_ROTOR, faults
from sim.live.explaining import WhatIf
from sim.live.process import FASTEST, SLOWEST
from sim.live.rows import KEPT_S
from sim.live.session import CEILING, ceilings
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

_BACK = "Time before now, of the rewind and of the explained tick."

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
    """A slider, switch or choice of one setting; a wide positive range is in decades, its label shows the value.

    Args:
        gui: Where it is added.
        name: Of the setting.
        field: Of the setting.
        value: At the beginning.
        span: Range, where it is narrower than that of the field.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        name: str,
        field: dataclasses.Field[Any],
        value: Any,
        span: tuple[float, float] | None = None,
    ) -> None:
        meta, self.name = field.metadata, name
        unit = f" [{meta['unit']}]" if meta["unit"] else ""
        self.caption = f"{field.name.removesuffix('_n').removesuffix('_m_s').replace('_', ' ')}{unit}"
        why = f" Why: {meta['why']}." if meta.get("why") else ""
        hint = f"{name}{unit}: {meta['doc']}.{why}"
        low, high = span or (meta.get("low", -math.inf), meta.get("high", math.inf))
        ranged = not isinstance(value, bool) and 0.0 <= low < high < math.inf
        self._low, self._least = low, low if low > 0.0 or not ranged else high * 10.0**-_RANGE
        self._decades = ranged and high / self._least >= _DECADES_FROM and (low > 0.0 or high >= _DECADES_FROM)
        if isinstance(value, bool):
            self.handle: Any = gui.add_checkbox(self.caption, value, hint=hint)
        elif self._decades:
            self.caption = self.caption.removesuffix(unit)
            ends = math.log10(self._least), math.log10(high)
            self.handle = gui.add_slider(self._text(value), *ends, 0.01, self._shown(value), hint=hint)
        elif math.isfinite(low) and math.isfinite(high):
            step = 10.0 ** math.floor(math.log10((high - low) / _STEPS))
            shown = min(max(float(value), low), high)
            self.handle = gui.add_slider(self.caption, float(low), float(high), step, shown, hint=hint)
        else:
            self.handle = gui.add_number(self.caption, float(value), hint=hint)

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
        return f"{self.caption} = {value:.4g}"


class Why:
    """Explanation of a tick, as recorded and with one setting changed.

    Args:
        gui: Where it is added.
        what_if: Explains ticks.
        owned: Makes a handle an input, with the function that is called after a change.
    """

    def __init__(self, gui: viser.GuiApi, what_if: WhatIf, owned: Callable[[Any, Callable[[], None]], Any]) -> None:
        self._what_if, self._point, self._head = what_if, None, ""
        self._what = gui.add_dropdown("instead", what_if.names, initial_value=what_if.names[0])
        self._factor = gui.add_slider(
            "factor x 1", -_WHAT_IF_DECADES, _WHAT_IF_DECADES, 0.02, 0.0, hint="On its value at that tick, in decades."
        )
        self._text = gui.add_markdown("No tick is explained yet.")
        for handle in (self._what, self._factor):
            owned(handle, self.show)

    def explain(self, tick: int, time_s: float, point: np.ndarray) -> None:
        """Explain a tick."""
        self._point, self._head = point, f"**Tick {tick}, t = {time_s:.3f} s**"
        self.show()

    def show(self) -> None:
        """Show the tick with the setting chosen."""
        factor, name, point = 10.0**self._factor.value, self._what.value, self._point
        self._factor.label = f"factor x {factor:.3g}"
        if point is None:
            return
        try:
            value, flown, now = self._what_if.scaled(point, name, factor)
            text = f"{self._head}, {name} = {value:.4g} (flown: {value / factor:.4g})\n\n"
            text += self._what_if.markdown(point, now, flown)
        except IbvsQpError as error:
            text = f"{self._head}\n\n{error}"
        self._text.content = text.replace("| ", "|\u00a0")  # tables have no gaps of their own


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
        self._noticed: dict[int, float] = {}
        self._ticks = self._first = 0
        gui = server.gui
        self._status, self._below = gui.add_markdown("Starting ..."), gui.add_markdown("")
        self._reduction = self._refused = ""
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
        self._lines: list[tuple[float, str]] = []

    # One writer.

    @property
    def _writer(self) -> int | None:
        """The browser that has been here for longest."""
        return min(self._server.get_clients(), default=None)

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
            if not self._writes(event):
                back()
                return
            try:
                _check(handle)
                act()
            except ConfigError as error:
                back()
                self.refuse(str(error))
                raise
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
        self._back = self._input(gui.add_slider("back [s]", 0.0, KEPT_S, self._what_if.tick_s, 0.0, hint=_BACK))
        self._button(
            "Rewind and fork", lambda: send("rewind", self._cursor()),
            "Pause at that tick; from there the flight may go another way, beside the trace before.",
        )  # fmt: skip

    def _cursor(self) -> int:
        return max(self._ticks - round(self._back.value / self._what_if.tick_s), self._first)

    def _tune(self) -> None:
        gui = self._server.gui
        fields = {field.name: field for field in dataclasses.fields(PaintingConfig)}
        with gui.add_folder("Task"):
            for name in _TASK:
                self._add("task", name, name, fields[name])
            field = next(each for each in dataclasses.fields(VehicleParams) if each.name == CEILING)
            self._add("thrust", CEILING, CEILING, field, ceilings(self._what_if.vehicle))
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

    def _add(
        self, kind: str, name: str, key: str, field: dataclasses.Field[Any], span: tuple[float, float] | None = None
    ) -> None:
        control = self._controls[name] = Control(self._server.gui, name, field, self._settings[name], span)
        self._input(control.handle, lambda: self._change(kind, {key: control.value}))

    def _change(self, kind: str, values: dict[str, Any]) -> None:
        self._send("change", kind, values, time.monotonic())

    def _disturb(self) -> None:
        gui, rotors = self._server.gui, self._what_if.rotors
        for label in BUTTONS:
            if label == OF_ROTOR[0]:
                rotor = gui.add_dropdown("rotor", rotors, initial_value=rotors[0], hint="Rotor that is lost or weak.")
                self._rotor = self._input(rotor)
            self._button(label, lambda label=label: self._strike(label))

    def _strike(self, label: str) -> None:
        for values in faults(label, self._rotor.value):
            self._change("fault", values)

    def _why(self) -> None:
        self._button(
            "Explain the tick", lambda: self._send("point", self._cursor()), "The tick that the slider back points at."
        )
        self._button(
            "Last tick with an active limit", lambda: self._send("limited"),
            "Pause, and move back to the newest tick with a rotor at its limit.",
        )  # fmt: skip
        self.why = Why(self._server.gui, self._what_if, self._input)

    # From the flight.

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
        values = ", ".join(f"{self._named(name)} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
                           for name, value in change["values"].items())  # fmt: skip
        self.refuse("")
        self.note(change["tick"] * self._what_if.tick_s, f"{values} (acts after {waited} ticks)")

    def _named(self, name: str) -> str:
        """A task's setting as its slider names it."""
        return self._controls[name].caption if name in self._controls and "." not in name else name

    def refused(self, text: str, settings: dict[str, Any]) -> None:
        """A change was refused."""
        self.refuse(text)
        self.show_settings(settings)

    def rewound(self, time_s: float, settings: dict[str, Any]) -> None:
        """The flight is at an earlier time."""
        self.point_back(0.0)
        self.show_settings(settings)
        self.refuse("")
        self._lines = [(at, text if at < time_s else f"~~{text.strip('~')}~~") for at, text in self._lines]
        self.note(time_s, "back here; later lines are struck out, the trace before is dashed")

    def point_back(self, time_s: float) -> None:
        """Point at a tick so long before now."""
        self._back.value = time_s

    def note(self, time_s: float, text: str) -> None:
        """Show a line under the panel."""
        self._lines = [*self._lines, (time_s, text)][-8:]
        self._events.content = "\n".join(f"- {at:.2f} s {line}" for at, line in self._lines)

    def refuse(self, text: str) -> None:
        """Show a refusal below the status, until the next change."""
        self._refused = f"**Refused:** {text}" if text else ""
        self._show_below()

    def _show_below(self) -> None:
        text = "\n\n".join(each for each in (self._reduction, self._refused) if each)
        if self._below.content != text:
            self._below.content = text

    def frame(self, frame: dict[str, Any], phase: str, state: str) -> None:
        """Show where the flight stands."""
        self._ticks, self._first = frame["ticks"], frame["first"]
        for time_s, kind, text in frame["events"]:
            self.note(time_s, f"{kind}: {text}")
        flown = f"x {frame['speed']:.2f}" if frame["running"] else frame["over"] or "paused"
        late = f", {100.0 * frame['late']:.2f} % of ticks late" if frame["running"] else ""
        time_s = frame["ticks"] * self._what_if.tick_s
        status = f"**{time_s:.2f} s** {flown}, phase **{phase}**, supervisor **{state}**{late}"
        if self._status.content != status:
            self._status.content = status
        self._reduction = frame["reduction"]
        self._show_below()
