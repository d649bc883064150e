"""Replayed outputs against the reference outputs: ``python -m tests.replay.compare [--exact] [CASE ...]``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .cases import CASES, DATA
from .replayer import replay
from .tables import Table
from .tolerances import MAY_DIFFER, TOLERANCES, Tolerance, tolerances_of

EXACT = {name: Tolerance() for name in TOLERANCES}


@dataclass(frozen=True, kw_only=True)
class Difference:
    """How one quantity differs.

    Attributes:
        quantity: Name of the array, e.g. "pilot.thrusts".
        largest: Largest difference, in the quantity's unit; for texts and whole numbers how many entries differ.
        at_tick: Where.
        first_over: First tick at which the tolerance is exceeded, or None.
        text: Shape or texts that differ.
    """

    quantity: str
    largest: float
    at_tick: int
    first_over: int | None
    text: str = ""


def reference_outputs(name: str) -> Table:
    """The stored outputs of a case."""
    with np.load(DATA / f"{name}.outputs.npz") as archive:
        return dict(archive)


def compare(reference: Table, replayed: Table, tolerances: Mapping[str, Tolerance] = TOLERANCES) -> list[Difference]:
    """One entry per quantity, also for those that are equal."""
    return [
        _difference(quantity, reference, replayed, tolerances) for quantity in dict.fromkeys((*reference, *replayed))
    ]


def _difference(quantity: str, reference: Table, replayed: Table, tolerances: Mapping[str, Tolerance]) -> Difference:
    if quantity not in reference or quantity not in replayed:
        where = "replay" if quantity not in replayed else "reference"
        return Difference(quantity=quantity, largest=np.inf, at_tick=0, first_over=0, text=f"not in the {where}")
    old, new = reference[quantity], replayed[quantity]
    if old.shape != new.shape:
        text = f"shape {new.shape} instead of {old.shape}"
        return Difference(quantity=quantity, largest=np.inf, at_tick=0, first_over=0, text=text)
    route, name = quantity.split(".")
    ticks = _ticks(reference, route, name, len(old))
    if old.dtype.kind != "f":
        return _of_entries(quantity, old, new, ticks, MAY_DIFFER.get(name, 0))
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        off = np.abs(new - old)
    off[(new == old) | (np.isnan(new) & np.isnan(old))] = 0.0
    off[np.isnan(off)] = np.inf
    tolerance = tolerances[name]
    allowed = np.where(_limited(reference, route)[ticks], _limited_bound(tolerance), tolerance.free)
    finite = np.where(np.isfinite(old), np.abs(old), 0.0)
    over = off > allowed.reshape(-1, *[1] * (old.ndim - 1)) + tolerance.relative * finite
    rows, beyond = off.reshape(len(off), -1).max(axis=1, initial=0.0), over.reshape(len(off), -1).any(axis=1)
    largest = float(rows.max(initial=0.0))
    return Difference(
        quantity=quantity,
        largest=largest,
        at_tick=int(ticks[rows.argmax()]) if len(rows) else 0,
        first_over=int(ticks[beyond.argmax()]) if beyond.any() else None,
    )


def _of_entries(quantity: str, old: np.ndarray, new: np.ndarray, ticks: np.ndarray, may: int) -> Difference:
    other = np.flatnonzero(old != new)
    if not len(other):
        return Difference(quantity=quantity, largest=0.0, at_tick=0, first_over=None)
    first, at = other[0], int(ticks[other[0]])
    return Difference(
        quantity=quantity,
        largest=float(len(other)),
        at_tick=at,
        first_over=at if len(other) > may else None,
        text=f"{str(new[first])!r} instead of {str(old[first])!r}",
    )


def _ticks(table: Table, route: str, name: str, length: int) -> np.ndarray:
    """The tick of every entry."""
    if name in ("P", "q", "A", "l", "u"):
        return table[f"{route}.program_tick"]
    if name.startswith("percept_line_"):
        return table[f"{route}.percept_tick"][table[f"{route}.percept_line_tick"]]
    return table[f"{route}.percept_tick"] if name.startswith("percept_") else np.arange(length)


def _limited(table: Table, route: str) -> np.ndarray:
    """Ticks at which a limit was active, and the tick after each, whose program holds the thrusts before."""
    limited = table[f"{route}.active_limits"] != ""
    return limited | np.roll(limited, 1)


def _limited_bound(tolerance: Tolerance) -> float:
    return tolerance.free if tolerance.limited is None else tolerance.limited


def report(differences: list[Difference]) -> str:
    """A table of what differs, for reading."""
    lines = [f"{'quantity':<40} {'largest':>10} {'at tick':>8} {'first over':>10}"]
    for entry in differences:
        first = "-" if entry.first_over is None else str(entry.first_over)
        lines.append(
            f"{entry.quantity:<40} {entry.largest:>10.3g} {entry.at_tick:>8} {first:>10}  {entry.text}".rstrip()
        )
    return "\n".join(lines)


def main() -> int:
    """Command line; 1 where a tolerance is exceeded."""
    parser = argparse.ArgumentParser(description="Replay recorded flights and compare with the reference outputs.")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)}; all if none is given")
    parser.add_argument("--exact", action="store_true", help="to the bit, without tolerances")
    parser.add_argument("--all", action="store_true", help="list what is equal, too")
    arguments, failed = parser.parse_args(), False
    for name in arguments.cases or CASES:
        differences = compare(reference_outputs(name), replay(name), EXACT if arguments.exact else tolerances_of(name))
        failed = failed or any(entry.first_over is not None for entry in differences)
        shown = [entry for entry in differences if arguments.all or entry.largest > 0.0]
        print(f"{name}: {report(shown)}\n" if shown else f"{name}: equal to the bit")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
