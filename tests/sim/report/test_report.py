"""Report and video: self-contained, complete, readable."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from synthetic_trace import Errors, synthetic_trace

from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import default_limits, qp_problem
from sim.evaluate.figures import FIGURES as FIGURES_OF_MERIT
from sim.evaluate.metrics import compute_metrics
from sim.figures import FIGURES, draw_all
from sim.report import report as wording
from sim.report.report import write_report
from sim.report.rundir import RunFolder, summary
from sim.world.scene import PaintScene, Scene

SCENE = Scene(paint=PaintScene(stroke_m=0.5))
FACTS = {
    "command": "ibvs-qp paint --scene 'a<b>.toml'",
    "seed": 0,
    "scene": "a<b>.toml",
    "world": "ideal",
    "preset": None,
    "camera": "plane",
    "image_size": [640, 480],
    "features": "rendered",
    "vision": "own",
}


@pytest.fixture(scope="module")
def traces():
    return {"qp": synthetic_trace(scene=SCENE), "paper": synthetic_trace(Errors(push_error_n=-0.4), SCENE, law="paper")}


@pytest.fixture(scope="module")
def page(traces, tmp_path_factory):
    folder = RunFolder(tmp_path_factory.mktemp("run"))
    metrics = {law: compute_metrics(trace) for law, trace in traces.items()}
    table = summary(FACTS, folder, metrics, False, 12.3, 10**9)
    figures = draw_all(traces, folder.path / "figures")
    write_report(folder.report, traces, table, figures)
    return folder.report.read_text(encoding="utf-8")


@pytest.mark.slow
def test_report_loads_no_external_resource(page):
    assert not re.search(r"(?:src|href)\s*=\s*[\"'](?!data:|video\.mp4)", page)
    assert "http://" not in page and "https://" not in page and "<script" not in page and "@import" not in page


def test_report_is_complete(page):
    assert page.count("data:image/png;base64,") == len(FIGURES)
    assert "$" not in re.sub(r"base64,[^\"]*", "", page), "a placeholder remains"
    for text in ("QP law", "analytic law", "push error, straights, rms", "0.200", "0.400", "press: made up", "mujoco"):
        assert text in page
    assert "a&lt;b&gt;.toml" in page and "<b>.toml" not in page


@pytest.mark.slow
def test_figures_are_wide_enough_to_read(traces, tmp_path):
    for _, file in draw_all({"qp": traces["qp"]}, tmp_path).values():
        height, width = cv2.imread(str(file)).shape[:2]
        assert width >= 1000 and height >= 250


def test_figures_of_a_flight_that_ended_before_touching(tmp_path):
    trace = synthetic_trace()
    early = int(np.searchsorted(trace.t, 1.5))
    for name, values in trace.arrays.items():
        if len(values) == len(trace.t) and name != "t":
            trace.arrays[name] = values[:early]
        elif name.endswith("1khz"):
            trace.arrays[name] = values[: 4 * early]
    trace.arrays["t"] = trace.t[:early]
    trace.canvas = trace.coverage_mask = None
    assert len(draw_all({"qp": trace}, tmp_path)) == len(FIGURES)


@pytest.mark.slow
def test_figures_leave_global_settings_alone(traces, tmp_path):
    import matplotlib

    before = dict(matplotlib.rcParams)
    draw_all({"qp": traces["qp"]}, tmp_path)
    assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_report_plays_the_video_beside_it(traces, tmp_path):
    folder = RunFolder(tmp_path)
    metrics = {law: compute_metrics(trace) for law, trace in traces.items()}
    folder.write_report(traces, summary(FACTS, folder, metrics, False, 12.3, 10**9), video=True)
    page = folder.report.read_text(encoding="utf-8")
    (name,) = re.findall(r"<video[^>]* src=\"([^\"]*)\"", page)
    assert "/" not in name and (tmp_path / name).stat().st_size > 10_000, "a file of the same folder"
    assert page.count('poster="data:image/jpeg;base64,') == 1, "a picture before it plays"


def test_a_false_claim_is_marked(page, traces, tmp_path):
    assert 'class="warning"' not in page
    metrics = {law: compute_metrics(trace) for law, trace in traces.items()}
    metrics["qp"] |= {"completed": False, "not_completed": "row 5: 54 mm from its place"}
    folder = RunFolder(tmp_path)
    write_report(folder.report, traces, summary(FACTS, folder, metrics, False, 12.3, 10**9), {})
    text = folder.report.read_text(encoding="utf-8")
    assert '<p class="warning">QP law: claimed as completed, but row 5: 54 mm from its place.</p>' in text
    assert text.count("yes (FALSE CLAIM)") == 1


def test_every_row_of_the_report_has_a_meaning(page):
    assert all(figure.about for figure in FIGURES_OF_MERIT.values() if figure.of is not None)
    assert set(wording.OUTCOMES) == set(Outcome)
    config = ControllerConfig()
    names = [row.name for limit in default_limits(config) for row in limit.rows(qp_problem(config).model)]
    assert all(wording.limit_words(name) for name in names)
    for words in (FIGURES_OF_MERIT["coverage"].about, wording.OUTCOMES["solved"]):
        assert words in page
