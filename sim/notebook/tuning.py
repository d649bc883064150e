"""Notebook 02: flies every change of a setting, compares it with the flight before, and saves it as a preset."""

from __future__ import annotations

import dataclasses
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ibvs_qp
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import dump_toml
from sim.flight.trace import Trace
from sim.notebook.knobs import KNOBS, knob_values, turned
from sim.notebook.wall_flights import Setting, fly_setting


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A flown setting beside the previous setting and the analytic law."""

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
        """Every changed knob, as "label: before → after"."""
        before = knob_values(self.last_setting)
        return tuple(
            f"{KNOBS[name].label}: {_text(before[name])} → {_text(value)}"
            for name, value in knob_values(self.setting).items()
            if value != before[name]
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

    def compare(self, values: dict[str, Any] | None = None, own_gains: bool = True) -> Comparison:
        """Fly the base setting with other values of some knobs, by name.

        Args:
            values: Values of knobs.
            own_gains: The analytic law uses the gains of its own preset; otherwise those of the setting.

        Returns:
            The comparison; the one before, with a refusal, when the configuration is refused.
        """
        shown = self._shown
        try:
            setting = turned(self.base, values or {})
            now, analytic = fly_setting(setting), fly_setting(analytic_setting(setting, own_gains))
        except ConfigError as error:
            return dataclasses.replace(shown or self.compare(), refusal=str(error))
        if shown is None:
            last_setting = self.base
        else:
            last_setting = shown.last_setting if shown.setting == setting else shown.setting
        last = fly_setting(last_setting)
        self._shown = Comparison(setting=setting, last_setting=last_setting, now=now, last=last, analytic=analytic)
        return self._shown


def compare_pair(before: dict[str, Any], change: dict[str, Any]) -> Comparison:
    """The shipped setting with some values of knobs, and the same with further ones."""
    return TuningBench(turned(Setting(), before)).compare(change)


def analytic_setting(setting: Setting, own_gains: bool = True) -> Setting:
    """Setting of the analytic law in the same scene with the same vehicle and contact settings.

    Weights, soft limits and solver do not affect this law; with their defaults the cached flight serves.

    Args:
        setting: Setting of the QP law.
        own_gains: Take the gains of the analytic law's own preset, tuned by the same search; else those of `setting`.
    """
    plain = ibvs_qp.preset("paper" if own_gains else "qp").controller
    changes = {name: getattr(plain, name) for name in ("weights", "limits", "solver")}
    changes |= {"gains": plain.gains} if own_gains else {}
    controller = dataclasses.replace(setting.pilot.controller, **changes)
    return dataclasses.replace(setting, pilot=dataclasses.replace(setting.pilot, controller=controller, law="paper"))


def save_setting(setting: Setting, preset: str | Path) -> tuple[Path, Path]:
    """Write a setting as a preset and, beside it, a scene (friction, slope, gusts and push belong to the scene).

    Returns:
        Both files.

    Raises:
        ConfigError: When a file cannot be written, or the contact would ring with this preset.
    """
    file = Path(preset).expanduser()
    if file.suffix != ".toml":
        raise ConfigError(f"{file} is refused: the name of a preset ends in .toml")
    require_margin(setting.pilot.controller, setting.pilot.controller.brush)
    scene = file.with_name(file.stem + ".scene.toml")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(setting.pilot.to_toml(), encoding="utf-8")
        scene.write_text(dump_toml(setting.scene), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot write {file}: {error.strerror or error}") from None
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
