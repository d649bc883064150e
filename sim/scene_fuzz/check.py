"""Outcome of a scene by the truth."""

from __future__ import annotations

import dataclasses
import math
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict
from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.preflight import check_job
from sim.flight.trace import CRASH
from sim.world.board import BoardGeometry
from sim.world.random_streams import stream
from sim.world.scene import Scene, load_scene
from sim.world.worlds import in_world

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


#: Outcomes, the good ones first.
COMPLETE, REFUSED, FAILED, UNCLAIMED = "complete", "refused before flight", "honestly failed", "complete, not claimed"
FALSE_CLAIM, INTERNAL, CRASHED = "FALSE CLAIM", "INTERNAL ERROR", "CRASH"
OUTCOMES = (COMPLETE, REFUSED, FAILED, UNCLAIMED, FALSE_CLAIM, INTERNAL, CRASHED)
#: Outcomes that no scene may have.
BAD = (FALSE_CLAIM, INTERNAL, CRASHED)


@dataclass(frozen=True, kw_only=True)
class Checked:
    """One scene."""

    name: str  # "seed 7" of a draw, a file's name
    moved: dict[str, Any]  # keys of a draw and their values
    outcome: str  # of `OUTCOMES`
    reason: str  # of the refusal, the pilot, the truth or the traceback
    push: float = math.nan  # hardest push over that of the job; NaN without a flight

    def __str__(self) -> str:
        """One line."""
        keys = ", ".join(f"{path} = {_short(value)}" for path, value in self.moved.items())
        push = f" (push {self.push:.1f} x)" if self.push > 2.0 else ""
        return f"{self.name}: {self.outcome}: {f'{keys}: ' if keys else ''}{self.reason}{push}"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def check_draw(seed: int, options: FlightOptions, world: str, longest_s: float) -> Checked:
    """Draw the scene of a seed, fly it in a world, and check the flight by the truth."""
    return _checked(f"seed {seed}", lambda: drawn_scene(seed, options.features, longest_s), options, world, seed)


def check_file(path: Path, options: FlightOptions, world: str, seed: int) -> Checked:
    """Fly the scene of a file in a world, and check the flight by the truth."""
    return _checked(f"{path.stem} {seed}", lambda: (load_scene(path), {}), options, world, seed)


def _checked(
    name: str,
    scene_of: Callable[[], tuple[Scene, dict[str, Any]]],
    options: FlightOptions,
    world: str,
    seed: int,
) -> Checked:
    moved: dict[str, Any] = {}
    try:
        scene, moved = scene_of()
        scene, options = in_world(scene, world), dataclasses.replace(options, seed=seed)
        check_job(scene, pilot_config(scene, options), options.features)
        trace = fly(scene, options)
        figures = compute_metrics(trace)
    except ConfigError as refusal:
        return Checked(name=name, moved=moved, outcome=REFUSED, reason=str(refusal))
    except Exception:  # any other error is a finding
        return Checked(name=name, moved=moved, outcome=INTERNAL, reason=traceback.format_exc().replace("\n", " | "))
    completed, claimed, push = figures["completed"], figures["claimed"], figures["push_peak_ratio"]
    outcome = (COMPLETE if claimed else UNCLAIMED) if completed else FALSE_CLAIM if claimed else FAILED
    if crashed := trace.reason.startswith(CRASH):
        outcome = CRASHED
    reason = trace.reason if crashed else f"{trace.reason}; {figures['not_completed']}"
    return Checked(name=name, moved=moved, outcome=outcome, reason=reason, push=push)
