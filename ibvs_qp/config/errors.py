"""Errors of configuration and use: field, value and allowed range."""

from __future__ import annotations

#: Longest value that a message repeats [characters]: two lines of a terminal.
LONGEST_VALUE = 160


class IbvsQpError(Exception):
    """Base of every error raised on purpose by this project."""


class ConfigError(IbvsQpError):
    """A configuration value is refused at construction."""


def shown(value: object) -> str:
    """A value as messages show it: its repr, cut when it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints, or a structure too deep
        return f"({type(value).__name__} without a short form)"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."


def out_of_range(field: str, value: object, unit: str, allowed: str) -> ConfigError:
    """Build the one wording for a refused value: field, value, unit and allowed range."""
    amount = f"{shown(value)} {unit}".rstrip()
    return ConfigError(f"{field} = {amount} is refused: {allowed}")
