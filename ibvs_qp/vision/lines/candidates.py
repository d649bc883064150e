"""Search for lines without a prediction: edges near the end of the surface and of the paint, fitted and scored."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import DetectConfig
from ibvs_qp.vision.lines.borders import Borders, board_beside_paint, differing, end_of_paint, score_borders, trimmed
from ibvs_qp.vision.lines.refine import FIT_BEYOND, LineFits, RefinedLine
from ibvs_qp.vision.lines.segments import edge_segments
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.plane import SurfaceRegion

#: Lines nearer than this are on one edge, and a segment this near to a known line is that one [px at 640].
_SAME_PX, _KNOWN_PX = 2.5, 8.0
#: Half width of the strip in which an edge of paint is fitted, and width within which it is one edge [px at 640]; it is
#: fitted beyond a segment by this multiple of its length.
_PAINT_PX, _ACROSS = 6.0, 20.0
#: A longer line on an edge is taken if its further part has this fraction of the better one's score.
_FURTHER_SHARE = 0.5
#: Score from which a line counts as a border of the surface.
BORDER = 0.2
#: A segment of a lower score before it is fitted will be no border after that.
_HOPELESS = 0.05
#: Confidence of an edge of paint whose two sides have the colours of paint and board.
_PAINT_CONFIDENCE = 0.9
#: Fraction of a line along which its sides must show board and paint, and along which depth rules out an edge of paint.
_SHOWS, _DEPTH_STEP = 0.6, 0.5
#: A border is sure to end the surface if depth, colour and the surface next to it show that for this fraction of it.
_ENDS = 0.5
#: Another border is nested in it if it lies farther inwards by less than this, the farthest place at which depth is
#: read to see the surface's end [px at 640], along it (cosine), and the other has this fraction of its score and of its
#: length at least; it keeps this part of score and confidence. A joint of a wall beside the end has up to 0.57 of its
#: length (truth frames, seeds 0 to 24).
_SOON_PX, _ALONG, _RIVAL, _LONG_ENOUGH, _NESTED = 26.0, 0.995, 0.7, 0.6, 0.6
#: Length that earns the full score of an edge of paint, fraction of the picture's width.
_FULL_LENGTH = 0.4
#: Logistic regression on candidates of truth frames (families hard, smeared depth, oblique, printed, flush wall; seeds
#: 100 and up): constant, weight of the score, weight of the fraction along which colour agrees. The constant is lower
#: than fitted by 1.5: a wrong line that is sure does more harm than a right one that is not.
_CONSTANT, _SCORE, _COLOR = -9.5, 11.0, 3.0


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A detected line, and its kind."""

    line: RefinedLine  # the fitted line
    role: str  # "horizontal" or "vertical", relative to gravity where it is known
    kind: str  # "board" (border of the surface), "paint" (edge of paint) or ""
    surface_side: int  # +1 or -1, the side of the normal on which the (unpainted) surface lies, 0 if unknown
    borders_plane: bool  # whether the surface ends there
    score: float  # 0..1, ranks the lines of one picture
    confidence: float  # 0..1, fraction of such lines that are of this kind
    ends_surface: bool = False  # whether depth and colour both show that the surface reaches it and ends


class LineSearch:
    """Finds and classifies the lines of a surface, whose fits are those of `LineFits`."""

    def __init__(self, config: DetectConfig, colors: SurfaceColors, fits: LineFits) -> None:
        self._config, self._colors, self._fits = config, colors, fits

    def find_candidates(
        self, picture: Picture, surface: SurfaceRegion, known: tuple[RefinedLine, ...] = ()
    ) -> list[Candidate]:
        """Find lines at the end of the surface, and edges of paint on it where its colour is known, best first.

        Where the tilt is known, lines near level and upright alone are looked at; known lines need no search. No two of
        the candidates are on the same edge.
        """
        config, colors, painted = self._config, self._colors, self._colors.paint_distinct
        region = surface.end_band(config.band_cells)
        if painted:
            region = region | end_of_paint(picture, surface, colors)
        segments, near = edge_segments(picture, region, config.half_range_deg), _KNOWN_PX * picture.scale
        new = [not any(_beside(ends, line.ends_px, near) for line in known) for ends in segments.reshape(-1, 2, 2)]
        segments = segments[new]
        if len(segments) == 0:
            return []
        rough, most = score_borders(segments, picture, surface, colors).score, config.candidates
        best = np.argsort(-rough, kind="stable")[:most]
        best = best[rough[best] > _HOPELESS]
        pieces = trimmed(segments[best], picture, surface)
        beyond = np.repeat((FIT_BEYOND, 0.0), (len(best), len(pieces)))
        fits = self._fits.fit_segments(picture, np.vstack((segments[best], pieces)), beyond, contents=painted)
        if painted:
            share = differing(segments, picture, colors)
            share[best] = 0.0
            lengths = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
            order = np.argsort(-lengths * share, kind="stable")
            order = order[share[order] > _SHOWS][:most]
            # across the picture: a stroke is wavy, and a short piece of it leans
            beyond = np.full(len(order), _ACROSS)
            fits += self._fits.fit_segments(picture, segments[order], beyond, contents=True, half_width_px=_PAINT_PX)
        shortest = config.min_length * picture.mask.shape[1]
        found = self.classify_lines([fit for fit in fits if fit is not None], picture, surface, shortest)
        return _each_edge_once(found, picture.scale)

    def classify_lines(
        self, fits: list[RefinedLine], picture: Picture, surface: SurfaceRegion, shortest_px: float = 0.0
    ) -> list[Candidate]:
        """Kinds of fitted lines, with score and confidence; shorter ones are no edges of paint."""
        if not fits:
            return []
        ends, theta = (np.array([getattr(fit, name) for fit in fits]) for name in ("ends_px", "theta"))
        borders = score_borders(ends.reshape(-1, 4), picture, surface, self._colors, theta)
        return [self._candidate(fit, borders, k, picture, shortest_px) for k, fit in enumerate(fits)]

    def _candidate(
        self, fit: RefinedLine, borders: Borders, index: int, picture: Picture, shortest_px: float
    ) -> Candidate:
        """A fitted line, classified by its two sides."""
        may_be_paint = borders.depth[index] <= _DEPTH_STEP and fit.length_px >= shortest_px
        paint_side = board_beside_paint(fit, self._colors, _SHOWS) if may_be_paint else 0
        if paint_side:
            kind, side, confidence = "paint", paint_side, _PAINT_CONFIDENCE
            length = min(fit.length_px / (_FULL_LENGTH * picture.mask.shape[1]), 1.0)
            score = (0.4 + 0.6 * length) * fit.inlier_share
        else:
            score = float(borders.score[index]) * fit.inlier_share
            kind, side = "board" if float(borders.score[index]) > BORDER else "", int(borders.side[index])
            confidence = 1.0 / (1.0 + math.exp(-(_CONSTANT + _SCORE * score + _COLOR * float(borders.color[index]))))
        return Candidate(
            line=fit,
            role=role_of(fit.theta, picture.tilt or 0.0),
            kind=kind,
            surface_side=side,
            borders_plane=kind == "board",
            score=score,
            confidence=confidence,
            ends_surface=kind == "board" and bool(min(part[index] for part in borders.parts) > _ENDS),
        )


