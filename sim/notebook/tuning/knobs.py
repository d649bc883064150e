"""The sliders and switches of the notebook: which field each one moves, over which range, and under which name."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.notebook.tuning.snippet import Setting

#: Steps of a logarithmic slider per decade; ten to twelve per cent apart is finer than the loop can tell.
STEPS_PER_DECADE = 10
#: Significant digits of a logarithmic step.
DIGITS = 3


@dataclass(frozen=True, kw_only=True)
class Knob:
    """One slider or switch.

    Attributes:
        label: Name shown, with the unit in brackets.
        paths: Dotted fields of `Setting` that it sets together; the first one is read. Rotor limits are set in the
            program and in the plant: what the rotors can do, the controller knows.
        low: Left end of the slider; a switch has None.
        high: Right end.
        step: Step; None for logarithmic steps.
    """

    label: str
    paths: tuple[str, ...]
    low: float | None = None
    high: float | None = None
    step: float | None = None

    @property
    def name(self) -> str:
        """Its key in a dictionary of values."""
        return self.paths[0]

    def stops(self, value: float) -> list[float]:
        """Places of a slider, among them the value it starts from."""
        assert self.low is not None and self.high is not None
        if self.step is not None:
            count = round((self.high - self.low) / self.step)
            places = [round(self.low + index * self.step, 6) for index in range(count + 1)]
        else:
            count = round(STEPS_PER_DECADE * math.log10(self.high / self.low))
            places = [_rounded(entry) for entry in np.geomspace(self.low, self.high, count + 1)]
        return sorted({*places, value})


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


_LIMITS, _WEIGHTS, _GAINS = "pilot.controller.limits.", "pilot.controller.weights.", "pilot.controller.gains."
_CONTACT, _VEHICLE = "pilot.controller.contact.", "pilot.controller.vehicle."


def _weight(name: str, unit: str, low: float, high: float) -> Knob:
    return Knob(label=f"{name.replace('_', ' ')} [1/({unit})²]", paths=(_WEIGHTS + name,), low=low, high=high)


#: Every knob, by group in the order shown.
GROUPS: dict[str, tuple[Knob, ...]] = {
    "What is asked": (
        Knob(label="push [N]", paths=("scene.paint.push_n",), low=1.0, high=40.0, step=0.5),
        Knob(label="sliding speed [m/s]", paths=("scene.paint.speed_m_s",), low=0.02, high=0.3, step=0.01),
        Knob(label="approach speed [m/s]", paths=(_CONTACT + "approach_speed_m_s",), low=0.02, high=0.3, step=0.01),
        Knob(label="within 10 cm [m/s]", paths=(_CONTACT + "close_speed_m_s",), low=0.02, high=0.3, step=0.01),
        Knob(label="last 2 cm [m/s]", paths=(_CONTACT + "touch_speed_m_s",), low=0.01, high=0.2, step=0.01),
    ),
    "The world": (
        Knob(label="friction [-]", paths=("scene.wall.friction",), low=0.0, high=1.0, step=0.05),
        Knob(label="slope of the board [°]", paths=("scene.board.slope_deg",), low=-5.0, high=5.0, step=0.5),
        Knob(label="gusts, rms [N]", paths=("scene.wind.gust_n_rms",), low=0.0, high=5.0, step=0.25),
        Knob(label="wall stiffness [N/m]", paths=("scene.wall.stiffness_n_m",), low=500.0, high=10000.0),
        Knob(label="seed", paths=("seed",), low=0, high=9, step=1),
    ),
    "Limits": (
        Knob(
            label="full thrust [N]",
            paths=(_VEHICLE + "thrust_max_n", "scene.vehicle.thrust_max_n"),
            low=12.0,
            high=52.56,
            step=0.5,
        ),
        Knob(
            label="idle thrust [N]",
            paths=(_VEHICLE + "thrust_min_n", "scene.vehicle.thrust_min_n"),
            low=0.0,
            high=5.0,
            step=0.1,
        ),
        Knob(label="thrust rate [N/s]", paths=(_VEHICLE + "thrust_rate_n_s",), low=10.0, high=1000.0),
        Knob(label="tilt barrier", paths=(_LIMITS + "tilt_barrier",)),
        Knob(label="tilt bound [°]", paths=(_LIMITS + "tilt_deg",), low=0.1, high=10.0),
        Knob(label="price of tilt", paths=(_LIMITS + "tilt_slack_weight",), low=1.0, high=1e6),
        Knob(label="force ceiling", paths=(_LIMITS + "push_barrier",)),
        Knob(label="ceiling / reference", paths=(_LIMITS + "push_ceiling_ratio",), low=1.0, high=3.0, step=0.05),
        Knob(label="price of the ceiling", paths=(_LIMITS + "push_slack_weight",), low=0.1, high=1e5),
        Knob(label="approach barrier", paths=(_LIMITS + "approach_barrier",)),
        Knob(label="reach check", paths=("pilot.controller.reach_check",)),
        Knob(label="ramp after touch", paths=("pilot.controller.touch_ramp",)),
    ),
    "Weights": (
        _weight("line", "1/s²", 0.1, 1e4),
        _weight("line_angle", "rad/s²", 1e-3, 1e4),
        _weight("push", "N", 1e-2, 1e4),
        _weight("level", "rad/s²", 0.1, 1e4),
        _weight("yaw", "rad/s²", 0.1, 1e4),
        _weight("velocity", "m/s²", 0.1, 1e4),
        _weight("height", "m/s²", 0.1, 1e5),
        _weight("effort", "N", 1e-5, 10.0),
        _weight("smoothness", "N", 1e-5, 10.0),
    ),
    "Gains": (
        Knob(label="line, k_p [1/s²]", paths=(_GAINS + "line_kp",), low=1.0, high=100.0),
        Knob(label="line, k_d [1/s]", paths=(_GAINS + "line_kd",), low=0.5, high=30.0),
        Knob(label="line, k_i [1/s³]", paths=(_GAINS + "line_ki",), low=0.0, high=10.0, step=0.2),
        Knob(label="force, K_fp [-]", paths=(_GAINS + "force_kfp",), low=0.0, high=3.0, step=0.05),
        Knob(label="force, K_fi [1/s]", paths=(_GAINS + "force_kfi",), low=0.0, high=5.0, step=0.1),
        Knob(label="impedance, K_sd [N s/m]", paths=(_GAINS + "force_ksd",), low=0.0, high=200.0, step=5.0),
    ),
}
#: The same knobs by name.
KNOBS = {knob.name: knob for knobs in GROUPS.values() for knob in knobs}


def knob_values(setting: Setting) -> dict[str, Any]:
    """Where every knob stands for a setting."""
    return {name: _read(setting, name) for name in KNOBS}


def turned(setting: Setting, values: dict[str, Any]) -> Setting:
    """The setting with some knobs turned.

    Args:
        setting: Where to begin.
        values: Values by name of the knob.

    Raises:
        ConfigError: When a value, or several together, are refused.
    """
    tree: dict[str, Any] = {}
    for name, value in values.items():
        for path in KNOBS[name].paths:
            *folders, leaf = path.split(".")
            branch = tree
            for folder in folders:
                branch = branch.setdefault(folder, {})
            branch[leaf] = value
    return _replaced(setting, tree)


def _read(node: Any, path: str) -> Any:
    for name in path.split("."):
        node = getattr(node, name)
    return node


def _replaced(node: Any, tree: dict[str, Any]) -> Any:
    """All changes of a section at once: two of its fields may only be allowed together."""
    new = {
        name: _replaced(getattr(node, name), value) if isinstance(value, dict) else value
        for name, value in tree.items()
        if isinstance(value, dict) or value != getattr(node, name)
    }
    return dataclasses.replace(node, **new) if new else node
