"""Short closed-loop flights at the wall for notebooks 02, 03 and 05: from 15 cm in front of it, press, slide, end."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

import ibvs_qp
from allocation import control_effectiveness
from ibvs_qp.controller import HybridController
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.paint_plan import CONTACT_N
from sim.evaluate.window import board_tip, mean, peak, phase_window, rms, tilt_deg
from sim.experiments.scenes import near_wall
from sim.experiments.variants import VARIANTS
from sim.flight.closed_loop import fly, make_pilot
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.flight.trace import Trace
from sim.notebook.common import number, table, unless_short
from sim.notebook.internals import Tick, TickRecord, WallJob, record_tick
from sim.sweep.setup import Setup
from sim.world.scene import Scene

#: Hold and slide of notebook 02, in full and in the short form [s]: a push settles within 1 s, a line within 2 s.
HOLD_S, SLIDE_S = (1.6, 1.2), (1.4, 0.3)
#: Cached flights.
KEPT_FLIGHTS = 64
#: The ramp of the push reference ends this long after the touch; figures of tilt omit the take-over of the hover [s].
SETTLED_S, HOVER_S = 1.1, 1.0


@dataclass(frozen=True, kw_only=True)
class Setting(Setup):
    """Pilot configuration with its law, scene and seed; equal settings give bit-identical flights."""

    pilot: PilotConfig = field(default_factory=lambda: ibvs_qp.preset("qp"))
    scene: Scene = field(default_factory=near_wall)
    seed: int = 0

    @property
    def options(self) -> FlightOptions:
        """Geometric features, no video."""
        return FlightOptions(law=self.pilot.law, seed=self.seed, features="geometric", video=False)


@functools.lru_cache(maxsize=KEPT_FLIGHTS)
def fly_setting(setting: Setting, hold_s: float | None = None, slide_s: float | None = None) -> Trace:
    """Fly a setting; results are cached. Hold and slide default to those of notebook 02 [s].

    Raises:
        ConfigError: When the configuration is refused, for example because the contact would ring.
    """
    hold_s = unless_short(*HOLD_S) if hold_s is None else hold_s
    slide_s = unless_short(*SLIDE_S) if slide_s is None else slide_s
    job = WallJob(hold_s=hold_s, slide_s=slide_s)
    return fly(setting.scene, setting.options, config=setting.pilot, job=job)


@dataclass(frozen=True, kw_only=True)
class WallTask:
    """A flight of notebook 03: the analytic law has its line rows as printed, with gains for them."""

    push_n: float = 5.0  # push reference [N]
    slope_deg: float = 0.0  # rotation of the board in its own plane [deg]
    friction: float = 0.3  # Coulomb coefficient of brush and board [-]
    hold_s: float = 1.2  # time of pressing at one place [s]
    slide_s: float = 0.0  # time of sliding along the edge afterwards [s]
    reach_check: bool = False  # whether the controller limits a push beyond reach
    feedforward: bool = True  # whether the controller feeds contact moments and expected friction forward

    def setting(self, law: str) -> Setting:
        """Preset of a law with these switches, and the scene."""
        preset = ibvs_qp.preset(law)
        gains = VARIANTS["printed"].gains if law == "paper" else {}
        controller = dataclasses.replace(
            preset.controller,
            gains=dataclasses.replace(preset.controller.gains, **gains),
            analytic_line_point="centre",
            analytic_angle_row=True,
            reach_check=self.reach_check,
            contact_feedforward=self.feedforward,
        )
        scene = near_wall(
            paint={"push_n": self.push_n}, board={"slope_deg": self.slope_deg}, wall={"friction": self.friction}
        )
        return Setting(pilot=dataclasses.replace(preset, controller=controller, law=law), scene=scene)

    def fly(self, law: str) -> Trace:
        """Fly the task under "qp" or "paper"."""
        return fly_setting(self.setting(law), self.hold_s, self.slide_s)


@dataclass(frozen=True, kw_only=True)
class RecordedFlight:
    """A flight under the QP law with internals of every tick (N ticks, n rotors)."""

    ticks: list[Tick]  # measurement and reference of every tick, N
    records: list[TickRecord]  # both laws at every tick, N
    t: np.ndarray  # time [s], (N,)
    qp: np.ndarray  # thrusts of the QP law, which were flown [N], (N, n)
    effectiveness: np.ndarray  # B, (6, n)

    def __getattr__(self, name: str) -> np.ndarray:
        """Field of all records as one array, (N, ...)."""
        if name.startswith("_"):
            raise AttributeError(name)
        return np.array([getattr(record, name) for record in self.records])

    @property
    def qp_free(self) -> np.ndarray:
        """Thrusts of the QP law without limits [N], (N, n)."""
        return np.array([record.program.free for record in self.records])

    @property
    def limited(self) -> np.ndarray:
        """Whether a limit of the program is active, (N,) bool."""
        return np.array([record.program.limited for record in self.records])

    def wrench_given_up(self, law: str) -> np.ndarray:
        """Wrench with limits minus wrench without, of "qp" or "paper" [N, N m], (N, 6)."""
        lost = self.qp - self.qp_free if law == "qp" else self.law - self.law_free
        return lost @ self.effectiveness.T


@functools.lru_cache(maxsize=16)
def record_flight(task: WallTask) -> RecordedFlight:
    """Fly a task under the QP law and record both laws at every tick; results are cached."""
    setting = task.setting("qp")
    config = pilot_config(setting.scene, setting.options, setting.pilot)
    job = WallJob(hold_s=task.hold_s, slide_s=task.slide_s)
    pilot, world = (
        make_pilot(setting.scene, setting.options, config, job),
        World(setting.scene, setting.options, config),
    )
    controller, ticks, records, stamps, thrusts = pilot.controller, [], [], [], []
    assert isinstance(controller, HybridController)
    while not world.plant.over:
        frame = world.sense()
        command = pilot.step(frame)
        if pilot.painter.finished or pilot.painter.phase in ("retreat", "done"):
            break
        if pilot.measurement is not None:
            ticks.append((pilot.measurement, pilot.reference))
            records.append(record_tick(controller))
            stamps.append(1e-9 * frame.stamp_ns)
            thrusts.append(command.thrusts)
        world.act(command.thrusts)
    return RecordedFlight(
        ticks=ticks,
        records=records,
        t=np.array(stamps),
        qp=np.array(thrusts),
        effectiveness=control_effectiveness(config.controller.vehicle.geometry),
    )


def touch_time(trace: Trace) -> float:
    """Time of the first contact [s]; NaN without one."""
    touching = np.flatnonzero(trace.push_true > CONTACT_N)
    return float(trace.t[touching[0]]) if len(touching) else math.nan


def flight_figures(trace: Trace) -> dict[str, float]:
    """Figures of a flight at the wall by name with unit; NaN for a phase that it did not reach.

    The hold counts from the end of the reference's ramp, the slide from its middle.
    """
    touch, (_, press_end), (slide, slide_end) = touch_time(trace), *(phase_window(trace, n) for n in ("press", "paint"))
    end = np.fmax(press_end, slide_end)
    contact, settled = ((trace.t >= touch + delay) & (trace.t <= end) for delay in (0.0, SETTLED_S))
    holding = settled & (trace.t <= press_end)
    sliding = (trace.t >= 0.5 * (slide + slide_end)) & (trace.t <= slide_end)
    error, tilt, tip = trace.push_true - trace.push_reference, tilt_deg(trace), board_tip(trace)[:, 1]
    return {
        "first touch [s]": touch,
        "greatest push [N]": peak(trace.contact_1khz),
        "push, mean once settled [N]": mean(trace.push_true[settled]),
        "push error, rms [N]": rms(error[settled]),
        "push error while holding, rms [N]": rms(error[holding]),
        "push error while sliding, rms [N]": rms(error[sliding]),
        "path along the edge, rms [mm]": 1e3 * rms((tip - trace.scene.paint.edge_margin_m)[sliding]),
        "greatest change of height in contact [mm]": 1e3 * peak((tip - np.interp(touch, trace.t, tip))[contact]),
        "greatest tilt [deg]": peak(tilt[trace.t > HOVER_S]),
        "greatest tilt in contact [deg]": peak(tilt[contact]),
        "roll while sliding, mean [deg]": mean(np.degrees(trace.euler[sliding, 0])),
        "greatest yaw in contact [deg]": peak(np.degrees(trace.euler[contact, 2])),
        "change of a thrust per tick in contact, rms [N]": rms(np.diff(trace.thrusts[settled], axis=0)),
        "least reach margin in contact [N]": float(np.nanmin(np.append(trace.reach_margin[settled], math.inf))),
        "ticks with an active limit [%]": 100.0 * float(trace.active.any(axis=1).mean()) if trace.active.size else 0.0,
    }


def flights_table(flights: dict[str, Trace], names: Sequence[str]) -> str:
    """Some figures of `flight_figures`, one column per flight, as markdown."""
    figures = [flight_figures(trace) for trace in flights.values()]
    rows = [(name, *(number(each[name]) for each in figures)) for name in names]
    return table(["", *flights], [*rows, ("end", *(trace.reason or "–" for trace in flights.values()))])
