"""A number of a user's task or limit that may change between steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


class Parameter:
    """Value read at every step by the rows that contain its symbol (`Model.parameter`).

    Attributes:
        name: Unique among the inputs of the step.
        value: Present value, (size,); assign with ``value[:] =``.
    """

    def __init__(self, name: str, value: float | Sequence[float]) -> None:
        self.name, self.value = name, np.atleast_1d(np.array(value, float))