def _each_edge_once(lines: list[Candidate], scale: float) -> list[Candidate]:
    """The best line of every edge, best first: a longer one is more exact, unless it is much worse."""
    kept: list[Candidate] = []
    for line in sorted(lines, key=lambda entry: -entry.score):
        same = next((k for k, other in enumerate(kept) if on_same_edge(line, other.line.ends_px, scale)), None)
        if same is None:
            kept.append(line)
        elif line.kind == kept[same].kind and goes_on(line.score, line.line, kept[same].score, kept[same].line):
            kept[same] = line
    return sorted(kept, key=lambda entry: -entry.score)


def demote_nested(lines: list[Candidate], picture: Picture) -> list[Candidate]:
    """The lines in their order; a border beside one farther out, where the surface certainly ends, loses confidence.

    Runs of paint, dirt and shadows within 26 px of the true end change the colour, and depth ends there as well.
    """
    pixel = picture.scale / picture.intrinsics[0]  # of a picture 640 wide, normalised
    kept, low, high = [], pixel * _SAME_PX, pixel * _SOON_PX
    for line in lines:
        rivals = [other for other in lines if other.ends_surface and other.score >= _RIVAL * line.score]
        if line.borders_plane and any(_beyond(line, other, low, high) for other in rivals):
            line = replace(line, score=_NESTED * line.score, confidence=_NESTED * line.confidence)
        kept.append(line)
    return kept


def _beyond(line: Candidate, other: Candidate, low: float, high: float) -> bool:
    """Whether another border runs along a line, farther from the surface by a normalised distance between two."""
    side = math.cos(line.line.theta - other.line.theta) * line.surface_side * other.surface_side
    if side < _ALONG or other.line.length_px < _LONG_ENOUGH * line.line.length_px:
        return False
    return low < _inwards(line, other) < high and low < -_inwards(other, line) < high


def _inwards(line: Candidate, other: Candidate) -> float:
    """How far the middle of a line lies from another border towards the surface of that, normalised."""
    x, y = (0.5 * (line.line.segment[0] + line.line.segment[1])).tolist()
    return other.surface_side * (x * math.cos(other.line.theta) + y * math.sin(other.line.theta) - other.line.rho)


def goes_on(score: float, line: RefinedLine, shorter_score: float, shorter: RefinedLine) -> bool:
    """Whether a line is longer than another on its edge, and such an edge in its further part: scores are means."""
    more, whole = line.length_px - shorter.length_px, score * line.length_px
    return more > 0.0 and whole - shorter_score * shorter.length_px >= _FURTHER_SHARE * shorter_score * more


def role_of(theta: float, tilt: float) -> str:
    """Role of a line by the angle of its normal from gravity's direction in the picture."""
    return HORIZONTAL if abs(math.sin(theta - tilt)) >= abs(math.cos(theta - tilt)) else VERTICAL


def on_same_edge(line: Candidate, segment: np.ndarray, scale: float) -> bool:
    """Whether a line and a segment (2, 2) [px] are on one edge, in a picture of a scale."""
    return _beside(line.line.ends_px, segment, scale * (_PAINT_PX if line.kind == "paint" else _SAME_PX))


def _beside(one: np.ndarray, two: np.ndarray, limit_px: float) -> bool:
    """Whether two segments (2, 2) [px] run along one edge where they overlap."""
    (u, v), (u_end, v_end) = two.tolist()
    length = math.hypot(u_end - u, v_end - v)
    du, dv = (u_end - u) / length, (v_end - v) / length
    ends = [(x - u, y - v) for x, y in one.tolist()]
    if max(abs(y * du - x * dv) for x, y in ends) > limit_px:
        return False
    along = [x * du + y * dv for x, y in ends]
    return max(along) > 0.0 and min(along) < length
