"""Made up flights shared by several test modules."""

from __future__ import annotations

import dataclasses

import pytest
from synthetic_trace import Errors, synthetic_trace

import sim.figures


def fake_fly(scene, options, progress=None, job=None):
    """A made-up flight, with short strokes so that its video is quick to write."""
    if progress:
        progress(1.0, "approach", 8.0)
    scene = dataclasses.replace(scene, paint=dataclasses.replace(scene.paint, stroke_m=0.3))
    errors = Errors(push_error_n=0.2 if options.law == "qp" else -0.4)
    return synthetic_trace(errors, scene, options.law, options.seed)


def draw_one_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports have one figure: drawing all takes longer than the rest of a command."""
    monkeypatch.setattr(sim.figures, "FIGURES", {"force": sim.figures.FIGURES["force"]})
