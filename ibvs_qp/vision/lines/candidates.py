"""Search for lines without a prediction: edges near the end of the surface and of the paint, fitted and scored."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.appearance.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.kernels.beside import labels_beside
from ibvs_qp.vision.lines.borders import PLACES, Borders, score_borders
from ibvs_qp.vision.lines.confidence import line_confidence
from ibvs_qp.vision.lines.edge_segments import FIT_BEYOND, edge_segments, fit_segments
from ibvs_qp.vision.lines.refined import RefinedLine
from ibvs_qp.vision.lines.trim import trimmed
from ibvs_qp.vision.picture.picture import Picture, denormalise
from ibvs_qp.vision.surface.region import SurfaceRegion

#: Shortest piece of a segment that is looked at where the surface ends before the segment does [px at 640].
_SHORTEST_PX = 40.0
#: Lines nearer than this are on one edge, and a segment this near to a known line is that one [px at 640].
_SAME_PX, _KNOWN_PX = 2.5, 8.0
#: Half width of the strip in which an edge of paint is fitted, and width within which it is one edge [px at 640]; it is
#: fitted beyond a segment by this multiple of its length.
_PAINT_PX, _ACROSS = 6.0, 20.0
#: A longer line on an edge is taken if its further part has this share of the better one's score.
_FURTHER_SHARE = 0.5
#: Score from which a line is said to border the surface.
BORDER = 0.2
#: A segment of a lower score before it is fitted will be no border after that.
_HOPELESS = 0.05
#: Confidence of an edge of paint whose two sides have the colours of paint and board.
_PAINT_CONFIDENCE = 0.9
#: Share of a line along which a side must show a colour, and along which depth rules out an edge of paint.
_SHOWS, _DEPTH_STEP = 0.6, 0.5
#: Distance from a line at which its two sides are read for a first look [px at 640], places along it at which they are,
#: and the share left out at either end.
_BESIDE_PX, _PLACES, _MARGIN = 4.0, 16, 0.05
#: Samples this far apart are near each other: two cells.
_NEAR_CELLS = np.ones((5, 5), np.uint8)
#: Length that earns the full score of an edge of paint, share of the picture's width.
_FULL_LENGTH = 0.4


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A detected line, and what it is.

    Attributes:
        line: The fitted line.
        pixels: Its visible end points [px], (2, 2).
        role: "horizontal" or "vertical", relative to gravity where it is known.
        kind: "board" (border of the surface), "paint" (edge of paint) or "".
        surface_side: +1 or -1, the side of the normal on which the (unpainted) surface lies, 0 if unknown.
        borders_plane: Whether the surface ends there.
        score: 0..1, ranks the lines of one picture.
        confidence: 0..1, share of such lines that are what `kind` says.
    """

    line: RefinedLine
    pixels: np.ndarray
    role: str
    kind: str
    surface_side: int
    borders_plane: bool
    score: float
    confidence: float


