"""Log of a flight: truth and the pilot's estimates of every tick, assembled into a trace at the end."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import Command, Outcome, SafetyState
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.vision.overlay import draw_overlay
from sim.flight.columns import Columns
from sim.flight.flight_truth import euler_angles, in_body, rotations
from sim.flight.options import FlightOptions
from sim.flight.surroundings import World
from sim.flight.trace import Event, Trace
from sim.flight.video import pack_picture
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.world.plant import STEPS_PER_TICK
from sim.world.readout import PLACES
from sim.world.scene import Scene

#: Names of the strategy's phases, in the order of a flight.
PHASES = ("start", "approach", "align", "press", "paint", "climb", "retreat", "done")
#: Ticks per logged propeller clearance, which changes slowly (the plant checks for strikes at every tick).
CLEARANCE_TICKS = 5
#: Pictures per second of the video [Hz].
VIDEO_RATE = 10.0
#: Columns of one number per tick, in the order in which `Recorder.tick` writes them.
NUMBERS = "t phase row outcome step_us iterations reach_margin".split()
#: Columns of integers.
INTEGERS = ("phase", "row", "outcome", "iterations")
#: Inputs of the controller's step that are logged, beside those of every line.
CONTACT_INPUTS = tuple(f"contact.{name}" for name in ("known", "distance", "push", "ramp"))
INPUTS = (*CONTACT_INPUTS, "contact_weight", "velocity_known", "velocity")
_PHASE_INDEX = {phase: index for index, phase in enumerate(PHASES)}
_PRESSED = [_PHASE_INDEX[phase] for phase in ("paint", "climb")]
_OUTCOME_INDEX = {outcome: float(index) for index, outcome in enumerate(Outcome)}


def controller_signals(pilot: Pilot) -> dict[str, np.ndarray]:
    """Signals of the controller's step that are logged, by name: 1-D views that hold after every step."""
    step, lines = pilot.setpoints.step, [f"line_{index}" for index in range(pilot.config.controller.line_slots)]
    signals = {name: step.inputs[name] for name in INPUTS}
    signals |= {f"{line}.{name}": step.inputs[f"{line}.{name}"] for line in lines for name in ("present", "vertical")}
    signals |= {f"{line}.error": step.outputs[f"{line}.error"] for line in lines}
    return signals | {"push_reference": step.outputs["push_reference"]}


def program_point(pilot: Pilot) -> np.ndarray | None:
    """Inputs and states that reproduce the quadratic program, a view; None under the analytic law."""
    return pilot.setpoints.step.point if isinstance(pilot.controller, HybridController) else None


