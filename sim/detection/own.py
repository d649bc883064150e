"""The pipelines of `ibvs-qp detect`, the perception that flies and that of the paper: lines in the common form."""

from __future__ import annotations

import dataclasses
import math
import time

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.config import REFERENCE_WIDTH, LineConfig, VisionConfig
from ibvs_qp.vision.lines.candidates import Candidate, on_same_edge
from ibvs_qp.vision.lines.refine import FIT_BEYOND, LineFits
from ibvs_qp.vision.lines.tracks import TrackState
from ibvs_qp.vision.paper import PaperPipeline
from ibvs_qp.vision.paper.result import normalised_line
from ibvs_qp.vision.perception import PerceptionResult
from ibvs_qp.vision.picture.layout import PictureLayout
from ibvs_qp.vision.picture.picture import Picture, denormalise, normalise
from sim.detection.detection import DetectedLine, Detection

#: Shortest segment that may be joined with others, and shortest line listed [px at 640].
_PIECE_PX, _LISTED_PX = 12.0, 20.0
#: Two pieces are one line if they lie this near to their common line [px at 640] and their gap is at most this
#: fraction of their lengths together.
_APART_PX, _GAP_SHARE = 1.5, 0.5
#: Largest angle between two pieces of one line [rad].
_TURN = np.radians(3.0)


def find_segments(grey: np.ndarray, scale: float) -> np.ndarray:
    """All line segments, longest first.

    The detector is OpenCV's LSD (von Gioi et al., IPOL 2012): no threshold of its own needs tuning, and on real
    pictures it misses one marked line in twenty at most; a line that it breaks into pieces is joined again.

    Args:
        grey: Picture, uint8 (H, W).
        scale: Factor for lengths stated for a picture 640 wide.

    Returns:
        End points (u1, v1, u2, v2) [px], the brighter side to the left of the way, (n, 4).
    """
    found = cv2.createLineSegmentDetector().detect(np.ascontiguousarray(grey))[0]
    pieces = np.zeros((0, 4)) if found is None else np.asarray(found, float).reshape(-1, 4)
    pieces = pieces[_lengths(pieces) >= _PIECE_PX * scale]
    lines = np.concatenate((pieces, _joined(pieces, scale)))
    lines = lines[_lengths(lines) >= _LISTED_PX * scale]
    return lines[np.argsort(-_lengths(lines), kind="stable")]


def _lengths(segments: np.ndarray) -> np.ndarray:
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def _joined(pieces: np.ndarray, scale: float) -> np.ndarray:
    """Lines of two pieces and more, (m, 4); pieces of one polarity only are joined, as LSD orders their ends by it."""
    order = np.argsort(-_lengths(pieces), kind="stable")
    free = np.ones(len(pieces), bool)
    lines = []
    for index in order:
        if not free[index]:
            continue
        free[index] = False
        line, grown = pieces[index], False
        while True:
            mates = np.flatnonzero(free & _continues(line, pieces, scale))
            if len(mates) == 0:
                break
            free[mates] = False
            line, grown = _through(np.vstack((line, pieces[mates]))), True
        if grown:
            lines.append(line)
    return np.array(lines).reshape(-1, 4)


def _continues(line: np.ndarray, pieces: np.ndarray, scale: float) -> np.ndarray:
    """Whether pieces lie on the line's prolongation and near enough to it, bool (n,)."""
    start, run = line[:2], line[2:] - line[:2]
    length = float(np.hypot(*run))
    direction = run / length
    normal = np.array([-direction[1], direction[0]])
    lengths = _lengths(pieces)
    parallel = (pieces[:, 2:] - pieces[:, :2]) @ direction >= np.cos(_TURN) * lengths
    ends = pieces.reshape(-1, 2, 2) - start
    near = np.abs(ends @ normal).max(axis=1) <= _APART_PX * scale
    along = ends @ direction
    gap = np.maximum(along.min(axis=1) - length, -along.max(axis=1))
    return parallel & near & (gap <= _GAP_SHARE * (lengths + length))


def _through(pieces: np.ndarray) -> np.ndarray:
    """The line through the ends of pieces, weighted by length, from the first to the last end, (4,)."""
    points, weight = pieces.reshape(-1, 2), np.repeat(_lengths(pieces), 2)
    middle = (weight[:, None] * points).sum(axis=0) / weight.sum()
    offset = points - middle
    _, axes = np.linalg.eigh((weight[:, None] * offset).T @ offset)
    direction = axes[:, 1]
    if direction @ (pieces[0, 2:] - pieces[0, :2]) < 0.0:
        direction = -direction
    along = offset @ direction
    return np.concatenate((middle + along.min() * direction, middle + along.max() * direction))


