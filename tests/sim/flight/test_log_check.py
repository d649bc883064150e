"""Arrays of a log before anything computes with them: their times increase, their indices point at names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from synthetic_trace import LIMITS, OUTCOMES, PHASES, synthetic_trace

from sim.flight.log_check import check_arrays

NAMES = {"phases": np.array(PHASES), "outcomes": np.array(OUTCOMES), "limits": np.array(LIMITS)}
SOUND = synthetic_trace().arrays | NAMES


def changed(name: str, place: int, value: float) -> dict[str, Any]:
    array = SOUND[name].copy()
    array[place] = value
    return SOUND | {name: array}


def test_sound_arrays_pass() -> None:
    check_arrays(SOUND)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, SOUND["t"][9], SOUND["t"][12]])
def test_a_time_that_does_not_increase_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="array t does not increase"):
        check_arrays(changed("t", 10, value))


@pytest.mark.parametrize(("name", "value"), [("phase", len(PHASES)), ("phase", -1), ("outcome", len(OUTCOMES))])
def test_an_index_without_a_name_is_refused(name: str, value: int) -> None:
    with pytest.raises(ValueError, match=f"array {name} has an index outside {name}s"):
        check_arrays(changed(name, 3, value))


@pytest.mark.parametrize("names", ["phases", "outcomes", "limits"])
@pytest.mark.parametrize("array", [np.zeros((1, 0)), np.array([["a", "b"]]), np.array("a"), np.arange(30)])
def test_names_that_are_no_list_of_text_are_refused(names: str, array: np.ndarray) -> None:
    with pytest.raises(ValueError, match=f"array {names} has shape"):
        check_arrays(SOUND | {names: array})
