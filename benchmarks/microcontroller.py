"""The C library on a Cortex-M in QEMU: instructions of every recorded tick, flash, RAM and stack; prints JSON.

Run as ``python benchmarks/microcontroller.py``; needs Debian's gcc-arm-none-eabi, libnewlib-arm-none-eabi and
qemu-system-arm. QEMU counts instructions, not cycles: `CYCLES_PER_INSTRUCTION` is the assumption behind milliseconds.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.interfaces.c_library.library import write_library
from ibvs_qp.interfaces.c_library.recorded import FlightTick, write_flight, write_recorded
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.pilot import PilotConfig
from sim.bench.ticks import press_flight, recorded_ticks

#: What the cross build and QEMU need.
TOOLS = "arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm", "make"
#: Cycles of a Cortex-M4F per instruction: one for most of its float arithmetic, two for a load, up to 14 for a division
#: or a root, and flash wait states behind a prefetch buffer (ARM DDI 0439, table 3-1). An assumption, not measured.
CYCLES_PER_INSTRUCTION = 2.1
#: Clocks [MHz] of an STM32F4 as in the paper's autopilot, of a faster M4F or M7, and of an STM32H7.
CLOCKS_MHZ = 168, 216, 480
#: Longest run of QEMU [s].
PATIENCE_S = 600.0


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Recorded ticks on the target.

    Attributes:
        iterations: Of OSQP, (N,). Likewise limited: whether a limit is active; instructions; outcome (`ibvs_outcome`);
            difference_n: largest difference from the thrusts of Python [N].
        stack: Deepest stack [bytes].
        flash: Code and constants without the recorded ticks [bytes].
        ram: Instance and variables without the stack [bytes].
        allocates: Whether the linker found a use of malloc.
    """

    iterations: np.ndarray
    limited: np.ndarray
    instructions: np.ndarray
    outcome: np.ndarray
    difference_n: np.ndarray
    stack: int
    flash: int
    ram: int
    allocates: bool


def missing_tools() -> list[str]:
    """Tools that this machine has not."""
    return [tool for tool in TOOLS if shutil.which(tool) is None]


def replay(config: ControllerConfig, ticks: list[tuple[Measurement, Reference]], single: bool) -> Replay:
    """Cross build a library and replay ticks: a Cortex-M4F for floats, a Cortex-M7 for doubles."""
    with tempfile.TemporaryDirectory() as scratch:
        write_library(Path(scratch), config, single)
        write_recorded(Path(scratch), config, ticks, single)
        return _replay(Path(scratch))


def replay_flight(config: PilotConfig, ticks: Sequence[FlightTick], single: bool) -> Replay:
    """The same with estimation."""
    with tempfile.TemporaryDirectory() as scratch:
        write_library(Path(scratch), config.controller, single, config.estimation)
        write_flight(Path(scratch), config.controller, ticks, single)
        return _replay(Path(scratch))


def _replay(folder: Path) -> Replay:
    sizes = _make(folder, "all").stdout.splitlines()[-1].split()
    said = _make(folder, "replay").stderr.splitlines()
    (linked,) = (folder / "cortex_m" / "build").glob("example_*.map")
    rows = np.array([line.split() for line in said if line[:1].isdigit()], float).reshape(-1, 5)
    (stack,) = (int(line.split()[1]) for line in said if line.startswith("stack"))
    iterations, limited, instructions, outcome, nano = rows.T
    text, data, bss = map(int, sizes[:3])
    return Replay(
        iterations=iterations,
        limited=limited > 0,
        instructions=instructions,
        outcome=outcome,
        difference_n=1e-9 * nano,
        stack=stack,
        flash=text + data,
        ram=data + bss,
        allocates="malloc" in linked.read_text(),
    )


def _make(folder: Path, target: str) -> subprocess.CompletedProcess[str]:
    command = ["make", "-s", "-C", str(folder / "cortex_m"), target]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True)  # nosec B603


def milliseconds(instructions: float, clock_mhz: float) -> float:
    """Time at a clock."""
    return 1e-3 * instructions * CYCLES_PER_INSTRUCTION / clock_mhz


def figures(found: Replay) -> dict[str, Any]:
    """Figures of one target."""
    worst, median = float(found.instructions.max()), float(np.median(found.instructions))
    return {
        "ticks": len(found.instructions),
        "limited_ticks": int(found.limited.sum()),
        "iterations_most": int(found.iterations.max()),
        "instructions_median": median,
        "instructions_worst": worst,
        "difference_most_n": float(found.difference_n.max()),
        "flash_bytes": found.flash,
        "ram_bytes": found.ram,
        "stack_bytes": found.stack,
        "milliseconds": {
            clock: {"median": round(milliseconds(median, clock), 2), "worst": round(milliseconds(worst, clock), 2)}
            for clock in CLOCKS_MHZ
        },
    }


def main() -> None:
    """Replay and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=2500, help="recorded ticks (default 2500: 10 s)")
    if missing := missing_tools():
        parser.error(f"not on this machine: {', '.join(missing)}")
    ticks = recorded_ticks(parser.parse_args().ticks, 0)
    targets = {"cortex_m4f_float": True, "cortex_m7_double": False}
    flight = press_flight(PilotConfig(), len(ticks))
    found = {name: figures(replay(ControllerConfig(), ticks, single)) for name, single in targets.items()}
    found |= {
        f"{name}_estimation": figures(replay_flight(PilotConfig(), flight, single)) for name, single in targets.items()
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
