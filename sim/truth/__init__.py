"""Rendered RGB-D frames whose every line is known exactly, for accuracy figures and tests."""

from sim.truth.frame import TruthFrame, render_frame
from sim.truth.scenes import FAMILIES, TruthScene, Variation, sample_scene

__all__ = ["FAMILIES", "TruthFrame", "TruthScene", "Variation", "render_frame", "sample_scene"]
