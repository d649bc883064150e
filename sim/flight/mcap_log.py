"""A simulated flight as an MCAP log: the topics of the pilot's recorder, and the truth on topics of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

from ibvs_qp.command import Command
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.interfaces.log.messages import encode
from ibvs_qp.interfaces.log.recorder import Recorder
from ibvs_qp.interfaces.log.scene import WALL, box, pose_in_frame, quaternion, shapes, transform, vehicle_scene
from ibvs_qp.interfaces.log.topics import POSE_NS, SHAPE_NS
from ibvs_qp.interfaces.log.writer import LogWriter
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.flight.surroundings import World
from sim.world.readout import PLACES

#: Frame of the vehicle that flies.
TRUE_VEHICLE = "true_vehicle"
#: Colours of its rotors and of the board (r, g, b, a).
_ROTOR, _BOARD = (0.2, 0.7, 0.3, 0.35), (0.8, 0.75, 0.65, 0.6)
#: Thickness of the drawn board [m].
_THIN = 0.01
#: World NED, wall to the north, to the log's frame at the wall: x into it, y to the left, z up.
_FLIP = np.diag((1.0, -1.0, -1.0))


@dataclass(frozen=True, kw_only=True)
class TruthTick:
    """State of the plant after a tick; no input of the controller. World NED: the board's face is the plane x = 0.

    Attributes:
        stamp_ns: Time.
        position_m: Of the origin of B, world [m], (3,).
        velocity_m_s: The same point's, world [m/s], (3,).
        attitude: Quaternion (w, x, y, z) of B in the world.
        angular_velocity_rad_s: In B [rad/s], (3,).
        tip_m: Brush tip in the wall's chart [m], (3,).
        push_n: Normal contact force [N].
        friction_n: Force of the board on the tip along it (right, down) [N], (2,).
        thrusts_n: Rotor thrusts behind the motors' lag [N], (n,).
    """

    stamp_ns: int
    position_m: np.ndarray
    velocity_m_s: np.ndarray
    attitude: np.ndarray
    angular_velocity_rad_s: np.ndarray
    tip_m: np.ndarray
    push_n: float
    friction_n: np.ndarray
    thrusts_n: np.ndarray


class McapLog:
    """Records a flight of the simulator; it waits for the writer, because it flies faster than real time.

    Args:
        file: The file.
        world: The world.
        pilot: The pilot.
    """

    def __init__(self, file: Path, world: World, pilot: Pilot) -> None:
        self._recorder, self._world = Recorder(file, pilot), world
        self._pose_ns, self._shape_ns = -POSE_NS, -SHAPE_NS
        self._start = np.array([0.0, *world.plant.tip_on_wall])  # where the pilot's odometer begins

    def step(self, frame: SensorFrame) -> Command:
        """Step of the pilot."""
        return self._recorder.step(frame)

    def tick(self, stamp_ns: int) -> None:
        """Log the truth of a tick, after the plant has moved."""
        plant = self._world.plant
        self._recorder.writer.offer(self._write, stamp_ns, plant.truth.copy(), plant.thrusts_actual)
        self._recorder.writer.wait_for_room()

    def note(self, name: str, text: str) -> None:
        """Log an event from outside the pilot."""
        self._recorder.note(name, text)

    def close(self) -> str:
        """Close the file.

        Returns:
            Why it is not complete, or an empty text.
        """
        self._recorder.close()
        return self._recorder.problem

    def _write(self, log: LogWriter, stamp_ns: int, truth: np.ndarray, thrusts: np.ndarray) -> None:
        """In the thread of the log."""
        part = {name: truth[place] for name, place in PLACES.items()}
        row = TruthTick(
            stamp_ns=stamp_ns,
            position_m=part["position"],
            velocity_m_s=part["velocity"],
            attitude=part["quaternion"],
            angular_velocity_rad_s=part["rate"],
            tip_m=part["tip"],
            push_n=float(part["push"][0]),
            friction_n=part["friction"][1:],
            thrusts_n=thrusts,
        )
        log.write("/truth/state", encode(row), stamp_ns)
        if stamp_ns - self._pose_ns < POSE_NS:
            return
        self._pose_ns = stamp_ns
        position = _FLIP @ (row.position_m - self._start)
        turn = quaternion(_FLIP @ rotation_from_quaternion(row.attitude))
        frame = transform(WALL, TRUE_VEHICLE, position, turn, stamp_ns)
        log.write("/truth/tf", FrameTransforms(transforms=[frame]))
        log.write("/truth/pose", pose_in_frame(WALL, position, turn, stamp_ns))
        if stamp_ns - self._shape_ns >= SHAPE_NS:
            self._shape_ns = stamp_ns
            log.write("/truth/vehicle", vehicle_scene(self._world.plant.vehicle, TRUE_VEHICLE, stamp_ns, _ROTOR))
            log.write("/truth/board", self._board(stamp_ns))

    def _board(self, stamp_ns: int) -> Any:
        geometry, board = self._world.geometry, self._world.scene.board
        middle = geometry.point(0.5 * board.width_m, 0.5 * board.height_m)
        centre = _FLIP @ (np.array([0.5 * _THIN, *middle]) - self._start)
        axes = np.column_stack(((1.0, 0.0, 0.0), (0.0, *geometry.along), (0.0, *geometry.up)))
        size = _THIN, board.width_m, board.height_m
        turn = quaternion(_FLIP @ axes @ np.diag((1.0, -1.0, 1.0)))
        return shapes(WALL, "true_board", stamp_ns, cubes=[box(centre, size, _BOARD, turn)])
