"""Rendered RGB-D frames with exactly known lines, for accuracy figures and tests."""

from sim.detection.truth.frame import TruthFrame, render_frame
from sim.detection.truth.scenes import FAMILIES, TruthScene, Variation, sample_scene

__all__ = ["FAMILIES", "TruthFrame", "TruthScene", "Variation", "render_frame", "sample_scene"]
