"""Search for lines without a prediction: edges near the end of the surface and of the paint, fitted and scored."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.appearance.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.lines.borders import PLACES, Borders, places_beside, score_borders
from ibvs_qp.vision.lines.refine import FIT_BEYOND, RefinedLine, fit_segments
from ibvs_qp.vision.lines.segments import edge_segments
from ibvs_qp.vision.picture.picture import Picture, denormalise
from ibvs_qp.vision.surface.plane import SurfaceRegion, filled

#: Shortest piece of a segment that is looked at where the surface ends before the segment does [px at 640].
_SHORTEST_PX = 40.0
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
#: Fraction of a line along which a side must show a colour, and along which depth rules out an edge of paint.
_SHOWS, _DEPTH_STEP = 0.6, 0.5
#: Distance from a line at which its two sides are read for a first look [px at 640], and places along it.
_BESIDE_PX, _PLACES = 4.0, 16
#: Distance from a segment at which the surface's samples must lie beside it [cells], and places looked at along it.
_CELLS_BESIDE, _PLACES_BESIDE = 1.5, 48
#: A segment beside which the surface lies for more than this fraction of its length stays whole.
_WHOLE = 0.95
#: Samples this far apart are near each other: two cells.
_NEAR_CELLS = np.ones((5, 5), np.uint8)
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
    pixels: np.ndarray  # its visible end points [px], (2, 2)
    role: str  # "horizontal" or "vertical", relative to gravity where it is known
    kind: str  # "board" (border of the surface), "paint" (edge of paint) or ""
    surface_side: int  # +1 or -1, the side of the normal on which the (unpainted) surface lies, 0 if unknown
    borders_plane: bool  # whether the surface ends there
    score: float  # 0..1, ranks the lines of one picture
    confidence: float  # 0..1, fraction of such lines that are of this kind


def find_candidates(
    picture: Picture,
    surface: SurfaceRegion,
    colors: SurfaceColors,
    config: VisionConfig,
    tilt: float | None,
    known: tuple[RefinedLine, ...] = (),
) -> list[Candidate]:
    """Find lines at the end of the surface, and edges of paint on it where its colour is known, best first.

    Args:
        picture: Colour, mask and depth.
        surface: The surface.
        colors: Colours of board and paint.
        config: Settings.
        tilt: Angle of gravity in the picture from down [rad]; lines near level and upright only are then looked at.
            None if it is unknown.
        known: Lines that need no search.

    Returns:
        Candidates, no two on the same edge.
    """
    region, painted = surface.end_band(config.detect.band_cells), colors.paint_distinct
    if painted:
        region = region | _end_of_paint(picture, surface, colors)
    segments = edge_segments(picture, surface.grid, region, tilt, config.detect.half_range_deg)
    lines, near = [denormalise(line.segment, picture.intrinsics) for line in known], _KNOWN_PX * picture.scale
    new = [not any(_beside(ends, line, near) for line in lines) for ends in segments.reshape(-1, 2, 2)]
    segments = segments[new]
    if len(segments) == 0:
        return []
    rough, most = _rough_scores(segments, picture, surface, colors), config.detect.candidates
    best = np.argsort(-rough, kind="stable")[:most]
    best = best[rough[best] > _HOPELESS]
    pieces = _trimmed(segments[best], surface, _SHORTEST_PX * picture.scale)
    beyond = np.repeat((FIT_BEYOND, 0.0), (len(best), len(pieces)))
    fits = fit_segments(np.vstack((segments[best], pieces)), picture, config.line, colors, beyond, contents=painted)
    if painted:
        share = _differing(segments, colors, picture)
        share[best] = 0.0
        order = np.argsort(-_lengths(segments) * share, kind="stable")
        order = order[share[order] > _SHOWS][:most]
        # across the picture: a stroke is wavy, and a short piece of it leans
        beyond, wide = np.full(len(order), _ACROSS), _PAINT_PX * picture.scale
        fits += fit_segments(segments[order], picture, config.line, colors, beyond, contents=True, half_width_px=wide)
    fitted = [fit for fit in fits if fit is not None]
    shortest = config.detect.min_length * picture.mask.shape[1]
    found = classify_lines(fitted, picture, surface, colors, tilt, shortest)
    return _each_edge_once(found, picture.scale)


def _end_of_paint(picture: Picture, surface: SurfaceRegion, colors: SurfaceColors) -> np.ndarray:
    """Samples near both paint and board, bool (rows, columns)."""
    grid = surface.grid
    labels = colors.label(grid.sample(picture.rgb), *grid.pixels)
    marks = surface.cells, labels == BOARD, labels == PAINT
    near = [cv2.dilate(cells.view(np.uint8), _NEAR_CELLS) > 0 for cells in marks]
    return near[0] & near[1] & near[2]


def _rough_scores(segments: np.ndarray, picture: Picture, surface: SurfaceRegion, colors: SurfaceColors) -> np.ndarray:
    """Scores of segments (n, 4) as ends of the surface before they are fitted, (n,)."""
    pixels = segments.reshape(-1, 2, 2)
    return score_borders(pixels, _normals_of(pixels), picture, surface, _paint_of(colors), PLACES // 2).score


def _each_edge_once(lines: list[Candidate], scale: float) -> list[Candidate]:
    """The best line of every edge, best first: a longer one is more exact, unless it is much worse."""
    kept: list[Candidate] = []
    for line in sorted(lines, key=lambda entry: -entry.score):
        same = next((k for k, other in enumerate(kept) if on_same_edge(line, other.pixels, scale)), None)
        if same is None:
            kept.append(line)
        elif line.kind == kept[same].kind and _adds(line, kept[same]):
            kept[same] = line
    return sorted(kept, key=lambda entry: -entry.score)


def _adds(longer: Candidate, line: Candidate) -> bool:
    """Whether a longer line on an edge is such an edge in its further part, too: scores are means along lines."""
    more = longer.line.length_px - line.line.length_px
    if more <= 0.0:
        return False
    further = (longer.score * longer.line.length_px - line.score * line.line.length_px) / more
    return further >= _FURTHER_SHARE * line.score


def classify_lines(
    fits: list[RefinedLine],
    picture: Picture,
    surface: SurfaceRegion,
    colors: SurfaceColors,
    tilt: float | None,
    shortest_px: float = 0.0,
) -> list[Candidate]:
    """Kinds of fitted lines, with score and confidence; shorter ones are no edges of paint."""
    if not fits:
        return []
    pixels = np.array([denormalise(fit.segment, picture.intrinsics) for fit in fits])
    theta = np.array([fit.theta for fit in fits])
    normals = _normals_of(pixels)
    normals *= np.sign(np.vecdot(normals, np.column_stack((np.cos(theta), np.sin(theta)))))[:, None]
    borders = score_borders(pixels, normals, picture, surface, _paint_of(colors))
    return [_candidate(fit, pixels[k], borders, k, picture, colors, tilt, shortest_px) for k, fit in enumerate(fits)]


def _candidate(
    fit: RefinedLine,
    pixels: np.ndarray,
    borders: Borders,
    index: int,
    picture: Picture,
    colors: SurfaceColors,
    tilt: float | None,
    shortest_px: float,
) -> Candidate:
    """A fitted line, classified by its two sides."""
    may_be_paint = borders.depth[index] <= _DEPTH_STEP and fit.length_px >= shortest_px
    paint_side = _board_beside_paint(fit, colors) if may_be_paint else 0
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
        pixels=pixels,
        role=role_of(fit.theta, 0.0 if tilt is None else tilt),
        kind=kind,
        surface_side=side,
        borders_plane=kind == "board",
        score=score,
        confidence=confidence,
    )


def _paint_of(colors: SurfaceColors) -> np.ndarray | None:
    """Colour of the paint where it differs from the board's."""
    return colors.paint if colors.paint_distinct else None


