"""Built C libraries, one per configuration and precision."""

from __future__ import annotations

import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest
from c_binding import CController
from c_flight import CFlight, recorded_flight
from recorded_inputs import recording

from ibvs_qp.config import ControllerConfig, EstimationConfig
from ibvs_qp.controller import HybridController, qp_problem
from ibvs_qp.interfaces.c_library.library import write_library
from ibvs_qp.interfaces.c_library.recorded import write_flight, write_recorded
from ibvs_qp.pilot import PilotConfig

#: Compiles in a third of the time of -O2.
FLAGS = "CFLAGS=-O1 -Werror"
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
needs_compiler = pytest.mark.skipif(
    not COMPILERS or not shutil.which("make"), reason="neither gcc nor clang, or no make"
)
_folders = tempfile.TemporaryDirectory(prefix="ibvs_qp_c")


@functools.cache
def written(
    config: ControllerConfig, single: bool, flight: str = "", estimation: EstimationConfig | None = None
) -> Path:
    """Folder with the library's sources; with the recorded flight of its tests where one is given."""
    folder = Path(tempfile.mkdtemp(dir=_folders.name))
    write_library(folder, config, single, estimation)
    if flight:
        ticks = recording(flight)
        write_recorded(folder, config, list(zip(ticks.measurements, ticks.references, strict=True)), single)
        if estimation is not None:
            write_flight(folder, config, [flown.tick for flown in recorded_flight(flight)], single)
    return folder


@functools.cache
def built(config: ControllerConfig, single: bool = False, estimation: EstimationConfig | None = None) -> Path:
    """Shared library; warnings are errors."""
    folder = written(config, single, "", estimation)
    make(folder, "build/libibvs_qp.so", FLAGS)
    return folder / "build" / "libibvs_qp.so"


def make(folder: Path, *words: str) -> str:
    """Output of a make."""
    done = subprocess.run(["make", "-s", *words], cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def instance(config: ControllerConfig, single: bool = False) -> CController:
    """A new instance of the library."""
    return CController(built(config, single), config, len(qp_problem(config).row_names), single)


def flight_instance(config: PilotConfig, single: bool = False) -> CFlight:
    """A new flight of the library with estimation."""
    controller = config.controller
    library = built(controller, single, config.estimation)
    return CFlight(library, controller, len(qp_problem(controller).row_names), single)


def pair(config: ControllerConfig, single: bool = False) -> tuple[HybridController, CController]:
    """The Python controller and the library's."""
    return HybridController(config), instance(config, single)
