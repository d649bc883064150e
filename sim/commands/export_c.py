"""``ibvs-qp export-c``: the controller as a self-contained C library."""

from __future__ import annotations

import dataclasses
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from sim.commands.options import flag, optional, preset_file

if TYPE_CHECKING:
    from ibvs_qp.pilot import PilotConfig

#: Recorded ticks in the library's self-test: as many as reach into the push.
RECORDED_TICKS = 2500


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExportC:
    """Write the controller as a C11 library: generated equations, OSQP without malloc, self-test and benchmark.

    Example: ibvs-qp export-c controller --float && make -C controller test
    """

    folder: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")]
    """New or empty folder."""
    preset: Annotated[Path | None, optional("FILE")] = None
    """Preset (TOML) or the name of a shipped one; vehicle, limits and weights are compiled in."""
    vehicle: Annotated[Path | None, optional("FILE")] = None
    """Vehicle in place of the preset's: as of ``ibvs-qp vehicle``."""
    float: Annotated[bool, flag] = False
    """Single precision, for a microcontroller without a double-precision unit."""
    estimation: Annotated[bool, flag] = False
    """Estimation as well: sensors and features of pictures in, estimates and thrusts out."""

    def run(self, words: list[str]) -> int:
        """Write the library."""
        from rich.console import Console

        from ibvs_qp.config.errors import ConfigError
        from ibvs_qp.pilot import PilotConfig
        from sim.flight.working import working
        from sim.vehicles.configuration import with_vehicle
        from sim.vehicles.vehicle_file import read_vehicle

        if self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise ConfigError(f"DIR: {self.folder} exists and is not an empty folder")
        chosen = preset_file(self.preset, "--preset")
        settings = PilotConfig() if chosen is None else PilotConfig.from_toml(chosen)
        if (file := preset_file(self.vehicle, "--vehicle", other_formats=True)) is not None:
            settings = with_vehicle(settings, read_vehicle(file).vehicle)
        if settings.law != "qp":
            raise ConfigError(f"law: {settings.law!r}; the library has only the quadratic program: 'qp'")
        with working(Console(stderr=True), "Writing the library ..."):
            write_tested_library(self.folder, settings, self.float, self.estimation)
        print(f"Written: {self.folder}")
        print(f"Build and test it: {shlex.join(['make', '-C', str(self.folder), 'test'])}")
        return 0


def write_tested_library(folder: Path, settings: PilotConfig, single: bool, estimation: bool) -> None:
    """Write the library of a pilot's law with the recorded ticks of its self-test."""
    from ibvs_qp.estimation.turned_camera import TurnedCamera
    from ibvs_qp.interfaces.c_library.library import write_library
    from ibvs_qp.interfaces.c_library.recorded import write_flight, write_recorded
    from sim.bench.ticks import press_flight

    controller, flight = settings.controller, press_flight(settings, RECORDED_TICKS)
    write_library(folder, controller, single, settings.estimation if estimation else None)
    # The pilot's measurements are in C, those of a controller in the axes of its camera.
    camera = TurnedCamera([-angle for angle in controller.vehicle.camera_turn_deg])
    ticks = [(camera.measurement(tick.measurement, []), tick.reference) for tick in flight]
    write_recorded(folder, controller, ticks, single)
    if estimation:
        write_flight(folder, controller, flight, single)
