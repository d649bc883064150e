"""Rows of a log into the named arrays of a trace: after the flight, or from the log of a killed flight on disk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.command import Outcome
from ibvs_qp.frames import rotation_rows
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.strategy import PHASES
from sim.flight.options import ticks_in
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.world.board import BoardGeometry
from sim.world.clearance import PropellerClearance
from sim.world.readout import PLACES
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, true_vehicle


def rotations(attitude: np.ndarray) -> np.ndarray:
    """Rotation matrices of unit quaternions (w, x, y, z): (N, 4) to (N, 3, 3)."""
    return np.moveaxis(np.array(rotation_rows(*attitude.T)), 2, 0)


def euler_angles(rotation: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw [rad] of rotations B to I: (N, 3, 3) to (N, 3)."""
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = np.arcsin(np.clip(-rotation[:, 2, 0], -1.0, 1.0))
    return np.column_stack((roll, pitch, np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])))


def in_body(rotation: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """World vectors in the body frame, R' v: (N, 3)."""
    return np.einsum("nji,nj->ni", rotation, vectors)


OUTCOMES = tuple(str(outcome) for outcome in Outcome)
#: Time between logged propeller clearances [s], which change slowly (the plant checks for strikes at every tick).
CLEARANCE_S = 0.02
#: Columns of one number per tick, in the order in which `Recorder.tick` writes them.
NUMBERS = "t phase row outcome step_us iterations reach_margin".split()
#: Columns of integers.
INTEGERS = ("phase", "row", "outcome", "iterations")
#: Inputs of the controller's step that are logged, in addition to those of every line.
CONTACT_INPUTS = tuple(f"contact.{name}" for name in ("known", "distance", "push", "ramp"))
INPUTS = (*CONTACT_INPUTS, "contact_weight", "velocity_known", "velocity")
_PRESSED = [PHASES.index(phase) for phase in ("paint", "retouch", "climb")]


@dataclass(frozen=True, kw_only=True)
class Flown:
    """Law, vehicle and scene of a log, which its rows depend on."""

    scene: Scene
    seed: int
    law: str
    config: PilotConfig
    vehicle: TrueVehicle
    clearance: PropellerClearance

    @classmethod
    def of(cls, scene: Scene, seed: int, law: str, config: PilotConfig) -> Flown:
        """The same without a plant."""
        vehicle = true_vehicle(scene, config.controller.vehicle, seed)
        clearance = PropellerClearance(BoardGeometry(scene), vehicle)
        return cls(scene=scene, seed=seed, law=law, config=config, vehicle=vehicle, clearance=clearance)


@dataclass(kw_only=True)
class LoggedRows:
    """Contents of a recorder's log."""

    columns: dict[str, np.ndarray]  # (N,) or (N, width)
    program: np.ndarray | None  # (N, P)
    limits: tuple[str, ...]  # names of the limits
    active: dict[int, list[tuple[int, float]]]  # by tick: index and price of every active limit
    vision_ms: list[float]
    thrust_limits: tuple[np.ndarray, np.ndarray]  # of the real rotors


def logged_signals(slots: int) -> list[str]:
    """Names of the logged signals of the controller's step, in their order, for a number of line slots."""
    lines = [f"line_{index}" for index in range(slots)]
    given = [f"{line}.{name}" for line in lines for name in ("present", "vertical")]
    return [*INPUTS, *given, *(f"{line}.error" for line in lines), "push_reference"]


def assemble(flown: Flown, rows: LoggedRows) -> dict[str, np.ndarray]:
    """The arrays of a trace, see `sim.flight.trace.FIELDS`."""
    arrays, ticks, slots = dict(rows.columns), len(rows.columns["t"]), flown.config.controller.line_slots
    arrays |= {name: arrays[name].astype(np.int32) for name in INTEGERS}
    pressed = np.isin(arrays["phase"], _PRESSED)
    arrays["row"][~pressed] = 0
    signals = {name: arrays.pop(name) for name in logged_signals(slots)}
    arrays["line_error_px"] = _line_errors(signals, slots, camera_intrinsics(flown.scene.camera)[0])
    pushes = arrays.pop("pushes").reshape(ticks, -1)
    arrays |= {"push_true": pushes[:, -1].copy(), "contact_1khz": pushes.reshape(-1)}
    arrays |= _estimates(signals) | _truth(flown, arrays.pop("truth"))
    active, price = np.zeros((ticks, len(rows.limits)), dtype=bool), np.zeros((ticks, len(rows.limits)))
    for tick, paid in rows.active.items():
        columns, prices = zip(*paid, strict=True)
        active[tick : tick + 1, columns], price[tick : tick + 1, columns] = True, prices
    arrays["active"], arrays["limit_price"] = active, price
    if rows.program is not None:
        arrays["program"] = rows.program
    nominal = flown.config.controller.vehicle
    arrays["thrust_min"], arrays["thrust_max"] = nominal.thrust_min, nominal.thrust_max
    arrays["true_thrust_min"], arrays["true_thrust_max"] = rows.thrust_limits
    arrays["true_mass"] = np.array([flown.vehicle.mass_kg])
    arrays["vision_ms"] = np.array(rows.vision_ms, float)
    arrays["painting_1khz"] = np.repeat(pressed, pushes.shape[1])
    return arrays


def _line_errors(signals: dict[str, np.ndarray], slots: int, focal: float) -> np.ndarray:
    """Error of the horizontal and the vertical guide at the tip [px], (N, 2), NaN where absent."""
    found = np.full((len(signals["push_reference"]), 2), math.nan)
    for index in range(slots):
        vertical, error = signals[f"line_{index}.vertical"], signals[f"line_{index}.error"]
        present = np.flatnonzero(signals[f"line_{index}.present"] > 0.0)
        found[present, (vertical[present] > 0.0).astype(int)] = focal * error[present]
    return found


def _truth(flown: Flown, truth: np.ndarray) -> dict[str, np.ndarray]:
    """Truth from the plant's readings at every tick, (N, numbers), see `sim.world.readout`."""
    position, attitude = (truth[:, PLACES[name]] for name in ("position", "quaternion"))
    rotation = rotations(attitude)
    every = ticks_in(CLEARANCE_S, flown.config.controller.tick_s)
    rare = slice(None, None, every)
    board = BoardGeometry(flown.scene)
    tip = truth[:, PLACES["tip"]].copy()
    clearance = flown.clearance.distances(position[rare], rotation[rare])
    return {
        "position": position.copy(),
        "attitude": attitude.copy(),
        "velocity": in_body(rotation, truth[:, PLACES["velocity"]]),
        "euler": _angles(board, rotation, tip),
        "tip": tip,
        "friction_true": truth[:, PLACES["friction"]][:, 1:].copy(),
        "propeller_clearance": np.repeat(clearance, every)[: len(truth)],
    }


def _angles(board: BoardGeometry, rotation: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw against gravity and the wall before the tip [rad], (N, 3)."""
    angles = euler_angles(board.from_ned.T @ rotation)
    if not board.surface.flat:
        yaw = angles[:, 2] - [board.bearing(place) for place in tip]
        angles[:, 2] = np.arctan2(np.sin(yaw), np.cos(yaw))
    return angles


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
