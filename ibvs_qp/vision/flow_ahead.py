"""Flow worked out beside the pilot, in a process that already has the pictures: the same velocities to the bit.

A picture reaches the pilot late. To follow points into it needs the surface in the picture before and the gyro's turn
in between, which are known before it arrives, so the velocity may be ready with it.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.checks import finite_vector
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow_solve import FlowVelocity
from ibvs_qp.vision.flow_task import FlowLink, FlowTask, Lens, Step
from ibvs_qp.vision.mask import Intrinsics
from ibvs_qp.vision.plane import PlaneEstimate


class FlowAhead:
    """Asks a process for what `SparseFlow` would find, and takes its place.

    Args:
        link: The way to the process.
        config: Settings of the flow.

    Attributes:
        spent_ms: Time that the process took for the last picture [ms].
    """

    def __init__(self, link: FlowLink, config: FlowConfig) -> None:
        self._link, self._config, self._number = link, config, 0
        self._lens: Lens | None = None
        self.spent_ms = 0.0
        self.reset()

    def reset(self) -> None:
        """Forget the last picture and its points."""
        self._begin, self._asked = True, None
        self._settle: tuple[tuple[list[float], float] | None, bool | None] = (None, None)

    def update(
        self,
        rgb: np.ndarray,
        depth: np.ndarray,
        excluded: np.ndarray,
        intrinsics: Intrinsics,
        stamp_ns: int,
        rotation: np.ndarray,
        camera_rotation: np.ndarray,
        plane: PlaneEstimate | None,
        camera_position: np.ndarray,
        busy: bool = False,
    ) -> FlowVelocity | str:
        """As `SparseFlow.update`, of a picture that the link has handed out; the turn as a matrix is made there."""
        lens = None
        if self._lens is None or self._lens.excluded is not excluded:
            lens = self._lens = Lens(self._config, excluded, intrinsics, camera_position)
            self.reset()
        step = Step(self._link.place(rgb), stamp_ns, rotation.tolist())
        if self._asked != step:
            self._ask(step, lens)
        self._asked = None
        answer = self._link.answer(self._number)
        self.spent_ms = answer.spent_ms
        self._settle = None if plane is None else (plane.inverse_depth.tolist(), float(plane.residual_sigma)), busy
        return answer.result

    def next_stamp(self, rgb: np.ndarray, stamp_ns: int) -> int | None:
        """Stamp of the picture taken after this one, or None if there is none yet."""
        following = self._link.following(self._link.place(rgb))
        return None if following is None else stamp_ns + following[1]

    def look_ahead(self, rgb: np.ndarray, stamp_ns: int | None, rotation: np.ndarray | None) -> None:
        """Have the next picture followed into, after the last one was seen.

        Args:
            rgb: The last picture.
            stamp_ns: Stamp of the next one, or None if it is not taken yet.
            rotation: Turn of the body in between, in B [rad], (3,).
        """
        step, following = None, self._link.following(self._link.place(rgb))
        if stamp_ns is not None and following is not None and self._lens is not None:
            turn = finite_vector(rotation, 3)
            step = Step(following[0], stamp_ns, [0.0] * 3 if turn is None else turn.tolist())
        if step is not None or self._settle[1] is not None:
            self._ask(step, None)

    def _ask(self, step: Step | None, lens: Lens | None) -> None:
        self._number += 1
        begin, again = step is not None and self._begin, step is not None and self._asked is not None
        self._link.ask(FlowTask(self._number, lens, *self._settle, step, begin, again))
        self._settle = None, None
        if step is not None:
            self._begin, self._asked = False, step
