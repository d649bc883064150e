r"""Place of the tip across the strokes, from the odometer and every edge in view.

A Kalman filter with five states: v of the true tip; :math:`\delta`, by which the picture shows the tip at a larger v
than it has (camera mount, arm, attitude); m and o, by which the last stroke and the one being laid have a larger v than
their maps say; and the odometer's drift, which the edges show and which goes on where they are out of view. A line at
v = L then appears at the place :math:`p = L - v - \delta` beside the tip:

======================================  ==========================  ===================
line                                    L                           row of H
======================================  ==========================  ===================
board edge at which the pattern starts  0                           (-1, -1, 0, 0, 0)
outer edge of the last stroke           map + w/2 + m               (-1, -1, 1, 0, 0)
outer edge of an older stroke           map + w/2                   (-1, -1, 0, 0, 0)
own edges behind the brush, w wide      map + o +-w/2               (-1, -1, 0, 1, 0)
======================================  ==========================  ===================

A map gets the error that v has when it is laid, so o follows that error over the way to the edge in view.

A painted edge has the waves of the stroke that left it. Their map is subtracted, and the odometer smooths what is left,
so that a stroke does not copy them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.pattern_lines import LOST_WEIGHT, PatternLine
from ibvs_qp.painting.stroke_map import StrokeMap

#: Standard deviation of the tip's place in the picture, by mount and arm [m].
TIP_STD = 5e-3
#: Time between looks [s].
LOOK_S = 0.1
#: Standard deviation of an edge in one look [m], and time between looks that count as independent [s]: a board is
#: straight, and its edge has the noise of a fit; a painted edge has the swings of the path that left it.
BOARD_STD, BOARD_INDEPENDENT_S = 1e-3, 0.3
EDGE_STD, INDEPENDENT_S = 1.5e-3, 0.5
#: Odometer: variance of v per metre of way and per second at one place [m^2/m], [m^2/s], as flown in the datasheet
#: world; standard deviation of its drift [m/s], and variance of the drift per second [m^2/s^3].
ODOMETER_PER_M, ODOMETER_AT_REST = 4e-6, 1e-7
DRIFT_STD, DRIFT_WANDER = 5e-4, 1e-9
#: The same of a map's error along its stroke: between two edges seen, v drifts [m^2/m].
MAP_PER_M = 0.5 * ODOMETER_PER_M
#: Variance of the tip's place in the picture per second: the attitude wanders by 0.1 deg within minutes [m^2/s].
TIP_WANDER = 1e-9
#: Part of the paint ahead of and behind the brush that a picture without end points shows, from the tip [m].
WINDOW_M = (0.06, 0.22)
#: Shortest piece of a painted edge that is looked at [m].
SHORTEST_M = 0.03
#: An edge farther from its expected place than this many standard deviations plus a floor [m] is another one.
GATE_SIGMAS, GATE_FLOOR_M = 4.0, 4e-3
#: Time constant of the direction of the strokes, from the board's edge [s]; largest slope of a board [rad].
TURN_TIME_S, LARGEST_TURN = 2.0, math.radians(15.0)

#: From the tip to the middle of its own edges in view [m].
BEHIND_M = 0.14
_V, _TIP, _LAST_MAP, _OWN_MAP, _DRIFT = range(5)
_BOARD, _LAST, _OWN = np.array([(-1.0, -1.0, 0.0, 0.0, 0.0), (-1.0, -1.0, 1.0, 0.0, 0.0), (-1.0, -1.0, 0.0, 1.0, 0.0)])
_AGAINST_LAST = np.array((1.0, 0.0, -1.0, 0.0, 0.0))


class CrossTrack:
    """v of the tip, its uncertainty, and the lines by which it is known.

    Attributes:
        turn: Direction of the strokes against the nominal axis u, from u to v [rad].
        guides: Tracks that were recognised at the last look with their v [m], best first.
        maps: Where the strokes were laid, oldest first.
        far_edge: v of the board's other edge where it has been in view [m], NaN before.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._half = config, 0.5 * config.brush_width_m
        self._x, self._p = np.zeros(5), np.zeros((5, 5))
        self.maps: list[StrokeMap] = []
        self._deviations: list[float] = []  # of every map but the last [m]
        self.turn, self.far_edge = 0.0, math.nan
        self.guides: dict[int, float] = {}
        self._laying = False

    @property
    def v(self) -> float:
        """Place of the tip [m]."""
        return float(self._x[_V])

    @property
    def tip_error(self) -> float:
        """By which the picture shows the tip at a larger v [m]."""
        return float(self._x[_TIP])

    @property
    def deviation(self) -> float:
        """Standard deviation of v against the last stroke, or against the board's edge before there is one [m]."""
        row = _AGAINST_LAST if self._painted else _BOARD
        return math.sqrt(max(float(row @ self._p @ row), 0.0))

    @property
    def _painted(self) -> list[StrokeMap]:
        """Maps of the strokes that are complete, oldest first; the state m belongs to the last of them."""
        return self.maps[:-1] if self._laying else self.maps

    def start(self, edge: PatternLine) -> None:
        """Begin at a distance from the board's edge; what the picture shows is v plus the tip's error."""
        self._x[:] = -edge.place, 0.0, 0.0, 0.0, 0.0
        seen, tip = edge.track.deviation**2 + BOARD_STD**2, TIP_STD**2
        self._p[:] = 0.0
        self._p[:2, :2] = (seen + tip, -tip), (-tip, tip)
        self._p[_DRIFT, _DRIFT] = DRIFT_STD**2
        self.guides = {edge.track.track_id: 0.0}
        self._follow_turn(edge, 1.0)

    def predict(self, du: float, dv: float, dt: float) -> None:
        """The tip has moved by the odometer [m] within dt [s]."""
        x, p = self._x, self._p
        x[_V] += dv - x[_DRIFT] * dt
        p[_V] -= dt * p[_DRIFT]
        p[:, _V] -= dt * p[:, _DRIFT]
        p[_V, _V] += ODOMETER_PER_M * math.hypot(du, dv) + ODOMETER_AT_REST * dt
        p[_DRIFT, _DRIFT] += DRIFT_WANDER * dt
        p[_TIP, _TIP] += TIP_WANDER * dt
        if self._laying and du != 0.0:
            p[_LAST_MAP, _LAST_MAP] += MAP_PER_M * abs(du)
            share = min(abs(du) / BEHIND_M, 1.0)
            x[_OWN_MAP] *= 1.0 - share
            p[_OWN_MAP] += share * (p[_V] - p[_OWN_MAP])
            p[:, _OWN_MAP] += share * (p[:, _V] - p[:, _OWN_MAP])

    def begin_stroke(self) -> None:
        """The tip begins to paint a stroke; what it paints is remembered."""
        self.maps.append(StrokeMap(self._config.stroke_m))
        self._laying = True
        self._clone(_V, _OWN_MAP)

    def lay(self, u: float) -> None:
        """The brush presses here."""
        self.maps[-1].add(u, self.v)

    def last_stroke(self, first_u: float, last_u: float) -> float:
        """Mean v between two places of the stroke before the one that is laid [m]; NaN where it is not known."""
        before = self._painted
        return before[-1].mean(first_u, last_u) + float(self._x[_LAST_MAP]) if before else math.nan

    def end_stroke(self) -> None:
        """The stroke ends; what comes into view first of the next one is its end."""
        self._laying = False
        if len(self.maps) > 1:
            self._deviations.append(math.sqrt(max(float(self._p[_LAST_MAP, _LAST_MAP]), 0.0)))
        self._clone(_OWN_MAP, _LAST_MAP)

    def _clone(self, source: int, target: int) -> None:
        """The error of one state becomes that of another: of v that of the map which it is laid by, and so on."""
        self._x[target] = self._x[source] if source != _V else 0.0
        self._p[target, :] = self._p[source, :]
        self._p[:, target] = self._p[:, source]
        self._p[target, target] = self._p[source, source]

    def look(self, lines: Sequence[PatternLine], u: float, ahead: float) -> None:
        """Correct with every edge in view, once per `LOOK_S`; ``ahead`` is the direction of travel along u, +-1."""
        parallel = [line for line in lines if line.parallel and line.weight > LOST_WEIGHT]
        guides = []
        straight = math.radians(self._config.gates.fresh_lean_deg)
        if (line := self._last_edge(parallel, u, ahead)) is not None and abs(line.lean) < straight:
            guides.append(line)
        if (line := self._board_edge(parallel)) is not None:
            guides.append(line)
            self._follow_turn(line, LOOK_S / TURN_TIME_S)
        own = self._own_edges(parallel, u, ahead) if self._laying else []
        if (line := self._opposite_edge(parallel)) is not None:
            guides.append(line)
        guides += own
        self.guides = {line.track.track_id: self.v + self.tip_error + line.place for line in guides}

    def _board_edge(self, lines: list[PatternLine]) -> PatternLine | None:
        found = [line for line in lines if line.kind != "paint" and line.side >= 0]
        noise = BOARD_STD**2 * BOARD_INDEPENDENT_S / LOOK_S, 0.0
        return self._correct([(line, line.place, 0.0) for line in found], _BOARD, noise, self._config.gates.start_m)

    def _last_edge(self, lines: list[PatternLine], u: float, ahead: float) -> PatternLine | None:
        """Outer edge of the last stroke, or of an older one where the last one is missing."""
        found = [line for line in lines if line.kind != "board" and line.side >= 0]
        row, error, deviation = _LAST, float(self._x[_LAST_MAP]), 0.0
        for stroke, older in zip(reversed(self._painted), (*reversed(self._deviations), 0.0), strict=False):
            line = self._painted_edge(found, stroke, (u, ahead), self._half, (row, error, deviation**2))
            if line is not None:
                return line
            row, error, deviation = _BOARD, 0.0, older
        return None

    def _own_edges(self, lines: list[PatternLine], u: float, ahead: float) -> list[PatternLine]:
        """Both edges of the stroke that is being laid, behind the brush: they show where the tip is in the picture.

        They lead the tip, too, where no other edge is in view: velocity alone holds it half as well against friction.
        """
        paint = [line for line in lines if line.kind == "paint"]
        error, seen = float(self._x[_OWN_MAP]), []
        for side in (1, -1):
            found = [line for line in paint if line.side == side]
            seen.append(self._painted_edge(found, self.maps[-1], (u, -ahead), side * self._half, (_OWN, error, 0.0)))
        return [line for line in seen if line is not None]

    def _painted_edge(
        self,
        lines: list[PatternLine],
        stroke: StrokeMap,
        place: tuple[float, float],
        half: float,
        model: tuple[np.ndarray, float, float],
    ) -> PatternLine | None:
        """Correct with an edge of a stroke.

        Args:
            lines: Those that may be this edge.
            stroke: Map of the stroke.
            place: u of the tip [m], and the direction along u in which the edge is seen.
            half: From the middle of the stroke to the edge [m].
            model: Row of H, error of the map [m], variance of the map [m^2].
        """
        (u, ahead), (row, error, variance) = place, model
        expected = []
        for line in lines:
            near, far, seen = self._piece(line, ahead)
            if (near + far) * ahead > 0.0 and far - near > SHORTEST_M:
                expected.append((line, seen, stroke.mean(u + near, u + far) + half + error))
        noise = EDGE_STD**2 * INDEPENDENT_S / LOOK_S, variance
        return self._correct(expected, row, noise, 0.5 * self._config.pitch_m)

    @staticmethod
    def _piece(line: PatternLine, ahead: float) -> tuple[float, float, float]:
        """Begin and end of the visible piece along u, and v of its middle, from the tip [m]."""
        u, v = line.middle
        if math.isnan(u):
            near, far = sorted(ahead * end for end in WINDOW_M)
            return near, far, line.place + 0.5 * line.lean * (near + far)
        return u - 0.5 * line.length, u + 0.5 * line.length, v

    def _correct(
        self, seen: list[tuple[PatternLine, float, float]], row: np.ndarray, noise: tuple[float, float], gate: float
    ) -> PatternLine | None:
        """Correct with the line nearest to its expected place, within a gate [m]; None without one.

        Args:
            seen: Lines, v of each from the tip, and v of the edge that it may be [m]; NaN where that is unknown.
            row: Row of H.
            noise: Variance of one look, and of the edge's place on the board [m^2].
            gate: Largest distance from the expected place [m].
        """
        best, least, apparent = None, math.inf, self.v + self.tip_error
        for line, place, level in seen:
            difference = place - (level - apparent)
            if abs(difference) < abs(least):
                best, least = line, difference
        if best is None:
            return None
        look, extra = noise
        variance = (look + best.track.deviation**2) / best.weight + extra
        gain = self._p @ row
        expected_variance = float(row @ gain) + EDGE_STD**2 + extra
        if abs(least) > min(GATE_SIGMAS * math.sqrt(expected_variance) + GATE_FLOOR_M, gate):
            return None
        gain = gain / (float(row @ gain) + variance)
        self._x += gain * least
        self._p -= np.outer(gain, row @ self._p)
        return best

    def _opposite_edge(self, lines: list[PatternLine]) -> PatternLine | None:
        """The board's edge beyond the last stroke, by kind and side; its place is remembered."""
        found = [line for line in lines if line.kind == "board" and line.side < 0 and line.place > 0.0]
        if not found:
            return None
        edge = min(found, key=lambda line: line.place)
        self.far_edge = self.v + self.tip_error + edge.place
        return edge

    def _follow_turn(self, edge: PatternLine, share: float) -> None:
        turn = self.turn + share * math.atan(edge.lean)
        self.turn = min(max(turn, -LARGEST_TURN), LARGEST_TURN)
