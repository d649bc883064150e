"""A vehicle from a file: a preset or [vehicle] in TOML, PX4's parameters, MJCF or URDF, with the stated keys."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import LARGEST_TOML, parse_toml, read_bytes
from ibvs_qp.config.settings import from_dict
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.px4.rotors import DEFAULTS, read_px4
from ibvs_qp.pilot import PilotConfig
from sim.vehicles.model_file import read_model

#: Endings of PX4's parameters without a CA_ROTOR_COUNT.
_PX4_ENDINGS = (".params", ".txt")
_PX4 = re.compile(rb"^[^#\n]*\bCA_ROTOR(?:_COUNT|\d+_P[XYZ])\b", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class VehicleFile:
    """A vehicle and where it comes from.

    Attributes:
        vehicle: The vehicle; missing keys are those of the Tarot T960.
        kind: Type of the file, for messages.
        stated: Fields of `VehicleParams` that the file states.
        notes: Further assumptions.
        preset: The whole configuration of a preset, None for a file with a vehicle alone.
    """

    vehicle: VehicleParams
    kind: str
    stated: frozenset[str]
    notes: tuple[str, ...] = ()
    preset: PilotConfig | None = None

    @property
    def assumed(self) -> tuple[str, ...]:
        """Fields that the file does not state."""
        return tuple(field.name for field in dataclasses.fields(VehicleParams) if field.name not in self.stated)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Assumptions of a flight in addition to the file, in words; keys missing in TOML are the Tarot's."""
        if self.kind == "TOML":
            return ()
        return (f"{self.kind} without {', '.join(self.assumed)}: those of the Tarot T960", *self.notes)


def read_vehicle(file: Path) -> VehicleFile:
    """Read a vehicle; the type of a file is found by its content.

    Args:
        file: An existing file.

    Raises:
        ConfigError: When it cannot be read, or is refused.
    """
    content = read_bytes(file, LARGEST_TOML)
    if content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        model = read_model(file)
        return VehicleFile(vehicle=model.vehicle, kind=model.kind, stated=model.stated, notes=model.notes)
    if file.suffix in _PX4_ENDINGS or _PX4.search(content):
        return _from_px4(file)
    return _from_toml(file, content)


def _from_px4(file: Path) -> VehicleFile:
    rotors, stated = read_px4(file), {"geometry"}
    vehicle = VehicleParams(geometry=rotors.geometry)
    if any(thrust != DEFAULTS["CT"] for thrust in rotors.thrust_coefficients):
        try:
            vehicle = dataclasses.replace(vehicle, thrust_max_n=rotors.thrust_coefficients)
        except ConfigError as error:
            raise ConfigError(f"{file}: CA_ROTORn_CT: {error}") from None
        stated.add("thrust_max_n")
    return VehicleFile(vehicle=vehicle, kind="PX4 parameters", stated=frozenset(stated))


def _from_toml(file: Path, content: bytes) -> VehicleFile:
    table = parse_toml(content, file)
    own, preset = table.get("vehicle") if set(table) == {"vehicle"} else None, None
    try:
        if isinstance(own, dict):
            vehicle = from_dict(VehicleParams, own, "vehicle")
        else:
            preset = PilotConfig.from_toml(file)
            vehicle = preset.controller.vehicle
            controller = table.get("controller")
            own = controller.get("vehicle", {}) if isinstance(controller, dict) else {}
    except ConfigError as error:
        words = str(error)
        raise ConfigError(words if words.startswith(str(file)) else f"{file}: {words}") from None
    return VehicleFile(vehicle=vehicle, kind="TOML", stated=frozenset(own), preset=preset)