def _board_beside_paint(fit: RefinedLine, colors: SurfaceColors) -> int:
    """Side of the board, +1 or -1, if the other one shows paint; 0 otherwise."""
    if not colors.paint_distinct or fit.sides.size == 0:
        return 0
    labels = colors.label(fit.sides, *fit.pixels.T)
    board, paint = ((labels == kind).mean(axis=1) >= _SHOWS for kind in (BOARD, PAINT))
    return 1 if board[1] and paint[0] else -1 if board[0] and paint[1] else 0


def role_of(theta: float, tilt: float) -> str:
    """Role of a line by the angle of its normal from gravity's direction in the picture."""
    return HORIZONTAL if abs(math.sin(theta - tilt)) >= abs(math.cos(theta - tilt)) else VERTICAL


def _normals_of(pixels: np.ndarray) -> np.ndarray:
    """Unit vectors across segments (n, 2, 2), (n, 2)."""
    run = pixels[:, 1] - pixels[:, 0]
    return np.column_stack((-run[:, 1], run[:, 0])) / np.hypot(*run.T)[:, None]


def _lengths(segments: np.ndarray) -> np.ndarray:
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def _differing(segments: np.ndarray, colors: SurfaceColors, picture: Picture) -> np.ndarray:
    """Fraction of each segment (n, 4) along which one side shows the board and the other the paint, (n,)."""
    height, width = picture.mask.shape
    u, v = places_beside(segments, _aside(segments, _BESIDE_PX * picture.scale), _PLACES)
    u = np.minimum(np.maximum(np.rint(u), 0.0), width - 1.0).astype(np.intp)
    v = np.minimum(np.maximum(np.rint(v), 0.0), height - 1.0).astype(np.intp)
    labels = colors.label(picture.rgb[v, u], u, v)
    one, two = labels[:, 0], labels[:, 1]
    return ((one != two) & (one > 0) & (two > 0)).mean(axis=1)


