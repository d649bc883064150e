"""Every figure of merit, once: name, words, unit, better direction, least difference that matters, and formula.

Tables, report, JSON, experiments, sweeps and docs/metrics.md read this list; a new figure is one more entry.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.evaluate.part import Part
from sim.evaluate.strokes import Stroke
from sim.evaluate.window import SETTLED_S, last_event, least, limited_fraction, mean, peak, percentile, rms
from sim.flight.trace import CRASH

if TYPE_CHECKING:
    import polars as pl

#: Least difference that matters in practice, by reported unit, and why. A smaller one does not matter, however certain.
MATTERS = {
    "mm": (0.5, "a sixteenth of the overlap of two rows, 8 mm; not visible in paint"),
    "N": (0.05, "1 % of the commanded 5 N, and the bias of the force/torque sensor"),
    "deg": (0.1, "moves the tip, 0.7 m ahead of the centre of mass, by 1.2 mm"),
    "s": (0.1, "three pictures"),
    "%": (0.5, "7 mm of a row of 1.3 m, less than the overlap of two rows"),
    "m/s": (0.1, "the speed of painting; these are speeds of descent"),
    "mm/s": (1.0, "a hundredth of the speed of painting"),
    "m": (0.01, "a centimetre"),
    "deg/s": (10.0, "rates after the loss of a rotor reach hundreds"),
    "N/s": (5.0, "a seventh of the thrust rate of the QP law while painting, 37 N/s"),
}
#: Directions: more is better, less is better, neither.
MORE, LESS, NEITHER = 1, -1, 0
#: A job is reduced if it flew less than this fraction of the push that was asked.
REDUCED = 0.95
#: Kind of the event with the reason why the push was lowered, and the reason without one.
PUSH_REDUCED, NOT_REACHED = "push reduced", "the push was not reached"


@dataclass(frozen=True)
class Figure:
    """A figure of merit."""

    name: str  # key of M and column of a table of flights; "a.b" is key b of the object a
    words: str  # in words
    about: str = ""  # one plain sentence, also for readers of the report
    of: Callable[[Part], Any] | None = None  # formula; None: a measure of `sim.evaluate.measures` yields it
    unit: str = ""  # reported unit
    scale: float = 1.0  # factor from the formula's unit to the reported one
    digits: int = 2  # decimals
    better: int = LESS  # +1 if more is better, -1 if less is better, 0 if neither
    exactly: str = ""  # definition where `about` is not exact
    shown: bool = True  # a line of the table of a flight
    in_rows: bool = False  # a column of the report's table of rows
    of_row: bool = True  # whether a single row has it too
    timing: bool = False  # depends on the computer: not in tables of flights
    matters: tuple[float, str] | None = None  # least difference that matters, and why, if not that of the unit

    @property
    def label(self) -> str:
        """Words with unit."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    @property
    def least(self) -> tuple[float, str]:
        """Least difference that matters in the reported unit, and why.

        Raises:
            KeyError: When neither the figure nor its unit has one.
        """
        return self.matters or MATTERS[self.unit]

    def values(self, table: pl.DataFrame) -> np.ndarray:
        """Figure of every row of a table in the reported unit, NaN without one, (rows,)."""
        import polars as pl

        return self.scale * table[self.name].cast(pl.Float64).fill_null(math.nan).to_numpy()

    def show(self, metrics: dict[str, Any]) -> str:
        """The figure in M as text; a dash if it is missing."""
        value: Any = metrics
        for part in self.name.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        if isinstance(value, bool):
            return "yes" if value else "no"
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return "–"
        return value if isinstance(value, str) else f"{value * self.scale:.{self.digits}f}"


def _worst(part: Part, of: Callable[[Stroke], float]) -> float:
    """Value of the largest magnitude over the strokes of a part."""
    values = np.array([of(stroke) for stroke in part.strokes.values()])
    values = values[np.isfinite(values)]
    return float(values[np.argmax(np.abs(values))]) if len(values) else math.nan


