"""``ibvs-qp vehicle``: actuation of a vehicle, from a preset or from PX4's parameters."""

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
    from rich.console import Console

    from allocation.actuation import Actuation
    from ibvs_qp.config.vehicle import VehicleParams
    from ibvs_qp.pilot import PilotConfig
    from ibvs_qp.pilot.vehicle_check import VehicleCheck
    from sim.vehicles.vehicle_file import VehicleFile

#: Push of a job unless it is stated, and the largest that a scene takes [N].
DEFAULT_PUSH_N, LARGEST_PUSH_N = 5.0, 40.0
#: Tilts whose reach is shown [deg].
SHOWN_TILTS_DEG = (0.0, 2.0, 5.0)
#: Endings of pictures.
_PICTURES = (".png", ".pdf", ".svg")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Check a vehicle: control effectiveness, hover, reach, camera in contact; exit code 2 if it cannot paint.

    Example: ibvs-qp vehicle octorotor_qp --picture octorotor.png
    """

    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """Preset (TOML) or the name of a shipped one, a TOML file with [vehicle] alone, PX4 parameters, MJCF, or URDF."""
    push: float = DEFAULT_PUSH_N
    """Push of the job [N]."""
    px4: Annotated[Path | None, optional("FILE")] = None
    """Write PX4's parameters CA_ROTORn_* to this file."""
    toml: Annotated[Path | None, optional("FILE")] = None
    """Write the vehicle as a TOML file with [vehicle], missing keys as comments."""
    mjcf: Annotated[Path | None, optional("FILE")] = None
    """Write the vehicle as an MJCF file that MuJoCo's viewer opens."""
    picture: Annotated[Path | None, optional("FILE")] = None
    """Draw the vehicle and its picture in contact to this PNG, PDF or SVG file."""
    json: Annotated[bool, flag] = False
    """Print one JSON line on standard output, and nothing else."""

    def run(self, words: list[str]) -> int:
        """Analyse and print."""
        from ibvs_qp.config.errors import ConfigError
        from ibvs_qp.interfaces.px4.rotors import to_px4
        from ibvs_qp.pilot import PilotConfig
        from ibvs_qp.pilot.vehicle_check import VehicleCheck, check_vehicle, rotor_problems, vehicle_actuation
        from sim.report.rundir import as_json
        from sim.vehicles.configuration import with_vehicle

        if self.picture is not None and self.picture.suffix not in _PICTURES:
            raise out_of_range("--picture", str(self.picture), "", f"its name ends in {', '.join(_PICTURES)}")
        if not 0.0 < self.push <= LARGEST_PUSH_N:
            raise out_of_range("--push", self.push, "N", f"allowed is above 0 to {LARGEST_PUSH_N:g} N")
        given = read_vehicle(self.file)
        vehicle, found = given.vehicle, vehicle_actuation(given.vehicle)
        problems = rotor_problems(vehicle, found)
        config = given.preset or (None if found.missing else with_vehicle(PilotConfig(), vehicle))
        check = VehicleCheck(problems=tuple(problems), warnings=(), picture=None)
        if config is not None:
            check = check_vehicle(config, self.push, found)
        if self.px4 is not None:
            parameters = to_px4(vehicle.geometry, vehicle.thrust_max.tolist())
            thrust = ("the greatest thrust is the Tarot T960's",) if "thrust_max_n" in given.assumed else ()
            self.px4.write_text(_remarks((*given.notes, *thrust)) + parameters, encoding="utf-8")
        if self.toml is not None:
            self.toml.write_text(vehicle_toml(given), encoding="utf-8")
        if self.mjcf is not None:
            from sim.vehicles.mjcf_export import vehicle_mjcf

            self.mjcf.write_text(vehicle_mjcf(vehicle), encoding="utf-8")
        if self.picture is not None:
            _draw(vehicle, config, self.picture)
        if self.json:
            print(as_json(_summary(given, found, config, check)))
        else:
            _show(given, found, config)
            for file in filter(None, (self.px4, self.toml, self.mjcf, self.picture)):
                print(f"Written: {file}")
            for warning in check.warnings:
                print(f"Warning: {warning}.")
        if check.problems:
            unstated = f" (not stated, so the Tarot T960's: {', '.join(given.assumed)})" if given.assumed else ""
            raise ConfigError(f"{self.file}: {'; '.join(check.problems)}{unstated}")
        return 0


def read_vehicle(file: Path) -> VehicleFile:
    """Vehicle of a file or of a shipped preset."""
    from sim.vehicles.vehicle_file import read_vehicle as read

    chosen = preset_file(file, "FILE", other_formats=True)
    assert chosen is not None
    return read(chosen)


def _remarks(notes: tuple[str, ...]) -> str:
    """Assumptions as comments of a line each."""
    return "".join(f"# Assumed: {' '.join(note.split())}\n" for note in notes)


def vehicle_toml(given: VehicleFile) -> str:
    """A file with [vehicle]; keys that its source lacks, and other assumptions, are comments."""
    import tomli_w

    from ibvs_qp.config.settings import to_dict

    table = to_dict(given.vehicle)
    stated = {name: value for name, value in table.items() if name in given.stated}
    assumed = {name: value for name, value in table.items() if name not in given.stated and name != "geometry"}
    lines = [f"# {line}  # of the Tarot T960: not stated in {given.kind}" for line in _toml_lines(assumed)]
    geometry = stated.pop("geometry", None)
    rotors = ["", _remarks(given.notes) + tomli_w.dumps({"vehicle": {"geometry": geometry}})] if geometry else [""]
    return "\n".join(["[vehicle]", *_toml_lines(stated), *lines, *rotors])


