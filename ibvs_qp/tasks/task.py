"""What a task is: a named set of least-squares rows, symbolic in thrusts and parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod

from ibvs_qp.qp.model import SymbolicModel, TaskRow


class Task(ABC):
    """A wish the program weighs against others.

    A task writes its rows once, at construction of the program; each tick only the values of its named parameters
    change. A task that is absent has weight zero: rows never come or go.
    """

    @abstractmethod
    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Rows of the task, affine in ``model.thrust``."""