#: A fit farther from its segment than this has found another edge [px at 640].
_STRAY_PX = 1.5
#: Error of a segment's end across it where no fit improved it [px].
_SEGMENT_SIGMA_PX = 0.3
#: A line this long has the full score, fraction of the picture's width.
_FULL_LENGTH = 0.25


def every_line(frame: RgbdFrame, config: LineConfig) -> tuple[DetectedLine, ...]:
    """All straight lines of a picture, longest first; needs colour and intrinsics only."""
    rgb = np.require(frame.rgb, np.uint8, ("C", "W"))  # the one type of the kernel
    frame = dataclasses.replace(frame, rgb=rgb)
    picture = Picture(frame, PictureLayout(frame, VisionConfig(), None))
    segments = find_segments(cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY), picture.scale)
    fits = LineFits(config, SurfaceColors(None, None, config.color_gate)).fit_segments(
        picture, segments, np.full(len(segments), FIT_BEYOND)
    )
    lines = []
    for segment, fit in zip(segments.reshape(-1, 2, 2), fits, strict=True):
        if fit is None or _apart(segment, fit.rho, fit.theta, picture) > _STRAY_PX * picture.scale:
            rho, theta, covariance = _plain_line(segment, picture)
            pixels, share = segment, 1.0
        else:
            rho, theta, covariance = fit.rho, fit.theta, fit.covariance
            pixels, share = fit.ends_px, fit.inlier_share
        length = float(np.hypot(*(pixels[1] - pixels[0])))
        score = share * min(length / (_FULL_LENGTH * REFERENCE_WIDTH * picture.scale), 1.0)
        lines.append(DetectedLine(pixels=pixels, rho=rho, theta=theta, covariance=covariance, score=score))
    return tuple(lines)


def _apart(segment: np.ndarray, rho: float, theta: float, picture: Picture) -> float:
    """Largest distance of a segment's ends from a line [px]."""
    offset = normalise(segment, picture.intrinsics) @ np.array([math.cos(theta), math.sin(theta)]) - rho
    return float(np.abs(offset).max()) * picture.intrinsics[0]


def _plain_line(segment: np.ndarray, picture: Picture) -> tuple[float, float, np.ndarray]:
    """(rho, theta) of a segment and their covariance, each end being off by the same standard deviation."""
    (u1, v1), (u2, v2) = segment.tolist()
    rho, theta = normalised_line(v1 - v2, u2 - u1, u1 * v2 - u2 * v1, picture.intrinsics)
    ends = normalise(segment, picture.intrinsics)
    along = ends @ np.array([-math.sin(theta), math.cos(theta)])
    variance = (_SEGMENT_SIGMA_PX / picture.intrinsics[0]) ** 2
    size, middle = float(np.ptp(along)), float(along.mean())
    angle = 2.0 * variance / max(size, 1e-6) ** 2
    # rho = value at the middle minus (distance of the middle from the foot) times the angle's error
    return rho, theta, np.array([[0.5 * variance + middle**2 * angle, -middle * angle], [-middle * angle, angle]])


#: Reason given where the caller names no place on the surface.
NO_SEED = "no seed pixel: which surface is meant is not known"


