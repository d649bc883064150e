"""Notebook 02: flies every change of a setting, compares it with the flight before, and saves it as a preset."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import ibvs_qp
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import dump_toml
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.presets import FILES
from sim.evaluate.window import phase_window
from sim.flight.trace import Trace
from sim.notebook.knobs import KNOBS, knob_values, turned
from sim.notebook.wall_flights import SETTLED_S, Setting, fly_setting, touch_time
from sim.world.scene import load_scene

#: A push lowered by less is not noted [N].
_REDUCED_N = 0.05


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A flown setting with the previous setting and the analytic law."""

    base: Setting  # the preset with which the controls began
    setting: Setting  # the setting
    last_setting: Setting  # the setting before
    now: Trace  # flight of the setting under the QP law
    last: Trace  # flight of the setting before
    analytic: Trace  # flight of the analytic law in the same scene
    refusal: str = ""  # reason of a refused setting; the other fields then show the comparison before

    @property
    def flights(self) -> dict[str, Trace]:
        """The three flights by their names in tables and figures."""
        return {"QP now": self.now, "QP before": self.last, "analytic law": self.analytic}

    @property
    def changes(self) -> tuple[str, ...]:
        """Every knob that differs from the preset, as "label: before → after"."""
        return _differences(self.base, self.setting)

    @property
    def last_change(self) -> tuple[str, ...]:
        """The same since the flight before."""
        return _differences(self.last_setting, self.setting)

    def changes_text(self) -> str:
        """Refusal, all changes since the preset, and the last one, as markdown."""
        if self.refusal:
            return f"**Refused:** {self.refusal}. The figures show the setting before."
        if not self.changes:
            return "**Changed:** nothing, this is the preset"
        lines = ["**Changed since the preset:**", "", *(f"- {each}" for each in self.changes)]
        last = "; ".join(self.last_change)
        return "\n".join([*lines, "", f"**Last step:** {last}"] if last else lines)


def reach_note(trace: Trace) -> str:
    """How far the reach check lowered the push of the job: "26.5 N reduced to 8.5 N"; empty where it did not.

    The push at the end of the hold counts; while sliding it may rise again, when the friction has shown itself.
    """
    commanded, (_, held_to) = trace.scene.paint.push_n, phase_window(trace, "press")
    before_end = np.flatnonzero(trace.t <= held_to)
    if not len(before_end) or not np.isfinite(held_to):
        return ""
    lowered = float(trace.push_reference[before_end[-1]])
    reduced = 0.0 < lowered < commanded - _REDUCED_N and trace.t[before_end[-1]] > touch_time(trace) + SETTLED_S
    return f"{commanded:g} N reduced to {lowered:.1f} N" if reduced else ""


def _differences(before: Setting, after: Setting) -> tuple[str, ...]:
    old = knob_values(before)
    return tuple(
        f"{KNOBS[name].label}: {_text(old[name])} → {_text(value)}"
        for name, value in knob_values(after).items()
        if value != old[name]
    )


def _text(value: Any) -> str:
    return ("off", "on")[value] if isinstance(value, bool) else f"{value:g}"


class TuningBench:
    """Flies settings and stores the last comparison.

    Args:
        base: Initial setting of the knobs, and the first one to compare with.
    """

    def __init__(self, base: Setting | None = None) -> None:
        self.base = base or Setting()
        self._shown: Comparison | None = None

    @property
    def setting(self) -> Setting:
        """The setting flown last."""
        return self._shown.setting if self._shown is not None else self.base

    def compare(
        self,
        values: dict[str, Any] | None = None,
        own_gains: bool = True,
        note: Callable[[str], object] = lambda _: None,
    ) -> Comparison:
        """Fly the base setting with other values of some knobs, by name.

        Args:
            values: Values of knobs.
            own_gains: The analytic law uses the gains of its own preset; otherwise those of the setting.
            note: Called with the law being flown.

        Returns:
            The comparison; the one before, with a refusal, when the configuration is refused.
        """
        shown = self._shown
        try:
            setting = turned(self.base, values or {})
            note("Flight 1 of 2: the QP law ...")
            now = fly_setting(setting)
            note("Flight 2 of 2: the analytic law ...")
            analytic = fly_setting(analytic_setting(setting, own_gains))
        except ConfigError as error:
            return dataclasses.replace(shown or self.compare(), refusal=str(error))
        if shown is None:
            last_setting = self.base
        else:
            last_setting = shown.last_setting if shown.setting == setting else shown.setting
        last = fly_setting(last_setting)
        self._shown = Comparison(
            base=self.base, setting=setting, last_setting=last_setting, now=now, last=last, analytic=analytic
        )
        return self._shown


