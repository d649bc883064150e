"""A task: a named set of least-squares rows, symbolic in the thrusts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow


class Task(ABC):
    """Something the program trades against other tasks by weight.

    A task writes its rows once, when the program is built. Its file holds error, rate, gain, target, weight and row.
    An absent task has weight zero: rows never come or go. A target that changes between steps is a
    `ibvs_qp.model.rows.Parameter` of the task (examples/own_task.py).

    Attributes:
        weight_settings: Fields of `ibvs_qp.config.ControllerConfig` with the weights of its rows: one for all rows,
            or one a row. A user's own task needs none.
    """

    weight_settings: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def rows(self, model: Model) -> list[TaskRow]:
        """Rows of the task, affine in ``model.thrust`` and ``model.acceleration``."""
