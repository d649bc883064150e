"""Charts of the last minute beside the picture: pushes, path, tilt, thrusts, prices of limits, time, supervisor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from sim.live.rows import KEPT_S, OUTCOMES, STATES

#: Charts per second [Hz], height of a chart [px], and samples in it [-].
CHARTS_HZ, _HEIGHT_PX, _SAMPLES = 3.0, 150, 300
#: Series of the limits but the thrusts', and price below which the axis is linear [-].
_OTHERS, _SMALL = "others", 0.01
_COLORS = ("#c62828", "#1565c0", "#2e7d32", "#ef6c00", "#6a1b9a", "#00838f", "#5d4037", "#546e7a")


class Charts:
    """Rows of the flight, of the ghost's push, and of the trace before a rewind, as charts.

    Args:
        gui: Where the charts are added.
        places: Columns of a row by name.
        limits: Names of the prices.
        rotors: Names of the rotors.
        kept_s: Time that is shown [s].
        path: Whether strokes are painted.
        fork: Whether the flight can be rewound.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        places: dict[str, slice],
        limits: tuple[str, ...],
        rotors: tuple[str, ...],
        kept_s: float = KEPT_S,
        *,
        path: bool = False,
        fork: bool = True,
    ) -> None:
        self._places, self._kept_s = places, kept_s
        prices = {name: places["price"].start + index for index, name in enumerate(limits)}
        thrusts = tuple(f"price.{limits.index(f'thrust_{name}')}" for name in rotors)
        self._others = [place for name, place in prices.items() if name.removeprefix("thrust_") not in rotors]
        width = max(place.stop for place in places.values())
        self.rows, self.before = np.empty((0, width)), np.empty((0, width))
        single = {
            "Push [N]": ("asked", "commanded", "felt", "push", "push before"),
            "Tilt [deg]": ("roll", "pitch", "roll before", "pitch before"),
            "Thrusts [N]": tuple(f"thrusts.{index}" for index in range(len(rotors))),
            "Prices of limits": (*thrusts, _OTHERS),
            "Time of the law [ms]": ("step_us",),
            "Supervisor and outcome [severity]": ("state", "outcome"),
        }
        if path:
            single["Path error [mm], 0 beside the strokes"] = ("path_mm", "path_mm before")
        words = {"push": "true", "path_mm": "error", "path_mm before": "before", "step_us": "time"}
        words |= {f"thrusts.{index}": name for index, name in enumerate(rotors)}
        words |= {name: rotor for name, rotor in zip(thrusts, rotors, strict=True)}
        self._charts: list[tuple[tuple[str, ...], Any]] = []
        nothing = np.zeros(1)
        for title, every in single.items():
            names = tuple(name for name in every if fork or not name.endswith(" before"))
            series: list[Any] = [{"label": "t"}]
            for index, name in enumerate(names):
                dash = {"dash": (4, 4)} if name.endswith("before") else {}
                color = _COLORS[index % len(_COLORS)]
                series.append({"label": words.get(name, name), "stroke": color, "width": 1.5} | dash)
            scales: dict[str, Any] = {"x": {"time": False}}
            axes: Any = ({}, {"grid": {"show": _OTHERS not in names}})
            if _OTHERS in names:  # prices at the start of the motors are a thousand times those of a press
                scales["y"] = {"distr": 4, "asinh": _SMALL}
            chart = gui.add_uplot(
                (nothing,) * (len(names) + 1), tuple(series), title=title, scales=scales, axes=axes,
                height=_HEIGHT_PX,
            )  # fmt: skip
            self._charts.append((names, chart))
        gui.add_markdown(f"States: {_numbered(STATES)}. Outcomes: {_numbered(OUTCOMES)}.")

    def add(self, rows: np.ndarray) -> None:
        """Append rows; those older than a minute are dropped."""
        if len(rows):
            self.rows = np.concatenate((self.rows, rows))
            oldest = self.rows[-1, 0] - self._kept_s
            self.rows = self.rows[self.rows[:, 0] > oldest]
            self.before = self.before[self.before[:, 0] > oldest]

    def rewind(self, time_s: float) -> None:
        """Later rows become the trace before."""
        later = self.rows[:, 0] > time_s
        self.before = self.rows[later] if later.any() else self.before
        self.rows = self.rows[~later]

    def show(self) -> None:
        """Send the charts."""
        if not len(self.rows):
            return
        rows, times = self.rows, self.rows[:, 0]
        if len(self.before):
            times = np.union1d(times, self.before[:, 0])
        times = times[:: max(len(times) // _SAMPLES, 1)]
        for names, chart in self._charts:
            if chart.visible:
                chart.data = (times, *(self._column(name, rows, times) for name in names))

    def _column(self, name: str, rows: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Values at some times; NaN, which is not drawn, after the last one. The first is a number, as uPlot needs."""
        plain, _, before = name.partition(" ")
        plain, _, index = plain.partition(".")
        if before:  # up to the fork both are one flight
            rows = np.concatenate((rows[rows[:, 0] < self.before[0, 0]], self.before)) if len(self.before) else rows[:1]
        known = rows[:, 0]
        if plain in (_OTHERS, "price"):  # the highest one up to the next time: some limits are active in one tick
            columns = self._others if plain == _OTHERS else [self._places[plain].start + int(index)]
            first = np.minimum(np.searchsorted(known, times), len(rows) - 1)
            values = np.maximum.reduceat(rows[:, columns].max(axis=1, initial=0.0), first)
            return np.where(times <= known[-1], values, math.nan)
        values = np.nan_to_num(rows[:, self._places[plain].start + int(index or 0)])
        return np.interp(times, known, values * (1e-3 if plain == "step_us" else 1.0), right=math.nan)


def _numbered(names: tuple[str, ...]) -> str:
    return ", ".join(f"{index} {name}" for index, name in enumerate(names))
