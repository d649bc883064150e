"""Thrust limits of a drive: copied, read-only, and in force until sound ones replace them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ibvs_qp.validation.thrust_limits import ThrustLimits

LOW, HIGH = [2.0] * 6, [40.0] * 6


def test_accepted_limits_are_read_only_copies() -> None:
    limits, high = ThrustLimits(6), np.array(HIGH)
    limits.assign((LOW, high))
    high[:] = 7.0
    assert limits.accepted is not None and limits.rejected == []
    for side, expected in zip(limits.accepted, (LOW, HIGH), strict=True):
        assert side.tolist() == expected
        with pytest.raises(ValueError, match="read-only"):
            side[0] = 0.0


@pytest.mark.parametrize(
    "broken",
    [(HIGH, LOW), (LOW, [np.nan] * 6), (LOW, [1e9] * 6), ([-1e9] * 6, HIGH), (LOW, HIGH[:5]), (LOW,), None, "ab", 7],
)
def test_refused_limits_are_named_and_leave_the_last_in_force(broken: Any) -> None:
    limits = ThrustLimits(6)
    limits.assign((LOW, HIGH))
    limits.assign(broken)
    if broken is None:
        assert limits.accepted is None and limits.rejected == [], "the configured ones"
        return
    assert limits.accepted is not None and [side.tolist() for side in limits.accepted] == [LOW, HIGH]
    assert limits.rejected and all(reason.startswith("thrust_limits: ") for reason in limits.rejected)
    limits.assign((LOW, LOW))
    assert limits.rejected == [] and limits.accepted[1].tolist() == LOW


class Unreadable(float):
    """A number that raises when it is read."""

    def __float__(self) -> float:
        raise ValueError


def _raise(*_: Any) -> Any:
    raise ValueError


class _Nameless(type):
    __name__ = property(_raise)  # type: ignore[assignment]


class Nameless(metaclass=_Nameless):
    """Its type has no name."""


@pytest.mark.parametrize("broken", [np.full(6, np.longdouble("1e4000")), (Unreadable(1.0),) * 6, Nameless()])
def test_a_pair_that_raises_when_it_is_read_is_refused_by_name(broken: Any) -> None:
    limits = ThrustLimits(6)
    limits.assign((LOW, HIGH))
    with np.errstate(all="raise"):
        limits.assign((broken, broken))
    assert limits.rejected and all(reason.startswith("thrust_limits: ") for reason in limits.rejected)
    assert limits.accepted is not None and limits.accepted[1].tolist() == HIGH