def find_candidates(
    picture: Picture,
    depth: np.ndarray,
    surface: SurfaceRegion,
    colors: SurfaceColors,
    config: VisionConfig,
    tilt: float | None,
    known: tuple[RefinedLine, ...] = (),
) -> list[Candidate]:
    """Find lines at the end of the surface, and edges of paint on it where its colour is known, best first.

    Args:
        picture: Colour and mask.
        depth: Depth [m], (H, W).
        surface: The surface.
        colors: What board and paint look like.
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
    rough, most = _rough_scores(segments, picture, depth, surface, colors), config.detect.candidates
    best = np.argsort(-rough, kind="stable")[:most]
    best = best[rough[best] > _HOPELESS]
    pieces = trimmed(segments[best], surface, _SHORTEST_PX * picture.scale)
    beyond = np.repeat((FIT_BEYOND, 0.0), (len(best), len(pieces)))
    fits = fit_segments(np.vstack((segments[best], pieces)), picture, config.line, colors, beyond, contents=painted)
    if painted:
        share = _differing(segments, colors, picture)
        share[best] = 0.0
        order = np.argsort(-_lengths(segments) * share, kind="stable")
        order = order[share[order] > _SHOWS][:most]
        fits += _fit_paint(segments[order], picture, config, colors)
    fitted = [fit for fit in fits if fit is not None]
    shortest = config.detect.min_length * picture.mask.shape[1]
    found = judge_lines(fitted, picture, depth, surface, colors, tilt, shortest)
    return _each_edge_once(found, picture.scale)


def _fit_paint(
    segments: np.ndarray, picture: Picture, config: VisionConfig, colors: SurfaceColors
) -> list[RefinedLine | None]:
    """Fits of edges of paint across the picture: a stroke is wavy, and a short piece of it leans."""
    beyond, wide = np.full(len(segments), _ACROSS), _PAINT_PX * picture.scale
    return fit_segments(segments, picture, config.line, colors, beyond, contents=True, half_width_px=wide)


def _end_of_paint(picture: Picture, surface: SurfaceRegion, colors: SurfaceColors) -> np.ndarray:
    """Samples near both paint and board, bool (rows, columns)."""
    grid = surface.grid
    labels = colors.label(grid.sample(picture.rgb), colors.levels_at(*grid.pixels))
    marks = surface.cells, labels == BOARD, labels == PAINT
    near = [cv2.dilate(cells.view(np.uint8), _NEAR_CELLS) > 0 for cells in marks]
    return near[0] & near[1] & near[2]


def _rough_scores(
    segments: np.ndarray, picture: Picture, depth: np.ndarray, surface: SurfaceRegion, colors: SurfaceColors
) -> np.ndarray:
    """Scores of segments (n, 4) as ends of the surface before they are fitted, (n,)."""
    pixels = segments.reshape(-1, 2, 2)
    paint, places = _paint_of(colors), PLACES // 2
    return score_borders(pixels, normals_of(pixels), picture, depth, surface, paint, places).score


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


def judge_lines(
    fits: list[RefinedLine],
    picture: Picture,
    depth: np.ndarray,
    surface: SurfaceRegion,
    colors: SurfaceColors,
    tilt: float | None,
    shortest_px: float = 0.0,
) -> list[Candidate]:
    """What fitted lines are, with score and confidence; shorter ones are no edges of paint."""
    if not fits:
        return []
    pixels = np.array([denormalise(fit.segment, picture.intrinsics) for fit in fits])
    theta = np.array([fit.theta for fit in fits])
    normals = normals_of(pixels)
    normals *= np.sign(np.vecdot(normals, np.column_stack((np.cos(theta), np.sin(theta)))))[:, None]
    borders = score_borders(pixels, normals, picture, depth, surface, _paint_of(colors))
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
    """A fitted line with what its two sides say."""
    may_be_paint = borders.depth[index] <= _DEPTH_STEP and fit.length_px >= shortest_px
    paint_side = _board_beside_paint(fit, colors) if may_be_paint else 0
    if paint_side:
        kind, side, confidence = "paint", paint_side, _PAINT_CONFIDENCE
        length = min(fit.length_px / (_FULL_LENGTH * picture.mask.shape[1]), 1.0)
        score = (0.4 + 0.6 * length) * fit.inlier_share
    else:
        score = float(borders.score[index]) * fit.inlier_share
        kind, side = "board" if float(borders.score[index]) > BORDER else "", int(borders.side[index])
        confidence = line_confidence(borders, index, fit)
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
    labels = colors.label(fit.sides, colors.levels_at(*fit.pixels.T))
    board, paint = ((labels == kind).mean(axis=1) >= _SHOWS for kind in (BOARD, PAINT))
    return 1 if board[1] and paint[0] else -1 if board[0] and paint[1] else 0


def role_of(theta: float, tilt: float) -> str:
    """Role of a line by the angle of its normal from gravity's direction in the picture."""
    return HORIZONTAL if abs(math.sin(theta - tilt)) >= abs(math.cos(theta - tilt)) else VERTICAL


def normals_of(pixels: np.ndarray) -> np.ndarray:
    """Unit vectors across segments (n, 2, 2), (n, 2)."""
    run = pixels[:, 1] - pixels[:, 0]
    return np.column_stack((-run[:, 1], run[:, 0])) / np.hypot(*run.T)[:, None]


def _lengths(segments: np.ndarray) -> np.ndarray:
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def _differing(segments: np.ndarray, colors: SurfaceColors, picture: Picture) -> np.ndarray:
    """Share of each segment (n, 4) along which one side shows the board and the other the paint, (n,)."""
    labels = np.empty((len(segments), 2, _PLACES), np.uint8)
    labels_beside(picture.rgb, segments, _MARGIN, _BESIDE_PX * picture.scale, colors.levels, colors.table(), labels)
    one, two = labels[:, 0], labels[:, 1]
    return ((one != two) & (one > 0) & (two > 0)).mean(axis=1)


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
