"""The perception that flies as a method of `ibvs-qp detect`: its lines in the common form."""

from __future__ import annotations

import dataclasses
import time

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.config import REFERENCE_WIDTH
from ibvs_qp.vision.lines.candidates import Candidate, on_same_edge
from ibvs_qp.vision.lines.tracks import TrackState
from ibvs_qp.vision.perception import PerceptionResult
from ibvs_qp.vision.picture.picture import denormalise
from sim.detection.detection import DetectedLine, Detection
from sim.detection.whole_picture import every_line

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
