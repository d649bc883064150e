"""A board that a tip paints, in the plane of the wall: edges, paint, camera's view and a tip that follows commands.

Board coordinates (u, v) [m] are those of the pattern on a board that is turned by a slope from u to v: stroke 1 begins
at u = 0, the edge that guides it is v = 0. The wall's axes are (right, down) of `Pattern.to_wall`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.painter import Painter
from ibvs_qp.pilot.painting.pattern import Pattern, stroke_place
from ibvs_qp.pilot.painting.strategy import PHASES

TICK = 0.04
#: What the camera shows around the tip at the wall [m]; it grows with the camera's distance, and its axis lies below.
VIEW_SIDE, VIEW_UP, VIEW_DOWN = 0.26, 0.11, 0.27
CAMERA_TO_TIP = 0.5
#: Bins of a painted edge [m], and the least length of a visible piece [m].
BIN, LEAST_PIECE = 0.01, 0.02
#: Part of a stroke's beginning and end that is not straight [m].
END_PART = 0.1
#: Identities of lines: the edges of the board, and those of a stroke k (outer: OUTER + k).
GUIDE, NEAR, END, FAR, OUTER, INNER = 1, 2, 3, 4, 100, 200
GUIDE_GAIN, TIP_SPEED_MAX = 4.0, 0.15


#: Largest error of a stroke's place and end [m].
PLACE = 3e-3


def short(**changes: Any) -> PaintingConfig:
    """A job with strokes of 0.5 m, everything else by default."""
    return PaintingConfig(**({"stroke_m": 0.5} | changes))


def wall(**changes: Any) -> PaintedWall:
    """A wall with a `short` job; settings of both by name."""
    job = {name: changes.pop(name) for name in list(changes) if name in PaintingConfig.__dataclass_fields__}
    return PaintedWall(short(**job), **changes)


def flown(phase: str, stroke: int = 0, seconds: float = 0.0, **changes: Any) -> PaintedWall:
    """A `wall` where that phase (of a stroke) has begun and lasted for a time."""
    world = wall(**changes)
    world.fly(250.0, until=phase, stroke=stroke)
    assert world.painter.phase == phase, world.painter.reason
    world.fly(seconds)
    return world


@dataclass
class Piece:
    """A straight piece on the board from one point (u, v) to another [m]; ``side`` as in `PatternLine`."""

    identity: int
    first: tuple[float, float]
    last: tuple[float, float]
    side: int
    kind: str = "board"
    weight: float = 1.0

    @classmethod
    def parallel(cls, identity: int, v: float, side: int, kind: str = "board") -> Piece:
        """A line along the strokes."""
        return cls(identity, (-3.0, v), (3.0, v), side, kind)

    @classmethod
    def upright(cls, identity: int, u: float, side: int, kind: str = "board") -> Piece:
        """A line across them."""
        return cls(identity, (u, -3.0), (u, 3.0), side, kind)


class Paint:
    """A stroke as it was painted: v of the tip in bins of u, and where a later stroke has not covered it."""

    def __init__(self, stroke_m: float) -> None:
        self.begin = -0.3
        self.v = np.full(round((stroke_m + 0.6) / BIN), math.nan)  # of the outermost path
        self.inner = self.v.copy()  # of the innermost one
        self.bare = np.zeros(self.v.size, bool)
        self.u = self.begin + BIN * (np.arange(self.v.size) + 0.5)

    def bin(self, u: float) -> int:
        return min(max(math.floor((u - self.begin) / BIN), 0), self.v.size - 1)

    def add(self, u: float, v: float) -> None:
        self.v[self.bin(u)], self.bare[self.bin(u)] = v, True
        self.inner[self.bin(u)] = v

    def add_again(self, u: float, v: float) -> None:
        at = self.bin(u)
        self.v[at], self.inner[at], self.bare[at] = np.fmax(self.v[at], v), np.fmin(self.inner[at], v), True

    def cover(self, u: float, half: float) -> None:
        """A later stroke's brush stands here and covers the outer edge."""
        self.bare[self.bin(u - half) : self.bin(u + half) + 1] = False

    def straight(self, stroke_m: float) -> np.ndarray:
        """v over the straight part."""
        return self.v[(self.u > END_PART) & (self.u < stroke_m - END_PART) & ~np.isnan(self.v)]