def compare_pair(before: dict[str, Any], change: dict[str, Any]) -> Comparison:
    """The shipped setting with some values of knobs, and the same with further ones."""
    return TuningBench(turned(Setting(), before)).compare(change)


def analytic_setting(setting: Setting, own_gains: bool = True) -> Setting:
    """Setting of the analytic law in the same scene with the same vehicle and contact settings.

    Weights, soft limits and solver do not affect this law; with their defaults the cached flight serves.

    Args:
        setting: Setting of the QP law.
        own_gains: Take the gains of the analytic law's own preset; else those of `setting`.
    """
    plain = ibvs_qp.preset("paper" if own_gains else "qp").controller
    changes = {name: getattr(plain, name) for name in ("weights", "limits", "solver")}
    changes |= {"gains": plain.gains} if own_gains else {}
    controller = dataclasses.replace(setting.pilot.controller, **changes)
    return dataclasses.replace(setting, pilot=dataclasses.replace(setting.pilot, controller=controller, law="paper"))


def load_setting(preset: str) -> Setting:
    """A setting from a preset: a shipped one by name, or a file, with the scene that `save_setting` put next to it.

    Raises:
        ConfigError: When it cannot be read, has the analytic law, or the rotors have different limits.
    """
    file = _path(preset)
    if not file.exists():
        file = FILES.get(preset, file)
    if not file.exists():
        raise ConfigError(f"{preset} does not exist; give a file, or one of {', '.join(FILES)}")
    pilot, scene = PilotConfig.from_toml(file), _scene_file(file)
    if pilot.law != "qp":
        raise ConfigError(f"{preset} is a preset of the analytic law; the controls are those of the QP law")
    setting = Setting(pilot=pilot, scene=load_scene(scene)) if scene.exists() else Setting(pilot=pilot)
    for name, value in knob_values(setting).items():
        if not isinstance(value, (bool, int, float)):
            raise ConfigError(f"{preset}: {name} = {value} has a value for every rotor, a slider shows one")
    return setting


@dataclass(frozen=True, kw_only=True)
class Start:
    """The preset with which the controls begin."""

    setting: Setting = field(default_factory=Setting)
    name: str = "the shipped preset"
    count: int = 0  # so that a reset is a change

    def again(self) -> Start:
        """The same, as a new value."""
        return dataclasses.replace(self, count=self.count + 1)


def load_start(
    preset: str, set_start: Callable[[Callable[[Start], Start]], Any], set_refusal: Callable[[str], Any]
) -> None:
    """Begin with another preset, see `load_setting`; one that is refused leaves the controls as they are.

    Args:
        preset: Name or file.
        set_start: Takes a function of the present start, and sets its result; each call rebuilds the controls.
        set_refusal: Takes the reason of a refusal; empty for a preset that is loaded.
    """
    try:
        setting = load_setting(preset)
    except ConfigError as error:
        set_refusal(str(error))
        return
    set_refusal("")
    set_start(lambda now: Start(setting=setting, name=f"`{preset}`", count=now.count + 1))


def _path(name: str | Path) -> Path:
    try:
        return Path(name).expanduser()
    except RuntimeError as error:  # no such user
        raise ConfigError(f"{name} is refused: {error}") from None


def _scene_file(preset: Path) -> Path:
    """File of the scene that belongs to a saved preset."""
    return preset.with_name(preset.stem + ".scene.toml")


def save_setting(setting: Setting, preset: str | Path) -> tuple[Path, Path]:
    """Write a setting as a preset and, next to it, a scene (friction, slope, gusts and push belong to the scene).

    Returns:
        Both files.

    Raises:
        ConfigError: When a file cannot be written, or the contact would ring with this preset.
    """
    file = _path(preset)
    if file.suffix != ".toml":
        raise ConfigError(f"{file} is refused: the name of a preset ends in .toml")
    require_margin(setting.pilot.controller, setting.pilot.controller.brush)
    scene = _scene_file(file)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(setting.pilot.to_toml(), encoding="utf-8")
        scene.write_text(dump_toml(setting.scene), encoding="utf-8")
    except (OSError, ValueError) as error:
        raise ConfigError(f"cannot write {file}: {getattr(error, 'strerror', None) or error}") from None
    return file, scene


def save_text(setting: Setting, preset: str) -> str:
    """Save a setting and describe how to fly it, or why it was not saved, as markdown."""
    try:
        files = save_setting(setting, preset)
    except ConfigError as error:
        return f"**Not saved:** {error}"
    file, scene = (shlex.quote(str(each)) for each in files)
    command = f"ibvs-qp paint --preset {file} --scene {scene} --seed {setting.seed}"
    return f"Saved `{file}` and `{scene}`. Fly the whole job with\n\n```sh\n{command}\n```"
