"""Figures of a run, drawn from its traces."""

from __future__ import annotations

from pathlib import Path

from sim.figures.board import draw_board, draw_overview, draw_path
from sim.figures.style import save, styled
from sim.figures.time_series import (
    draw_attitude,
    draw_force,
    draw_image_error,
    draw_limits,
    draw_thrusts,
    draw_velocity,
)
from sim.flight.trace import Trace

#: Every figure of a run: file name, caption, function.
FIGURES = {
    "overview": ("Overview: camera view, painted board, push force", draw_overview),
    "force": ("Push force: reference, measured and true", draw_force),
    "image_error": ("Image error of the guiding edges at the brush tip", draw_image_error),
    "path": ("Path of the brush tip and its distance to the nominal polyline", draw_path),
    "velocity": ("Velocity in the body frame, estimated and true", draw_velocity),
    "attitude": ("True attitude; yaw 0 faces the wall", draw_attitude),
    "thrusts": ("Commanded rotor thrusts and their limits", draw_thrusts),
    "limits": ("Active limits over time; right: fraction of the flight in which each limit was active", draw_limits),
    "board": ("Painted board; dashed: intended band", draw_board),
}

__all__ = ["FIGURES", "draw_all", "draw_board", "draw_force", "draw_image_error", "draw_path"]


def draw_all(traces: dict[str, Trace], folder: Path) -> dict[str, tuple[str, Path]]:
    """Draw every figure into a folder.

    Args:
        traces: One flight per law, of at least one tick.
        folder: For the PNG files.

    Returns:
        Caption and file of every figure, by name.
    """
    drawn = {}
    with styled():
        for name, (caption, draw) in FIGURES.items():
            drawn[name] = (caption, save(draw(traces), folder / f"{name}.png"))
    return drawn