@dataclass
class PaintedWall:
    """A tip that follows its commands (velocity, guides to first order, stand-off, push), and what it leaves.

    Attributes:
        tip: True tip (u, v) on the board [m].
        delta: By which the picture shows the tip at a larger v than it has [m].
        slope: Turn of the board from u to v [rad].
        height: v of the board's other edge [m].
        wave: Added to the v of the tip by something that the odometer measures: stroke, u to m.
        drift: Velocity by which the odometer is wrong, (right, down) [m/s].
        hidden: Identities of lines that the picture does not show.
        ends_seen: Whether the picture tells where the pieces end.
        noise: Standard deviation of an offset in one look [m], renewed every 0.12 s.
        stuck_across: Whether nothing moves a tip that paints, once or again, across its stroke but the wave.
    """

    config: PaintingConfig
    painter: Painter = None  # type: ignore[assignment]
    tip: np.ndarray = field(default_factory=lambda: np.array((0.0, 0.05)))
    delta: float = 0.0
    slope: float = 0.0
    height: float = 2.0
    length: float = math.nan
    wave: Callable[[int, float], float] = lambda _stroke, _u: 0.0
    drift: tuple[float, float] = (0.0, 0.0)
    hidden: set[int] = field(default_factory=set)
    extra: list[Piece] = field(default_factory=list)
    ends_seen: bool = True
    noise: float = 0.0
    distance: float = 0.3
    contact_allowed: bool = True
    tared_after: float = 0.5
    blind_wall: bool = False
    stuck: bool = False
    stuck_across: bool = False
    push: float = 5.0

    def __post_init__(self) -> None:
        self.painter = Painter(self.config) if self.painter is None else self.painter
        self.pattern = Pattern(self.config.pattern, self.config.start)
        margin = self.config.edge_margin_m
        self.length = self.config.stroke_m + 2.0 * margin if math.isnan(self.length) else self.length
        self.board = [
            Piece.parallel(GUIDE, 0.0, 1),
            Piece.upright(NEAR, -margin, 1),
            Piece.upright(END, self.length - margin, -1),
            Piece.parallel(FAR, self.height, -1),
        ]
        self.paint: list[Paint] = []
        self.ends: list[tuple[int, float, float]] = []  # stroke and place of the tip when it ended
        self.begins: list[tuple[int, float]] = []  # stroke and deviation of its place when it began
        self.reached = [math.inf, -math.inf]  # range of u with the brush on the board
        self.odometer, self.velocity = np.zeros(2), np.zeros(2)
        self.time, self.contact_since = 0.0, math.nan
        self.command: PaintingCommand | None = None
        self._wave, self._rng, self._noise = 0.0, np.random.default_rng(1), {}
        self._cos, self._sin = math.cos(self.slope), math.sin(self.slope)

    # ------------------------------------------------------------------ geometry

    def to_wall(self, u: float, v: float) -> tuple[float, float]:
        """(right, down) of a vector on the board."""
        return self.pattern.to_wall(self._cos * u - self._sin * v, self._sin * u + self._cos * v)

    def to_board(self, right: float, down: float) -> tuple[float, float]:
        """(u, v) of a vector in the wall."""
        u, v = self.pattern.to_pattern(right, down)
        return self._cos * u + self._sin * v, self._cos * v - self._sin * u

    @property
    def view(self) -> tuple[float, float, float]:
        """What the picture shows at this distance: to each side, above and below the tip [m]."""
        grown = 1.0 + max(self.distance, 0.0) / CAMERA_TO_TIP
        axis, half = 0.5 * (VIEW_DOWN - VIEW_UP), 0.5 * (VIEW_DOWN + VIEW_UP)
        return VIEW_SIDE * grown, half * grown - axis, half * grown + axis

    def lines(self) -> dict[int, TrackedLine]:
        """The lines in view."""
        found = {}
        for piece in (*self.board, *self.extra, *self._painted()):
            if piece.identity not in self.hidden and (line := self._seen(piece)) is not None:
                found[piece.identity] = line
        return found

    def _seen(self, piece: Piece) -> TrackedLine | None:
        tip_u, tip_v = float(self.tip[0]), float(self.tip[1]) + self.delta
        first, last = (self.to_wall(u - tip_u, v - tip_v) for u, v in (piece.first, piece.last))
        clipped = clip(first, last, self.view)
        if clipped is None:
            return None
        (r0, d0), (r1, d1) = clipped
        length = math.hypot(r1 - r0, d1 - d0)
        if length < LEAST_PIECE:
            return None
        normal = (d1 - d0) / length, -(r1 - r0) / length
        role = HORIZONTAL if abs(normal[1]) > abs(normal[0]) else VERTICAL
        if (normal[1] if role == HORIZONTAL else normal[0]) < 0.0:
            normal = -normal[0], -normal[1]
        inward = self.to_board(*normal)  # the side is counted along v, or u for an upright line
        sign = 1 if max(inward, key=abs) > 0.0 else -1
        middle = 0.5 * (r0 + r1), 0.5 * (d0 + d1)
        offset = normal[0] * middle[0] + normal[1] * middle[1] + self._noise.get(piece.identity, 0.0)
        angle = math.atan2(normal[1], normal[0])
        return TrackedLine(
            track_id=piece.identity,
            role=role,
            slot=0,
            angle=angle,
            deviation=1e-3,
            seen_ns=0,
            frames=9,
            offset=offset,
            weight=piece.weight,
            surface_side=sign * piece.side,
            kind=piece.kind,
            seen_angle=angle,
            middle=normal[0] * middle[1] - normal[1] * middle[0] if self.ends_seen else math.nan,
            length=length if self.ends_seen else 0.0,
        )

    def _painted(self) -> list[Piece]:
        """Straight fits to the edges of paint that the picture shows."""
        reach = sorted(self.to_board(*corner)[0] for corner in self._corners())
        half, pieces = 0.5 * self.config.brush_width_m, []
        for stroke, paint in enumerate(self.paint, start=1):
            if stroke < len(self.paint) - 2:
                continue  # covered
            near = (paint.u > self.tip[0] + reach[0]) & (paint.u < self.tip[0] + reach[-1]) & ~np.isnan(paint.v)
            pieces += self._fit(OUTER + stroke, paint, near & paint.bare, half)
            if stroke == 1:
                pieces += self._fit(INNER + stroke, paint, near, -half)
        return pieces

    def _corners(self) -> list[tuple[float, float]]:
        side, up, down = self.view
        return [(-side, -up), (side, -up), (-side, down), (side, down)]

    def _fit(self, identity: int, paint: Paint, shown: np.ndarray, half: float) -> list[Piece]:
        """The longest piece of an edge beside the brush."""
        brush = 0.5 * self.config.brush_width_m
        hidden = (abs(paint.u - self.tip[0]) < brush) & (abs(paint.v + half - self.tip[1]) < brush + 5e-3)
        places = np.flatnonzero(shown & ~hidden)
        if places.size < 3:
            return []
        places = max(np.split(places, np.flatnonzero(np.diff(places) > 1) + 1), key=len)
        if places.size < 3:
            return []
        u, v = paint.u[places], paint.v[places] + half
        middle, level = u.mean(), v.mean()
        lean = float((u - middle) @ (v - level) / ((u - middle) @ (u - middle)))
        ends = [(float(end), float(level + lean * (end - middle))) for end in (u[0] - 0.5 * BIN, u[-1] + 0.5 * BIN)]
        return [Piece(identity, ends[0], ends[1], 1 if half > 0.0 else -1, "paint")]

    # -------------------------------------------------------------------- flight

    @property
    def in_contact(self) -> bool:
        return not math.isnan(self.contact_since)

    @property
    def guide(self) -> int:
        """Track of the line that leads across the strokes, -1 without one."""
        guides = [] if self.command is None else self.command.guides
        return next((line.track_id for line, _ in guides if line.role == self.pattern.guide_role), -1)

    def step(self) -> PaintingCommand:
        """One tick."""
        self.time += TICK
        touching = self.time - self.contact_since if self.in_contact else 0.0
        if self.noise and round(self.time / TICK) % 3 == 0:
            self._noise = {k: self.noise * self._rng.standard_normal() for k in (1, 2, 3, 4, *range(101, 125), 201)}
        inputs = self.inputs = PainterInput(
            time_s=self.time,
            lines=self.lines(),
            odometer=self.odometer.tolist(),
            velocity=self.velocity.tolist(),
            distance=self.distance,
            wall_known=not self.blind_wall,
            in_contact=self.in_contact,
            time_since_touch=touching,
            push=self.push * min(1.0, touching),
            push_reference=5.0,
            tared=self.time > self.tared_after,
        )
        before, stroke = self.painter.phase, self.painter.row
        command = self.command = self.painter.fly(inputs)
        if before == "paint" and self.painter.phase != "paint":
            self.ends.append((stroke, *self.tip.tolist()))
        if before != "paint" and self.painter.phase == "paint":
            self.paint.append(Paint(self.config.stroke_m))
            if isinstance(self.painter, Painter):
                self.begins.append((self.painter.row, self.painter._tip.cross.deviation))
        self._move(command)
        return command

    def _move(self, command: PaintingCommand) -> None:
        velocity = np.array(command.velocity, float)
        for line, target in command.guides:
            velocity += GUIDE_GAIN * (line.offset - target) * np.array((math.cos(line.angle), math.sin(line.angle)))
        self.velocity = np.zeros(2) if self.stuck else np.clip(velocity, -TIP_SPEED_MAX, TIP_SPEED_MAX)
        before = self.tip
        along, across = self.to_board(*self.velocity)
        held = self.stuck_across and self.painter.phase in ("paint", "retouch")
        self.tip = self.tip + TICK * np.array((along, 0.0 if held else across))
        if self.painter.phase == "paint":
            wave = self.wave(self.painter.row, float(self.tip[0]))
            self.tip[1] += wave - self._wave
            self._wave = wave
        self.odometer = self.odometer + np.array(self.to_wall(*(self.tip - before))) + TICK * np.array(self.drift)
        target = -0.0025 if command.contact else command.standoff
        self.distance += float(np.clip(target - self.distance, -0.05 * TICK, 0.15 * TICK))
        touching = self.distance < 0.0 and self.contact_allowed
        if not touching:
            self.contact_since = math.nan
        elif not self.in_contact:
            self.contact_since = self.time
        if self.in_contact:
            self._leave_paint()

    def _leave_paint(self) -> None:
        u, v = self.tip.tolist()
        self.reached = [min(self.reached[0], u), max(self.reached[1], u)]
        if self.painter.phase in ("paint", "retouch"):
            (self.paint[-1].add if self.painter.phase == "paint" else self.paint[-1].add_again)(u, v)
            if len(self.paint) > 1:
                self.paint[-2].cover(u, 0.5 * self.config.brush_width_m)

    def fly(self, seconds: float, until: str = "", stroke: int = 0) -> list[PaintingCommand]:
        """Fly for a time, or until a phase (of a stroke) begins or the job has ended."""
        commands = []
        for _ in range(round(seconds / TICK)):
            commands.append(self.step())
            reached = until and self.painter.phase == until and self.painter.row >= stroke
            if self.painter.finished or reached:
                break
        return commands

    def jolt(self, u: float = 0.0, v: float = 0.0) -> None:
        """Something moves the tip, and the odometer measures it [m]."""
        self.tip = self.tip + np.array((u, v))
        self.odometer = self.odometer + np.array(self.to_wall(u, v))

    def paint_without_push(self, way: float) -> None:
        """Go on without push over a way along the stroke [m]."""
        before, self.push = self.tip[0], 0.0
        while abs(self.tip[0] - before) < way:
            self.step()
        self.push = 5.0

    def finish(self, seconds: float = 300.0) -> str:
        """Fly to the end of the job; returns why it failed, or an empty text."""
        self.fly(seconds)
        assert self.painter.finished, self.painter.phase
        return self.painter.reason if self.painter.failed else ""

    # ------------------------------------------------------------------- results

    def phases(self) -> list[str]:
        """The phases that were entered."""
        return [phase for _, phase, _ in self.painter.log if phase in PHASES]

    def place_errors(self) -> np.ndarray:
        """Mean of v over the straight part of every stroke minus its nominal place [m]."""
        config = self.config
        job = (config.rows, self.height, config.edge_margin_m, config.pitch_m)
        places = [paint.straight(config.stroke_m).mean() for paint in self.paint]
        return np.array([place - stroke_place(k, *job) for k, place in enumerate(places, start=1)])