class OwnMethod:
    """`ibvs_qp.vision.Perception` for a camera alone: no gyro, no attitude, no vehicle in its pictures.

    Args:
        config: Its settings.
    """

    def __init__(self, config: VisionConfig | None = None) -> None:
        self._config = VisionConfig() if config is None else config
        self._perception = Perception(self._config, None)
        self.reset()

    def reset(self) -> None:
        """Forget the sequence: the next picture stands alone."""
        self._perception.reset()
        self._follows = False

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Detection:
        """Surface, candidates and guides of a picture that stands alone."""
        self.reset()
        return self._seen(frame, seed_pixel, tracked=False)

    def follow(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Detection:
        """The same for the next picture of a motion sequence: lines keep their identity, guides do not flicker."""
        found = self._seen(frame, seed_pixel, tracked=self._follows)
        if found.refused is not None and self._follows:  # it may still be understood alone
            self.reset()
            found = self._seen(frame, seed_pixel, tracked=False)
        if found.refused is not None:
            self.reset()
        self._follows = found.refused is None
        return found

    def every_line(self, frame: RgbdFrame) -> tuple[DetectedLine, ...]:
        """All straight lines of a picture, on a surface or not, longest first; none for a picture that is refused."""
        return () if frame_problem(frame) else every_line(frame, self._config.line)

    def _seen(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None, *, tracked: bool) -> Detection:
        started = time.perf_counter()
        problem = frame_problem(frame) or (NO_SEED if seed_pixel is None else None)
        if problem is not None:
            return Detection(refused=problem, time_ms=_since(started))
        found = self._perception.process(frame, seed_pixel=seed_pixel, detect=not tracked)
        tracks = {track.track_id: _of_track(track, frame) for track in found.tracks if track.seen}
        lines = list(tracks.values())
        lines += [_of_candidate(entry) for entry in _untracked(found, lines, max(frame.rgb.shape) / REFERENCE_WIDTH)]
        return Detection(
            plane=found.plane,
            refused=found.refused,
            candidates=tuple(sorted(_numbered(lines), key=lambda line: -line.score)),
            guides={side: track and tracks.get(track.track_id) for side, track in found.guides.items()},
            tracked=tracked,
            time_ms=_since(started),
        )


def _untracked(found: PerceptionResult, tracked: list[DetectedLine], scale: float) -> list[Candidate]:
    """Candidates on edges that no track follows."""
    taken = [line.pixels for line in tracked]
    return [entry for entry in found.candidates if not any(on_same_edge(entry, pixels, scale) for pixels in taken)]


def _of_track(track: TrackState, frame: RgbdFrame) -> DetectedLine:
    return DetectedLine(
        pixels=denormalise(track.segment, frame.intrinsics),
        rho=track.rho,
        theta=track.theta,
        covariance=track.covariance,
        score=track.score,
        confidence=track.confidence,
        borders_plane=track.borders_plane,
        surface_side=track.surface_side,
        line_id=track.track_id,
    )


def _of_candidate(found: Candidate) -> DetectedLine:
    line = found.line
    return DetectedLine(
        pixels=line.ends_px,
        rho=line.rho,
        theta=line.theta,
        covariance=line.covariance,
        score=found.score,
        confidence=found.confidence,
        borders_plane=found.borders_plane,
        surface_side=found.surface_side,
    )


def _numbered(lines: list[DetectedLine]) -> list[DetectedLine]:
    """The lines, those without an identity numbered after the others."""
    last, result = max((line.line_id for line in lines), default=0), []
    for line in lines:
        last += line.line_id == 0
        result.append(line if line.line_id else dataclasses.replace(line, line_id=last))
    return result


def _since(started: float) -> float:
    return 1e3 * (time.perf_counter() - started)


#: The published pipeline rates no line: every line, guide or not, has this confidence [-].
PAPER_CONFIDENCE = 0.5


class PaperMethod:
    """`ibvs_qp.vision.paper.PaperPipeline`, picture by picture, without tracking and without a mask."""

    def __init__(self) -> None:
        self._pipeline = PaperPipeline()

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Detection:
        """Surface, horizontal and vertical lines, the topmost and the first vertical one as guides."""
        if seed_pixel is None:
            return Detection(refused="no seed pixel: the search of the bounding box starts from one")
        found = self._pipeline.detect(frame, seed_pixel)
        guides = [line for line in found.guides.values() if line is not None]
        distinct = {id(line): line for line in (*found.candidates, *guides)}
        lines = {key: _common(number, line, frame) for number, (key, line) in enumerate(distinct.items())}
        return Detection(
            plane=found.plane,
            refused=found.refused,
            candidates=tuple(lines[id(line)] for line in found.candidates),
            guides={side: None if line is None else lines[id(line)] for side, line in found.guides.items()},
            time_ms=found.time_total_ms,
        )


def _common(number: int, candidate: Candidate, frame: RgbdFrame) -> DetectedLine:
    line = candidate.line
    return DetectedLine(
        pixels=denormalise(line.segment, frame.intrinsics),
        rho=line.rho,
        theta=line.theta,
        covariance=line.covariance,
        score=candidate.score,
        confidence=PAPER_CONFIDENCE,
        borders_plane=candidate.surface_side != 0,
        surface_side=candidate.surface_side,
        line_id=number,
    )
