"""The list of guards: what to remove from which file, and which tests must then fail."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_name("guards.toml")


@dataclass(frozen=True, kw_only=True)
class Guard:
    """One entry of the list.

    Attributes:
        part: Part of the system.
        name: Unique within its part.
        file: File with the guard, from the root.
        original: The source text, once in the file.
        mutant: What replaces it: the same without the guard.
        tests: Files or single tests of pytest, from the root.
        prevents: What would happen without the guard.
    """

    part: str
    name: str
    file: str
    original: str
    mutant: str
    tests: tuple[str, ...]
    prevents: str

    @property
    def title(self) -> str:
        """Part and name."""
        return f"{self.part}: {self.name}"

    def mutated(self, text: str) -> str:
        """The text of the file without the guard.

        Raises:
            ValueError: When the original is not there exactly once.
        """
        if (count := text.count(self.original)) != 1:
            raise ValueError(f"{self.title}: found {count} times in {self.file}, not once")
        return text.replace(self.original, self.mutant)


def read_guards(pattern: str = "") -> list[Guard]:
    """Guards whose title contains a text, in the order of the list."""
    table = tomllib.loads(LIST.read_text(encoding="utf-8"))
    entries = [(part, entry) for part, guards in table.items() for entry in guards]
    guards = [Guard(part=part, **{**entry, "tests": tuple(entry["tests"])}) for part, entry in entries]
    return [guard for guard in guards if pattern in guard.title]
