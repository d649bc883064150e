r"""Place of the tip along the strokes, from the odometer and the edges of the board across them.

u counts from the beginning of the nominal stroke: the edge to which stroke 1 runs lies at u = stroke + margin. A Kalman
filter holds u and n, the u of the edge beside the beginning. The place of these edges beside the tip is
:math:`p = (\text{stroke} + \text{margin}) - u` and :math:`p = n - u`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.pattern_lines import CERTAIN_WEIGHT, LOST_WEIGHT, MARK_WEIGHT, PatternLine

#: Variance of the odometer per metre of way [m^2/m]: 7 mm after 1 m, as flown in the datasheet world.
DRIFT_PER_M = 5e-5
#: Standard deviation of an edge's place in one look, and of an unknown place [m]; of the scale by which a far edge's
#: place is seen [-]: depth and focal length.
EDGE_STD, UNKNOWN_STD, SCALE_STD = 2e-3, 0.5, 0.015
#: Standard deviation of the margin beside the beginning where the board's edge confirms it [m].
MARGIN_STD = 1e-3
#: An edge farther from its expected place than this shows another length of the board, or an error of the odometer [-].
SIGMAS = 3.0

_END, _NEAR = np.array((-1.0, 0.0)), np.array((-1.0, 1.0))


class AlongTrack:
    """u of the tip and its uncertainty.

    Attributes:
        known: Whether u has an origin: by an edge, or assumed.
        end_seen: Whether the edge to which stroke 1 runs has been recognised.
        end, near: Tracks of the two edges at the last look, -1 where not in view.
        slip: Largest error of the odometer in the stroke in progress that an edge has shown at once [m].
        step: Last move by the odometer [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config = config
        self._x, self._p = np.zeros(2), np.diag((UNKNOWN_STD**2, UNKNOWN_STD**2))
        self.known = self.end_seen = False
        self._near_known = self._length_unsure = False
        self.slip = self.step = self._unknown = 0.0
        self._way = self._way_variance = self._began = self._began_variance = 0.0
        self.end = self.near = -1
        #: u [m] and its variance [m^2] before and after every look of the pass.
        self._trail: list[tuple[float, float, float, float]] = []

    @property
    def u(self) -> float:
        """Place of the tip [m]."""
        return float(self._x[0])

    @property
    def deviation(self) -> float:
        """Standard deviation of u [m]."""
        return math.sqrt(max(float(self._p[0, 0]), 0.0))

    @property
    def begin(self) -> float:
        """U at which the strokes begin and even ones end [m]: 0, or the margin from the edge beside it."""
        return max(0.0, float(self._x[1]) + self._config.edge_margin_m) if self._near_known else 0.0

    def predict(self, du: float) -> None:
        """The tip has moved by the odometer [m]."""
        self.step = du
        self._x[0] += du
        self._way += du
        self._p[0, 0] += DRIFT_PER_M * abs(du)
        self._way_variance += DRIFT_PER_M * abs(du)

    def doubt(self, jump: float) -> None:
        """The odometer may be wrong by its last move [m]."""
        self._p[0, 0] += jump**2
        self._way_variance += jump**2

    def begin_stroke(self) -> None:
        """A stroke begins here."""
        self._way = self._way_variance = self.slip = 0.0
        self._began, self._began_variance = self.u, float(self._p[0, 0])
        self.begin_pass()

    def begin_pass(self) -> None:
        """A way along the stroke begins here: the stroke, or a retouch one way or the other."""
        variance = float(self._p[0, 0])
        self._trail = [(self.u, variance, self.u, variance)]

    def smoothed(self) -> tuple[np.ndarray, np.ndarray]:
        r"""Places of the pass as they were estimated on the way, and as every later correction shows them.

        The backward recursion of Rauch, Tung and Striebel over the looks k, with u and P before a correction (-) and
        after it,

        .. math:: u^s_k = u_k + \frac{P_k}{P^-_{k+1}} (u^s_{k+1} - u^-_{k+1}).

        Returns:
            u before and after [m], (n,) each: where a look corrects u, its two values and the smoothed one twice.
        """
        prior, prior_variance, u, variance = np.array(self._trail).T
        after = u.copy()
        for k in range(len(u) - 2, -1, -1):
            after[k] += variance[k] / prior_variance[k + 1] * (after[k + 1] - prior[k + 1])
        return np.concatenate((prior, u)), np.concatenate((after, after))

    @property
    def began(self) -> float:
        """Where the stroke began, u [m]; corrections on the way belong to its beginning and to the odometer."""
        share = self._began_variance / (self._began_variance + self._way_variance + EDGE_STD**2)
        return self._began + share * (self.u - self._began - self._way)

    @property
    def moved(self) -> float:
        """From the beginning of the stroke to the tip, along u [m]."""
        return self.u - self.began

    @property
    def stroke_length(self) -> float:
        """Length of the stroke so far [m]."""
        return abs(self.moved)

    @property
    def length_deviation(self) -> float:
        """Standard deviation of that length [m]."""
        ends = self._began_variance + float(self._p[0, 0])
        return math.sqrt(ends * self._way_variance / (ends + self._way_variance)) if ends > 0.0 else 0.0

    def find_end(self, lines: Sequence[PatternLine]) -> bool:
        """Take u from the edge to which stroke 1 runs, wherever it is; False where it is not in view."""
        found = self._certain(_ends(lines))
        if not found:
            return False
        edge = min(found, key=lambda line: line.place)
        self._shift(self._config.stroke_m + self._config.edge_margin_m - edge.place - self.u)
        self._p[0, :] = self._p[:, 0] = 0.0
        self._p[0, 0], self._p[1, 1] = EDGE_STD**2 + (SCALE_STD * edge.place) ** 2, UNKNOWN_STD**2
        self.known = self.end_seen = True
        self._near_known = False  # the next look compares it with the margin
        self.end = edge.track.track_id
        return True

    def start_at(self, mark: PatternLine) -> None:
        """Take u from the edge beside the beginning: the job begins at the margin from it."""
        near = -self._config.edge_margin_m
        self._x[:] = near - mark.place, near
        self._p[:] = MARGIN_STD**2
        self._p[0, 0] += EDGE_STD**2
        self.known = self._near_known = True

    def start_here(self) -> None:
        """The job begins where the tip is."""
        self._x[0], self._p[0, 0], self.known = 0.0, MARGIN_STD**2, True

    def look(self, lines: Sequence[PatternLine]) -> str:
        """Correct with the edges in view, once per look; returns what was noticed, or an empty text."""
        noticed, prior, self._unknown = "", (self.u, float(self._p[0, 0])), 0.0
        ends = [line for line in _ends(lines) if line.weight > (LOST_WEIGHT if self.end_seen else CERTAIN_WEIGHT)]
        expected = self._config.stroke_m + self._config.edge_margin_m - self.u
        end = self._edge(ends, expected, self._end_gate)
        self.end = -1 if end is None else end.track.track_id
        if end is not None:
            noticed = self._correct(end, expected, _END)
            self.end_seen = True
        beside = [line for line in lines if not line.parallel and line.kind != "paint" and line.side >= 0]
        beside = [line for line in beside if line.weight > (LOST_WEIGHT if self._near_known else MARK_WEIGHT)]
        near, erred = self._near_edge(beside)
        self.near = -1 if near is None else near.track.track_id
        self._trail.append((prior[0], prior[1] + self._unknown, self.u, float(self._p[0, 0])))
        return noticed or erred

    @property
    def _end_gate(self) -> float:
        """Largest distance of that edge from its expected place [m]: the length of stroke 1 is nominal."""
        return self._config.gates.stop_m if self.end_seen else self._config.gates.first_stop_m

    def _near_edge(self, lines: list[PatternLine]) -> tuple[PatternLine | None, str]:
        """Correct with the edge beside the beginning; returns it and what was noticed."""
        margin = self._config.edge_margin_m
        if self._near_known:
            expected = float(self._x[1]) - self.u
            near = self._edge(lines, expected, self._config.gates.stop_m)
            return near, "" if near is None else self._correct(near, expected, _NEAR)
        found = [line for line in lines if line.kind == "board" and line.weight > CERTAIN_WEIGHT and line.place < 0.0]
        if not found:
            return None, ""
        near = max(found, key=lambda line: line.place)
        self._x[1] = self.u + near.place
        self._p[0, 1] = self._p[1, 0] = self._p[0, 0]
        self._p[1, 1] = self._p[0, 0] + EDGE_STD**2
        self._near_known = True
        likely = abs(float(self._x[1]) + margin) < SIGMAS * math.sqrt(float(self._p[1, 1]))
        if self._config.begins_at_margin and likely:
            self._update(-margin - float(self._x[1]), np.array((0.0, 1.0)), MARGIN_STD**2)
        return near, ""

    def _edge(self, lines: list[PatternLine], expected: float, gate: float) -> PatternLine | None:
        """Edge beside its expected place; else a certain edge of the board farther off.

        It is the odometer that errs, and no stroke runs over an edge in view: a fault of the velocity for seconds moves
        u by more than the margin.
        """
        near = _nearest(lines, expected, gate)
        if near is not None:
            return near
        return _nearest(self._certain(lines), expected, self._config.gates.first_stop_m)

    def _certain(self, lines: list[PatternLine]) -> list[PatternLine]:
        """Edges of the board that are seen well."""
        limit = self._config.gates.start_deviation_m
        board = [line for line in lines if line.kind == "board" and line.weight > CERTAIN_WEIGHT]
        return [line for line in board if line.track.deviation < limit]

    def _correct(self, line: PatternLine, expected: float, row: np.ndarray) -> str:
        difference = line.place - expected
        seen = EDGE_STD**2 + line.track.deviation**2 + (SCALE_STD * line.place) ** 2
        variance = float(row @ self._p @ row) + seen
        noticed = ""
        if abs(difference) > SIGMAS * math.sqrt(variance):
            if line.weight <= CERTAIN_WEIGHT:
                return ""  # it leaves the picture or has just come, and its fit may be wrong
            unknown = self._config.gates.first_stop_m**2
            if row is _END and not self.end_seen:
                # Both edges are seen, so the board is longer or shorter than the job says: the origin of u moves.
                self._p += unknown
                self._began_variance += unknown
                self._unknown += unknown
                self._trail = [(u, p + unknown, v, q + unknown) for u, p, v, q in self._trail]
                self._length_unsure = True
                noticed = f"the board's edge lies {difference * 1e3:+.0f} mm from where the job expects it"
            elif row is _NEAR and self._length_unsure:
                self._p[1, 1] += unknown  # it was the odometer then, and the board is as long as the job says
            else:
                self._p[0, 0] += unknown
                self._way_variance += unknown
                self._unknown += unknown
                self.slip = max(self.slip, abs(difference))
                noticed = f"the tip is {-difference * 1e3:+.0f} mm from where the odometer has it"
        if row is _NEAR and self.end == -1:
            self._length_unsure = False
        self._update(difference, row, seen / max(line.weight, LOST_WEIGHT))
        return noticed

    def _update(self, difference: float, row: np.ndarray, noise: float) -> None:
        gain = self._p @ row
        gain = gain / (float(row @ gain) + noise)
        self._x += gain * difference
        self._p -= np.outer(gain, row @ self._p)

    def _shift(self, by: float) -> None:
        self._x += by


def _ends(lines: Sequence[PatternLine]) -> list[PatternLine]:
    """Edges that may end stroke 1: across the strokes, the surface on the side from which the brush comes."""
    return [line for line in lines if not line.parallel and line.kind != "paint" and line.side < 0]


def _nearest(lines: Sequence[PatternLine], expected: float, gate: float) -> PatternLine | None:
    near = [line for line in lines if abs(line.place - expected) < gate]
    return min(near, key=lambda line: abs(line.place - expected), default=None)
