"""Record of one flight: arrays at the control rate, contact force at the physics rate, pictures, events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sim.world.scene import Scene

#: Beginning of the reason of a flight that ended in a crash.
CRASH = "crash"
#: Reason of a flight that ended in a touchdown, and of one that Ctrl-C ended.
LANDED, INTERRUPTED = "landed", "interrupted"
#: Reason of a flight without an end.
KILLED = "the process of the flight was killed: its log ends here"
#: Part of the reason of a flight, or of a strategy, that took too long.
TIME_OUT = "time-out"
#: Paint coverage of a pixel above which it counts as painted.
PAINTED = 0.5
#: Meaning of every array of a trace (N control ticks, M physics steps, F pictures).
FIELDS = {
    "t": "(N,) time since start [s]",
    "position": "(N,3) body origin (assumed centre of mass), world (NED before an upright wall), x into the wall [m]",
    "velocity": "(N,3) true velocity of the centre of mass in B [m/s]",
    "attitude": "(N,4) true quaternion (w,x,y,z) of B in the world",
    "euler": "(N,3) true roll, pitch, yaw against gravity [rad]; yaw 0 faces the wall in the middle of the board",
    "tip": "(N,3) true tip position in the wall's chart; x = 0 is the board's face [m]",
    "thrusts": "(N,n) commanded thrusts [N]",
    "thrusts_actual": "(N,n) thrusts after motor lag [N]",
    "thrust_min": "(n,) lower limits [N]",
    "thrust_max": "(n,) upper limits [N]",
    "true_thrust_min": "(n,) lower limits of the real rotors at the end of the flight [N]",
    "true_thrust_max": "(n,) upper limits of the real rotors at the end of the flight [N]",
    "true_mass": "(1,) true mass [kg]",
    "push_true": "(N,) true normal contact force, > 0 pressing [N]",
    "push_measured": "(N,) tared, filtered push that the controller used [N]",
    "push_reference": "(N,) commanded push [N], 0 while free",
    "friction_true": "(N,2) true tangential force on the tip (right, down) [N]",
    "velocity_estimate": "(N,3) estimated velocity in B [m/s]; NaN where unknown",
    "standoff_estimate": "(N,) estimated tip distance, positive in free air [m]",
    "line_error_px": "(N,2) error of the horizontal and the vertical guide at the tip [px]; NaN where absent",
    "contact_weight": "(N,) lambda [-]",
    "phase": "(N,) index into phases",
    "row": "(N,) row being painted, 1 based; 0 outside rows, climbs carry the row they lead to",
    "outcome": "(N,) index into outcomes",
    "active": "(N,L) bool, limit active, columns named by limits",
    "limit_price": "(N,L) price |d cost / d bound| of every active limit per unit, 0 where inactive, NaN where unknown",
    "reach_margin": "(N,) further push that the rotors can hold at the present contact [N]; NaN where unknown",
    "unallocated": "(N,6) unallocated wrench [N, N m]",
    "step_us": "(N,) duration of the controller step [us]",
    "iterations": "(N,) solver iterations",
    "vision_ms": "(F,) duration of perception of every picture [ms]",
    "propeller_clearance": "(N,) smallest distance of any propeller disc to wall or board [m]",
    "program": "(N,P) parameters of the quadratic program (QP law), for `ibvs-qp explain`",
    "contact_1khz": "(M,) true normal contact force at every physics step [N]",
    "painting_1khz": "(M,) bool, true while a row or a climb is being painted (phase demands contact)",
}


#: Arrays that figures of merit are computed from; the log level `trace` has no others.
FIGURE_INPUTS = (
    *("t", "position", "velocity", "attitude", "euler", "tip", "thrusts", "thrusts_actual", "thrust_min", "thrust_max"),
    *("true_thrust_min", "true_thrust_max", "true_mass", "push_true", "push_reference", "friction_true"),
    *("velocity_estimate", "phase", "row", "outcome", "active", "step_us", "vision_ms", "propeller_clearance"),
    *("contact_1khz", "painting_1khz"),
)


#: Names of the laws in titles, headings and legends, in the order flown.
LAWS = {"qp": "QP law", "paper": "analytic law"}


def law_name(law: str) -> str:
    """Name of a law in titles, headings and legends."""
    return LAWS.get(law, law)


@dataclass(kw_only=True)
class Event:
    """A phase change with its reason, a touch, a loss, a rejected input."""

    t: float
    kind: str
    text: str


@dataclass(kw_only=True)
class Trace:
    """One flight under one law."""

    scene: Scene  # the scene flown
    seed: int  # its seed
    law: str  # "qp" or "paper"
    arrays: dict[str, np.ndarray] = field(default_factory=dict)  # see `FIELDS`
    phases: tuple[str, ...] = ()  # names of the phases, as `ibvs_qp.pilot.painting.strategy.PHASES`
    outcomes: tuple[str, ...] = ()  # names of the outcomes
    limits: tuple[str, ...] = ()  # names of the limits, columns of ``active``
    events: list[Event] = field(default_factory=list)  # phase changes and other events in order
    claimed: bool = False  # whether the pilot ended its job as planned, by its own data (truth: sim.evaluate.truth)
    # Least durations [s] of the phases of a job without strokes (`sim.flight.jobs.PressJob`); empty for a paint job.
    plan: dict[str, float] = field(default_factory=dict)
    # Way (right, down) along the board in every leg of a strategy of the user's [m]; None for a shipped one.
    legs: tuple[tuple[float, float], ...] | None = None
    reason: str = ""  # why the flight ended, in words
    wall_time_s: float = 0.0  # wall-clock time of the simulation [s]
    # Painted board as the camera would see it, uint8 RGB, with `canvas_px_per_m`; no class attribute, see `draw_later`.
    canvas: np.ndarray | None = field(default_factory=lambda: None)
    canvas_px_per_m: float = 0.0  # resolution of canvas and coverage mask [px/m]
    coverage_mask: np.ndarray | None = None  # paint coverage of the canvas 0..1, float32, same size
    # Video material: (t, RGB picture with detections drawn, phase name), thinned out.
    pictures: list[tuple[float, np.ndarray, str]] = field(default_factory=list)
    preset: str = ""  # configuration of the pilot, TOML

    def draw_later(self, draw: Callable[[], np.ndarray]) -> None:
        """Draw `canvas` on first access; sweeps and tuning never access it."""
        self.__dict__.pop("canvas", None)
        self.__dict__["_draw"] = draw

    def __getattr__(self, name: str) -> Any:
        """Arrays read as attributes: ``trace.push_true``."""
        own = self.__dict__
        if name == "canvas" and "_draw" in own:
            own["canvas"] = own.pop("_draw")()
            return own["canvas"]
        arrays = own.get("arrays", {})
        if name in arrays:
            return arrays[name]
        raise AttributeError(name)

    def __getstate__(self) -> dict[str, Any]:
        """Pickled with the canvas drawn."""
        state = self.__dict__ | {"canvas": self.canvas}
        state.pop("_draw", None)
        return state
