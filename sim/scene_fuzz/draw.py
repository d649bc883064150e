"""A scene with two to four keys moved from their defaults, each anywhere in its documented range."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ibvs_qp.config.settings import from_dict
from sim.world.board import BoardGeometry
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Sections of a scene that are drawn: job, board and sensors; `plant` and `errors` are other studies.
SECTIONS = ("board", "wall", "paint", "start", "camera", "force_torque", "imu", "features", "wind")
#: Keys moved in one scene, fewest and most.
FEWEST, MOST = 2, 4
#: Keys that only change the appearance of a flight, one seed to another.
_SEEDS = ("texture_seed",)
#: Keys that the sensor model of lines ignores.
_PICTURES = ("board.color", "wall.color", "paint.color", "board.clutter", "camera.depth_noise_relative")
#: Shortest stroke of a scene [m].
_SHORTEST_M = 0.1
#: A range whose ends differ by more than this factor is drawn on a logarithmic scale.
_DECADES = 20.0


def scene_keys(features: str) -> list[str]:
    """Dotted paths of all keys that change a flight with "rendered" or "geometric" features."""
    scene, left_out = Scene(), () if features == "rendered" else _PICTURES
    paths = [
        f"{section}.{field.name}"
        for section in SECTIONS
        for field in dataclasses.fields(getattr(scene, section))
        if field.name not in _SEEDS
    ]
    return [path for path in paths if path not in left_out]


def drawn_scene(seed: int, features: str, longest_s: float) -> tuple[Scene, dict[str, Any]]:
    """The scene of a seed, and the keys that it moves; strokes that are not drawn are as long as the board allows.

    Args:
        seed: Number of the draw.
        features: "rendered" or "geometric".
        longest_s: Scenes whose strokes take longer at their speed are drawn again [s].

    Raises:
        ConfigError: When a section refuses its values together.
    """
    source = stream(seed, "scene fuzz")
    keys = scene_keys(features)
    while True:
        chosen = source.choice(len(keys), int(source.integers(FEWEST, MOST + 1)), replace=False)
        moved = {keys[index]: _value(source, keys[index]) for index in sorted(chosen)}
        scene = _scene(moved)
        if "paint.stroke_m" not in moved and (room := _room(scene)) < scene.paint.stroke_m:
            scene = _scene({**moved, "paint.stroke_m": max(room, _SHORTEST_M)})
        if _painting_s(scene) <= longest_s:
            return scene, moved


def _scene(moved: dict[str, Any]) -> Scene:
    tree: dict[str, dict[str, Any]] = {}
    for path, value in moved.items():
        section, key = path.split(".")
        tree.setdefault(section, {})[key] = value
    return from_dict(Scene, tree)


def _room(scene: Scene) -> float:
    """Length of a stroke that leaves the margin at both ends [m]."""
    return BoardGeometry(scene).extent[0] - 2.0 * scene.paint.edge_margin_m


def _painting_s(scene: Scene) -> float:
    paint = scene.paint
    strokes = 1 if paint.pitch_m <= 0.0 else BoardGeometry(scene).strokes
    return strokes * (paint.stroke_m + max(paint.pitch_m, 0.0)) / paint.speed_m_s


def _value(source: np.random.Generator, path: str) -> Any:
    section, key = path.split(".")
    field = next(field for field in dataclasses.fields(getattr(Scene(), section)) if field.name == key)
    meta, default = field.metadata, field.default
    if "options" in meta:
        return str(source.choice(meta["options"]))
    words = meta.get("words", ())
    if words and source.random() < 0.5:
        return str(source.choice(words))
    if isinstance(default, tuple):
        return [_number(source, entry, meta["low"], meta["high"]) for entry in default]
    return _number(source, default, meta["low"], meta["high"])


def _number(source: np.random.Generator, default: Any, low: float, high: float) -> Any:
    """A number between low and high, as near to the default as far from it: the square of a uniform way to an end."""
    end, way = (low, high)[int(source.integers(2))], float(source.random()) ** 2
    if low > 0.0 and high > _DECADES * low:
        value = float(default) * (end / float(default)) ** way
    else:
        value = float(default) + way * (end - float(default))
    value = min(max(value, low), high)
    return round(value) if isinstance(default, int) else value
