"""Scenes that presets, tuning, notebooks and tests share, and changes of them."""

from __future__ import annotations

import dataclasses
from typing import Any

from sim.world.scene import Scene

#: Start of flights in which the approach is not the subject: tip to board [m].
NEAR_START_M = 0.15


def changed(scene: Scene, **sections: dict[str, Any]) -> Scene:
    """The scene with other values, e.g. ``changed(scene, wall={"friction": 0.8})``."""
    new = {name: dataclasses.replace(getattr(scene, name), **values) for name, values in sections.items()}
    return dataclasses.replace(scene, **new)


def near_wall(**sections: dict[str, Any]) -> Scene:
    """The default scene, started near the wall."""
    return changed(changed(Scene(), start={"distance_m": NEAR_START_M}), **sections)


def short_job(stroke_m: float, rows: int = 2, **sections: dict[str, Any]) -> Scene:
    """The paint job with shorter strokes on a board that fits them, started near the wall."""
    scene = near_wall(paint={"stroke_m": stroke_m, "rows": rows})
    width = stroke_m + 2.0 * scene.paint.edge_margin_m
    return changed(changed(scene, board={"width_m": width}), **sections)