class Recorder:
    """Rows of the log, one per tick; `trace` turns them into named arrays."""

    def __init__(self, scene: Scene, options: FlightOptions, world: World, pilot: Pilot) -> None:
        self._scene, self._options, self._world, self._pilot = scene, options, world, pilot
        rotors = pilot.config.controller.vehicle.geometry.count
        signals = controller_signals(pilot) | {"truth": world.plant.truth, "thrusts_actual": world.plant.motor_thrusts}
        widths = {name: len(view) for name, view in signals.items()}
        self._log = Columns(dict.fromkeys(NUMBERS, 1) | widths | {"thrusts": rotors, "unallocated": 6})
        self._signals = tuple(signals.values())
        self._focal = camera_intrinsics(scene.camera)[0]
        self._limits: dict[str, int] = {}
        self._active: dict[int, list[tuple[int, float]]] = {}
        self._program = program_point(pilot)
        # Single precision halves the log; its rounding of 1e-7 does not change what `ibvs-qp explain` prints.
        self._programs = Columns({"program": 0 if self._program is None else len(self._program)}, np.float32)
        self._vision: list[float] = []
        self._events: list[Event] = []
        self._pictures: list[tuple[float, np.ndarray, str]] = []
        self._next_picture = 0.0
        self._rejected: set[str] = set()
        self._safety = SafetyState.NOMINAL
        self._logged = self._ticks = 0

    def tick(self, frame: SensorFrame, command: Command) -> None:
        """Log one tick, after the plant has moved."""
        pilot, time_s = self._pilot, frame.stamp_ns * 1e-9
        painter = pilot.painter
        phase = painter.phase
        numbers = (
            time_s,
            _PHASE_INDEX[phase],
            painter.row,
            _OUTCOME_INDEX[command.outcome],
            pilot.controller_time_s * 1e6,
            command.iterations,
            command.reach_margin,
        )
        self._log.add(np.array(numbers), *self._signals, command.thrusts, command.unallocated_wrench)
        if self._program is not None:
            self._programs.add(self._program)
        active = command.active_limits
        if active:
            places = self._limits
            paid = [(places.setdefault(limit.name, len(places)), limit.price) for limit in active]
            self._active[self._ticks] = paid
        if command.rejected or len(painter.log) != self._logged or command.safety is not self._safety:
            self._note_events(time_s, command)
        if frame.image is not None and pilot.percept is not None:
            self._vision.append(sum(pilot.percept.time_ms.values()))
            if self._options.video and time_s >= self._next_picture:
                self._next_picture = time_s + 1.0 / VIDEO_RATE
                picture = pack_picture(draw_overlay(frame.image.rgb, pilot.percept))
                self._pictures.append((time_s, picture, phase))
        self._ticks += 1

    def _note_events(self, time_s: float, command: Command) -> None:
        log = self._pilot.painter.log
        for when, kind, text in log[self._logged :]:
            self._events.append(Event(t=when, kind=kind, text=text))
        self._logged = len(log)
        if command.safety is not self._safety:
            self._safety, reasons = command.safety, "; ".join(command.safety_reasons)
            self._events.append(Event(t=time_s, kind="safety", text=f"{command.safety}: {reasons}".removesuffix(": ")))
        for name in command.rejected:
            kind = name.split(":")[0]  # the numbers after it may change from tick to tick
            if kind not in self._rejected:
                self._rejected.add(kind)
                self._events.append(Event(t=time_s, kind="rejected", text=name))

    def note(self, time_s: float, kind: str, text: str) -> None:
        """Log an event from outside the pilot."""
        self._events.append(Event(t=time_s, kind=kind, text=text))

    def trace(self) -> Trace:
        """Everything logged so far as a trace."""
        # Ctrl-C may strike in the middle of a tick: its half-written row is dropped. The count comes last.
        ticks = self._ticks
        arrays = {name: column[:ticks] for name, column in self._log.arrays().items()}
        arrays |= {name: arrays[name].astype(np.int32) for name in INTEGERS}
        pressed = np.isin(arrays["phase"], _PRESSED)
        arrays["row"][~pressed] = 0
        signals = {name: arrays.pop(name) for name in controller_signals(self._pilot)}
        arrays["line_error_px"] = self._line_errors(signals)
        arrays |= _estimates(signals) | self._truth(arrays.pop("truth"))
        active, price = np.zeros((ticks, len(self._limits)), dtype=bool), np.zeros((ticks, len(self._limits)))
        for tick, paid in self._active.items():
            columns, prices = zip(*paid, strict=True)
            active[tick : tick + 1, columns], price[tick : tick + 1, columns] = True, prices
        arrays["active"], arrays["limit_price"] = active, price
        if len(self._programs):
            arrays |= {name: column[:ticks] for name, column in self._programs.arrays().items()}
        vehicle = self._pilot.config.controller.vehicle
        arrays["thrust_min"], arrays["thrust_max"] = vehicle.thrust_min, vehicle.thrust_max
        arrays["true_thrust_min"], arrays["true_thrust_max"] = self._world.plant.thrust_limits
        arrays["true_mass"] = np.array([self._world.plant.vehicle.mass_kg])
        arrays["vision_ms"] = np.array(self._vision, float)
        arrays["painting_1khz"] = np.repeat(pressed, STEPS_PER_TICK)
        canvas = self._world.canvas
        trace = Trace(
            scene=self._world.scene,
            seed=self._options.seed,
            law=self._options.law,
            arrays=arrays,
            phases=PHASES,
            outcomes=tuple(str(outcome) for outcome in Outcome),
            limits=tuple(self._limits),
            events=self._events,
            canvas_px_per_m=canvas.pixels_per_m,
            coverage_mask=canvas.coverage,
            pictures=self._pictures,
            preset=self._pilot.config.to_toml(),
        )
        trace.draw_later(lambda: canvas.rgb)
        return trace

    def _line_errors(self, signals: dict[str, np.ndarray]) -> np.ndarray:
        """Error of the horizontal and the vertical guide at the tip [px], (N, 2), NaN where absent."""
        found = np.full((self._ticks, 2), math.nan)
        for index in range(self._pilot.config.controller.line_slots):
            vertical, error = signals[f"line_{index}.vertical"], signals[f"line_{index}.error"]
            present = np.flatnonzero(signals[f"line_{index}.present"] > 0.0)
            found[present, (vertical[present] > 0.0).astype(int)] = self._focal * error[present]
        return found

    def _truth(self, truth: np.ndarray) -> dict[str, np.ndarray]:
        """Truth from the plant's readings at every tick, (N, numbers), see `sim.world.readout`."""
        plant, (position, attitude) = self._world.plant, (truth[:, PLACES[name]] for name in ("position", "quaternion"))
        rotation = rotations(attitude)
        rare = slice(None, None, CLEARANCE_TICKS)
        clearance = plant.clearance.distances(position[rare], rotation[rare])
        pushes = truth[:, PLACES["pushes"]]
        return {
            "position": position.copy(),
            "attitude": attitude.copy(),
            "velocity": in_body(rotation, truth[:, PLACES["velocity"]]),
            "euler": euler_angles(rotation),
            "tip": position + rotation @ np.array(plant.vehicle.tip_position_m),
            "push_true": pushes[:, -1].copy(),
            "contact_1khz": pushes.reshape(-1),
            "friction_true": truth[:, PLACES["friction"]].copy(),
            "propeller_clearance": np.repeat(clearance, CLEARANCE_TICKS)[: len(truth)],
        }


def _estimates(signals: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Measured and estimated quantities that the controller used, from its logged signals (N, ...)."""
    known, distance, push, ramp = (signals[name] for name in CONTACT_INPUTS)
    moving = signals["velocity_known"][:, None] > 0.0
    return {
        "push_measured": push.copy(),
        "push_reference": signals["push_reference"] * ramp,
        "standoff_estimate": np.where(known > 0.0, distance, math.inf),
        "contact_weight": signals["contact_weight"],
        "velocity_estimate": np.where(moving, signals["velocity"], math.nan),
    }
