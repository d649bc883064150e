"""Scenes drawn at random, in two families without a common scene: one to tune on, one to evaluate on.

Every parameter has a stream of its own, drawn from the number of the scene: another parameter changes no other. The
errors of the scene are those of the ideal world; `sim.world.worlds.in_world` gives it those of another.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import from_dict
from ibvs_qp.config.vehicle import VehicleParams
from sim.world.random_streams import stream
from sim.world.scene import Color, Scene

#: Families of scenes. Texture seeds of the first are even, of the second odd: no scene belongs to both.
TUNING, EVALUATION = FAMILIES = ("tuning", "evaluation")
#: Number of texture seeds of a family; a scene allows twice as many [-].
TEXTURES = 2**30
#: Least distance of two of the colours of board, wall and paint [grey levels, RGB norm]: that of board and wall in the
#: scene low_contrast is 83; twice the gate of 42 within which vision takes a colour for the board's or the paint's.
CONTRAST = 84.0
#: Channels of colours [grey levels]: grain and shading of the textures need room before they saturate.
CHANNEL = (30, 236)
#: Most distracting objects on and around the board [-]: as many as in the scene low_contrast.
CLUTTER = 10


@dataclass(frozen=True, kw_only=True)
class Range:
    """Range of a uniformly drawn parameter."""

    low: float  # least value
    high: float  # greatest value
    unit: str = ""  # of both
    reason: str  # why these ends
    log: bool = False  # whether the logarithm is uniform

    def at(self, fraction: float) -> float:
        """Value at a fraction 0..1 of the way from low to high."""
        if self.log:
            return self.low * (self.high / self.low) ** fraction
        return self.low + (self.high - self.low) * fraction


#: Ranges of the numbers of a scene, by dotted path.
RANGES = {
    "board.width_m": Range(low=0.9, high=1.6, unit="m", reason="rows of 0.7 to 1.5 m; a flight takes 30 to 60 s"),
    "board.height_m": Range(low=0.4, high=0.9, unit="m", reason="top edge in view, or not"),
    "board.bottom_m": Range(low=0.9, high=2.0, unit="m", reason="0.7 m of air below; a ladder's height"),
    "board.slope_deg": Range(low=-4.0, high=4.0, unit="deg", reason="hung by eye; experiment sloped-edge flies 5 deg"),
    "board.gap_m": Range(low=0.02, high=0.10, unit="m", reason="on battens, or on a stand"),
    "wall.friction": Range(low=0.1, high=0.6, reason="wet paint to a dry brush on rough board"),
    "wall.stiffness_n_m": Range(low=500.0, high=10000.0, unit="N/m", log=True, reason="soft roller to hard brush"),
    "wall.damping_n_s_m": Range(low=20.0, high=60.0, unit="N s/m", reason="around the shipped scenes"),
    "paint.edge_margin_m": Range(low=0.045, high=0.060, unit="m", reason="more than the brush's radius of 40 mm"),
    "start.distance_m": Range(low=0.30, high=0.55, unit="m", reason="the board's right edge and bottom are in view"),
    "start.right_m": Range(low=-0.04, high=0.04, unit="m", reason="placed by hand; as in the scene dark_board"),
    "start.down_m": Range(low=-0.04, high=0.04, unit="m", reason="as to the right"),
    "start.yaw_deg": Range(low=-4.0, high=4.0, unit="deg", reason="placed by hand; as in the scene dark_board"),
    "camera.latency_s": Range(low=0.040, high=0.080, unit="s", reason="one frame at 30 Hz and transfer, to twice that"),
}
#: Board beyond the rows: the length of a row leaves both margins and this [m]; scene low_contrast has 0.1 m.
SPARE = Range(
    low=0.0, high=0.08, unit="m", reason="a row ends at the margin on the left and begins freely on the right"
)
#: True over nominal mass of the vehicle [-].
MASS = Range(low=0.95, high=1.05, reason="another battery, a fuller brush; 0.3 kg of 6 kg")


def random_scene(seed: int, family: str) -> Scene:
    """A scene of a family; the same number gives the same scene.

    Args:
        seed: Number of the scene, from 0.
        family: `TUNING` or `EVALUATION`.

    Raises:
        ConfigError: When there is no such family.
    """
    if family not in FAMILIES:
        raise out_of_range("family", family, "", f"allowed are {', '.join(FAMILIES)}")
    tree: dict[str, dict[str, Any]] = {"plant": {}}
    for path, span in RANGES.items():
        section, key = path.split(".")
        tree.setdefault(section, {})[key] = _drawn(seed, family, path, span)
    for section, color in zip(("board", "wall", "paint"), _colors(seed, family), strict=True):
        tree[section]["color"] = color
    for section in ("board", "wall"):
        number = int(stream(seed, f"{family} {section}.texture_seed").integers(TEXTURES))
        tree[section]["texture_seed"] = 2 * number + FAMILIES.index(family)
    tree["board"]["clutter"] = int(stream(seed, f"{family} board.clutter").integers(CLUTTER + 1))
    room = tree["board"]["width_m"] - 2.0 * tree["paint"]["edge_margin_m"]
    tree["paint"]["stroke_m"] = room - _drawn(seed, family, "spare", SPARE)
    tree["plant"]["mass_kg"] = VehicleParams().mass_kg * _drawn(seed, family, "mass", MASS)
    return from_dict(Scene, tree)


def _drawn(seed: int, family: str, name: str, span: Range) -> float:
    return span.at(float(stream(seed, f"{family} {name}").random()))


def _colors(seed: int, family: str) -> list[Color]:
    """Colours of board, wall and paint, drawn again until they differ enough."""
    source = stream(seed, f"{family} colours")
    while True:
        colors = source.integers(*CHANNEL, (3, 3)).tolist()
        if all(math.dist(a, b) >= CONTRAST for a, b in itertools.combinations(colors, 2)):
            return [tuple(color) for color in colors]
