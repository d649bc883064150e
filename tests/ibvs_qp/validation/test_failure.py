"""An exception of a caller's type is named without running any of its code."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest
from controller_scenes import measured
from recorded_inputs import recording
from references import good_reference

from ibvs_qp.analytic import PaperController
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.supervision.assured import Assured
from ibvs_qp.validation.failure import raised


def _raise(*_: Any) -> Any:
    raise ValueError("hostile")


class _Nameless(type):
    __name__ = property(_raise)  # type: ignore[assignment]


class NoName(Exception, metaclass=_Nameless):
    """Its type has no name."""


class NoTrace(Exception):
    """It has no trace."""

    __traceback__ = property(_raise)  # type: ignore[assignment]


class OddTrace(Exception):
    """Its trace is none."""

    __traceback__ = 5  # type: ignore[assignment]


class NoText(Exception):
    """It has no text."""

    __str__ = __repr__ = _raise


HOSTILE = [NoName, NoTrace, OddTrace, NoText, type("N" * 10**5, (Exception,), {})]
STEPPED = {
    "qp": lambda: HybridController(),
    "analytic": lambda: PaperController(),
    "assured": lambda: Assured(HybridController()),
    "pilot": lambda: Pilot(),
}


def raising(good: Any, kind: type, error: type[Exception]) -> Any:
    """A copy of an input whose attitude raises when it is read."""

    def attitude(_: Any) -> Any:
        raise error

    hostile = object.__new__(type("Hostile", (kind,), {"attitude": property(attitude)}))
    for field in fields(kind):
        if field.name != "attitude":
            object.__setattr__(hostile, field.name, getattr(good, field.name))
    return hostile


def test_an_exception_is_named_without_its_code() -> None:
    caught: list[Exception] = []
    for error in HOSTILE:
        try:
            raise error
        except Exception as hostile:
            caught.append(hostile)
    told = [raised("here", hostile) for hostile in caught]  # out here: no test report can show a hostile context
    assert [name.partition(" in ")[0] for name in told] == [
        *("here: NoName", "here: NoTrace", "here: OddTrace", "here: NoText", "here: " + "N" * 40)
    ]
    assert all("in test_an_exception_is_named_without_its_code, line" in name for name in told)


@pytest.mark.parametrize("name", STEPPED)
def test_no_step_raises_on_an_exception_that_raises(name: str) -> None:
    stepped: Any = STEPPED[name]()
    for error in HOSTILE:
        stepped.reset()
        command = None
        try:
            if name == "pilot":
                frames = recording("rotor_loss").frames
                stepped.step(frames[0])
                command = stepped.step(raising(frames[1], SensorFrame, error))
            else:
                stepped.step(measured(0), good_reference())
                command = stepped.step(raising(measured(1), Measurement, error), good_reference())
        except Exception:
            pass  # a hostile one, which a test report cannot show either
        assert command is not None, "the step raised"
        assert any("attitude: Unreadable, not 4 numbers" in reason for reason in command.rejected), command.rejected
