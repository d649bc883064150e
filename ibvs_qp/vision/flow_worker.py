"""Works out flow where the pictures are, for who asks with `ibvs_qp.vision.flow_ahead`."""

from __future__ import annotations

import copy
import time

import numpy as np

from ibvs_qp.vision.flow import SparseFlow
from ibvs_qp.vision.flow_solve import FlowSurface
from ibvs_qp.vision.flow_task import FlowAnswer, FlowTask, Lens
from ibvs_qp.vision.motion import CameraMotion


class FlowWorker:
    """Follows points from picture to picture; a step that was taken for nothing can be taken back."""

    def __init__(self) -> None:
        self._lens: Lens | None = None

    def run(self, task: FlowTask, pictures: list[tuple[np.ndarray, np.ndarray]]) -> FlowAnswer | None:
        """Do what is asked; the answer to a step if there is one.

        Args:
            task: What is asked.
            pictures: Colour and depth of every place.
        """
        begin = time.perf_counter()
        if task.lens is not None:
            self._lens, self._flow = task.lens, SparseFlow(task.lens.config)
            self._before = copy.copy(self._flow)
        lens = self._lens
        assert lens is not None, "the first task brings the lens"
        if task.busy is not None:
            surface = None if task.surface is None else FlowSurface(np.array(task.surface[0]), task.surface[1])
            self._flow.settle(self._depth, lens.excluded, lens.intrinsics, surface, task.busy)
        step = task.step
        if step is None:
            return None
        if task.again:
            self._flow = self._before
        if task.reset:
            self._flow.reset()
        self._before = copy.copy(self._flow)  # what it holds is replaced, never changed
        rgb, self._depth = pictures[step.place]
        turn = np.array(step.rotation)
        camera = CameraMotion.of_body(turn, None, 0.0, lens.camera_position).rotation
        result = self._flow.follow(
            rgb, lens.excluded, lens.intrinsics, step.stamp_ns, turn, camera, lens.camera_position
        )
        return FlowAnswer(task.number, result, 1e3 * (time.perf_counter() - begin))
