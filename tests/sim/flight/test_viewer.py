"""The window on a flight: refused in one line where there is no display, else fed with what the plant does."""

from __future__ import annotations

import contextlib
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from contract_schema import refusal

from sim.commands.paint import Paint
from sim.flight import viewer
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import PaintScene, Scene, StartScene


@pytest.fixture(params=[None, ":987"])
def no_display(request, monkeypatch):
    """A computer without a display, or with one that does not answer; what a message must name."""
    pytest.importorskip("glfw")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if request.param:
        monkeypatch.setenv("DISPLAY", request.param)
        monkeypatch.setattr("glfw.init", lambda: False)
    monkeypatch.setattr(viewer.sys, "platform", "linux")
    return request.param or "DISPLAY"


def test_without_a_display_the_video_shows_the_flight_and_one_line_says_so(no_display, capsys) -> None:
    assert Paint(view=True)._shown() == {"view": False, "no_video": False}
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert no_display in err and "video.mp4" in err


def test_without_a_display_and_without_a_video_nothing_flies(no_display, capsys, tmp_path) -> None:
    err = refusal(["paint", "--view", "--no-video", "--out", str(tmp_path / "run")], capsys)
    assert err.startswith("ibvs-qp: error: --view") and no_display in err
    assert not (tmp_path / "run").exists()


class Window:
    """Stands for MuJoCo's passive viewer."""

    def __init__(self, model, data, **_) -> None:
        self.cam, self.user_scn = mujoco.MjvCamera(), mujoco.MjvScene(model, maxgeom=50)
        self.data, self.syncs, self.closed, self.open = data, [], 0, True

    def lock(self):
        return contextlib.nullcontext()

    def is_running(self) -> bool:
        return self.open

    def sync(self) -> None:
        self.syncs.append(self.data.time)

    def close(self) -> None:
        self.closed += 1


@pytest.mark.slow
def test_the_window_sees_the_flight_and_its_paint_and_changes_nothing(monkeypatch) -> None:
    import mujoco.viewer

    windows = []

    def launch(model, data, **options):
        windows.append(Window(model, data, **options))
        return windows[-1]

    monkeypatch.setattr(mujoco.viewer, "launch_passive", launch)
    monkeypatch.setattr(viewer.time, "sleep", lambda _: None)
    job = Scene(paint=PaintScene(rows=1, stroke_m=0.12), start=StartScene(distance_m=0.2))
    options = {"features": "geometric", "video": False}
    seen = fly(job, FlightOptions(view=True, **options))
    alone = fly(job, FlightOptions(**options))
    assert np.array_equal(seen.arrays["thrusts"], alone.arrays["thrusts"])
    (window,) = windows
    assert window.closed == 1
    assert np.diff(window.syncs).min() == pytest.approx(0.02, abs=0.004)
    assert window.syncs[-1] == pytest.approx(seen.t[-1], abs=0.05)
    dabs = [window.user_scn.geoms[k] for k in range(window.user_scn.ngeom)]
    assert len(dabs) >= 8
    places = np.array([dab.pos for dab in dabs])
    assert np.abs(places[:, 0]).max() < 1e-3, "on the board's face"
    assert np.ptp(places[:, 1]) > 0.08
    assert np.allclose(dabs[0].mat[:, 2], (1.0, 0.0, 0.0)), "discs face the camera"


def test_a_closed_window_ends_nothing(monkeypatch) -> None:
    import mujoco.viewer

    plant = SimpleNamespace(
        scene=Scene(), model=mujoco.MjModel.from_xml_string("<mujoco/>"), data=None, time_ns=0, tip=np.zeros(3)
    )
    plant.data = mujoco.MjData(plant.model)
    window = Window(plant.model, plant.data)
    monkeypatch.setattr(mujoco.viewer, "launch_passive", lambda *_, **__: window)
    shown = viewer.FlightViewer(plant, np.zeros(3))  # type: ignore[arg-type]
    shown.show(False)
    window.open = False
    plant.time_ns = 10**9
    shown.show(True)
    assert len(window.syncs) == 1 and window.user_scn.ngeom == 0
