"""The library on a Cortex-M4F and a Cortex-M7 in QEMU: recorded ticks, memory, and time by counted instructions."""

from __future__ import annotations

import pytest
from c_flight import recorded_flight
from recorded_inputs import recording

from benchmarks.microcontroller import milliseconds, missing_tools, replay, replay_flight
from tests.replay.cases import CASES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing_tools()), reason=f"not on this machine: {', '.join(missing_tools())}"),
]
#: Budget of the controller on an STM32F405: 160 kB of its flash, 32 kB of RAM [bytes], and a tick [ms].
FLASH, RAM, TICK_MS = 160_000, 32_000, 4.0
#: The same with estimation [bytes]; the M7 with doubles has both, too.
FLIGHT_FLASH, FLIGHT_RAM = 320_000, 64_000


@pytest.mark.parametrize("case", ["press_beyond_reach", "rotor_loss", "heavy_noise", "paint_qp"])
def test_float_on_a_cortex_m4f_is_in_time(case: str) -> None:
    flight = recording(case)
    ticks = list(zip(flight.measurements, flight.references, strict=True))[:2500]
    found = replay(CASES[case].config().controller, ticks, single=True)
    assert len(found.instructions) == len(ticks) and found.limited.any()
    assert found.difference_n.max() <= (0.2 if case == "rotor_loss" else 0.05)
    assert milliseconds(found.instructions.max(), 168) <= TICK_MS
    assert found.flash <= FLASH and found.ram + found.stack <= RAM
    assert set(found.outcome) <= {0, 1, 5} and not found.allocates


def test_double_on_a_cortex_m7_is_that_of_python() -> None:
    flight = recording("press_beyond_reach")
    ticks = list(zip(flight.measurements, flight.references, strict=True))
    found = replay(CASES["press_beyond_reach"].config().controller, ticks, single=False)
    assert found.difference_n.max() <= 1e-4  # other rounding of sines; in the last digits but one of a limited program
    assert milliseconds(float(sorted(found.instructions)[len(ticks) // 2]), 480) <= 1.0


@pytest.mark.parametrize("case", ["press_beyond_reach", "heavy_noise"])
@pytest.mark.parametrize("single", [True, False])
def test_estimation_fits_and_is_that_of_python(case: str, single: bool) -> None:
    ticks = [tick.tick for tick in recorded_flight(case)]
    found = replay_flight(CASES[case].config(), ticks, single)
    assert len(found.instructions) == len(ticks) and set(found.outcome) <= {0, 1, 5}
    assert found.difference_n.max() <= (0.05 if single else 1e-4)
    assert found.flash <= FLIGHT_FLASH and found.ram + found.stack <= FLIGHT_RAM and not found.allocates
    assert not single or milliseconds(found.instructions.max(), 168) <= TICK_MS
