"""Sliders and switches of notebook 02: the field that each one sets, its range and its label."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.notebook.wall_flights import Setting
from sim.sweep.setup import changed, value_at

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