def _aside(segments: np.ndarray, distance: float) -> np.ndarray:
    """Ways [px] to the left and to the right of segments (n, 4), seen from the first end to the second, (n, 2, 2)."""
    run = segments[:, 2:] - segments[:, :2]
    right = (distance / np.hypot(*run.T))[:, None] * np.column_stack((-run[:, 1], run[:, 0]))
    return np.stack((-right, right), axis=1)


def _trimmed(segments: np.ndarray, surface: SurfaceRegion, shortest_px: float) -> np.ndarray:
    """The pieces beside the surface of those segments (n, 4) that reach beyond it, one each at most, (m, 4) [px].

    A joint of the wall may run on where an edge of the surface stops. The search for segments joins the two, a pixel or
    two aside; a fit to both is wrong by a part of that. Shorter pieces are left out.
    """
    ends, margin = segments.reshape(-1, 2, 2), 0.5 / _PLACES_BESIDE
    region = cv2.morphologyEx(filled(surface.colored), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    run = ends[:, 1] - ends[:, 0]
    aside = _aside(segments, _CELLS_BESIDE * surface.grid.stride)
    rows, columns, inside = surface.grid.cells_at(*places_beside(segments, aside, _PLACES_BESIDE, margin))
    sides = inside & region[rows, columns]
    marked = sides.sum(axis=2)
    beside = np.where((marked[:, 0] >= marked[:, 1])[:, None], sides[:, 0], sides[:, 1])
    first, count = _longest_runs(beside)
    kept = (count < _WHOLE * _PLACES_BESIDE) & (count * np.hypot(*run.T) >= shortest_px * _PLACES_BESIDE)
    start, end = ((edge / _PLACES_BESIDE)[:, None] * run + ends[:, 0] for edge in (first, first + count))
    return np.hstack((start, end))[kept]


def _longest_runs(marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First place and number of places of the longest run in every row of bool (n, K), (n,) each."""
    place = np.arange(marks.shape[1])
    length = place - np.maximum.accumulate(np.where(marks, -1, place), axis=1)  # since the last unmarked place
    last = np.argmax(length, axis=1)
    count = length[np.arange(len(marks)), last]
    return last + 1 - count, count


def on_same_edge(line: Candidate, segment: np.ndarray, scale: float) -> bool:
    """Whether a line and a segment (2, 2) [px] are on one edge, in a picture of a scale."""
    return _beside(line.pixels, segment, scale * (_PAINT_PX if line.kind == "paint" else _SAME_PX))


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