def clip(
    first: tuple[float, float], last: tuple[float, float], view: tuple[float, float, float]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Part of a segment (right, down) inside the view (Liang and Barsky); None if there is none."""
    side, up, down = view
    low, high = 0.0, 1.0
    step = last[0] - first[0], last[1] - first[1]
    for at, by, least, most in ((first[0], step[0], -side, side), (first[1], step[1], -up, down)):
        if abs(by) < 1e-12:
            if not least <= at <= most:
                return None
            continue
        enter, leave = sorted(((least - at) / by, (most - at) / by))
        low, high = max(low, enter), min(high, leave)
    if low >= high:
        return None
    return (
        (first[0] + low * step[0], first[1] + low * step[1]),
        (first[0] + high * step[0], first[1] + high * step[1]),
    )


def assert_painted(world: PaintedWall) -> None:
    """The job is claimed, and every stroke lies at its place."""
    assert world.finish() == ""
    assert abs(world.place_errors()).max() < PLACE


def started(right: float, down: float, **changes: Any) -> PaintedWall:
    """A job of one stroke that starts that far along u and v from where stroke 1 begins [m]."""
    return wall(**({"rows": 1, "tip": np.array((right, 0.05 + down))} | changes))


def assert_started_well(world: PaintedWall) -> None:
    """A job of one stroke is claimed, begins and ends where it should, and lies at its place."""
    assert_painted(world)
    assert world.paint[0].u[~np.isnan(world.paint[0].v)][0] == pytest.approx(0.0, abs=0.012)
    assert world.ends[0][1] == pytest.approx(world.config.stroke_m, abs=PLACE)
