"""Log of a flight: truth beside what the pilot believed, gathered tick by tick into a trace."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.setpoints.lines import LINE_TERMS
from ibvs_qp.vision.overlay import draw_overlay
from sim.cameras.protocol import camera_intrinsics
from sim.columns import Columns
from sim.flight_truth import euler_angles, in_body, rotations
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
#: Columns that are one number a tick; vectors follow, in the order in which `Recorder.tick` fills them in.
NUMBERS = """t push_true push_measured push_reference standoff_estimate horizontal_error vertical_error
contact_weight phase row outcome step_us iterations reach_margin""".split()
#: Columns of integers.
INTEGERS = ("phase", "row", "outcome", "iterations")
_ERROR = LINE_TERMS.index("error")
_PHASE_INDEX = {phase: index for index, phase in enumerate(PHASES)}
_OUTCOME_INDEX = {outcome: float(index) for index, outcome in enumerate(Outcome)}


class Recorder:
    """Rows of the log; `trace` turns them into arrays."""

    def __init__(self, scene: Scene, options: FlightOptions, world: World, pilot: Pilot) -> None:
        self._scene, self._options, self._world, self._pilot = scene, options, world, pilot
        rotors = pilot.config.controller.vehicle.geometry.count
        numbers = {name: 1 for name in NUMBERS}
        numbers |= {"motion": len(world.plant.motion), "friction_true": 2, "contact_1khz": STEPS_PER_TICK}
        vectors = {"thrusts": rotors, "thrusts_actual": rotors, "unallocated": 6, "velocity_estimate": 3}
        self._log = Columns(numbers | vectors)
        self._numbers, self._places = sum(numbers.values()), tuple(self._log.places[name] for name in vectors)
        self._focal = camera_intrinsics(scene.camera)[0]
        tick, slots = pilot.terms.tick, range(pilot.config.controller.line_slots)
        self._lines = [(tick.inputs[f"line_{slot}"], slot, tick.outputs[f"line_{slot}_terms"]) for slot in slots]
        self._limits: dict[str, int] = {}
        self._active: list[tuple[tuple[int, float], ...]] = []
        # Single precision: 1e-7 of a parameter is nothing that a person reads, and half the log.
        self._program = pilot.controller.engine.data.stacked if isinstance(pilot.controller, HybridController) else None
        self._programs = Columns({"program": 0 if self._program is None else len(self._program)}, np.float32)
        self._painting: list[bool] = []
        self._vision: list[float] = []
        self._events: list[Event] = []
        self._pictures: list[tuple[float, np.ndarray, str]] = []
        self._next_picture = 0.0
        self._rejected: set[str] = set()
        self._logged = 0

    def tick(self, frame: SensorFrame, command: Command) -> None:
        """Log one tick, after the plant has moved."""
        plant, pilot = self._world.plant, self._pilot
        terms, painter = pilot.terms, pilot.painter
        contact, time_s, painting = terms.contact, frame.stamp_ns * 1e-9, painter.phase in ("paint", "climb")
        row = self._log.row()
        row[: self._numbers] = (
            time_s,
            plant.contact_normal_force,
            contact.push,
            terms.push_reference * contact.ramp,
            contact.distance,
            *self._line_errors(),
            terms.contact_weight,
            _PHASE_INDEX[painter.phase],
            painter.row if painting else 0,
            _OUTCOME_INDEX[command.outcome],
            pilot.controller_time_s * 1e6,
            command.iterations,
            command.reach_margin,
            *plant.motion,
            *plant.friction,
            *plant.pushes,
        )
        thrusts, actual, unallocated, velocity = self._places
        row[thrusts], row[actual], row[unallocated] = command.thrusts, plant.motor_thrusts, command.unallocated_wrench
        known = pilot.measurement.velocity if pilot.measurement is not None else None
        row[velocity] = known if known is not None else math.nan
        if self._program is not None:
            self._programs.row()[:] = self._program
        self._painting.append(painting)
        active = command.active_limits
        places = [self._limits.setdefault(limit.name, len(self._limits)) for limit in active]
        self._active.append(tuple(zip(places, [limit.price for limit in active], strict=True)))
        self._note_events(time_s, command)
        if frame.image is not None and pilot.percept is not None:
            self._vision.append(sum(pilot.percept.time_ms.values()))
            if self._options.video and time_s >= self._next_picture:
                self._next_picture = time_s + 1.0 / VIDEO_RATE
                picture = pack_picture(draw_overlay(frame.image.rgb, pilot.percept))
                self._pictures.append((time_s, picture, painter.phase))

    def _line_errors(self) -> list[float]:
        """Error of the horizontal and the vertical guide at the tip [px], NaN where absent."""
        errors, vertical = [math.nan, math.nan], self._pilot.terms.tick.inputs["vertical"]
        for given, slot, terms in self._lines:
            if given.item(0) > 0.0:
                errors[vertical.item(slot) > 0.0] = self._focal * terms.item(_ERROR)
        return errors

    def _note_events(self, time_s: float, command: Command) -> None:
        log = self._pilot.painter.log
        if not command.rejected and len(log) == self._logged:
            return
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

    def trace(self) -> Trace:
        """Everything logged so far as a trace."""
        # Ctrl-C may strike in the middle of a tick: its half-written row is dropped. The limits come last.
        ticks = len(self._active)
        arrays = {name: column[:ticks] for name, column in self._log.arrays().items()}
        arrays |= {name: arrays[name].astype(np.int32) for name in INTEGERS}
        arrays["line_error_px"] = np.column_stack((arrays.pop("horizontal_error"), arrays.pop("vertical_error")))
        arrays |= self._truth(arrays.pop("motion"))
        arrays["contact_1khz"] = arrays["contact_1khz"].reshape(-1)
        active, price = np.zeros((ticks, len(self._limits)), dtype=bool), np.zeros((ticks, len(self._limits)))
        for tick, limits in enumerate(self._active):
            for column, paid in limits:
                active[tick, column], price[tick, column] = True, paid
        arrays["active"], arrays["limit_price"] = active, price
        if len(self._programs):
            arrays |= {name: column[:ticks] for name, column in self._programs.arrays().items()}
        vehicle = self._pilot.config.controller.vehicle
        arrays["thrust_min"], arrays["thrust_max"] = vehicle.thrust_min, vehicle.thrust_max
        arrays["true_thrust_min"], arrays["true_thrust_max"] = self._world.plant.thrust_limits
        arrays["vision_ms"] = np.array(self._vision, float)
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
            canvas=canvas.rgb if self._options.board else None,
            canvas_px_per_m=canvas.pixels_per_m,
            coverage_mask=canvas.coverage,
            pictures=self._pictures,
            preset=self._pilot.config.to_toml(),
        )

    def _truth(self, motion: np.ndarray) -> dict[str, np.ndarray]:
        """Truth that follows from the motion of every tick, (N, 13), see `sim.readings.PlantReadings.motion`."""
        plant, position, attitude = self._world.plant, motion[:, :3], motion[:, 6:10]
        rotation = rotations(attitude)
        rare = slice(None, None, CLEARANCE_TICKS)
        clearance = plant.clearance.distances(position[rare], rotation[rare])
        return {
            "position": position.copy(),
            "attitude": attitude.copy(),
            "velocity": in_body(rotation, motion[:, 3:6]),
            "euler": euler_angles(rotation),
            "tip": position + rotation @ np.array(plant.vehicle.tip_position_m),
            "propeller_clearance": np.repeat(clearance, CLEARANCE_TICKS)[: len(motion)],
        }