def _reduced(part: Part) -> str | None:
    asked, flown = part.trace.scene.paint.push_n, mean(part.trace.push_true[part.straight])
    if math.isnan(flown) or flown >= REDUCED * asked:
        return None
    return last_event(part.trace, PUSH_REDUCED) or NOT_REACHED


def _rate(part: Part) -> float:
    """Frame rate that perception could keep up with, from the median time per picture [Hz]."""
    median = percentile(part.trace.vision_ms, 50)
    return 1e3 / median if median > 0.0 else math.nan


def _path_of_last_row(part: Part) -> float:
    last = [row for row in part.rows() if row.row == part.stroke_count]
    return rms(last[0].path.distance[last[0].straight]) if last else math.nan


def _thrust_rate(part: Part) -> float:
    thrusts, t = part.thrusts, part.trace.t
    return rms(np.diff(thrusts, axis=0) / float(np.median(np.diff(t)))) if len(thrusts) > 1 else math.nan


def _shares(part: Part, names: tuple[str, ...], value: Callable[[int], Any]) -> dict[str, Any]:
    return {name: value(index) for index, name in enumerate(names)}


def _outcomes(part: Part) -> dict[str, int]:
    outcome = part.trace.outcome[part.ticks]
    return _shares(part, part.trace.outcomes, lambda index: int(np.count_nonzero(outcome == index)))


def _limits(part: Part) -> dict[str, float]:
    active = part.trace.active[part.ticks]
    return _shares(part, part.trace.limits, lambda at: float(np.mean(active[:, at])) if len(active) else math.nan)


def _real_time(part: Part) -> float:
    return part.duration_s / part.trace.wall_time_s if part.trace.wall_time_s > 0 else math.nan


def _solved(part: Part) -> float:
    outcomes = _outcomes(part)
    return outcomes.get("solved", 0) / ticks if (ticks := sum(outcomes.values())) else math.nan


