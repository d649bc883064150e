r"""Place of the tip across the strokes, from the odometer and every edge in view.

A line at v = L appears at :math:`p = L - v - \delta` beside the tip (states: `cross_filter`):

======================================  =====================================
line                                    L
======================================  =====================================
board edge at which the pattern starts  0
board edge beyond the last stroke       v of the far edge
outer edge of the last stroke           map + its error + w/2 + :math:`\beta`
outer edge of an older stroke           map + w/2 + :math:`\beta`
own edges behind the brush, w wide      map + its error +-w/2
======================================  =====================================

A painted edge has the waves of the stroke that left it: its map is subtracted, so that no stroke copies them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.cross_filter import (
    AHEAD,
    AT_V,
    BOARD_STD,
    FAR,
    LAST,
    NODES,
    OWN,
    TIP,
    TURN,
    WANDER,
    CrossFilter,
    V,
)
from ibvs_qp.pilot.painting.pattern_lines import LOST_WEIGHT, VISIBLE_WEIGHT, PatternLine, nearest, surface_edges
from ibvs_qp.pilot.painting.stroke_map import StrokeMap, Strokes

#: Time between looks [s].
LOOK_S = 0.1
#: Standard deviation of a painted edge in one look [m]; time between looks that count as independent, and that for a
#: board's edge [s]: a painted one has the swings of the path that left it, the board's one the noise of a fit.
EDGE_STD, INDEPENDENT_S, BOARD_INDEPENDENT_S = 1e-3, 0.5, 0.3
#: Standard deviation of the direction of a board's edge across the strokes, as boards are not square [rad]; time
#: between looks that count as independent [s]; shortest piece that shows a direction [m].
SQUARE_STD, SQUARE_INDEPENDENT_S, SQUARE_LENGTH_M = math.radians(0.4), 2.0, 0.08
#: Way without an edge after which the odometer is less certain [m].
UNLED_AFTER_M = 0.06
#: Part of the paint beside the brush that a picture without end points shows, from the tip [m].
WINDOW_M = (0.06, 0.22)
#: Shortest piece of a painted edge that counts [m]; below the brush, a picture shows 25 mm.
SHORTEST_M = 0.015
#: An edge farther from its expected place than this many standard deviations plus a floor [m] is another one.
GATE_SIGMAS, GATE_FLOOR_M = 4.0, 4e-3
#: Distance of the last stroke's edge from its expected place, in the mean of two looks [m], in the datasheet world;
#: looks for which the last stroke counts in the mean of the next one [-].
MISFIT, MISFIT_LOOKS = 4e-4, 20
#: Time constant of the direction of the strokes, from the board's edge [s]; largest slope of a board [rad].
TURN_TIME_S, LARGEST_TURN = 2.0, math.radians(15.0)
_BOARD_NOISE = BOARD_STD**2 * BOARD_INDEPENDENT_S / LOOK_S


class _Edge(NamedTuple):
    """A line, and the edge that it may be."""

    line: PatternLine
    place: float  # v of the line from the tip [m]
    row: np.ndarray  # of H
    level: float  # v of the edge [m], NaN where that is unknown
    variance: float = 0.0  # of its place on the board [m^2]


class CrossTrack:
    """v of the tip, its uncertainty, and the lines by which it is known.

    Attributes:
        filter: Estimates v.
        guides: Tracks that were recognised at the last look with their v [m], best first.
        strokes: Where the strokes were laid.
        unled: Way of the stroke in progress since the last stroke's edge or one of the board's was recognised [m].
        longest_unled: The longest such way of the stroke [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._half = config, 0.5 * config.brush_width_m
        self._spacing = config.stroke_m / (NODES - 1)
        self.filter, self.strokes = CrossFilter(), Strokes(config.stroke_m, self._half)
        self.guides: dict[int, float] = {}
        self._variances: list[np.ndarray] = []  # of every complete map but the last, at its nodes [m^2]
        self._far_known = False
        self._roll = 0.0  # of the picture against the odometer's axes, by the board's edge [rad]
        self._open = np.zeros(NODES, bool)  # nodes of the stroke that is laid which the tip has not passed
        self._u, self._forward = 0.0, 1.0  # of the tip [m]; direction in which the stroke in progress is laid
        self._way = self.unled = self.longest_unled = 0.0
        self._difference = 0.0  # of the last line from its expected place [m]
        self._before = math.nan  # that of the last stroke's edge at the last look
        self._misfits = MISFIT_LOOKS * [MISFIT**2]  # products of those of two looks [m^2]
        self._stroke_misfits: list[float] = []  # misfit of every stroke that is complete [m]

    @property
    def v(self) -> float:
        """Place of the tip [m]."""
        return float(self.filter.x[V])

    @property
    def tip_error(self) -> float:
        """By which the picture shows the tip at a larger v [m]."""
        return float(self.filter.x[TIP])

    @property
    def far_edge(self) -> float:
        """Place v of the board's edge beyond the last stroke where it has been in view [m], NaN before."""
        return float(self.filter.x[FAR]) if self._far_known else math.nan

    @property
    def picture_turn(self) -> float:
        """Direction of the strokes in the picture, which the camera's mount rolls [rad]."""
        return self.filter.turn + self._roll

    @property
    def deviation(self) -> float:
        """Standard deviation of v against the last stroke here, or against the board's edge before there is one [m]."""
        p = self.filter.p
        if self.strokes.complete:
            return self._deviation_from(LAST)
        return math.sqrt(max(float(p[V, V] + p[TIP, TIP] + 2.0 * p[V, TIP]), 0.0))

    def _deviation_from(self, nodes: slice) -> float:
        """Standard deviation of v against the map of a stroke here [m]."""
        p, shares = self.filter.p, self._shares(self._u)
        stroke = float(shares @ p[nodes, nodes] @ shares) - 2.0 * float(shares @ p[nodes, V])
        return math.sqrt(max(float(p[V, V]) + stroke, 0.0))

    @property
    def misfit(self) -> float:
        """By which the last stroke's edge differed from its expected place in this stroke, in the mean [m].

        Gusts and late pictures move the tip faster than the filter follows. From products of the differences in two
        looks: noise that changes from look to look does not count.
        """
        return math.sqrt(max(sum(self._misfits) / len(self._misfits), 0.0))

    def start(self, edge: PatternLine) -> None:
        """Begin at a distance from the board's edge."""
        self.filter.start(-edge.place, edge.track.deviation)
        self._far_known, self.guides = False, {edge.track.track_id: 0.0}
        self._follow_turn(edge, 1.0)
        self.filter.x[TURN], self._roll = self._roll, 0.0

    def predict(self, du: float, dv: float, dt: float, jumped: bool = False) -> None:
        """The tip has moved by the odometer, as of `CrossFilter.predict`."""
        self.filter.predict(du, dv, dt, self.unled > UNLED_AFTER_M, jumped)
        self._way += math.hypot(du, dv)

    def begin_stroke(self) -> None:
        """The tip begins to paint a stroke."""
        self.strokes.begin_pass()
        self._way = self.unled = self.longest_unled = 0.0
        self._misfits = MISFIT_LOOKS * [self.misfit**2]
        self._open[:] = True
        self.filter.take_error(self._open)

    def begin_again(self) -> None:
        """The tip turns round and paints the stroke in progress again, led by its own edge."""
        self.unled = 0.0
        self.strokes.begin_pass()

    def lay(self, u: float) -> None:
        """The brush presses here."""
        self._u = u
        if len(self.strokes.passes) > 1:
            v = self.v - float(self._shares(u) @ self.filter.x[OWN])
            self.strokes.add(u, v, self._deviation_from(OWN))
            return
        self.unled, self._way = self.unled + self._way, 0.0
        self.longest_unled = max(self.longest_unled, self.unled)
        self.strokes.add(u, self.v)

    def end_stroke(self) -> None:
        """The stroke ends and becomes the last one."""
        self.unled = 0.0
        if self.strokes.complete:  # the first stroke has no last edge
            self._stroke_misfits.append(self.misfit)
            self._variances.append(np.diag(self.filter.p)[LAST].copy())
        self.strokes.end_stroke()
        self.filter.end_stroke()

    def last_stroke(self, first_u: float, last_u: float) -> float:
        """Mean v between two places of the stroke before the one that is laid [m]; NaN where it is not known."""
        if not self.strokes.complete:
            return math.nan
        error = float(self._shares(0.5 * (first_u + last_u)) @ self.filter.x[LAST])
        return self.strokes.complete[-1].mean(first_u, last_u) + error

    def stroke_place(self, first_u: float, last_u: float) -> tuple[float, float]:
        """Mean v of the stroke in progress between two places, as first laid, and its standard deviation [m].

        NaN where it was not laid.
        """
        shares = np.mean([self._shares(u) for u in np.linspace(first_u, last_u, NODES)], axis=0)
        place = self.strokes.passes[0][0].mean(first_u, last_u) + float(shares @ self.filter.x[OWN])
        # The error of a place is the sum of those of all strokes before it.
        misfit = math.sqrt(float(np.mean(np.square([*self._stroke_misfits, self.misfit]))))
        rougher = max(misfit / EDGE_STD, 1.0)  # the filter's own noise of an edge is one EDGE_STD
        return place, rougher * math.sqrt(max(float(shares @ self.filter.p[OWN, OWN] @ shares), 0.0))

    def overlap(self, first_u: float, last_u: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Overlap with the last stroke between two places: u, overlap, its standard deviation, and the largest overlap.

        As of `Strokes.overlap`, [m], (n,) each; empty before the second stroke.
        """
        if not self.strokes.complete:
            return np.empty(0), np.empty(0), np.empty(0), np.empty(0)
        u, overlap, largest = self.strokes.overlap(first_u, last_u)
        x, p, shares = self.filter.x, self.filter.p, np.reshape([self._shares(place) for place in u], (-1, NODES))
        offset = shares @ (x[LAST] - x[OWN]) + 2.0 * self._half
        covariance = p[LAST, LAST] - p[LAST, OWN] - p[OWN, LAST] + p[OWN, OWN]
        deviation = np.sqrt(np.maximum(np.sum(shares @ covariance * shares, axis=1), 0.0))
        return u, overlap + offset, deviation, largest + offset

    def _shares(self, u: float) -> np.ndarray:
        """Weights of the nodes in the error of a map at a place along it, by linear interpolation, (NODES,)."""
        place = min(max(u / self._spacing, 0.0), NODES - 1.0)
        node, shares = min(int(place), NODES - 2), np.zeros(NODES)
        shares[node], shares[node + 1] = 1.0 - (place - node), 1.0 - (node + 1 - place)
        return shares

    def look(self, lines: Sequence[PatternLine], u: float, ahead: float, again: bool = False) -> None:
        """Correct with every edge in view, once per `LOOK_S`; the tip is at u and travels ahead along u, +-1.

        ``again`` on the paint of the stroke in progress, which hides the last one's edge.
        """
        self._u, laying = u, bool(self.strokes.passes)
        self._forward = self._forward if again else ahead
        if laying:
            self._open &= ahead * (self._spacing * np.arange(NODES) - u) > 0.0
            self.filter.take_error(self._open)
        parallel = [line for line in lines if line.parallel and line.weight > LOST_WEIGHT]
        last = None if again else self._last_edge(parallel, ahead)
        compared = last is not None and laying and self.unled < UNLED_AFTER_M
        if compared and not math.isnan(self._before):
            self._misfits.append(self._difference * self._before)
        self._before = self._difference if compared else math.nan
        board = self._board_edge(parallel, lines)
        opposite, known = self._opposite_edge(parallel)
        if last is not None or board is not None or known:
            self.unled = 0.0
        if last is not None and abs(last.lean) >= math.radians(self._config.gates.fresh_lean_deg):
            last = None
        own = self._own_edges(parallel, 0.0 if again else ahead) if laying else []
        found = [line for line in (last, board, opposite, *own) if line is not None]
        self.guides = {line.track.track_id: self.filter.apparent + line.place for line in found}

    def _last_edge(self, lines: list[PatternLine], ahead: float) -> PatternLine | None:
        """Outer edge of the last stroke, or of an older one where the last one is missing."""
        found = [line for line in lines if line.kind != "board" and line.side >= 0]
        newest_first = zip(reversed(self.strokes.complete), (None, *reversed(self._variances)), strict=False)
        for stroke, variances in newest_first:
            nodes = LAST if variances is None else None
            if (line := self._painted_edge(found, stroke, ahead, self._half, nodes, variances)) is not None:
                return line
        return None

    def _own_edges(self, lines: list[PatternLine], ahead: float) -> list[PatternLine | None]:
        """Both edges of the stroke that is being laid, behind the brush: they show where the tip is in the picture.

        On its own paint (``ahead`` is 0) the outer one, on either side; the inner one is that of the brush. They lead
        the tip, too, where no other edge is in view: velocity alone holds it half as well against friction.
        """
        stroke, found = self.strokes.outermost(), []
        for side in (1, -1) if ahead else (1,):
            edges = [line for line in lines if line.kind == "paint" and line.side == side]
            found.append(self._painted_edge(edges, stroke, -ahead, side * self._half, OWN))
        return found

    def _painted_edge(
        self,
        lines: list[PatternLine],
        stroke: StrokeMap,
        ahead: float,
        half: float,
        nodes: slice | None,
        variances: np.ndarray | None = None,
    ) -> PatternLine | None:
        """Correct with an edge of a stroke, `half` from its middle, in direction `ahead` along u, 0 for either.

        `nodes` are the states that are the error of the map; where it has none, `variances` are those of its nodes.
        """
        u, x, edges = self._u, self.filter.x, []
        for line in lines:
            near, far, seen = self._piece(line, ahead)
            if far - near > SHORTEST_M and (not ahead or (near + far) * ahead > 0.0):
                middle, row = 0.5 * (near + far), AT_V.copy()
                shares = self._shares(u + middle)
                row[TURN] = row[WANDER] = middle
                row[AHEAD] = float(nodes is not OWN) if ahead else self._share_ahead(near, far)
                level = stroke.mean(u + near, u + far) + half + row[AHEAD] * float(x[AHEAD])
                if nodes is not None:
                    row[nodes] = shares
                    level += float(shares @ x[nodes])
                variance = 0.0 if variances is None else float(shares @ variances)
                edges.append(_Edge(line, seen, row, level, variance))
        return self._correct(edges, EDGE_STD**2 * INDEPENDENT_S / LOOK_S, 0.5 * self._config.pitch_m)

    def _share_ahead(self, near: float, far: float) -> float:
        """Fraction of a visible piece that lies ahead of the tip, in the direction in which the stroke was laid [-]."""
        ahead = far if self._forward > 0.0 else -near
        return min(max(ahead / (far - near), 0.0), 1.0)

    @staticmethod
    def _piece(line: PatternLine, ahead: float) -> tuple[float, float, float]:
        """Begin and end of the visible piece along u, and v of its middle, from the tip [m]."""
        u, v = line.middle
        if math.isnan(u):
            near, far = sorted(ahead * end for end in WINDOW_M) if ahead else (-WINDOW_M[1], WINDOW_M[1])
            return near, far, line.place + 0.5 * line.lean * (near + far)
        return u - 0.5 * line.length, u + 0.5 * line.length, v

    def _board_edge(self, parallel: list[PatternLine], lines: Sequence[PatternLine]) -> PatternLine | None:
        """Edge at which the pattern starts, which shows the direction of the strokes; where it is lost, others do."""
        edges = [_Edge(line, line.place, AT_V, 0.0) for line in surface_edges(parallel, parallel=True)]
        board = self._correct(edges, _BOARD_NOISE, self._config.gates.start_m)
        if board is not None:
            self._follow_turn(board, LOOK_S / TURN_TIME_S)
        else:
            self._correct_turn(lines)
        return board

    def _opposite_edge(self, lines: list[PatternLine]) -> tuple[PatternLine | None, bool]:
        """Correct with the board's edge beyond the last stroke, by kind and side; and whether its place was known.

        An edge elsewhere than expected is another one: its place is known from now on, as well as that of the tip.
        """
        found = [line for line in lines if line.kind == "board" and line.side < 0 and line.place > 0.0]
        edge = nearest(found, 0.0)
        if edge is None:
            return None, False
        if self._far_known:
            row = AT_V.copy()
            row[FAR] = 1.0
            edges = [_Edge(line, line.place, row, self.far_edge) for line in found]
            if (line := self._correct(edges, _BOARD_NOISE, self._config.gates.start_m)) is not None:
                return line, True
        self.filter.find_far_edge(edge.place, edge.track.deviation)
        self._far_known = True
        return edge, False

    def _follow_turn(self, edge: PatternLine, share: float) -> None:
        turn = self.picture_turn + share * math.atan(edge.lean)
        self._roll = min(max(turn, -LARGEST_TURN), LARGEST_TURN) - self.filter.turn

    def _correct_turn(self, lines: Sequence[PatternLine]) -> None:
        """Correct the direction with the longest edge of the board across the strokes: it turns with the picture."""
        edges = [line for line in lines if not line.parallel and line.kind == "board" and line.weight > VISIBLE_WEIGHT]
        line = max(edges, key=lambda edge: edge.length, default=None)
        if line is None or line.length < SQUARE_LENGTH_M:
            return
        row, turned = np.zeros_like(AT_V), -math.atan(line.lean)
        row[TURN] = row[WANDER] = 1.0
        expected = self.filter.variance(row)
        if abs(turned) <= GATE_SIGMAS * math.sqrt(expected + SQUARE_STD**2):
            noise = SQUARE_STD**2 * SQUARE_INDEPENDENT_S / LOOK_S / line.weight
            self.filter.correct(turned, row, expected + noise)

    def _correct(self, edges: list[_Edge], noise: float, gate: float) -> PatternLine | None:
        """Correct with the line nearest to its expected place, within a gate [m], by a look of that noise [m^2]."""
        apparent = self.filter.apparent
        edges = [edge for edge in edges if not math.isnan(edge.level)]
        if not edges:
            return None
        line, place, row, level, extra = min(edges, key=lambda edge: abs(edge.place - edge.level + apparent))
        difference = place - (level - apparent)
        expected = self.filter.variance(row)
        limit = GATE_SIGMAS * math.sqrt(expected + EDGE_STD**2 + extra) + GATE_FLOOR_M
        if abs(difference) > min(limit, gate):
            return None
        self.filter.correct(difference, row, expected + (noise + line.track.deviation**2) / line.weight + extra)
        self._difference = difference
        return line
