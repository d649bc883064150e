"""Accuracy of a detector on the edges of truth frames: ``python -m tests.support.truth.accuracy --frames 40``."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.picture.picture import normalise
from sim.detection.detection import GUIDE_SIDES, Detection
from sim.detection.methods import METHODS, make_method
from tests.support.truth.frame import TrueLine, TruthFrame, render_frame
from tests.support.truth.scenes import FAMILIES, TruthScene, sample_scene

#: Match: largest distance of both ends of the true segment from the line [px], and largest angle [deg].
MATCH_PX, MATCH_DEG = 4.0, 2.0
#: Least confidence of a certain line [-].
HIGH_CONFIDENCE = 0.8


@dataclass
class Errors:
    """Errors of a detector on a family of frames."""

    offset_px: list[float] = field(default_factory=list)  # distance at the middle of the true segment, of found guides
    angle_deg: list[float] = field(default_factory=list)  # angle error of found guides
    confidence: list[float] = field(default_factory=list)  # confidence of found guides
    wrong: list[float] = field(default_factory=list)  # confidence of guides on no true edge of that side
    missed: list[str] = field(default_factory=list)  # names of frames and edges without a correct guide
    visible: int = 0  # number of true edges in view
    # squared error of (rho, theta) over its covariance; 2 expected
    chi_square: list[float] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)  # reasons of frames without a surface

    def add(self, truth: TruthFrame, result: Detection, name: str) -> None:
        """Add one frame."""
        if result.refused is not None:
            self.refused.append(f"{name}: {result.refused}")
        for side in GUIDE_SIDES:
            line, edge = result.guides.get(side), truth.edges.get(side)
            self.visible += edge is not None
            if line is None:
                if edge is not None:
                    self.missed.append(f"{name} {side}")
                continue
            errors = None if edge is None else line_errors(edge, line.rho, line.theta, truth.frame.intrinsics)
            if edge is None or errors is None or errors[2] > MATCH_PX or errors[1] > MATCH_DEG:
                self.wrong.append(line.confidence)
                if edge is not None:
                    self.missed.append(f"{name} {side} (another line, confidence {line.confidence:.2f})")
                continue
            self.offset_px.append(errors[0])
            self.angle_deg.append(errors[1])
            self.confidence.append(line.confidence)
            rho, theta = align_line(edge.rho, edge.theta, line.theta)
            error = np.array([line.rho - rho, line.theta - theta])
            self.chi_square.append(float(error @ np.linalg.solve(line.covariance, error)))

    @property
    def found(self) -> float:
        """Fraction of the true edges with a correct guide."""
        return len(self.offset_px) / max(self.visible, 1)

    def pool(self, other: Errors) -> None:
        """Add the frames of another family."""
        for entry in dataclasses.fields(self):
            setattr(self, entry.name, getattr(self, entry.name) + getattr(other, entry.name))

    def __str__(self) -> str:
        if not self.offset_px:
            return f"found 0 of {self.visible}"
        offset, angle = np.percentile(self.offset_px, [50, 95]), np.percentile(self.angle_deg, [50, 95])
        return (
            f"found {100 * self.found:5.1f} % of {self.visible:4d}  offset {offset[0]:.3f} / {offset[1]:.3f} px  "
            f"angle {angle[0]:.4f} / {angle[1]:.4f} deg  chi2 {np.mean(self.chi_square):5.1f}  "
            f"sure {100 * float(np.mean(np.array(self.confidence) >= HIGH_CONFIDENCE)):3.0f} %  "
            f"wrong {len(self.wrong)} (highest confidence {max(self.wrong, default=0.0):.2f})"
        )


def line_errors(
    edge: TrueLine, rho: float, theta: float, intrinsics: tuple[float, float, float, float]
) -> tuple[float, float, float]:
    """Distance at the middle of the true segment [px], angle [deg], and largest distance at its ends [px]."""
    across = normalise(edge.pixels, intrinsics) @ np.array([math.cos(theta), math.sin(theta)]) - rho
    angle = math.degrees(abs(math.remainder(theta - edge.theta, math.pi)))
    return abs(float(across.mean())) * intrinsics[0], angle, float(np.abs(across).max()) * intrinsics[0]


def measure_family(scenes: list[TruthScene], detect: Callable[[TruthFrame], Detection]) -> Errors:
    """Render scenes one by one and add up the errors of a detector."""
    errors = Errors()
    for scene in scenes:
        truth = render_frame(scene)
        errors.add(truth, detect(truth), f"seed {scene.seed}")
    return errors


def main() -> None:
    """Print one line per family."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=40, help="frames per family")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first frame")
    parser.add_argument("--method", choices=tuple(METHODS), default="own")
    parser.add_argument("--family", choices=tuple(FAMILIES), help="one family only")
    parser.add_argument("--show-missed", action="store_true", help="list the missed edges")
    options = parser.parse_args()
    method, total = make_method(options.method), Errors()
    for name in [options.family] if options.family else FAMILIES:
        scenes = [sample_scene(FAMILIES[name], options.first_seed + k) for k in range(options.frames)]
        errors = measure_family(scenes, lambda truth: method.detect(truth.frame, truth.seed))
        print(f"{name:14s} {errors}")
        if options.show_missed:
            for missed in [*errors.missed, *errors.refused]:
                print(f"    {missed}")
        total.pool(errors)
    print(f"{'all':14s} {total}")


if __name__ == "__main__":
    main()
