"""Walls in a balanced design: every level of every factor occurs, and the same number gives the same walls."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from ibvs_qp.pilot.painting.pattern import COLUMNS, CORNERS, PATTERNS, ROWS
from sim.experiments.scenes import changed
from sim.scenes import FILES
from sim.world.random_streams import stream
from sim.world.scene import PaintScene, Scene, load_scene

#: Numbers of strokes.
STROKES = (5, 10, 20)
#: Distracting objects on and around the board: none, as on the default board, as in the scene low_contrast.
CLUTTER = (0, 4, 10)
#: Width and height of the boards [m]; a board is never smaller than its strokes need.
WIDTH_M, HEIGHT_M = (1.4, 3.0), (0.6, 1.7)


def walls(seed: int, count: int, strokes: Sequence[int] = STROKES, patterns: Sequence[str] = PATTERNS) -> list[Scene]:
    """Scenes with a Latin hypercube over the board's size, and every level of the other factors equally often.

    The factors: number of strokes with pattern, corner of stroke 1, colours (those of the shipped scenes), clutter;
    textures are those of the scene's number.

    Args:
        seed: Of the design.
        count: Number of scenes.
        strokes: Levels of the number of strokes.
        patterns: Levels of the pattern.
    """

    def dealt(name: str, levels: Sequence[Any]) -> list[Any]:
        return [levels[place % len(levels)] for place in stream(seed, f"wall {name}").permutation(count)]

    def spread(name: str) -> list[float]:
        source = stream(seed, f"wall {name}")
        return ((source.permutation(count) + source.random(count)) / count).tolist()

    factors = zip(
        dealt("strokes", list(itertools.product(strokes, patterns))),
        dealt("start", CORNERS),
        dealt("look", list(FILES)),
        dealt("clutter", CLUTTER),
        spread("width"),
        spread("height"),
        range(count),
        strict=True,
    )
    return [_wall(*factor) for factor in factors]


def _wall(
    job: tuple[int, str], start: str, look_name: str, clutter: int, width: float, height: float, number: int
) -> Scene:
    strokes, pattern = job
    margin, pitch = PaintScene().edge_margin_m, PaintScene().pitch_m
    needed = 2.0 * margin + (strokes - 1) * pitch
    size = [
        low + part * (high - low)
        for part, low, high in (
            (width, max(WIDTH_M[0], needed if pattern == COLUMNS else 0.0), WIDTH_M[1]),
            (height, max(HEIGHT_M[0], needed if pattern == ROWS else 0.0), HEIGHT_M[1]),
        )
    ]
    look, texture = load_scene(FILES[look_name]), {"texture_seed": number}
    return changed(
        Scene(),
        board={"width_m": size[0], "height_m": size[1], "color": look.board.color, "clutter": clutter, **texture},
        wall={"color": look.wall.color, **texture},
        paint={
            "color": look.paint.color,
            "pattern": pattern,
            "start": start,
            "rows": strokes,
            "stroke_m": size[PATTERNS.index(pattern)] - 2.0 * margin,
        },
    )