_FIGURES = (
    # ---------------------------------------------------------------------------------------------------- outcome
    Figure(
        "completed", "completed", "Whether the job was done, by the true motion and not by the report of the pilot.",
        lambda p: p.not_completed is None, better=MORE,
        exactly="by the truth: every stroke *at its place*, its length within 1 cm, no hole, contact in 98 % of "
        "painting (90 % with gusts or in the harsh world), retreat, no crash, no time-out. A press: every phase of its "
        "plan. A row: its stroke at its place and of its length",
    ),
    Figure(
        "claimed", "claimed by the pilot", "Whether the pilot reported so; a flight where both differ has failed.",
        lambda p: p.claimed, better=NEITHER,
    ),
    Figure(
        "false_claim", "false claim", "Whether the pilot reported a job that is not done.",
        lambda p: float(p.claimed and p.not_completed is not None), better=LESS, shown=False, digits=0,
    ),
    Figure(
        "not_completed", "not completed because", "Missing condition of the job; a dash if none.",
        lambda p: p.not_completed, better=NEITHER, exactly="missing condition of `completed`, by the truth; or null",
    ),
    Figure("reason", "ended because", "Why the flight ended.", lambda p: p.reason, better=NEITHER),
    Figure(
        "duration_s", "flight time", "Simulated time from start to end.",
        lambda p: p.duration_s, "s", digits=1, better=NEITHER,
    ),
    Figure(
        "real_time_factor", "real-time factor",
        "Simulated over computing time; 1 keeps up with the clock. It does not measure flight quality.",
        _real_time, "×", digits=1, better=NEITHER, of_row=False, timing=True,
        exactly="simulated time over wall-clock time of flight and log",
    ),
    Figure(
        "crashed", "crash", "Whether the flight ended in a crash.",
        lambda p: float(p.trace.reason.startswith(CRASH)), better=NEITHER, shown=False, digits=0, of_row=False,
        exactly="1 if the flight ended in a crash, else 0",
    ),
    # ------------------------------------------------------------------------------------------------------- paint
    Figure(
        "stroke_m", "shortest stroke", "Length of the shortest painted row; good: the length in the scene.",
        lambda p: p.stroke_m, "m", better=NEITHER, in_rows=True,
        exactly="shortest stroke, along it in contact on the board",
    ),
    Figure(
        "place_error_m", "place error, largest",
        "How far a row lies from where it belongs on the board, counted from the board's edge; good: within 8 mm.",
        lambda p: _worst(p, lambda stroke: stroke.place_error_m), "mm", 1e3, digits=1, in_rows=True,
        exactly="*place error*: mean over the straight part of a stroke of (true tip line − nominal line), + away from "
        "the first edge; of a flight: the largest in magnitude",
    ),
    Figure(
        "overlap_m", "overlap of rows, least",
        "Least overlap of a row with the one before; negative is a gap without paint.",
        lambda p: min((s.overlap_m for s in p.strokes.values() if math.isfinite(s.overlap_m)), default=math.nan),
        "mm", 1e3, digits=1, better=MORE, in_rows=True,
        exactly="least overlap of a stroke's band with that of the stroke before, without the last 2 cm; < 0 is a gap",
    ),
    Figure(
        "coverage", "coverage of the intended band",
        "Fraction of the intended stripes with paint on it; good: near 100 %.",
        lambda p: p.coverage, "%", 100.0, digits=1, better=MORE, in_rows=True,
        exactly="painted fraction of the intended band, along the polyline of the *scene*",
    ),
    Figure(
        "off_board_share", "painting beyond the board",
        "Fraction of the painting time with the tip off the board; good: 0.",
        lambda p: p.off_board_share, "%", 100.0,
        exactly="fraction of painting time with the true tip beyond an edge of the board",
    ),
    # -------------------------------------------------------------------------------------------------------- path
    Figure(
        "path_rms_straight_m", "path error, straights, rms",
        "Typical distance of the brush from the ideal line on straight parts; smaller is better.",
        lambda p: rms(p.path.distance[p.straight]), "mm", 1e3, in_rows=True,
        exactly="unsigned distance of the true tip to the polyline, no time lag; *straight*: all painting farther than "
        "0.10 m from a vertex",
    ),
    Figure(
        "path_rms_corner_m", "path error, corners, rms", "The same within 10 cm of a corner; smaller is better.",
        lambda p: rms(p.path.distance[p.corner]), "mm", 1e3, in_rows=True,
    ),
    Figure(
        "path_rms_m", "path error, rms", "The same over all painting.",
        lambda p: rms(p.path.distance[p.painting]), "mm", 1e3, shown=False,
    ),
    Figure(
        "path_max_m", "path error, largest", "Largest distance from the ideal line; smaller is better.",
        lambda p: peak(p.path.distance[p.painting]), "mm", 1e3, in_rows=True,
    ),
    Figure(
        "path_rms_last_row_m", "path error, straight of the last row, rms", "The same for the last row.",
        _path_of_last_row, "mm", 1e3, shown=False, of_row=False, exactly="null if the last row was not reached",
    ),
    Figure(
        "height_error_rms_m", "height error, rms",
        "Typical distance above or below the row being painted; smaller is better.",
        lambda p: rms(p.path.height[p.ticks]), "mm", 1e3,
        exactly="tip beyond or before its stroke, across it, in phase `paint`",
    ),
    # -------------------------------------------------------------------------------------------------------- push
    Figure(
        "push_asked_n", "push asked", "The push of the job.",
        lambda p: p.trace.scene.paint.push_n, "N", better=NEITHER, exactly="push of the scene",
    ),
    Figure(
        "push_commanded_n", "push commanded, mean", "Push that the pilot commanded on straight parts.",
        lambda p: mean(p.trace.push_reference[p.straight]), "N", better=NEITHER, exactly="mean on straights",
    ),
    Figure(
        "push_flown_n", "push flown, mean", "True push on straight parts; good: the push asked.",
        lambda p: mean(p.trace.push_true[p.straight]), "N", better=NEITHER, exactly="true push, mean on straights",
    ),
    Figure(
        "push_reduced", "push reduced because", "Why less than 95 % of the push was flown; a dash if it was flown.",
        _reduced, better=NEITHER, exactly="null, or the reason for which less than 95 % of the asked push was flown",
    ),
    Figure(
        "force_rms_straight_n", "push error, straights, rms",
        "Typical difference of true and commanded push on straight parts; smaller is better.",
        lambda p: rms(p.push_error[p.straight]), "N", digits=3, in_rows=True, exactly="true minus commanded push",
    ),
    Figure(
        "force_rms_corner_n", "push error, corners, rms", "The same within 10 cm of a corner; smaller is better.",
        lambda p: rms(p.push_error[p.corner]), "N", digits=3, in_rows=True,
    ),
    Figure(
        "force_rms_n", "push error, rms", "The same over all painting.",
        lambda p: rms(p.push_error[p.painting]), "N", digits=3, shown=False,
    ),
    Figure(
        "force_peak_n", "push, peak of the flight",
        "Hardest push on the wall at any moment; good: little more than the commanded push.",
        lambda p: peak(p.contact), "N", exactly="largest push at 1 kHz",
    ),
    Figure(
        "push_peak_ratio", "push, peak over reference", "Hardest push over the push of the job.",
        lambda p: peak(p.contact) / p.trace.scene.paint.push_n, shown=False, of_row=False,
        matters=(0.05, "0.25 N of 5 N, half of the band in which a push counts as settled"),
    ),
    Figure(
        "contact_share", "contact while painting",
        "Fraction of the painting time in which the brush touched the wall; good: 100 %.",
        lambda p: p.contact_share, "%", 100.0, better=MORE, in_rows=True,
        exactly="fraction of 1 kHz samples with more than 0.05 N while painting",
    ),
    Figure(
        "first_touch_s", "first touch at", "When the brush first touched the wall.",
        lambda p: p.touch["first_touch_s"], "s", better=NEITHER, exactly="first 1 kHz sample above 0.05 N",
    ),
    Figure(
        "settle_s", "push settled after",
        "Time from the first touch until the push stays within 0.5 N of the command; shorter is better.",
        lambda p: p.touch["settle_s"], "s",
        exactly="from the first touch to the first 0.5 s within 0.5 N of the commanded push",
    ),
    Figure(
        "bounces", "bounces", "How often the brush left the wall within 3 s of the first touch; good: 0.",
        lambda p: p.touch["bounces"], digits=0, matters=(1.0, "one loss of contact"),
    ),
    # ------------------------------------------------------------------------------------------------------ motion
    Figure(
        "tilt_rms_deg", "tilt, rms", "Typical lean of the vehicle; good: near 0, since tilted rotors push without it.",
        lambda p: rms(p.tilt[p.released]), "deg", exactly="angle to the world's vertical, after 1 s",
    ),
    Figure(
        "tilt_peak_deg", "tilt, peak", "Largest lean; smaller is better.",
        lambda p: peak(p.tilt[p.released]), "deg", in_rows=True,
    ),
    Figure(
        "yaw_rms_deg", "yaw, rms",
        "Typical angle between the heading and straight at the wall; smaller is better.",
        lambda p: rms(p.yaw[p.released]), "deg", exactly="true yaw from the wall's normal, after 1 s",
    ),
    Figure(
        "yaw_peak_deg", "yaw, peak", "The largest of these angles; smaller is better.",
        lambda p: peak(p.yaw[p.released]), "deg", in_rows=True,
    ),
    Figure(
        "velocity_rms_m_s", "velocity estimate, error rms",
        "Typical error of the vehicle's own estimate of its velocity; smaller is better.",
        lambda p: p.velocity_rms, "mm/s", 1e3, digits=1,
        exactly="estimated minus true velocity, over the components known",
    ),
    Figure(
        "propeller_clearance_min_m", "propeller clearance, smallest",
        "Least distance of a propeller to wall or board; 0 would be a crash.",
        lambda p: least(p.trace.propeller_clearance[p.ticks]), "m", digits=3, better=MORE,
        exactly="smallest distance of a propeller disc to wall or board",
    ),
    Figure(
        "effort_n", "thrust effort, rms", "How far the thrusts move from their mean.",
        lambda p: rms(p.thrusts - p.thrusts.mean(axis=0)) if len(p.thrusts) > 1 else math.nan, "N", shown=False,
        of_row=False, exactly=f"thrusts minus their own mean, over rotors and ticks after {SETTLED_S:g} s",
    ),
    Figure(
        "jitter_n_s", "thrust rate, rms", "How fast the commanded thrusts change; it wears motors.",
        _thrust_rate, "N/s", digits=0, shown=False, of_row=False,
        exactly=f"rate of the commanded thrusts, over rotors and ticks after {SETTLED_S:g} s",
    ),
    # -------------------------------------------------------------------------------------------------- controller
    Figure("outcomes", "outcomes", "Ticks by outcome of the controller.", _outcomes, better=NEITHER, shown=False),
    Figure("limits", "limits", "Fraction of ticks with each limit active.", _limits, better=NEITHER, shown=False),
    Figure(
        "solved_share", "ticks solved", "Fraction of ticks in which the solver reached its accuracy.",
        _solved, "%", 100.0, better=MORE, shown=False, of_row=False,
    ),
    Figure(
        "limited_share", "limited ticks", "Fraction of ticks with an active limit.",
        lambda p: limited_fraction(p.trace, p.ticks), "%", 100.0, better=NEITHER, shown=False, of_row=False,
    ),
    Figure(
        "step_us.p50", "controller step, median",
        "Computing time of one control command, half of them took less; the period is 4000 µs.",
        lambda p: percentile(p.trace.step_us[p.ticks], 50), "µs", digits=0, timing=True,
    ),
    Figure(
        "step_us.p99", "controller step, 99 %",
        "The time that 99 of 100 commands stayed below, with other programs on the computer.",
        lambda p: percentile(p.trace.step_us[p.ticks], 99), "µs", digits=0, timing=True,
    ),
    Figure(
        "step_us.max", "controller step, longest", "The longest of these times.",
        lambda p: percentile(p.trace.step_us[p.ticks], 100), "µs", digits=0, shown=False, timing=True,
    ),
    Figure(
        "vision_ms.p50", "vision per picture, median",
        "Computing time to find surface and edges in one picture; a picture comes every 33 ms at 30 Hz.",
        lambda p: percentile(p.trace.vision_ms, 50), "ms", of_row=False, timing=True,
    ),
    Figure(
        "vision_ms.p99", "vision per picture, 99 %",
        "The time that 99 of 100 pictures stayed below, with other programs on the computer.",
        lambda p: percentile(p.trace.vision_ms, 99), "ms", of_row=False, timing=True,
    ),
    Figure(
        "perception_hz", "perception", "Pictures per second that perception could keep up with.",
        _rate, "Hz", digits=0, better=NEITHER, shown=False, of_row=False, timing=True,
        exactly="of the median time per picture",
    ),
    # -------------------------------------------- of the measures of presses, slides and lost rotors, which compute it
    Figure("touch_peak_n", "push at touch, peak", "Largest push within 3 s after the first touch.", unit="N"),
    Figure(
        "force_error_rms_n", "push minus job's push, rms",
        "Push minus the push of the job, from 4 s after the touch or the fault.", unit="N",
    ),
    Figure(
        "force_std_n", "push, standard deviation",
        "Spread of the push, from 4 s after the touch or the fault.", unit="N", digits=3,
    ),
    Figure(
        "push_mean_n", "push delivered, mean",
        "Mean push, from 4 s after the touch or the fault; of a slide from 1 s after its start.",
        unit="N", better=NEITHER,
    ),
    Figure(
        "delivered_share", "delivered fraction of the push",
        "Mean push over the push of the job.", unit="%", scale=100.0, digits=1, better=MORE,
    ),
    Figure("reach_n", "reach", "Largest push that the true limits of the rotors can hold.", unit="N", better=NEITHER),
    Figure(
        "reach_share", "delivered fraction of the reach",
        "Mean push over the lesser of reach and push of the job.", unit="%", scale=100.0, digits=1, better=MORE,
    ),
    Figure(
        "approach_speed_m_s", "speed at touch",
        "Speed towards the wall just before the first touch.", unit="mm/s", scale=1e3, digits=0, better=NEITHER,
    ),
    Figure(
        "height_error_peak_m", "height error, peak",
        "Largest distance from the height of the guide since the touch.", unit="mm", scale=1e3, digits=1,
    ),
    Figure(
        "recovery_s", "recovered after",
        "From the fault until the push stays within 0.5 N and the tip within 5 mm.", unit="s",
    ),
    Figure("fault_force_peak_n", "push error after the step, peak", "Largest push error from the fault on.", unit="N"),
    Figure(
        "fault_path_peak_m", "tip after the step, peak",
        "Largest distance of the tip from its place at the fault.", unit="mm", scale=1e3, digits=1,
    ),
    Figure("speed_m_s", "speed", "Speed of a slide, from 1 s after its start.", unit="m/s", better=NEITHER),
    Figure(
        "speed_error_share", "speed error",
        "Speed of a slide against the commanded one, from 1 s after its start.", unit="%", scale=100.0, digits=1,
    ),
    Figure(
        "slide_held", "slide held",
        "Whether a slide has at least 90 % of its speed and 95 % of the push that was asked.", better=MORE, digits=0,
        matters=(0.5, "held or not"),
    ),
    Figure(
        "stuck_share", "time stuck",
        "Time of a slide, from 1 s after its start, at less than a fifth of the commanded speed.",
        unit="%", scale=100.0, digits=1,
    ),
    Figure(
        "reduced_said", "reduction reported",
        "Whether a command reported the reduced push and why.", better=MORE, digits=0,
    ),
    Figure(
        "survived_s", "flight time after the loss",
        "From the loss of a rotor to the crash, the landing or the planned end.", unit="s", digits=1, better=NEITHER,
    ),
    Figure("push_spike_n", "push after the loss, peak", "Largest push after the loss of a rotor.", unit="N"),
    Figure("descent_peak_m_s", "descent, fastest", "Fastest descent after the loss of a rotor.", unit="m/s"),
    Figure("detached", "left the wall", "Whether the tip is 10 cm from the board at the end.", better=MORE, digits=0),
    Figure("yaw_rate_peak_deg_s", "yaw rate, peak", "Fastest turn after the loss of a rotor.", unit="deg/s", digits=0),
    Figure(
        "yaw_turned_deg", "turn since the loss",
        "Largest turn from the heading at the loss of a rotor, full turns included.", unit="deg", digits=0,
        matters=(10.0, "turns after the loss of a rotor reach hundreds of degrees"),
    ),
)  # fmt: skip
#: The figures by name, in the order of the table.
FIGURES = {figure.name: figure for figure in _FIGURES}


def figure_of(name: str) -> Figure:
    """The figure of a name; any other column has its own name and no unit."""
    return FIGURES.get(name, Figure(name, name, better=NEITHER))


def figures_of(part: Part) -> dict[str, Any]:
    """Every figure that has a formula, nested by name; one that a single row lacks is NaN there."""
    found: dict[str, Any] = {}
    for figure in FIGURES.values():
        if figure.of is None:
            continue
        *outer, name = figure.name.split(".")
        place = found.setdefault(outer[0], {}) if outer else found
        place[name] = figure.of(part) if figure.of_row or not part.row else math.nan
    return found
