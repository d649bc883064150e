"""The contact of every physics step: where curved walls, reliefs and bristles need other numbers than a flat board."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import mujoco
import numpy as np

from sim.world.board import BoardGeometry
from sim.world.bristles import Bristles
from sim.world.contact import contact_stiffness, set_friction, set_stiffness
from sim.world.errors import BrushErrors, ReliefErrors
from sim.world.face import TIP_RADIUS_M, Face
from sim.world.mjcf import STEP_NS, ModelIds
from sim.world.mujoco_frames import FLIP
from sim.world.relief import Relief

_STEP_S = STEP_NS * 1e-9


class Touch:
    """Lays the contact plane and sets stiffness, friction and drag before a physics step.

    Attributes:
        needed: Whether a step needs that; a spring before a flat board does not.
        rough: Whether the wall has a relief.

    Args:
        board: Wall and board, with the errors of the scene.
        face: The contact plane.
        model: The compiled model, written to.
        ids: Its indices.
        seed: Seed of the flight.
    """

    def __init__(self, board: BoardGeometry, face: Face, model: mujoco.MjModel, ids: ModelIds, seed: int) -> None:
        scene = board.scene
        errors, wall = scene.errors, scene.wall
        self._board, self._face, self._model, self._ids = board, face, model, ids
        self._relief = Relief(errors.relief, board, seed) if errors.relief != ReliefErrors() else None
        self.rough = self._relief is not None
        self._bristles = None
        if errors.brush != BrushErrors():
            self._bristles = Bristles(errors.brush, wall.stiffness_n_m, wall.friction)
        self.needed = not board.surface.flat or self._relief is not None or self._bristles is not None
        self._last: np.ndarray | None = None  # the tip before the surface at the physics step before
        self._last_on_board = True
        self._wet_s = 0.0

    def set_wall(self, stiffness: float, friction: float, tip: np.ndarray) -> float:
        """Another stiffness [N/m] and friction, at a place of the tip in the chart [m], (3,).

        Returns:
            How much deeper the tip lies in the new wall under the same push at rest [m].
        """
        height, *_ = self._rise(tip)
        dent = max(float(tip[0]) + height - self._face.depth, 0.0)
        before, bristles = contact_stiffness(self._model), self._bristles
        set_stiffness(self._model, stiffness)
        set_friction(self._model, friction)
        if bristles is None:
            return dent * (before / stiffness - 1.0)
        push = bristles.stiffness(dent, 0.0) * dent
        bristles.set_wall(stiffness, friction)
        return bristles.depth(push) - dent

    def jumped(self) -> None:
        """The tip has jumped: its way is no motion."""
        self._last = None

    def _rise(self, place: np.ndarray) -> tuple[float, float, float]:
        """Height of the relief before a place of the chart [m], and its slopes along and up on the board."""
        if self._relief is None or not self._face.on_board:
            return 0.0, 0.0, 0.0
        return self._relief.height(*self._board.spot(float(place[1]), float(place[2])))

    def prepare(self, data: mujoco.MjData) -> None:
        """Set up the contact of the next physics step."""
        mujoco.mj_kinematics(self._model, data)
        sphere = data.geom_xpos[self._ids.tip]
        surface = self._board.surface
        place = surface.chart(FLIP * sphere)
        height, *slopes = self._rise(place)
        self._face.lay(place, height, slopes)
        if self._bristles is None:
            return
        ahead = np.array(data.geom_xmat[self._ids.tip][::3]) * TIP_RADIUS_M
        tip = surface.chart(FLIP * (sphere + ahead))
        tip[0] += height - self._face.depth
        if self._face.on_board != self._last_on_board:
            self._last_on_board = self._face.on_board
            self.jumped()
        moved = np.zeros(3) if self._last is None else (tip - self._last) / _STEP_S
        self._last = tip
        touching = tip[0] > 0.0
        slip = moved * (0.0, 1.0, 1.0)
        speed = float(np.hypot(*slip[1:]))
        set_stiffness(self._model, self._bristles.stiffness(float(tip[0]), float(moved[0])))
        set_friction(self._model, self._bristles.friction(speed))
        force = np.zeros(3)
        if touching:
            self._wet_s += _STEP_S
            force = FLIP * (surface.axes(tip) @ (-self._bristles.drag(self._wet_s) * slip))
        tool = self._ids.tool
        arm = sphere - data.xipos[tool]
        data.xfrc_applied[tool] = *force, *np.cross(arm, force)
