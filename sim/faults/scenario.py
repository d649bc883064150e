"""The fault matrix as data: rows of ``scenarios/*.toml``, each a fault, its place, and the expectation."""

from __future__ import annotations

import dataclasses
import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ibvs_qp.command import SafetyState
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import Checked, choice, from_dict, setting
from sim.faults.fault import Fault
from sim.faults.kinds import KINDS
from sim.faults.rotors import RotorFault

SCENARIOS = Path(__file__).with_name("scenarios")
#: When a fault strikes: in contact in the middle of the stroke, free on the way to the wall (event, delay [s]).
PLACES = {"contact": ("touch", 3.0), "free": ("approach", 0.5)}
#: The flight goes on at least this long after a fault [s]: retreat, hover and a descent from 1.5 m at 0.15 m/s fit in.
WATCH_S = 20.0
#: Name of a rotor that stands for another one in every flight: number (seed modulo rotors) in the table of rotors.
EACH = "each"
_STATES = tuple(str(state) for state in SafetyState)


@dataclass(frozen=True, kw_only=True)
class Expected(Checked):
    """Expectation at one place."""

    reach: str = choice("nominal", "this state or a more severe one must be reached", _STATES)
    within_s: float = setting(0.3, "latest, after the fault can be observed", unit="s", low=0.0, high=60.0)
    at_most: str = choice("terminated", "no state may be more severe", _STATES)
    completes: bool = setting(False, "the job must be completed")
    control_fails: bool = setting(True, "the same flight without the supervisor must break a criterion")
    after: str = setting("", "event that starts the delay; empty as for every row")
    delay_s: float | None = setting(None, "time from then to the fault; as for every row", unit="s", low=0.0, high=60.0)


@dataclass(frozen=True, kw_only=True)
class Scenario(Checked):
    """One row of the matrix."""

    name: str
    about: str = ""  # purpose of the row, if its name does not show it
    faults: tuple[Fault, ...] = ()  # the faults, at the same time
    observable_s: float = setting(0.0, "time after which the fault can be observed", unit="s", low=0.0, high=60.0)
    when_it_deviates: bool = setting(False, "it can be observed only once a rotor differs from its command, after that")
    contact: Expected | None = None  # in contact; None is not flown
    free: Expected | None = None  # on the way to the wall
    rotor_lost: bool = setting(False, "a rotor is lost: the bound on the tilt does not apply")
    beyond: str = ""  # why no law could save the vehicle; only the commands and the reports are scored then

    @property
    def places(self) -> dict[str, Expected]:
        """Expectations by place."""
        given = {"contact": self.contact, "free": self.free}
        return {place: expected for place, expected in given.items() if expected is not None}

    def flown(self, place: str, seed: int, rotors: tuple[str, ...]) -> tuple[Fault, ...]:
        """The faults of one flight.

        Args:
            place: Key of `PLACES`.
            seed: Seed of the flight; chooses the rotor where each one has its turn.
            rotors: Names of the rotors.
        """
        after, delay_s = PLACES[place]
        expected = self.places[place]
        after, delay_s = expected.after or after, delay_s if expected.delay_s is None else expected.delay_s
        timed = (dataclasses.replace(fault, after=after, delay_s=delay_s, watch_s=WATCH_S) for fault in self.faults)
        turn = rotors[seed % len(rotors)]
        return tuple(
            dataclasses.replace(fault, rotor=turn) if isinstance(fault, RotorFault) and fault.rotor == EACH else fault
            for fault in timed
        )


@functools.cache
def scenarios() -> tuple[Scenario, ...]:
    """Every row, file by file.

    Raises:
        ConfigError: When a file is refused, or two rows have one name.
    """
    rows = [row for file in sorted(SCENARIOS.glob("*.toml")) for row in _rows(file)]
    names = [row.name for row in rows]
    if double := {name for name in names if names.count(name) > 1}:
        raise ConfigError(f"rows with the same name: {', '.join(sorted(double))}")
    return tuple(rows)


def _rows(file: Path) -> list[Scenario]:
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    try:
        return [scenario(row) for row in table["row"]]
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}") from None


def scenario(row: dict[str, Any]) -> Scenario:
    """A row from its table.

    Raises:
        ConfigError: On an unknown key or kind of fault, or a refused value.
    """
    values = dict(row)
    faults = tuple(_fault(values.get("name", "row"), dict(fault)) for fault in values.pop("faults", ()))
    return dataclasses.replace(from_dict(Scenario, values, "row"), faults=faults)


def _fault(row: str, values: dict[str, Any]) -> Fault:
    kind = values.pop("kind", None)
    if kind not in KINDS:
        raise ConfigError(f"{row}: unknown kind of fault {kind!r}; known kinds: {', '.join(KINDS)}")
    return from_dict(KINDS[kind], values, f"{row}: {kind}")
