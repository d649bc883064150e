"""The paper's pipeline as a method of `ibvs-qp detect`: its lines in the common form."""

from __future__ import annotations

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.paper import PaperPipeline
from ibvs_qp.vision.picture.picture import denormalise
from sim.detection.detection import DetectedLine, Detection

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
