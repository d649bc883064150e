"""Rows of the last minute of a flight: numbers for charts and scene, and the inputs of every tick's program."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import FeatureFrame, SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.painting.strategy import PHASES
from ibvs_qp.symbolic.signals import places
from sim.flight.closed_loop import ClosedLoop
from sim.flight.options import FlightOptions, ticks_in
from sim.flight.recorder import Recorder
from sim.flight.surroundings import World
from sim.flight.trace import Event
from sim.world.readout import PLACES
from sim.world.scene import Scene

#: Time that can be rewound, and that the charts show [s].
KEPT_S = 60.0
#: Most events of the pilot that are kept [-].
MOST_EVENTS = 200
#: A thrust this near to a limit is at it [N].
NEAR_N = 0.05
STATES, OUTCOMES = tuple(str(each) for each in SafetyState), tuple(str(each) for each in Outcome)
_STATE, _OUTCOME = ({each: index for index, each in enumerate(kind)} for kind in (SafetyState, Outcome))
_PHASE = {phase: index for index, phase in enumerate(PHASES)}
#: Numbers of a row: times in s and us, pushes in N, path error in mm, angles in deg.
NUMBERS = "t wall_s asked commanded felt push path_mm roll pitch step_us state phase outcome reach".split()
#: Readings of the plant in a row, and their widths: the last entries of each; of friction, those along the wall.
READ = {"position": 3, "quaternion": 4, "tip": 3, "friction": 2}


class LiveRecorder(Recorder):
    """Keeps the rows of the last `KEPT_S`, and no log: the memory of a flight is bounded.

    Attributes:
        places: Columns of a row by name: slices.
        limits: Names of the limits, in the order of their prices.
        wall_s: Clock time at the beginning of the tick [s], written by the owner.
        events: The last events: phases, faults, refusals.
        noted: Events so far.
    """

    def __init__(self, scene: Scene, options: FlightOptions, world: World, pilot: Pilot) -> None:
        self._world, self._pilot = world, pilot
        law, rotors = pilot.controller, pilot.config.controller.vehicle.geometry.count
        self.limits: tuple[str, ...] = law.problem.row_names if isinstance(law, HybridController) else ()
        self._limit = {name: index for index, name in enumerate(self.limits)}
        if isinstance(law, HybridController):
            self._bounds = places(law.problem.model.signals.inputs)
            self._thrusts = [self._limit[f"thrust_{name}"] for name in law.config.vehicle.geometry.names]
        widths = {**dict.fromkeys(NUMBERS, 1), **READ, "thrusts": rotors, "actual": rotors, "price": len(self.limits)}
        ends = np.cumsum([0, *widths.values()]).tolist()
        self.places = {name: slice(*ends[index : index + 2]) for index, name in enumerate(widths)}
        self._read = np.concatenate(
            [np.arange(PLACES[name].stop - width, PLACES[name].stop) for name, width in READ.items()]
        )
        self.capacity = ticks_in(KEPT_S + 1.0, pilot.config.controller.tick_s)
        self._rows = np.full((self.capacity, ends[-1]), math.nan)
        points = pilot.setpoints.step.point.size if self.limits else 0
        self._points, self.ticks = np.zeros((self.capacity, points)), 0
        self.wall_s = 0.0
        self.events: list[Event] = []
        self.noted = 0
        self._logged, self._refused = 0, ""

    def tick(self, frame: SensorFrame, command: Command) -> None:
        """Keep the row of a tick, after the plant has moved."""
        pilot, plant, report = self._pilot, self._world.plant, self._pilot.push_report
        place, row = self.ticks % self.capacity, self._rows[self.ticks % self.capacity]
        roll, pitch, _ = np.degrees(plant.euler)
        row[: len(NUMBERS)] = (
            frame.stamp_ns * 1e-9, self.wall_s, report.asked_n, report.commanded_n, report.felt_n,
            plant.contact_normal_force, self._path_mm(), roll, pitch, pilot.controller_time_s * 1e6,
            _STATE[command.safety], _PHASE[pilot.painter.phase], _OUTCOME[command.outcome], command.reach_margin,
        )  # fmt: skip
        row[self.places["position"].start : self.places["friction"].stop] = plant.truth[self._read]
        row[self.places["thrusts"]], row[self.places["actual"]] = command.thrusts, plant.motor_thrusts
        prices = row[self.places["price"]]
        prices[:] = 0.0
        for limit in command.active_limits:
            if (column := self._limit.get(limit.name)) is not None:
                prices[column] = limit.price
        if self.limits:
            self._points[place] = pilot.setpoints.step.point
        self.ticks += 1
        self._note_all(command, frame.stamp_ns * 1e-9)

    def note(self, time_s: float, kind: str, text: str) -> None:
        """Keep an event from outside the pilot."""
        self.events.append(Event(t=time_s, kind=kind, text=text))
        self.noted += 1
        del self.events[:-MOST_EVENTS]

    def events_since(self, noted: int) -> list[Event]:
        """Events after so many, as far as they are kept."""
        return self.events[max(len(self.events) - (self.noted - noted), 0) :]

    def rows(self, first: int, end: int, every: int = 1) -> np.ndarray:
        """Copies of the rows of some ticks, as far as they are kept, (rows, width)."""
        first = max(first, self.ticks - self.capacity, 0)
        return self._rows[np.arange(first, min(end, self.ticks), every) % self.capacity]

    def point(self, tick: int) -> np.ndarray:
        """Inputs and states of a tick's program; of the last tick where it is not kept."""
        tick = min(max(tick, self.ticks - self.capacity, 0), max(self.ticks - 1, 0))
        return self._points[tick % self.capacity].copy()

    def last_limited(self) -> int | None:
        """Newest tick of the last `KEPT_S` with a rotor at a thrust limit that has a price; None without."""
        first = max(self.ticks - self.capacity, 0)
        place = np.arange(first, self.ticks) % self.capacity
        thrusts, prices = (self._rows[place][:, self.places[name]] for name in ("thrusts", "price"))
        low, high = (self._points[place][:, self._bounds[name]] for name in ("thrust_low", "thrust_high"))
        at_limit = (thrusts < low + NEAR_N) | (thrusts > high - NEAR_N)  # others are at the rate limit
        found = np.flatnonzero((at_limit & (prices[:, self._thrusts] > 0.0)).any(axis=1))
        return first + int(found[-1]) if len(found) else None

    def back_to(self, ticks: int, events: list[Event]) -> None:
        """Forget later ticks."""
        self.ticks, self.events, self._logged = ticks, events, len(self._pilot.painter.log)

    def _path_mm(self) -> float:
        """Tip beyond (+) or before (-) its stroke, across it; NaN while none is painted [mm]."""
        painter, geometry = self._pilot.painter, self._world.geometry
        if painter.phase != "paint" or not 1 <= painter.row <= geometry.strokes:
            return math.nan
        spot = geometry.to_pattern(np.array(geometry.spot(*self._world.plant.tip_on_wall)))
        return 1e3 * (float(spot[1]) - geometry.stroke_place(painter.row))

    def _note_all(self, command: Command, time_s: float) -> None:
        log = self._pilot.painter.log
        for when, kind, text in log[self._logged :]:
            self.note(when, kind, text)
        self._logged = len(log)
        refused = "; ".join(command.rejected)
        if refused and refused.split(":")[0] != self._refused.split(":")[0]:
            self.note(time_s, "rejected", refused)
        self._refused = refused or self._refused


class LiveLoop(ClosedLoop):
    """A flight whose log is bounded."""

    recorder_kind = LiveRecorder
    features: FeatureFrame | None = None
    """Last lines without pictures."""

    def sense(self) -> SensorFrame:
        """First half of a tick."""
        frame = super().sense()
        self.features = frame.features or self.features
        return frame

    @property
    def recorder(self) -> LiveRecorder:
        """Its rows."""
        recorder = self._recorder
        assert isinstance(recorder, LiveRecorder)
        return recorder
