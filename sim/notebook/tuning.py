"""Notebook 02: flies every change of a setting, compares it with the flight before, and saves it as a preset."""

from __future__ import annotations

import dataclasses
import math
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
from sim.notebook.wall_flights import SETTLED_S, Setting, fly_setting, touch_time
from sim.sweep.setup import changed, value_at
from sim.world.scene import load_scene

#: Steps of a logarithmic slider per decade, and their significant digits.
STEPS_PER_DECADE, DIGITS = 10, 3


@dataclass(frozen=True)
class Knob:
    """One slider or switch."""

    label: str  # name with the unit in brackets
    path: str  # dotted field of `Setting`; it is also the knob's name
    low: float | None = None  # left end of the slider; None for a switch
    high: float | None = None  # right end
    step: float | None = None  # step; None for logarithmic steps

    def stops(self, value: float) -> list[float]:
        """Positions of the slider, including its initial value."""
        assert self.low is not None and self.high is not None
        if self.step is not None:
            places = [round(each, 6) for each in np.arange(self.low, self.high + 0.5 * self.step, self.step).tolist()]
        else:
            count = round(STEPS_PER_DECADE * math.log10(self.high / self.low)) + 1
            places = [float(f"{each:.{DIGITS}g}") for each in np.geomspace(self.low, self.high, count)]
        return sorted({*places, value})


_CONTROLLER = "pilot.controller."
_LIMITS, _WEIGHTS, _GAINS = _CONTROLLER + "limits.", _CONTROLLER + "weights.", _CONTROLLER + "gains."
_CONTACT, _VEHICLE = _CONTROLLER + "contact.", _CONTROLLER + "vehicle."

#: Every knob, by group in the order of display.
GROUPS: dict[str, tuple[Knob, ...]] = {
    "Task": (
        Knob("push [N]", "scene.paint.push_n", 1.0, 40.0, 0.5),
        Knob("sliding speed [m/s]", "scene.paint.speed_m_s", 0.02, 0.3, 0.01),
        Knob("approach speed [m/s]", _CONTACT + "approach_speed_m_s", 0.02, 0.3, 0.01),
        Knob("last 10 cm [m/s]", _CONTACT + "close_speed_m_s", 0.02, 0.3, 0.01),
        Knob("last 1 cm [m/s]", _CONTACT + "touch_speed_m_s", 0.01, 0.2, 0.01),
    ),
    "World": (
        Knob("friction [-]", "scene.wall.friction", 0.0, 1.0, 0.05),
        Knob("slope of the board [°]", "scene.board.slope_deg", -5.0, 5.0, 0.5),
        Knob("gusts, rms [N]", "scene.wind.gust_n_rms", 0.0, 5.0, 0.25),
        Knob("wall stiffness [N/m]", "scene.wall.stiffness_n_m", 500.0, 10000.0),
        Knob("seed", "seed", 0, 9, 1),
    ),
    "Limits": (
        Knob("full thrust [N]", _VEHICLE + "thrust_max_n", 12.0, 52.56, 0.5),
        Knob("idle thrust [N]", _VEHICLE + "thrust_min_n", 0.0, 5.0, 0.1),
        Knob("thrust rate [N/s]", _VEHICLE + "thrust_rate_n_s", 10.0, 1000.0),
        Knob("tilt barrier", _LIMITS + "tilt_barrier"),
        Knob("tilt bound [°]", _LIMITS + "tilt_deg", 0.1, 10.0),
        Knob("slack weight of tilt", _LIMITS + "tilt_slack_weight", 1.0, 1e6),
        Knob("force ceiling", _LIMITS + "push_barrier"),
        Knob("ceiling / reference", _LIMITS + "push_ceiling_ratio", 1.0, 3.0, 0.05),
        Knob("slack weight of the ceiling", _LIMITS + "push_slack_weight", 0.1, 1e5),
        Knob("approach barrier", _LIMITS + "approach_barrier"),
        Knob("reach check", _CONTROLLER + "reach_check"),
        Knob("ramp after touch", _CONTROLLER + "touch_ramp"),
    ),
    "Weights": tuple(
        Knob(f"{name.replace('_', ' ')} [1/({unit})²]", _WEIGHTS + name, low, high)
        for name, unit, low, high in (
            ("line", "1/s²", 0.1, 1e4),
            ("line_angle", "rad/s²", 1e-3, 1e4),
            ("push", "N", 1e-2, 1e4),
            ("level", "rad/s²", 0.1, 1e4),
            ("yaw", "rad/s²", 0.1, 1e4),
            ("velocity", "m/s²", 0.1, 1e4),
            ("height", "m/s²", 0.1, 1e5),
            ("effort", "N", 1e-5, 10.0),
            ("smoothness", "N", 1e-5, 10.0),
        )
    ),
    "Gains": (
        Knob("line, k_p [1/s²]", _GAINS + "line_kp", 5.0, 500.0),
        Knob("line, k_d [1/s]", _GAINS + "line_kd", 1.0, 100.0),
        Knob("line, k_i [1/s³]", _GAINS + "line_ki", 0.0, 10.0, 0.2),
        Knob("force, K_fp [-]", _GAINS + "force_kfp", 0.0, 3.0, 0.05),
        Knob("impedance, K_sp [N/m]", _GAINS + "force_ksp", 0.0, 1000.0, 10.0),
        Knob("impedance, K_sd [N s/m]", _GAINS + "force_ksd", 0.0, 200.0, 5.0),
    ),
}
#: The same knobs by name.
KNOBS = {knob.path: knob for knobs in GROUPS.values() for knob in knobs}


def knob_values(setting: Setting) -> dict[str, Any]:
    """Value of every knob in a setting."""
    return {name: value_at(setting, name) for name in KNOBS}


def turned(setting: Setting, values: dict[str, Any]) -> Setting:
    """The setting with other values of some knobs.

    Raises:
        ConfigError: When a value, or several together, are refused.
    """
    paths = {KNOBS[name].path: value for name, value in values.items()}
    return changed(dataclasses.replace(setting, seed=int(paths.pop("seed", setting.seed))), paths)


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
