"""Report and video: self-contained, complete, readable."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from synthetic_trace import Errors, synthetic_trace

from sim.evaluate.metrics import compute_metrics
from sim.figures import FIGURES, draw_all
from sim.flight.pictures import pack_pictures, unpack_picture
from sim.video.film import write_video
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


def test_report_loads_no_external_resource(page):
    assert not re.search(r"(?:src|href)\s*=\s*[\"'](?!data:|video\.mp4)", page)
    assert "http://" not in page and "https://" not in page and "<script" not in page and "@import" not in page


def test_report_is_complete(page):
    assert page.count("data:image/png;base64,") == len(FIGURES)
    assert "$" not in re.sub(r"base64,[^\"]*", "", page), "a placeholder remains"
    for text in ("QP law", "analytic law", "push error, straights, rms", "0.200", "0.400", "press: made up", "mujoco"):
        assert text in page
    assert "a&lt;b&gt;.toml" in page and "<b>.toml" not in page


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


def test_figures_leave_global_settings_alone(traces, tmp_path):
    import matplotlib

    before = dict(matplotlib.rcParams)
    draw_all({"qp": traces["qp"]}, tmp_path)
    assert dict(matplotlib.rcParams) == before


def test_video_shows_both_laws_for_the_whole_flight(traces, tmp_path):
    write_video(traces, tmp_path / "video.mp4")
    video = cv2.VideoCapture(str(tmp_path / "video.mp4"))
    frames = video.get(cv2.CAP_PROP_FRAME_COUNT)
    rate = video.get(cv2.CAP_PROP_FPS)
    assert frames / rate == pytest.approx(float(traces["qp"].t[-1]), abs=0.2)
    good, frame = video.read()
    assert good and frame.shape[1] == 1280


def test_packed_pictures_look_the_same(traces):
    trace = synthetic_trace()
    smooth = np.tile(np.linspace(0, 255, 160).astype(np.uint8)[None, :, None], (120, 1, 3))
    smooth[..., 2] = 10
    trace.pictures = [(0.0, smooth, "paint")]
    packed = pack_pictures(trace).pictures[0][1]
    assert packed.ndim == 1
    assert np.abs(unpack_picture(packed).astype(int) - smooth).mean() < 3.0
