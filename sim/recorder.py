"""Log of a flight: truth beside what the pilot believed, gathered tick by tick into a trace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import HORIZONTAL, SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.vision.overlay import draw_overlay
from sim.plant import STEPS_PER_TICK
from sim.trace import Event, Trace
from sim.video import pack_picture

if TYPE_CHECKING:
    from sim.closed_loop import FlightOptions, World
    from sim.scene import Scene

#: Names of the strategy's phases, in the order of a flight.
PHASES = ("start", "approach", "align", "press", "paint", "climb", "retreat", "done")
#: The propeller clearance is taken once in so many ticks; it moves slowly (a strike is checked every tick).
CLEARANCE_TICKS = 5
#: Pictures kept for the video per second.
VIDEO_RATE = 10.0


class Recorder:
    """Rows of the log; `trace` turns them into arrays."""

    def __init__(self, scene: Scene, options: FlightOptions, world: World, pilot: Pilot) -> None:
        self._scene, self._options, self._world, self._pilot = scene, options, world, pilot
        self._rows: dict[str, list[Any]] = {}
        self._limits: dict[str, int] = {}
        self._active: list[tuple[int, ...]] = []
        # Single precision: 1e-7 of a parameter is nothing that a person reads, and half the log.
        self._program = pilot.controller.engine.data.stacked if isinstance(pilot.controller, HybridController) else None
        self._programs: list[np.ndarray] = []
        self._contact: list[np.ndarray] = []
        self._painting: list[bool] = []
        self._vision: list[float] = []
        self._events: list[Event] = []
        self._pictures: list[tuple[float, np.ndarray, str]] = []
        self._next_picture = 0.0
        self._rejected: set[str] = set()
        self._logged = 0
        self._clearance = np.inf

    def tick(self, frame: SensorFrame, command: Command) -> None:
        """Log one tick, after the plant has moved."""
        plant, pilot = self._world.plant, self._pilot
        terms, painter = pilot.terms, pilot.painter
        time_s = frame.stamp_ns * 1e-9
        measurement = pilot.measurement
        velocity = measurement.velocity if measurement is not None and measurement.velocity is not None else None
        fx = self._scene.camera.height / 2.0 / np.tan(np.radians(self._scene.camera.vertical_fov_deg) / 2.0)
        errors = [np.nan, np.nan]
        for line in terms.lines:
            errors[0 if line.role == HORIZONTAL else 1] = line.error * fx
        add = self._add
        add("t", time_s)
        add("position", plant.position)
        add("velocity", plant.velocity)
        add("attitude", plant.quaternion)
        add("euler", plant.euler)
        add("tip", plant.tip)
        add("thrusts", command.thrusts)
        add("thrusts_actual", plant.thrusts_actual)
        add("push_true", plant.contact_normal_force)
        add("push_measured", terms.contact.push)
        add("push_reference", terms.push_reference * terms.contact.ramp)
        add("friction_true", plant.contact_friction)
        add("velocity_estimate", velocity if velocity is not None else np.full(3, np.nan))
        add("standoff_estimate", terms.contact.distance)
        add("line_error_px", errors)
        add("contact_weight", terms.contact_weight)
        add("phase", PHASES.index(painter.phase))
        add("row", painter.row if painter.phase in ("paint", "climb") else 0)
        add("outcome", list(Outcome).index(command.outcome))
        add("unallocated", command.unallocated_wrench)
        add("step_us", pilot.controller_time_s * 1e6)
        add("iterations", command.iterations)
        if self._program is not None:
            self._programs.append(self._program.astype(np.float32))
        if len(self._active) % CLEARANCE_TICKS == 0:
            self._clearance = plant.propeller_clearance
        add("propeller_clearance", self._clearance)
        self._contact.append(np.array(plant.contact_1khz))
        self._painting.append(painter.phase in ("paint", "climb"))
        self._active.append(
            tuple(self._limits.setdefault(limit.name, len(self._limits)) for limit in command.active_limits)
        )
        self._note_events(time_s, command)
        if frame.image is not None and pilot.percept is not None:
            self._vision.append(sum(pilot.percept.time_ms.values()))
            if self._options.video and time_s >= self._next_picture:
                self._next_picture = time_s + 1.0 / VIDEO_RATE
                picture = pack_picture(draw_overlay(frame.image.rgb, pilot.percept))
                self._pictures.append((time_s, picture, painter.phase))

    def _add(self, name: str, value: Any) -> None:
        self._rows.setdefault(name, []).append(value)

    def _note_events(self, time_s: float, command: Command) -> None:
        log = self._pilot.painter.log
        for when, kind, text in log[self._logged :]:
            self._events.append(Event(t=when, kind=kind, text=text))
        self._logged = len(log)
        for name in command.rejected:
            kind = name.split(":")[0]  # its numbers may change from tick to tick
            if kind not in self._rejected:
                self._rejected.add(kind)
                self._events.append(Event(t=time_s, kind="rejected", text=name))

    def note(self, time_s: float, kind: str, text: str) -> None:
        """Log an event that the pilot does not know of."""
        self._events.append(Event(t=time_s, kind=kind, text=text))

    def trace(self, wall_time_s: float) -> Trace:
        """Everything logged so far as a trace."""
        # Ctrl-C may strike in the middle of a tick: its half-written row is dropped.
        rows = [self._active, self._contact, self._painting, *self._rows.values()]
        ticks = min(map(len, [*rows, self._programs] if self._programs else rows))
        arrays = {name: np.array(values[:ticks], float) for name, values in self._rows.items()}
        for name in ("phase", "row", "outcome", "iterations"):
            if name in arrays:
                arrays[name] = arrays[name].astype(np.int32)
        active = np.zeros((ticks, len(self._limits)), dtype=bool)
        for tick, columns in enumerate(self._active[:ticks]):
            active[tick, list(columns)] = True
        arrays["active"] = active
        if self._programs:
            arrays["program"] = np.array(self._programs[:ticks])
        vehicle = self._pilot.config.controller.vehicle
        arrays["thrust_min"], arrays["thrust_max"] = vehicle.thrust_min, vehicle.thrust_max
        arrays["true_thrust_min"], arrays["true_thrust_max"] = self._world.plant.thrust_limits
        arrays["vision_ms"] = np.array(self._vision, float)
        arrays["contact_1khz"] = np.concatenate(self._contact[:ticks]) if ticks else np.zeros(0)
        arrays["painting_1khz"] = np.repeat(np.array(self._painting[:ticks], bool), STEPS_PER_TICK)
        canvas = self._world.canvas
        return Trace(
            scene=self._world.scene,
            seed=self._options.seed,
            law=self._options.law,
            arrays=arrays,
            phases=PHASES,
            outcomes=tuple(str(outcome) for outcome in Outcome),
            limits=tuple(self._limits),
            events=self._events,
            wall_time_s=wall_time_s,
            canvas=canvas.rgb,
            canvas_px_per_m=canvas.pixels_per_m,
            coverage_mask=canvas.coverage,
            pictures=self._pictures,
            preset=self._pilot.config.to_toml(),
        )
