"""Rendered RGB-D frames with exactly known lines, for accuracy figures and tests."""

from tests.support.truth.frame import TruthFrame, render_frame
from tests.support.truth.scenes import FAMILIES, TruthScene, Variation, sample_scene

__all__ = ["FAMILIES", "TruthFrame", "TruthScene", "Variation", "render_frame", "sample_scene"]
