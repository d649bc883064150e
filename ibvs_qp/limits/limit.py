"""What a limit is: a named set of two-sided rows, hard or soft with a price."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from ibvs_qp.model.rows import LimitRow, SymbolicModel

#: Bound of a row that does not limit now: finite, so that OSQP never sees the row change its type.
WIDE = 1e4


class Limit(ABC):
    """A bound the program keeps: hard, or soft with a price per squared unit of slack.

    Only thrust and thrust rate are hard and their intersection is never empty, so the program is feasible by
    construction. Row types never change from tick to tick.

    Attributes:
        bounded_by: Fields of `ibvs_qp.config.ControllerConfig` that set its bounds, with unit, default and reason.
        priced_by: Field that holds the price of its slack; none where it is hard.
        switched_by: Field that takes it out of the program.
    """

    bounded_by: ClassVar[tuple[str, ...]] = ()
    priced_by: ClassVar[str | None] = None
    switched_by: ClassVar[str | None] = None

    @abstractmethod
    def rows(self, model: SymbolicModel) -> list[LimitRow]:
        """Rows of the limit, affine in ``model.thrust``."""

    @staticmethod
    def price(model: SymbolicModel, price: float) -> float | None:
        """Price of the slack, None where the user wants barriers without slack."""
        return None if model.config.limits.hard_barriers else price
