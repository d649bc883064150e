"""What a task is: a named set of least-squares rows, symbolic in thrusts and parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ibvs_qp.qp.model import SymbolicModel, TaskRow

if TYPE_CHECKING:
    from ibvs_qp.setpoints import Setpoints


class Task(ABC):
    """A wish the program weighs against others.

    A task writes its rows once, at construction of the program; each tick only the values of its named parameters
    change. A task that is absent has weight zero: rows never come or go.
    """

    @abstractmethod
    def rows(self, model: SymbolicModel) -> list[TaskRow]:
        """Rows of the task, affine in ``model.thrust``."""

    def pack(self, values: Mapping[str, np.ndarray], terms: Setpoints) -> None:  # noqa: B027 - optional
        """Write this tick's values of the task's own parameters, ``values[name][:] = ...``.

        For tasks that a user adds; a task without parameters leaves it out, the shipped ones are packed together.

        Args:
            values: Parameters of the program by name.
            terms: What is measured and wanted at this tick.
        """
