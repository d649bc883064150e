"""The stroke in progress: its place, its painted part, and whether it is claimed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.pilot.painting.along_track import SIGMAS, AlongTrack
from ibvs_qp.pilot.painting.command import PainterInput
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.cross_track import CrossTrack
from ibvs_qp.pilot.painting.pattern import FILL, FILL_REST_M, PLACE_TOLERANCE_M, Pattern, stroke_place
from ibvs_qp.pilot.painting.speed import clipped

#: The end of a stroke moves by at most this much so that its length is right [m]. A stroke that begins farther from its
#: place than the other value shows that the board's length differs from the job's [m].
MOST_END_SHIFT_M, MOST_BEGIN_ERROR_M = 0.004, 0.015
#: A stroke is as long as asked within this [m]; if it ends without an edge, u must be known this well [m].
LENGTH_TOLERANCE_M, CERTAIN_LENGTH_M = 0.01, 0.005
#: Longest way without an edge of a stroke that is claimed [m]: the odometer errs by 3 mm on it in the datasheet world,
#: and by up to 10 mm in the harsh one.
MOST_UNLED_M = 0.4
#: Way without an edge after which a stroke runs farther out until one shows [m], how steeply [-], steeper than the
#: odometer errs, and how far, over the nominal overlap [-].
UNLED_BEFORE_M, ASIDE_SLOPE, MOST_ASIDE = 0.05, 0.06, 0.75
#: Way outwards of a step from stroke to stroke and of an alignment while no edge is in view [m].
ASIDE_M = 0.002
#: Most of the time of painting without contact [-]; push of no contact [N]; part of the commanded push above which a
#: place has felt the brush [-]: the filtered push falls late, and a hole looks shorter by 10 mm at 0.3, by 5 mm at 0.5.
MOST_LOST, LOST_N, FELT_SHARE = 0.02, 0.3, 0.5
#: Length of the pieces of a stroke that have felt the brush or not [m]: more than one tick's way at 0.5 m/s.
PIECE_M = 0.0025
#: Last part of a stroke, whose overlap does not count [m].
CORNER_M = 0.02
#: Standard deviations at which a stroke is at its place, leaves no gap, and overlaps no more than allowed [-].
PLACE_SIGMAS, GAP_SIGMAS, DEPTH_SIGMAS = 2.0, 2.0, 1.0
#: Way ahead from which a stroke takes its target [m]: the tip follows a target that moves within half a second.
REACTION_M = 0.05
#: Target overlap where the stroke before falls short, and the most of a stroke that is claimed, over the nominal
#: overlap [-].
LEAST_OVERLAP, MOST_OVERLAP = 0.75, 3.0
#: Retouches of one stroke [-]; standard deviations by which its overlap must be positive [-]; length that is painted
#: again before the gap [m]; distance from the beginning of the stroke where the tip turns [m]: it slides on by 11 mm.
MOST_RETOUCHES, RETOUCH_SIGMAS, RETOUCH_BEFORE_M, TURN_BEFORE_M = 2, 2.5, 0.1, 0.02
#: Target overlap of a retouch over the nominal overlap [-]: at 1.5 the innermost of three passes exceeded
#: `MOST_OVERLAP` in 3 of 12 flights in the world twice_harsh, at 1.25 in 1.
RETOUCH_OVERLAP = 1.25
#: Most by which the target overlap of a stroke, and of its retouch, exceeds the planned one, over the job's [-]: waves
#: of both strokes add to it.
EXCESS, RETOUCH_EXCESS = 0.4, 0.5


@dataclass
class Stroke:
    """The stroke in progress, or the next one."""

    config: PaintingConfig
    cross: CrossTrack
    along: AlongTrack
    number: int  # from 1
    place: float  # v where it belongs [m]
    painted_s: float = 0.0  # time of painting in the job so far [s]
    lost_s: float = 0.0  # and of it without contact [s]
    slipped: bool = False  # whether an edge has shown an error of the odometer in a stroke before
    touches: int = 0  # that were taken back before it
    retouches: int = 0
    back_to: float = math.nan  # u to which the tip goes back for a retouch [m], NaN otherwise
    longest: float = 0.0  # length with each pass and overshoot [m]
    behind: float = 0.0  # paint before its beginning, by a gust or a retouch [m]

    def __post_init__(self) -> None:
        """Derive."""
        self.travel = Pattern.travel(self.number)
        self._felt = np.zeros(round(self.config.stroke_m / PIECE_M), bool)  # pieces that the brush has touched

    def following(self) -> Stroke:
        """The stroke after this one, whose place is kept until the step to the next one begins."""
        number, slipped = self.number + 1, self.slipped or self._slips
        return Stroke(self.config, self.cross, self.along, number, self.place, self.painted_s, self.lost_s, slipped)

    @property
    def _slips(self) -> bool:
        """Whether an edge has shown an error of the odometer beyond the tolerance of the length."""
        return self.along.slip > LENGTH_TOLERANCE_M

    @property
    def goes_back(self) -> bool:
        """Whether the tip goes back to where it paints again."""
        return not math.isnan(self.back_to)

    @property
    def direction(self) -> float:
        """Direction of travel along u: the last stroke's edge is in view there, not under the brush."""
        return -self.travel if self.goes_back else self.travel

    @property
    def begin(self) -> float:
        """Where the stroke begins, u [m]."""
        return self.along.begin if self.travel > 0.0 else self.config.stroke_m

    @property
    def goal(self) -> float:
        """Where the stroke ends, u [m].

        Half the error of its beginning is made up for there, and the paint that a gust laid before it, together at most
        `MOST_END_SHIFT_M`.
        """
        goal = self.config.stroke_m if self.travel > 0.0 else self.along.begin
        error = self.along.began - self.begin
        if abs(error) > MOST_BEGIN_ERROR_M:
            return goal
        return goal + clipped(0.5 * error - self.travel * self.behind, -MOST_END_SHIFT_M, MOST_END_SHIFT_M)

    @property
    def way(self) -> tuple[float, float]:
        """From the tip to the beginning, along u and v [m]."""
        return self.begin - self.along.u, self.place - self.cross.v

    def nominal_place(self, number: int) -> float:
        """Nominal v of a stroke [m]; the last one of a filling job keeps the margin to a far edge in view."""
        config, far_edge = self.config, self.cross.far_edge
        rows = number if math.isnan(far_edge) else config.rows
        return stroke_place(number, rows, far_edge, config.edge_margin_m, config.pitch_m)

    @property
    def is_last(self) -> bool:
        """Whether the job ends with it."""
        if self.config.rows != FILL:
            return self.number >= int(self.config.rows)
        rest = self.cross.far_edge - self.config.edge_margin_m - self.place
        return rest <= FILL_REST_M  # not where it is unknown

    @property
    def certain_m(self) -> float:
        """Half the overlap, or the certainty at any overlap [m]; a stroke that errs by twice as much leaves a gap."""
        return max(0.5 * self.config.overlap_m, self.config.least_certainty_m)

    @property
    def is_certain(self) -> bool:
        """Whether three standard deviations of the place are certain."""
        return SIGMAS * self.cross.deviation < self.certain_m

    @property
    def planned_overlap(self) -> float:
        """Overlap with the stroke before at their places [m]: the last one of a filling job has more."""
        return self.config.brush_width_m - (self.place - self.nominal_place(self.number - 1))

    @property
    def nominal_overlap(self) -> float:
        """Overlap that is asked for [m], 0 for stroke 1; the last one of a filling job may have less than the job's."""
        return 0.0 if self.number < 2 else min(self.config.overlap_m, self.planned_overlap)

    def aside(self, way: float = ASIDE_M) -> float:
        """Way outwards at which an edge shows that the arm hides from a tip that errs inwards [m]."""
        return max(min(way, MOST_ASIDE * self.nominal_overlap), 0.0)

    def target(self) -> float:
        """Target v of a first pass [m]; farther and farther out where no edge shows."""
        target = self._touching_target(self.place, LEAST_OVERLAP)
        if aside := self.aside(ASIDE_SLOPE * (self.cross.unled - UNLED_BEFORE_M)):
            target = min(target + aside, max(target, self._touching_target(self.place + aside, 1.0 - MOST_ASIDE)))
        return target

    def retouch_target(self) -> float:
        """Target v of a pass over the stroke [m]: farther in, and no farther out than the first one."""
        first, _ = self.cross.stroke_place(*self._piece_ahead())
        place = self.place if math.isnan(first) else min(self.place, first)
        return self._touching_target(place, RETOUCH_OVERLAP, RETOUCH_EXCESS)

    def _touching_target(self, place: float, share: float, excess: float = EXCESS) -> float:
        """The place, or v beside it where the stroke before lies off its own [m].

        ``share`` is the least overlap over the nominal one; ``excess`` the largest less the planned, over the job's.
        """
        reach = self._reach_of_last()
        if math.isnan(reach):
            return place
        deepest = reach - self.planned_overlap - excess * self.config.overlap_m
        return max(min(place, reach - share * self.nominal_overlap), deepest)

    def _reach_of_last(self) -> float:
        """Largest v at which the brush still touches the stroke before [m]; NaN where unknown."""
        return self.cross.last_stroke(*self._piece_ahead()) + self.config.brush_width_m

    def _piece_ahead(self) -> tuple[float, float]:
        """First and last u of a piece ahead of the tip, as long as half the brush's width [m]."""
        middle, half = self.along.u + REACTION_M * self.direction, 0.25 * self.config.brush_width_m
        return middle - half, middle + half

    def count(self, inputs: PainterInput, dt: float) -> None:
        """Count the time of painting, and of it without contact, and mark the piece under the brush."""
        self.painted_s += dt
        if inputs.in_contact:
            self.behind = max(self.behind, -self.travel * self.along.moved)
        if inputs.push <= LOST_N:
            self.lost_s += dt
        elif inputs.in_contact and inputs.push > FELT_SHARE * inputs.push_reference:  # one sample alone may be noise
            self._felt[self._piece(self.along.u)] = True

    def _hole(self) -> tuple[float, float] | None:
        """First and last u of the longest way without contact that leaves a hole [m]; None without one.

        The brush covers half its width from both sides; beyond an end there is no other side.
        """
        first, last = sorted((self._piece(self.along.began), self._piece(self.along.u)))
        felt, half = self._felt[first : last + 1], round(0.5 * self.config.brush_width_m / PIECE_M)
        holes = np.flatnonzero(np.diff(felt.astype(int), prepend=1, append=1)).reshape(-1, 2)
        size = np.diff(holes)[:, 0]
        inner = (holes[:, 0] > half) & (holes[:, 1] < len(felt) - half)
        size[size <= np.where(inner, half, round(LENGTH_TOLERANCE_M / PIECE_M))] = 0
        if not size.any():
            return None
        begin, end = (first + holes[np.argmax(size)]) * PIECE_M
        return float(begin), float(end)

    def _without_contact(self, hole: tuple[float, float]) -> str:
        return f"row {self.number} was without contact over {1e3 * (hole[1] - hole[0]):.0f} mm"

    def _piece(self, u: float) -> int:
        return int(clipped(u / PIECE_M, 0.0, len(self._felt) - 1.0))

    def measure(self) -> None:
        """Measure the paint past the end of the stroke, to which gusts push the tip."""
        self.longest = max(self.longest, self.along.stroke_length)

    def turn_back(self) -> str:
        """Go back to where the stroke may leave a gap to the last one; empty where not, or if it cannot be mended."""
        u, overlap, known, _ = self._overlap()
        least = overlap - RETOUCH_SIGMAS * np.hypot(known, self.cross.misfit)
        enough = RETOUCH_OVERLAP * self.config.overlap_m > RETOUCH_SIGMAS * known
        gaps = u[(least < 0.0) & enough & (SIGMAS * known <= 2.0 * self.certain_m)]
        hole = self._hole()
        gap = f"row {self.number} may leave a gap of {-float(least.min()) * 1e3:.1f} mm" if gaps.size else ""
        gaps = np.concatenate((gaps, hole or ()))
        if not gaps.size or self.retouches >= MOST_RETOUCHES or self.cross.longest_unled > MOST_UNLED_M:
            return ""
        first = float(gaps.min() if self.travel > 0.0 else gaps.max())
        before = max(self.travel * (first - self.begin) - RETOUCH_BEFORE_M, TURN_BEFORE_M)
        self.retouches, self.back_to = self.retouches + 1, self.begin + self.travel * before
        flaw = gap or self._without_contact(hole or (math.nan, math.nan))
        return f"{flaw}, back by {abs(self.along.u - self.back_to):.2f} m"

    def doubt(self, by_edge: bool) -> str:
        """Why the stroke that has ended, with the edge there in view or not, is not claimed; empty where it is."""
        config, along, cross, row, asked = self.config, self.along, self.cross, self.number, self.config.stroke_m
        if not by_edge and along.deviation > CERTAIN_LENGTH_M:
            return f"row {row} ended by the odometer, its length is known to {along.deviation * 1e3:.0f} mm"
        ended, known = along.stroke_length, along.length_deviation
        if abs(ended - asked) + known > LENGTH_TOLERANCE_M:
            ends = f"row {row} is {ended * 1e3:.0f} mm long, known to {known * 1e3:.1f} mm"
            return f"{ends}, {asked * 1e3:.0f} mm were asked"
        # The greatest of many estimates errs towards more: no margin.
        if (painted := self.longest + self.behind) - asked > LENGTH_TOLERANCE_M:
            return f"row {row} is painted over {painted * 1e3:.0f} mm, {asked * 1e3:.0f} mm were asked"
        # the odometer seldom errs in two strokes: one of the edges is false
        if along.slip > config.gates.stop_m or (self._slips and self.slipped):
            return f"row {row} met an edge {along.slip * 1e3:.0f} mm from where the odometer expected it"
        if hole := self._hole():
            return self._without_contact(hole)
        if self.is_last and self.lost_s > MOST_LOST * self.painted_s:
            return f"the strokes were without contact for {self.lost_s:.1f} s of {self.painted_s:.1f} s"
        _, overlap, known, largest = self._overlap()
        errs, nominal = np.hypot(known, cross.misfit), self.planned_overlap
        if SIGMAS * (worst := known.max(initial=0.0)) > 2.0 * self.certain_m:
            return f"row {row} lost its edge, its overlap is known to {worst * 1e3:.1f} mm"
        if cross.longest_unled > MOST_UNLED_M:
            return f"row {row} had no edge to follow for {cross.longest_unled:.2f} m"
        if (least := (overlap - GAP_SIGMAS * errs).min(initial=math.inf)) < 0.0:
            return f"row {row} may leave a gap of {-least * 1e3:.1f} mm to the row before"
        if (most := (largest + DEPTH_SIGMAS * errs).max(initial=0.0)) > MOST_OVERLAP * nominal:
            return f"row {row} may overlap the row before by {most * 1e3:.1f} mm, nominal {nominal * 1e3:.1f} mm"
        place, known = cross.stroke_place(self.begin, self.goal)
        if not abs(aside := place - self.place) + PLACE_SIGMAS * known <= PLACE_TOLERANCE_M:  # nor where it is unknown
            lies = f"row {row} lies {aside * 1e3:+.0f} mm from its place, known to {known * 1e3:.1f} mm"
            return f"{lies}, limit {PLACE_TOLERANCE_M * 1e3:g} mm"
        return ""

    def _overlap(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Overlap of the stroke that has ended with the last one, as of `CrossTrack.overlap`."""
        return self.cross.overlap(self.begin, self.goal - CORNER_M * self.travel)
