"""The surface before the tip: the board's face inside its outline, the wall's face beside it.

The contact recipe (`sim.world.contact`) holds for a plane: a box would push the tip out sideways near its rim and
bound the penetration. So the plane moves, from the board's face to the wall's where the tip leaves the outline. On a
curved wall it is the tangent plane at the place nearest to the tip's sphere, whose contact is that of the surface.
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from sim.world.board import BoardGeometry
from sim.world.mujoco_frames import FLIP

#: Radius of the tip's contact sphere [m]; its foremost point is the tip. Small: the contact point stays at the tip.
TIP_RADIUS_M = 0.005


class Face:
    """Where the contact plane lies, by the place of the tip.

    A tip that has slipped off the board and comes back deeper than it left, by more than its radius, meets the board's
    edge from the side: the round tip slides up no more.

    Attributes:
        on_board: Whether the tip lies inside the board's outline.

    Args:
        board: Board and wall.
        place: Position of the contact plane in the compiled model [m], (3,), written to.
        quaternion: Its orientation there, z towards the vehicle, (4,), likewise.
    """

    def __init__(self, board: BoardGeometry, place: np.ndarray, quaternion: np.ndarray) -> None:
        self.on_board = True
        self._board, self._place, self._quaternion, self._left_at = board, place, quaternion, 0.0

    @property
    def depth(self) -> float:
        """Depth of the surface before the tip in the chart [m]: of the board's face, or of the wall's."""
        return 0.0 if self.on_board else self._board.scene.board.gap_m

    def follow(self, tip: Sequence[float]) -> str | None:
        """Move the plane to the surface before the tip.

        Args:
            tip: Undeformed tip in the chart [m], (3,).

        Returns:
            Why this is a crash, or None.
        """
        depth, y, z = tip
        along, up = self._board.spot(y, z)
        size = self._board.scene.board
        on_board = 0.0 <= along <= size.width_m and 0.0 <= up <= size.height_m
        if on_board == self.on_board:
            return None
        self.on_board = on_board
        if on_board:
            self._place[0] = 0.0  # of a plane; `lay` follows on other surfaces
            return "tip struck the board's edge" if depth > self._left_at + TIP_RADIUS_M else None
        self._place[0], self._left_at = size.gap_m, max(depth, 0.0)
        return None

    def lay(self, place: np.ndarray, height: float, slopes: Sequence[float]) -> None:
        """Lay the plane at the place nearest to the tip's sphere.

        Args:
            place: That place in the chart, of which the depth does not count, (3,).
            height: Of the relief there, towards the vehicle [m].
            slopes: Of the relief, along and up on the board, (2,).
        """
        board = self._board
        surface, foot = board.surface, np.array(place)
        foot[0] = self.depth - height
        self._place[:] = FLIP * surface.points(foot)
        along, up = slopes
        rise = along * board.along + up * board.up  # in (y, z) of the chart
        mujoco.mju_quatZ2Vec(self._quaternion, -FLIP * (surface.axes(foot) @ (1.0, *rise)))
