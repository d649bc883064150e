"""``ibvs-qp vehicle``: what the rotors of a vehicle can do, from a preset or from PX4's parameters."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro

from ibvs_qp.config.errors import out_of_range
from sim.commands.options import flag, optional, preset_file

if TYPE_CHECKING:
    from allocation.actuation import Actuation
    from ibvs_qp.config.vehicle import VehicleParams

#: Endings of pictures.
_PICTURES = (".png", ".pdf", ".svg")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Check a vehicle: control effectiveness, hover, reach, and what is not fully actuated.

    Example: ibvs-qp vehicle octorotor_qp --picture octorotor.png
    """

    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """Preset (TOML) or the name of a shipped one, a TOML file with [vehicle] alone, or PX4 parameters (.params)."""
    px4: Annotated[Path | None, optional("FILE")] = None
    """Write PX4's parameters CA_ROTORn_* to this file."""
    picture: Annotated[Path | None, optional("FILE")] = None
    """Draw the vehicle to this PNG, PDF or SVG file."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Analyse and print."""
        from allocation.actuation import actuation
        from ibvs_qp.adapters.px4_rotors import to_px4
        from ibvs_qp.frames import GRAVITY
        from sim.report.rundir import as_json

        if self.picture is not None and self.picture.suffix not in _PICTURES:
            raise out_of_range("--picture", str(self.picture), "", f"its name ends in {', '.join(_PICTURES)}")
        vehicle = read_vehicle(self.file)
        tip, limits = np.array(vehicle.tip_position_m), (vehicle.thrust_min, vehicle.thrust_max)
        found = actuation(vehicle.geometry, vehicle.mass_kg * GRAVITY, tip, *limits)
        if self.px4 is not None:
            self.px4.write_text(to_px4(vehicle.geometry, vehicle.thrust_max.tolist()), encoding="utf-8")
        if self.picture is not None:
            _draw(vehicle, self.picture)
        if self.json:
            print(as_json(_summary(vehicle, found)))
        else:
            _show(vehicle, found)
            for file in filter(None, (self.px4, self.picture)):
                print(f"Written: {file}")
        return 0


def read_vehicle(file: Path) -> VehicleParams:
    """Vehicle of a preset, of a file with [vehicle], or of PX4's parameters, whose rest is that of the Tarot T960."""
    from ibvs_qp.adapters.px4_rotors import read_px4
    from ibvs_qp.config.errors import ConfigError
    from ibvs_qp.config.settings import from_dict
    from ibvs_qp.config.toml_text import read_toml
    from ibvs_qp.config.vehicle import VehicleParams
    from ibvs_qp.pilot import PilotConfig

    if file.suffix in (".params", ".txt"):
        return VehicleParams(geometry=read_px4(file).geometry)
    chosen = preset_file(file, "FILE")
    assert chosen is not None
    table = read_toml(chosen)
    if set(table) != {"vehicle"} or not isinstance(table["vehicle"], dict):
        return PilotConfig.from_toml(chosen).controller.vehicle
    try:
        return from_dict(VehicleParams, table["vehicle"], "vehicle")
    except ConfigError as error:
        raise ConfigError(f"{chosen}: {error}") from None


def _draw(vehicle: VehicleParams, file: Path) -> None:
    from sim.figures.vehicle import vehicle_figure

    vehicle_figure(vehicle).savefig(file)


def _summary(vehicle: VehicleParams, found: Actuation) -> dict[str, Any]:
    return {
        "schema": 1,
        "rotors": list(vehicle.geometry.names),
        "effectiveness": found.effectiveness.tolist(),
        "singular_values": found.singular_values.tolist(),
        "condition": found.condition,
        "missing": list(found.missing),
        "hover_n": found.hover.tolist(),
        "hovers": found.hovers,
        "level_reach_n": found.level_reach,
        "push_n": None if found.push is None else found.push.push,
        "sliding_push_n": None if found.sliding_push is None else found.sliding_push.push,
        "tilt_without_deg": found.tilt_without.tolist(),
    }


def _show(vehicle: VehicleParams, found: Actuation) -> None:
    from rich.console import Console

    from allocation.actuation import DIRECTIONS, SLIDING_FRICTION
    from sim.evaluate.table import plain, terminal_table

    console, geometry = Console(), vehicle.geometry
    names, numbers = [plain(name) for name in geometry.names], [str(index) for index in range(geometry.count)]
    ratios = [f"{ratio:+.3f}" for ratio in geometry.spins * geometry.torque_ratios]
    rows = zip(numbers, names, map(_vector, geometry.positions), map(_vector, geometry.axes), ratios, strict=True)
    title = f"{vehicle.mass_kg:g} kg, {geometry.count} rotors; front, right, down"
    console.print(
        terminal_table(("#", "rotor", "position, m", "thrust axis", "KM, m"), rows, title, text=("#", "rotor"))
    )
    limits = [f"{low:.1f} to {high:.1f}" for low, high in zip(vehicle.thrust_min, vehicle.thrust_max, strict=True)]
    hover = [f"{thrust:.1f}" for thrust in found.hover]
    rows = zip(numbers, limits, hover, map(_tilt, found.tilt_without), strict=True)
    console.print(terminal_table(("#", "thrust, N", "hover, N", "least tilt if lost"), rows))
    effectiveness = [
        (name, *(f"{entry + 0.0:+.3f}" for entry in row.round(6)))
        for name, row in zip(DIRECTIONS, found.effectiveness, strict=True)
    ]
    console.print(terminal_table(("per newton of #", *numbers), effectiveness, "Control effectiveness B"))
    if found.missing:
        console.print("[bold]Not fully actuated.[/] The rotors cannot give:")
        for direction in found.missing:
            console.print(f"  {direction}")
        console.print("The controller needs all six directions: it holds the vehicle level and moves it by forces.")
        return
    console.print(f"Fully actuated; condition {found.condition:.1f} (moments divided by the mean lever).")
    if not found.hovers:
        console.print("[bold]No level hover[/] within the thrust limits.")
        return
    azimuth = math.degrees(found.level_reach_azimuth)
    console.print(
        f"Level flight: at least {found.level_reach:.1f} N in every horizontal direction (worst {azimuth:+.0f} deg)."
    )
    assert found.push is not None and found.sliding_push is not None
    binding = " and ".join(f"rotor {index} at its {side} limit" for index, side in found.push.binding)
    console.print(f"Push at the tip: {found.push.push:.1f} N standing ({binding});")
    console.print(f"  {found.sliding_push.push:.1f} N sliding anywhere with a friction of {SLIDING_FRICTION:g}.")


def _vector(values: np.ndarray) -> str:
    return " ".join(f"{value + 0.0:+.2f}" for value in values)


def _tilt(tilt: float) -> str:
    return f"{tilt:.0f} deg, yaw free" if math.isfinite(tilt) else "no hover"
