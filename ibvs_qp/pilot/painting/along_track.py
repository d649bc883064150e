r"""Place of the tip along the strokes, from the odometer and the edges of the board across them.

u counts from the beginning of the nominal stroke: the edge to which stroke 1 runs lies at u = stroke + margin. A Kalman
filter holds u and n, the u of the edge next to the beginning. The place of these edges beside the tip is
:math:`p = (\text{stroke} + \text{margin}) - u` and :math:`p = n - u`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.pattern_lines import (
    CERTAIN_WEIGHT,
    LOST_WEIGHT,
    MARK_WEIGHT,
    PatternLine,
    nearest,
    surface_edges,
)

#: Variance of the odometer per metre of way [m^2/m]: 7 mm after 1 m, as measured in the datasheet world.
DRIFT_PER_M = 5e-5
#: Standard deviation of an edge's place in one look, and of an unknown place [m]; of the scale by which a far edge's
#: place is seen [-]: depth and focal length.
EDGE_STD, UNKNOWN_STD, SCALE_STD = 2e-3, 0.5, 0.015
#: Standard deviation of the margin next to the beginning where the board's edge confirms it [m].
MARGIN_STD = 1e-3
#: An edge farther from its expected place than this shows another length of the board, or an error of the odometer [-].
SIGMAS = 3.0

_END, _NEAR, _MARGIN = np.array((-1.0, 0.0)), np.array((-1.0, 1.0)), np.array((0.0, 1.0))


class AlongTrack:
    """u of the tip and its uncertainty.

    Attributes:
        u: Place of the tip [m].
        known: Whether u has an origin: by an edge, or assumed.
        end_seen: Whether the edge to which stroke 1 runs has been recognised.
        end, near: Tracks of the two edges at the last look, -1 where not in view.
        slip: Largest error of the odometer in the stroke in progress that an edge has shown at once [m].
        step: Last move by the odometer [m].
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._end_u = config, config.stroke_m + config.edge_margin_m
        self.u = self._near_u = 0.0
        self._p = np.diag((UNKNOWN_STD**2, UNKNOWN_STD**2))
        self.known = self.end_seen = self._near_known = self._length_unsure = False
        self.end = self.near = -1
        self.slip = self.step = self._way = self._way_variance = self._began = self._began_variance = 0.0
        self._unknown = 0.0  # variance of u that an edge has shown at this look [m^2]
        #: u [m] and its variance [m^2] before and after every look of the pass.
        self._trail: list[tuple[float, float, float, float]] = []

    @property
    def _variance(self) -> float:
        return float(self._p[0, 0])

    @property
    def deviation(self) -> float:
        """Standard deviation of u [m]."""
        return math.sqrt(max(self._variance, 0.0))

    @property
    def begin(self) -> float:
        """U at which the strokes begin and even ones end [m]: 0, or the margin from the edge beside it."""
        return max(0.0, self._near_u + self._config.edge_margin_m) if self._near_known else 0.0

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
        ends = self._began_variance + self._variance
        return math.sqrt(ends * self._way_variance / (ends + self._way_variance)) if ends > 0.0 else 0.0

    def predict(self, du: float, jumped: bool = False) -> None:
        """The tip has moved by the odometer [m]; it may be wrong by this move if it jumped."""
        self.step = du
        self.u += du
        self._way += du
        self._add_variance(DRIFT_PER_M * abs(du))
        if jumped:
            self._add_variance(du**2)

    def _add_variance(self, variance: float) -> None:
        """The odometer is less certain [m^2]."""
        self._p[0, 0] += variance
        self._way_variance += variance

    def begin_stroke(self) -> None:
        """A stroke begins here."""
        self._way = self._way_variance = self.slip = 0.0
        self._began, self._began_variance = self.u, self._variance
        self.begin_pass()

    def begin_pass(self) -> None:
        """A way along the stroke begins here: the stroke, or a retouch one way or the other."""
        self._trail = [(self.u, self._variance, self.u, self._variance)]

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

    def find_end(self, lines: Sequence[PatternLine]) -> bool:
        """Take u from the edge to which stroke 1 runs, wherever it is; False where it is not in view."""
        edge = min(self._certain(_ends(lines)), key=lambda line: line.place, default=None)
        if edge is None:
            return False
        self.u += self._end_u - edge.place - self.u
        self._p[:] = np.diag((EDGE_STD**2 + (SCALE_STD * edge.place) ** 2, UNKNOWN_STD**2))
        self.known = self.end_seen = True
        self._near_known = False  # the next look compares it with the margin
        self.end = edge.track.track_id
        return True

    def find_mark(self, lines: Sequence[PatternLine]) -> bool:
        """Take u from the edge next to the beginning, if the job begins at the margin from it and the tip is there."""
        near, mark_m = -self._config.edge_margin_m, self._config.gates.mark_m
        mark = nearest(surface_edges(lines, parallel=False), near)
        if mark is None or mark.weight <= CERTAIN_WEIGHT or not self._config.begins_at_margin:
            return False
        if abs(mark.place - near) >= mark_m + SIGMAS * mark.track.deviation:
            return False
        self.u, self._near_u = near - mark.place, near
        self._p[:] = MARGIN_STD**2
        self._p[0, 0] += EDGE_STD**2
        self.known = self._near_known = True
        return True

    def start_here(self) -> None:
        """The job begins where the tip is."""
        self.u, self._p[0, 0], self.known = 0.0, MARGIN_STD**2, True

    # ------------------------------------------------------------------- looks

    def look(self, lines: Sequence[PatternLine]) -> str:
        """Correct with the edges in view, once per look; returns the event in words, or an empty text."""
        u, variance, noticed, self._unknown = self.u, self._variance, "", 0.0
        ends = [line for line in _ends(lines) if line.weight > (LOST_WEIGHT if self.end_seen else CERTAIN_WEIGHT)]
        # The length of stroke 1 is nominal.
        gate = self._config.gates.stop_m if self.end_seen else self._config.gates.first_stop_m
        end = self._edge(ends, self._end_u - u, gate)
        self.end = -1 if end is None else end.track.track_id
        if end is not None:
            noticed = self._correct(end, self._end_u - u, _END)
            self.end_seen = True
        beside = surface_edges(lines, parallel=False)
        beside = [line for line in beside if line.weight > (LOST_WEIGHT if self._near_known else MARK_WEIGHT)]
        near, erred = self._near_edge(beside)
        self.near = -1 if near is None else near.track.track_id
        self._trail.append((u, variance + self._unknown, self.u, self._variance))
        return noticed or erred

    def _near_edge(self, lines: list[PatternLine]) -> tuple[PatternLine | None, str]:
        """Correct with the edge next to the beginning; returns it and the event in words."""
        if self._near_known:
            expected = self._near_u - self.u
            near = self._edge(lines, expected, self._config.gates.stop_m)
            return near, "" if near is None else self._correct(near, expected, _NEAR)
        found = [line for line in lines if line.kind == "board" and line.weight > CERTAIN_WEIGHT and line.place < 0.0]
        near = max(found, key=lambda line: line.place, default=None)
        if near is None:
            return None, ""
        self._near_u = self.u + near.place
        self._p[0, 1] = self._p[1, 0] = self._p[0, 0]
        self._p[1, 1] = self._p[0, 0] + EDGE_STD**2
        self._near_known = True
        margin = self._config.edge_margin_m
        likely = abs(self._near_u + margin) < SIGMAS * math.sqrt(float(self._p[1, 1]))
        if self._config.begins_at_margin and likely:
            self._update(-margin - self._near_u, _MARGIN, MARGIN_STD**2)
        return near, ""

    def _edge(self, lines: list[PatternLine], expected: float, gate: float) -> PatternLine | None:
        """Edge near its expected place; else a certain edge of the board farther off.

        It is the odometer that errs, and no stroke runs over an edge in view: a fault of the velocity for seconds moves
        u by more than the margin.
        """
        near = nearest(lines, expected, gate)
        return near or nearest(self._certain(lines), expected, self._config.gates.first_stop_m)

    def _certain(self, lines: list[PatternLine]) -> list[PatternLine]:
        """Edges of the board in clear view."""
        limit, board = self._config.gates.start_deviation_m, [line for line in lines if line.kind == "board"]
        return [line for line in board if line.weight > CERTAIN_WEIGHT and line.track.deviation < limit]

    def _correct(self, line: PatternLine, expected: float, row: np.ndarray) -> str:
        difference, noticed = line.place - expected, ""
        seen = EDGE_STD**2 + line.track.deviation**2 + (SCALE_STD * line.place) ** 2
        if abs(difference) > SIGMAS * math.sqrt(float(row @ self._p @ row) + seen):
            if line.weight <= CERTAIN_WEIGHT:
                return ""  # it leaves the picture or has just come, and its fit may be wrong
            unknown = self._config.gates.first_stop_m**2
            if row is _END and not self.end_seen:
                # Both edges are in view, so the board's length differs from the job's: the origin of u moves.
                self._p += unknown
                self._began_variance += unknown
                self._unknown += unknown
                self._trail = [(u, p + unknown, v, q + unknown) for u, p, v, q in self._trail]
                self._length_unsure = True
                noticed = f"the board's edge lies {difference * 1e3:+.0f} mm from where the job expects it"
            elif row is _NEAR and self._length_unsure:
                self._p[1, 1] += unknown  # the odometer has drifted, and the board has the length of the job
            else:
                self._add_variance(unknown)
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
        self.u, self._near_u = self.u + float(gain[0]) * difference, self._near_u + float(gain[1]) * difference
        self._p -= np.outer(gain, row @ self._p)


def _ends(lines: Sequence[PatternLine]) -> list[PatternLine]:
    """Edges that may end stroke 1: across the strokes, the surface on the side from which the brush comes."""
    return surface_edges(lines, parallel=False, side=-1)