def _toml_lines(table: dict[str, Any]) -> list[str]:
    import tomli_w

    return [" ".join(tomli_w.dumps({name: value}).split()) for name, value in table.items()]


def _draw(vehicle: VehicleParams, config: PilotConfig | None, file: Path) -> None:
    from sim.figures.vehicle import vehicle_figure

    vehicle_figure(vehicle, config).savefig(file)


def _summary(given: VehicleFile, found: Actuation, config: PilotConfig | None, check: VehicleCheck) -> dict[str, Any]:
    vehicle = given.vehicle
    return {
        "schema": 1,
        "kind": given.kind,
        "assumed": list(given.assumed),
        "notes": list(given.notes),
        "problems": list(check.problems),
        "warnings": list(check.warnings),
        "force_sensor": None if config is None else _force_sensor(config),
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
        "tilted_reach": _tilted_reach(vehicle, found),
        "tilt_without_deg": found.tilt_without.tolist(),
    }


def _show(given: VehicleFile, found: Actuation, config: PilotConfig | None) -> None:
    from rich.console import Console

    from allocation.actuation import DIRECTIONS, SLIDING_FRICTION
    from sim.evaluate.table import plain, terminal_table

    vehicle, mark = given.vehicle, " (assumed)" if "mass_kg" in given.assumed else ""
    console, geometry = Console(), vehicle.geometry
    names, numbers = [plain(name) for name in geometry.names], [str(index) for index in range(geometry.count)]
    ratios = [f"{ratio:+.3f}" for ratio in geometry.spins * geometry.torque_ratios]
    rows = zip(numbers, names, map(_vector, geometry.positions), map(_vector, geometry.axes), ratios, strict=True)
    title = f"{vehicle.mass_kg:.4g} kg{mark}, {geometry.count} rotors; front, right, down"
    console.print(
        terminal_table(("#", "rotor", "position, m", "thrust axis", "KM, m"), rows, title, text=("#", "rotor"))
    )
    limits = [f"{low:.1f} to {high:.1f}" for low, high in zip(vehicle.thrust_min, vehicle.thrust_max, strict=True)]
    hover = [f"{thrust:.1f}" for thrust in found.hover]
    rows = zip(numbers, limits, hover, map(_tilt, found.tilt_without), strict=True)
    mark = " (assumed)" if "thrust_max_n" in given.assumed else ""
    console.print(terminal_table(("#", f"thrust, N{mark}", "hover, N", "least tilt if lost"), rows))
    effectiveness = [
        (name, *(f"{entry + 0.0:+.3f}" for entry in row.round(6)))
        for name, row in zip(DIRECTIONS, found.effectiveness, strict=True)
    ]
    console.print(terminal_table(("per newton of #", *numbers), effectiveness, "Control effectiveness B"))
    _show_origin(console, given, config)
    if config is not None:
        text = _force_sensor(config)
        console.print(f"{text[0].upper()}{text[1:]}.", highlight=False)
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
    rows = [
        [f"{entry['tilt_deg']:g}", *("–" if push is None else f"{push:.1f}" for push in list(entry.values())[1:])]
        for entry in _tilted_reach(vehicle, found)
    ]
    console.print(terminal_table(("limits.trim_deg", "push standing, N", "push sliding, N"), rows, "Reach by tilt"))


def _tilted_reach(vehicle: VehicleParams, found: Actuation) -> list[dict[str, float | None]]:
    """Reach where roll and pitch may trim by some angles; empty for a vehicle without a level hover."""
    from ibvs_qp.pilot.vehicle_check import sliding_reach, standing_reach

    if found.sliding_push is None or not found.hovers:
        return []
    return [
        {
            "tilt_deg": tilt,
            "push_n": _finite(standing_reach(vehicle, tilt)),
            "sliding_push_n": _finite(sliding_reach(vehicle, found, tilt)),
        }
        for tilt in SHOWN_TILTS_DEG
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _show_origin(console: Console, given: VehicleFile, config: PilotConfig | None) -> None:
    """Settings that follow from the vehicle, and the missing keys of the file."""
    from sim.evaluate.table import plain, terminal_table
    from sim.vehicles.configuration import derived_settings

    if config is not None:
        console.print(terminal_table(("setting", "value", "from"), derived_settings(config), text=("setting", "from")))
    if given.assumed:
        console.print(f"Assumed, not stated in {given.kind}: {', '.join(given.assumed)}.")
    for note in given.notes:
        console.print(f"Assumed: {plain(note)}.")


def _force_sensor(config: PilotConfig) -> str:
    """Turns of the force sensor that the start-up check finds, and those that it cannot."""
    from ibvs_qp.validation.load_check import checkable_turns

    return checkable_turns(config.controller.vehicle, config.safety)


def _vector(values: np.ndarray) -> str:
    return " ".join(f"{value + 0.0:+.2f}" for value in values)


def _tilt(tilt: float) -> str:
    return f"{tilt:.0f} deg, yaw free" if math.isfinite(tilt) else "no hover"
