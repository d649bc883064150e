r"""Place of the tip across the strokes, from the odometer and every edge in view.

A Kalman filter with these states: v of the true tip; :math:`\delta`, by which the picture shows the tip at a larger v
than it has (camera mount, arm, attitude); the odometer's drift; the direction of the strokes against the odometer's
axes, and how these and the picture wander with the attitude; :math:`\beta`, by which an edge ahead seems to lie at a
larger v than the same edge behind; v of the board's far edge; and, at `NODES` places along the last stroke and the one
being laid, the amount by which each lies at a larger v than its map says. A line at v = L then appears at the place
:math:`p = L - v - \delta` beside the tip:

======================================  =====================================
line                                    L
======================================  =====================================
board edge at which the pattern starts  0
board edge beyond the last stroke       v of the far edge
outer edge of the last stroke           map + its error + w/2 + :math:`\beta`
outer edge of an older stroke           map + w/2 + :math:`\beta`
own edges behind the brush, w wide      map + its error +-w/2
======================================  =====================================

A map gets the error that v has when it is laid, so a node takes the error of v until the tip has passed it. Drift and
direction change slowly: they keep a long chain of strokes straight, each of which follows the edge of the one before.

A painted edge has the waves of the stroke that left it. Their map is subtracted, and the odometer smooths what is left,
so that a stroke does not copy them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.pattern_lines import LOST_WEIGHT, VISIBLE_WEIGHT, PatternLine
from ibvs_qp.painting.stroke_map import StrokeMap, band_edge

#: Standard deviation of the tip's place in the picture, by mount and arm [m].
TIP_STD = 5e-3
#: Time between looks [s].
LOOK_S = 0.1
#: Standard deviation of an edge in one look [m], and time between looks that count as independent [s]: a board is
#: straight, and its edge has the noise of a fit; a painted edge has the swings of the path that left it.
BOARD_STD, BOARD_INDEPENDENT_S = 1e-3, 0.3
EDGE_STD, INDEPENDENT_S = 1e-3, 0.5
#: Standard deviation of beta for each stroke, by the lens [m]; assumed, the roll of the picture is a state.
AHEAD_STD = 4e-4
#: Odometer: variance of v per metre of way and per second at one place [m^2/m], [m^2/s], as flown in the datasheet
#: world over 1 to 15 s; standard deviation of its drift [m/s], and variance of the drift per second [m^2/s^3].
ODOMETER_PER_M, ODOMETER_AT_REST = 8e-6, 2e-7
#: The same per metre of a stroke without an edge, where nothing shows how the wander of the attitude turns its axes:
#: 1.7e-5 in the datasheet world and 2.5e-5 in the harsh one (a flight each, over 0.5 m, less the mean drift); way after
#: which it holds [m].
UNLED_PER_M, UNLED_AFTER_M = 2.5e-5, 0.06
DRIFT_STD, DRIFT_WANDER = 1e-3, 1e-9
#: Standard deviation of the strokes' direction where the board's edge shows it, by the roll of the camera's mount
#: [rad]; its variance per second [rad^2/s].
TURN_STD, TURN_WANDER = 8e-3, 1e-9
#: Wander of the axes of odometer and picture with the attitude: standard deviation [rad] and correlation time [s], as
#: flown in 1 s pieces of ten flights: 0.25 deg in the datasheet world, and 0.4 deg per axis by design in the harsh one;
#: the value is between both.
WANDER_STD, WANDER_TIME_S = math.radians(0.3), 8.0
#: Standard deviation of the direction of a board's edge across the strokes, by its fit and by boards that are not
#: square [rad]; time between looks that count as independent [s]; shortest piece that shows a direction [m]. With twice
#: of the first two, columns in the harsh world did not become certain.
SQUARE_STD, SQUARE_INDEPENDENT_S, SQUARE_LENGTH_M = math.radians(0.4), 2.0, 0.08
#: Variance of the far edge per metre of way across the strokes: its distance from the tip shrinks, and the wall
#: distance that scales it is known to 1 %, 0.7 mm of a usual pitch [m^2/m].
FAR_PER_M = 7e-6
#: Variance of the tip's place in the picture per second: the attitude wanders by 0.1 deg within minutes [m^2/s].
TIP_WANDER = 1e-9
#: Part of the paint ahead of and behind the brush that a picture without end points shows, from the tip [m].
WINDOW_M = (0.06, 0.22)
#: Shortest piece of a painted edge that is looked at [m]; below the brush, a picture shows 25 mm.
SHORTEST_M = 0.015
#: An edge farther from its expected place than this many standard deviations plus a floor [m] is another one.
GATE_SIGMAS, GATE_FLOOR_M = 4.0, 4e-3
#: Distance of the last stroke's edge from its expected place, in the mean of two looks: 0.4 mm in the datasheet world,
#: 1 mm in the harsh one [m]; looks for which the last stroke counts in the mean of the next one [-].
MISFIT, MISFIT_LOOKS = 4e-4, 20
#: Time constant of the direction of the strokes, from the board's edge [s]; largest slope of a board [rad].
TURN_TIME_S, LARGEST_TURN = 2.0, math.radians(15.0)
#: Places along a stroke at which the error of its map is a state [-].
NODES = 24

_V, _TIP, _DRIFT, _TURN, _WANDER, _AHEAD, _FAR = range(7)
_LAST, _OWN = slice(7, 7 + NODES), slice(7 + NODES, 7 + 2 * NODES)
_STATES = _OWN.stop


class CrossTrack:
    """v of the tip, its uncertainty, and the lines by which it is known.

    Attributes:
        guides: Tracks that were recognised at the last look with their v [m], best first.
        maps: Where the strokes were laid, oldest first.
        unled: Way of the stroke in progress since the last stroke's edge or one of the board's was recognised [m].
        longest_unled: The longest such way of the stroke [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._half = config, 0.5 * config.brush_width_m
        self._spacing = config.stroke_m / (NODES - 1)
        self._x, self._p = np.zeros(_STATES), np.zeros((_STATES, _STATES))
        self.maps: list[StrokeMap] = []
        self._variances: list[np.ndarray] = []  # of every map but the last, at its nodes [m^2]
        self._far_known = False
        self._roll = 0.0  # of the picture against the odometer's axes, by the board's edge [rad]
        self.guides: dict[int, float] = {}
        self._laying = False
        #: Where the stroke in progress was painted again, each way for itself: as estimated, and on the safe side.
        self._again: list[tuple[StrokeMap, StrokeMap]] = []
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
        return float(self._x[_V])

    @property
    def tip_error(self) -> float:
        """By which the picture shows the tip at a larger v [m]."""
        return float(self._x[_TIP])

    @property
    def far_edge(self) -> float:
        """Place v of the board's edge beyond the last stroke where it has been in view [m], NaN before."""
        return float(self._x[_FAR]) if self._far_known else math.nan

    @property
    def turn(self) -> float:
        """Direction of the strokes against the odometer's axis u, from u to v [rad]."""
        return float(self._x[_TURN] + self._x[_WANDER])

    @property
    def picture_turn(self) -> float:
        """Direction of the strokes in the picture, which the camera's mount rolls [rad]."""
        return self.turn + self._roll

    @property
    def deviation(self) -> float:
        """Standard deviation of v against the last stroke here, or against the board's edge before there is one [m]."""
        if self._painted:
            return self._deviation_from(_LAST)
        p = self._p
        return math.sqrt(max(float(p[_V, _V] + p[_TIP, _TIP] + 2.0 * p[_V, _TIP]), 0.0))

    @property
    def misfit(self) -> float:
        """By which the last stroke's edge differed from its expected place in this stroke, in the mean [m].

        Gusts and late pictures move the tip faster than the filter follows. From products of the differences in two
        looks: noise that changes from look to look does not count.
        """
        return math.sqrt(max(sum(self._misfits) / len(self._misfits), 0.0))

    def _deviation_from(self, nodes: slice) -> float:
        """Standard deviation of v against the map of a stroke here [m]."""
        p, shares = self._p, self._shares(self._u)
        stroke = float(shares @ p[nodes, nodes] @ shares) - 2.0 * float(shares @ p[nodes, _V])
        return math.sqrt(max(float(p[_V, _V]) + stroke, 0.0))

    @property
    def _painted(self) -> list[StrokeMap]:
        """Maps of the strokes that are complete, oldest first; the last nodes belong to the last of them."""
        return self.maps[:-1] if self._laying else self.maps

    def start(self, edge: PatternLine) -> None:
        """Begin at a distance from the board's edge; what the picture shows is v plus the tip's error."""
        self._x[:], self._far_known = 0.0, False
        self._x[_V] = -edge.place
        seen, tip = edge.track.deviation**2 + BOARD_STD**2, TIP_STD**2
        self._p[:] = 0.0
        self._p[:2, :2] = (seen + tip, -tip), (-tip, tip)
        self._p[_DRIFT, _DRIFT], self._p[_TURN, _TURN] = DRIFT_STD**2, TURN_STD**2
        self._p[_WANDER, _WANDER] = WANDER_STD**2
        self.guides = {edge.track.track_id: 0.0}
        self._follow_turn(edge, 1.0)
        self._x[_TURN], self._roll = self._roll, 0.0

    def predict(self, du: float, dv: float, dt: float) -> None:
        """The tip has moved by the odometer, in the axes of the strokes [m], within dt [s]."""
        x, p = self._x, self._p
        kept = math.exp(-dt / WANDER_TIME_S)
        x[_V] += dv - x[_DRIFT] * dt
        p[_V] -= dt * p[_DRIFT] + du * (p[_TURN] + p[_WANDER])
        p[:, _V] = p[_V]
        p[_V, _V] -= dt * p[_V, _DRIFT] + du * (p[_V, _TURN] + p[_V, _WANDER])
        x[_WANDER] *= kept
        p[_WANDER] *= kept
        p[:, _WANDER] *= kept
        p[_WANDER, _WANDER] += (1.0 - kept**2) * WANDER_STD**2
        way, per_m = math.hypot(du, dv), UNLED_PER_M if self.unled > UNLED_AFTER_M else ODOMETER_PER_M
        self._way += way
        p[_V, _V] += per_m * way + ODOMETER_AT_REST * dt
        p[_DRIFT, _DRIFT] += DRIFT_WANDER * dt
        p[_TURN, _TURN] += TURN_WANDER * dt
        p[_TIP, _TIP] += TIP_WANDER * dt
        p[_FAR, _FAR] += FAR_PER_M * abs(dv)

    def doubt(self, jump: float) -> None:
        """The odometer may be wrong by its last move [m]."""
        self._p[_V, _V] += jump**2

    def begin_stroke(self) -> None:
        """The tip begins to paint a stroke; what it paints is remembered."""
        self.maps.append(StrokeMap(self._config.stroke_m))
        self._way = self.unled = self.longest_unled = 0.0
        self._misfits = MISFIT_LOOKS * [self.misfit**2]
        self._laying = True
        self._open[:] = True
        self._take_error()

    def lay(self, u: float) -> None:
        """The brush presses here."""
        self.unled, self._way = self.unled + self._way, 0.0
        self.longest_unled = max(self.longest_unled, self.unled)
        self._u = u
        self.maps[-1].add(u, self.v)

    def begin_again(self) -> None:
        """The tip turns round and paints the stroke in progress again, led by its own edge."""
        self.unled = 0.0
        self._again.append((StrokeMap(self._config.stroke_m), StrokeMap(self._config.stroke_m)))

    def lay_again(self, u: float) -> None:
        """The brush presses here, where the stroke in progress lies already."""
        self._u = u
        v, (found, farthest_out) = self.v - float(self._shares(u) @ self._x[_OWN]), self._again[-1]
        found.add(u, v)
        farthest_out.add(u, v + self._deviation_from(_OWN))

    def end_pass(self, before: np.ndarray, after: np.ndarray) -> None:
        """The stroke or retouch ends; what it laid has moved along u, as of `AlongTrack.smoothed` [m], (n,) each.

        Strokes have waves of 3 mm over 0.1 m: a map that is 20 mm off shows no gap where there is one.
        """
        if not self._again:
            self.maps[-1] = self.maps[-1].moved(before, after)
            return
        found, farthest_out = self._again.pop()
        if shift := float(after[0] - before[0]):  # of the passes before: what this one shows belongs to them as well
            to = before[:1] + shift
            self.maps[-1] = self.maps[-1].moved(before[:1], to)
            self._again = [(one.moved(before[:1], to), other.moved(before[:1], to)) for one, other in self._again]
        self._again.append((found.moved(before, after), farthest_out.moved(before, after)))

    def last_stroke(self, first_u: float, last_u: float) -> float:
        """Mean v between two places of the stroke before the one that is laid [m]; NaN where it is not known."""
        before = self._painted
        if not before:
            return math.nan
        return before[-1].mean(first_u, last_u) + float(self._shares(0.5 * (first_u + last_u)) @ self._x[_LAST])

    def stroke_place(self, first_u: float, last_u: float) -> tuple[float, float]:
        """Mean v of the stroke in progress between two places, as first laid, and its standard deviation [m].

        NaN where it was not laid.
        """
        shares = self._shares(np.linspace(first_u, last_u, NODES)).mean(axis=0)
        place = self.maps[-1].mean(first_u, last_u) + float(shares @ self._x[_OWN])
        # The error of a place is the sum of those of all strokes before it.
        misfit = math.sqrt(float(np.mean(np.square([*self._stroke_misfits, self.misfit]))))
        rougher = max(misfit / EDGE_STD, 1.0)  # the filter's own noise of an edge is one EDGE_STD
        return place, rougher * math.sqrt(max(float(shares @ self._p[_OWN, _OWN] @ shares), 0.0))

    def overlap(self, first_u: float, last_u: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Overlap of the stroke in progress with the last one, as painted, where both lie between two places.

        What was painted again adds to it as far as that is certain, and in full to the largest overlap.

        Args:
            first_u: One place along the strokes [m].
            last_u: The other one [m].

        Returns:
            u, overlap, its standard deviation, and the largest overlap [m], (n,) each; empty before the second stroke.
        """
        if len(self.maps) < 2:
            return np.empty(0), np.empty(0), np.empty(0), np.empty(0)
        (u, last), (_, own), p = self.maps[-2].places(), self.maps[-1].places(), self._p
        low, high = sorted((first_u, last_u))
        within = (low <= u) & (u <= high) & np.isfinite(last - own)
        shares = self._shares(u[within])
        inner = np.fmin.reduce([own, *(farthest_out.places()[1] for _, farthest_out in self._again)])
        innermost = np.fmin.reduce([own, *(found.places()[1] for found, _ in self._again)])
        offset = shares @ (self._x[_LAST] - self._x[_OWN]) + 2.0 * self._half
        last, inner, innermost = self._edge(u, last, 1), self._edge(u, inner, -1), self._edge(u, innermost, -1)
        overlap, largest = (last - inner)[within] + offset, (last - innermost)[within] + offset
        covariance = p[_LAST, _LAST] - p[_LAST, _OWN] - p[_OWN, _LAST] + p[_OWN, _OWN]
        return u[within], overlap, np.sqrt(np.maximum(np.sum(shares @ covariance * shares, axis=1), 0.0)), largest

    def _edge(self, u: np.ndarray, v: np.ndarray, side: int) -> np.ndarray:
        """Edge of the band along a line less the brush's radius [m], (bins,); NaN where nothing is painted."""
        painted, edge = np.isfinite(v), np.full(v.size, math.nan)
        edge[painted] = band_edge(u[painted], v[painted], self._half, side)
        return edge

    def end_stroke(self) -> None:
        """The stroke ends: the error of its map becomes that of the last stroke, and beta begins anew.

        Its map is from now on that of its outer edge, which a gust may have moved where it was painted again.
        """
        self._laying, self.unled = False, 0.0
        self.maps[-1] = self._outermost()
        self._again = []
        if len(self.maps) > 1:  # the first stroke has no last edge
            self._stroke_misfits.append(self.misfit)
            self._variances.append(np.diag(self._p)[_LAST].copy())
        self._x[_LAST] = self._x[_OWN]
        self._p[_LAST] = self._p[_OWN]
        self._p[:, _LAST] = self._p[:, _OWN]
        self._x[_AHEAD], self._p[_AHEAD], self._p[:, _AHEAD] = 0.0, 0.0, 0.0
        self._p[_AHEAD, _AHEAD] = AHEAD_STD**2

    def look(self, lines: Sequence[PatternLine], u: float, ahead: float, again: bool = False) -> None:
        """Correct with every edge in view, once per `LOOK_S`.

        Args:
            lines: Lines in view.
            u: Of the tip [m].
            ahead: Direction of travel along u, +-1.
            again: Whether the tip is on the paint of the stroke in progress, which hides the last one's edge.
        """
        self._u = u
        self._forward = self._forward if again else ahead
        if self._laying:
            self._open &= ahead * (self._spacing * np.arange(NODES) - u) > 0.0
            self._take_error()
        parallel = [line for line in lines if line.parallel and line.weight > LOST_WEIGHT]
        guides = []
        straight = math.radians(self._config.gates.fresh_lean_deg)
        last = None if again else self._last_edge(parallel, u, ahead)
        if last is not None and self._laying and self.unled < UNLED_AFTER_M:
            if not math.isnan(self._before):
                self._misfits.append(self._difference * self._before)
            self._before = self._difference
        else:
            self._before = math.nan
        if last is not None and abs(last.lean) < straight:
            guides.append(last)
        if (line := self._board_edge(parallel)) is not None:
            guides.append(line)
            self._follow_turn(line, LOOK_S / TURN_TIME_S)
        else:
            self._correct_turn(lines)
        opposite, known = self._opposite_edge(parallel)
        self.unled = 0.0 if last is not None or guides or known else self.unled
        if opposite is not None:
            guides.append(opposite)
        if self._laying:
            guides += self._own_edges(parallel, u, 0.0 if again else ahead)
        self.guides = {line.track.track_id: self.v + self.tip_error + line.place for line in guides}

    def _correct_turn(self, lines: Sequence[PatternLine]) -> None:
        """Correct the direction with the longest edge of the board across the strokes: it turns with the picture.

        Not while the edge along the strokes is in view, which shows that direction whether the board is square or not.
        """
        edges = [line for line in lines if not line.parallel and line.kind == "board" and line.weight > VISIBLE_WEIGHT]
        line = max(edges, key=lambda edge: edge.length, default=None)
        if line is None or line.length < SQUARE_LENGTH_M:
            return
        row, turned = np.zeros(_STATES), -math.atan(line.lean)
        row[_TURN] = row[_WANDER] = 1.0
        gain = self._p @ row
        expected = float(row @ gain)
        if abs(turned) > GATE_SIGMAS * math.sqrt(expected + SQUARE_STD**2):
            return
        gain = gain / (expected + SQUARE_STD**2 * SQUARE_INDEPENDENT_S / LOOK_S / line.weight)
        self._x += gain * turned
        self._p -= np.outer(gain, row @ self._p)

    def _take_error(self) -> None:
        """The places of the stroke that are still to be laid get the error of v."""
        at = _OWN.start + np.flatnonzero(self._open)
        self._x[at] = 0.0
        self._p[at] = self._p[_V]
        self._p[:, at] = self._p[:, _V, np.newaxis]

    def _shares(self, u: float | np.ndarray) -> np.ndarray:
        """Shares of the nodes in the error of a map at places along it, by linear interpolation; (NODES,) each."""
        place = np.clip(np.asarray(u) / self._spacing, 0.0, NODES - 1.0)
        return np.maximum(1.0 - np.abs(place[..., np.newaxis] - np.arange(NODES)), 0.0)

    def _board_edge(self, lines: list[PatternLine]) -> PatternLine | None:
        found = [line for line in lines if line.kind != "paint" and line.side >= 0]
        noise = BOARD_STD**2 * BOARD_INDEPENDENT_S / LOOK_S
        row = _row_of_h()
        return self._correct([(line, line.place, row, 0.0, 0.0) for line in found], noise, self._config.gates.start_m)

    def _last_edge(self, lines: list[PatternLine], u: float, ahead: float) -> PatternLine | None:
        """Outer edge of the last stroke, or of an older one where the last one is missing."""
        found = [line for line in lines if line.kind != "board" and line.side >= 0]
        nodes: slice | None = _LAST
        for stroke, older in zip(reversed(self._painted), (None, *reversed(self._variances)), strict=False):
            line = self._painted_edge(found, stroke, (u, ahead), self._half, nodes, older)
            if line is not None:
                return line
            nodes = None
        return None

    def _own_edges(self, lines: list[PatternLine], u: float, ahead: float) -> list[PatternLine]:
        """Both edges of the stroke that is being laid, behind the brush: they show where the tip is in the picture.

        On its own paint the outer one, on either side, as every pass over it left it: ``ahead`` is then 0, and the
        inner one is that of the brush.
        They lead the tip, too, where no other edge is in view: velocity alone holds it half as well against friction.
        """
        paint, stroke = [line for line in lines if line.kind == "paint"], self._outermost()
        seen = []
        for side in (1, -1) if ahead else (1,):
            found = [line for line in paint if line.side == side]
            seen.append(self._painted_edge(found, stroke, (u, -ahead), side * self._half, _OWN))
        return [line for line in seen if line is not None]

    def _outermost(self) -> StrokeMap:
        """Map of the stroke in progress, where it was painted again that of its outermost line."""
        stroke = self.maps[-1]
        for found, _ in self._again:
            stroke = stroke.widened(found)
        return stroke

    def _painted_edge(
        self,
        lines: list[PatternLine],
        stroke: StrokeMap,
        place: tuple[float, float],
        half: float,
        nodes: slice | None,
        variances: np.ndarray | None = None,
    ) -> PatternLine | None:
        """Correct with an edge of a stroke.

        Args:
            lines: Those that may be this edge.
            stroke: Map of the stroke.
            place: u of the tip [m], and the direction along u in which the edge is seen, 0 for either.
            half: From the middle of the stroke to the edge [m].
            nodes: States that are the map's error, or None.
            variances: Of the map at its nodes, where they are no states [m^2].
        """
        u, ahead = place
        expected = []
        for line in lines:
            near, far, seen = self._piece(line, ahead)
            if ((near + far) * ahead > 0.0 or ahead == 0.0) and far - near > SHORTEST_M:
                middle, row, variance = 0.5 * (near + far), _row_of_h(), 0.0
                row[_TURN], row[_WANDER], shares = middle, middle, self._shares(u + middle)
                row[_AHEAD] = float(nodes is not _OWN) if ahead else self._share_ahead(near, far)
                level = stroke.mean(u + near, u + far) + half + row[_AHEAD] * float(self._x[_AHEAD])
                if nodes is not None:
                    row[nodes] = shares
                    level += float(shares @ self._x[nodes])
                if variances is not None:
                    variance = float(shares @ variances)
                expected.append((line, seen, row, level, variance))
        return self._correct(expected, EDGE_STD**2 * INDEPENDENT_S / LOOK_S, 0.5 * self._config.pitch_m)

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

    def _correct(
        self, seen: list[tuple[PatternLine, float, np.ndarray, float, float]], noise: float, gate: float
    ) -> PatternLine | None:
        """Correct with the line nearest to its expected place, within a gate [m]; None without one.

        Args:
            seen: Lines, v of each from the tip [m], and of the edge that it may be: row of H, v [m], NaN where that is
                unknown, and variance of its place on the board [m^2].
            noise: Variance of one look [m^2].
            gate: Largest distance from the expected place [m].
        """
        apparent = self.v + self.tip_error
        seen = [edge for edge in seen if not math.isnan(edge[3])]
        if not seen:
            return None
        line, place, row, level, extra = min(seen, key=lambda edge: abs(edge[1] - edge[3] + apparent))
        difference = place - (level - apparent)
        gain = self._p @ row
        expected = float(row @ gain)
        limit = GATE_SIGMAS * math.sqrt(expected + EDGE_STD**2 + extra) + GATE_FLOOR_M
        if abs(difference) > min(limit, gate):
            return None
        gain = gain / (expected + (noise + line.track.deviation**2) / line.weight + extra)
        self._x += gain * difference
        self._p -= np.outer(gain, row @ self._p)
        self._difference = difference
        return line

    def _opposite_edge(self, lines: list[PatternLine]) -> tuple[PatternLine | None, bool]:
        """Correct with the board's edge beyond the last stroke, by kind and side; and whether its place was known.

        An edge elsewhere than expected is another one: its place is known from now on, as well as that of the tip.
        """
        found = [line for line in lines if line.kind == "board" and line.side < 0 and line.place > 0.0]
        if not found:
            return None, False
        if self._far_known:
            row, noise = _row_of_h(), BOARD_STD**2 * BOARD_INDEPENDENT_S / LOOK_S
            row[_FAR] = 1.0
            expected = [(line, line.place, row, self.far_edge, 0.0) for line in found]
            if (line := self._correct(expected, noise, self._config.gates.start_m)) is not None:
                return line, True
        edge = min(found, key=lambda line: line.place)
        x, p, row = self._x, self._p, _row_of_h()
        x[_FAR], self._far_known = self.v + self.tip_error + edge.place, True
        p[_FAR] = -row @ p
        p[:, _FAR] = p[_FAR]
        p[_FAR, _FAR] = float(row @ p @ row) + BOARD_STD**2 + edge.track.deviation**2
        return edge, False

    def _follow_turn(self, edge: PatternLine, share: float) -> None:
        turn = self.picture_turn + share * math.atan(edge.lean)
        self._roll = min(max(turn, -LARGEST_TURN), LARGEST_TURN) - self.turn


def _row_of_h() -> np.ndarray:
    """Row of H for the place of an edge at known v, (_STATES,)."""
    row = np.zeros(_STATES)
    row[_V] = row[_TIP] = -1.0
    return row
