"""What a task is: a named set of least-squares rows, symbolic in thrusts and parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from ibvs_qp.model.rows import SymbolicModel, TaskRow


class Task(ABC):
    """A wish the program weighs against others.

    A task writes its rows once, at construction of the program; each tick only the values of its named parameters
    change. A task that is absent has weight zero: rows never come or go.

    Attributes:
        weighed_by: Fields of `ibvs_qp.config.ControllerConfig` that weigh its rows and say unit, default and reason:
            one for all rows, or one a row. A task of one's own needs none.
    """

    weighed_by: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Rows of the task, affine in ``model.thrust``."""
