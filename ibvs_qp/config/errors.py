"""Errors of configuration and use: field, value and allowed range."""

from __future__ import annotations


class IbvsQpError(Exception):
    """Base of every error raised on purpose by this project."""


class ConfigError(IbvsQpError):
    """A configuration value is refused at construction."""


def out_of_range(field: str, value: object, unit: str, allowed: str) -> ConfigError:
    """Build the one wording for a refused value: field, value, unit and allowed range."""
    shown = f"{value!r} {unit}".rstrip()
    return ConfigError(f"{field} = {shown} is refused: {allowed}")
