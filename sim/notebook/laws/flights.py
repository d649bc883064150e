"""Short flights of either law at the wall: push, slope, friction, and which switch of the controller is on."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.window import board_tip, mean, peak, phase_window, rms, tilt_deg
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import FlightOptions, default_preset, fly, pilot_config
from sim.flight.trace import Trace
from sim.notebook.tuning.snippet import SnippetJob
from sim.world.scene import Scene

#: Figures begin this long after the touch or after the slide began [s]: ramps are over.
SETTLED_S = 1.5
#: Flights kept.
_KEPT = 64


@dataclass(frozen=True, kw_only=True)
class WallTask:
    """What is asked of a vehicle at the wall.

    Attributes:
        push_n: Push asked for [N].
        slope_deg: Turn of the board in its own plane [deg].
        friction: Coulomb coefficient of brush and board [-].
        hold_s: Time of pressing at one place [s].
        slide_s: Time of sliding along the edge afterwards [s].
        reach_check: Whether a push beyond reach is reduced before it is asked of a law.
        feedforward: Whether contact moments and expected friction are fed forward.
        seed: Of the flight.
    """

    push_n: float = 5.0
    slope_deg: float = 0.0
    friction: float = 0.3
    hold_s: float = 1.2
    slide_s: float = 0.0
    reach_check: bool = False
    feedforward: bool = True
    seed: int = 0

    @property
    def scene(self) -> Scene:
        """The truth, started near the wall."""
        return near_wall(
            paint={"push_n": self.push_n},
            board={"slope_deg": self.slope_deg},
            wall={"friction": self.friction},
        )

    @property
    def job(self) -> SnippetJob:
        """Press, slide, end."""
        return SnippetJob(hold_s=self.hold_s, slide_s=self.slide_s)

    def pilot(self, law: str) -> PilotConfig:
        """The preset of a law with the switches set."""
        preset = default_preset(law)
        controller = dataclasses.replace(
            preset.controller, reach_check=self.reach_check, contact_feedforward=self.feedforward
        )
        return dataclasses.replace(preset, controller=controller)


@functools.lru_cache(maxsize=_KEPT)
def fly_task(task: WallTask, law: str) -> Trace:
    """Fly a task under a law with geometric features; a task flown before is remembered."""
    options = FlightOptions(law=law, seed=task.seed, features="geometric", video=False)
    return fly(task.scene, options, config=pilot_config(task.scene, options, task.pilot(law)), job=task.job)


def task_figures(trace: Trace) -> dict[str, float]:
    """What a short flight is judged by; NaN where it never came so far.

    Args:
        trace: Of `fly_task`.

    Returns:
        ``push_n`` (mean) and ``push_error_n`` (rms against what was commanded) once settled; from the touch on
        ``height_mm`` (greatest change), ``tilt_deg`` and ``yaw_deg`` (peaks); while sliding ``roll_deg`` (mean) and
        ``path_mm`` (rms of the tip's distance to its place over the edge); ``lost_share`` of the time without contact.
    """
    begin, end = phase_window(trace, "press")
    slide, slide_end = phase_window(trace, "paint")
    last = float(np.nanmax([end, slide_end])) if not np.isnan([end, slide_end]).all() else np.nan
    touched = np.flatnonzero((trace.t >= begin) & (trace.push_true > 0.0))
    touch = float(trace.t[touched[0]]) if len(touched) else np.nan
    from_touch = (trace.t >= touch) & (trace.t <= last)
    settled = (trace.t >= touch + SETTLED_S) & (trace.t <= last)
    sliding = (trace.t >= slide + 0.5 * (slide_end - slide)) & (trace.t <= slide_end)
    tip = board_tip(trace)
    height = tip[from_touch, 1] - tip[from_touch, 1][0] if from_touch.any() else np.array([])
    return {
        "push_n": mean(trace.push_true[settled]),
        "push_error_n": rms((trace.push_true - trace.push_reference)[settled]),
        "lost_share": mean((trace.push_true[settled] <= 0.0).astype(float)),
        "height_mm": 1e3 * peak(height),
        "tilt_deg": peak(tilt_deg(trace)[from_touch]),
        "yaw_deg": peak(np.degrees(trace.euler[from_touch, 2])),
        "roll_deg": mean(np.degrees(trace.euler[sliding, 0])),
        "path_mm": 1e3 * rms(tip[sliding, 1] - trace.scene.paint.edge_margin_m),
    }
