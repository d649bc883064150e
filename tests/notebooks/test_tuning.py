"""Controls of notebook 02: knobs, comparisons, and the preset that the command line flies."""

import dataclasses
import json
import re

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot import PilotConfig
from sim.commands import cli
from sim.evaluate.window import tilt_deg
from sim.figures.style import new_figure
from sim.notebook.common import DOTS_PER_INCH, RED, SHORT_VARIABLE, picture
from sim.notebook.dashboard import draw_dashboard
from sim.notebook.tuning import (
    KNOBS,
    Start,
    TuningBench,
    analytic_setting,
    knob_values,
    load_setting,
    load_start,
    reach_note,
    save_setting,
    turned,
)
from sim.notebook.wall_flights import HOVER_S, Setting, flight_figures, fly_setting
from sim.world.scene import load_scene


@pytest.fixture(autouse=True)
def short_form(monkeypatch):
    monkeypatch.setenv(SHORT_VARIABLE, "1")


def test_every_knob_is_read_and_turned_and_the_rest_stays():
    base = Setting()
    for name, value in knob_values(base).items():
        knob = KNOBS[name]
        if knob.low is None:
            other = not value
        else:
            stops = knob.stops(value)
            assert value in stops and stops == sorted(set(stops)) and len(stops) >= 10
            other = next(stop for stop in reversed(stops) if stop != value)
        moved = turned(base, {name: other})
        assert knob_values(moved) == knob_values(base) | {name: other}
        assert turned(moved, {name: value}) == base


def test_weights_and_soft_limits_do_not_touch_the_analytic_flight():
    base = analytic_setting(Setting())
    for name, value in (("pilot.controller.weights.push", 7.0), ("pilot.controller.limits.tilt_deg", 0.3)):
        assert analytic_setting(turned(Setting(), {name: value})) == base
    assert analytic_setting(turned(Setting(), {"pilot.controller.vehicle.thrust_max_n": 20.0})) != base


@pytest.mark.slow
def test_a_comparison_reports_the_changes_and_their_effect():
    bench = TuningBench()
    bench.compare()
    changed = bench.compare({"pilot.controller.weights.push": 5.0, "pilot.controller.reach_check": False})
    assert changed.changes == ("reach check: on → off", "push [1/(N)²]: 0.5 → 5")
    assert changed.last_setting == bench.base and not np.array_equal(changed.now.thrusts, changed.last.thrusts)
    further = bench.compare({"pilot.controller.weights.push": 5.0, "pilot.controller.touch_ramp": False})
    assert further.changes == ("ramp after touch: on → off", "push [1/(N)²]: 0.5 → 5"), "against the preset"
    assert further.last_change == ("reach check: off → on", "ramp after touch: on → off")
    assert bench.compare({}).changes == ()
    changed = bench.compare({"pilot.controller.weights.push": 5.0, "pilot.controller.reach_check": False})
    refused = bench.compare({"pilot.controller.vehicle.thrust_max_n": 1.0})
    assert "thrust_max_n" in refused.refusal and refused.now is changed.now


@pytest.mark.slow
def test_a_push_that_was_reduced_is_named_with_both_values():
    values = {"scene.paint.push_n": 26.5, "scene.wall.friction": 0.8}
    reduced = fly_setting(turned(Setting(), values), hold_s=1.6)
    match = re.fullmatch(r"26\.5 N reduced to (\d+\.\d) N", reach_note(reduced))
    assert match and float(match[1]) == pytest.approx(8.5, abs=0.3)
    unchecked = turned(Setting(), values | {"pilot.controller.reach_check": False})
    assert reach_note(fly_setting(unchecked, hold_s=1.6)) == ""
    assert reach_note(fly_setting(Setting())) == ""


def test_the_tilt_bound_lies_inside_its_axes():
    comparison = TuningBench().compare()
    greatest = float(tilt_deg(comparison.now)[comparison.now.t > HOVER_S].max())
    bound = 1.4 * greatest
    near = dataclasses.replace(comparison, setting=turned(Setting(), {"pilot.controller.limits.tilt_deg": bound}))
    (axes,) = (each for each in draw_dashboard(near).axes if each.get_title() == "tilt of the vehicle")
    heights = [line.get_ydata()[0] for line in axes.lines if line.get_color() == RED]
    assert heights == [bound] and axes.get_ylim()[1] > bound


def test_a_preset_is_loaded_or_the_reason_named(tmp_path):
    start = Start()
    assert start.again() != start and start.again().setting == start.setting
    setting = turned(Setting(), {"scene.wall.friction": 0.6, "pilot.controller.weights.push": 1.0})
    save_setting(setting, tmp_path / "mine.toml")
    starts, refusals = [start], [""]

    def load(preset: str) -> None:
        load_start(preset, lambda change: starts.append(change(starts[-1])), refusals.append)

    load(str(tmp_path / "mine.toml"))
    assert starts[-1].setting == setting and starts[-1] != start
    load("octorotor_qp")
    eight = starts[-1]
    assert eight.setting.pilot.controller.vehicle.geometry.count == 8 and "octorotor_qp" in eight.name
    for wrong, reason in (("tarot_t960_paper", "analytic law"), ("nothing.toml", "tarot_t960_qp")):
        load(wrong)
        assert starts[-1] is eight and reason in refusals[-1], "a refused preset is no new start: no control is reset"
    load("octorotor_qp")
    assert starts[-1] != eight and refusals[-1] == ""


@pytest.mark.slow
def test_the_figure_of_eight_rotors_is_drawn():
    bench = TuningBench(load_setting("octorotor_qp"))
    assert picture(draw_dashboard, bench.compare()).png


def test_a_picture_has_the_style_and_the_description_of_its_figure():
    def draw() -> Figure:
        """A curve."""
        figure = new_figure(2.0)
        figure.subplots().plot([0.0, 1.0], [0.0, 2.0])
        return figure

    shown = picture(draw)
    pixels = cv2.imdecode(np.frombuffer(shown.png, np.uint8), 1)
    assert shown.text == "A curve." and pixels is not None and pixels.shape[0] == 2.0 * DOTS_PER_INCH


@pytest.mark.slow
def test_force_ceiling_halves_the_peak_of_a_bad_force_law():
    """Measured: 15.6 N without the ceiling, 6.4 N with it; a bouncing flight differs by 2 N between processors."""
    bad = {"gains.force_kfp": 4.0, "gains.force_ksd": 0.0, "touch_ramp": False, "limits.push_barrier": False}
    bench = TuningBench()
    values = {f"pilot.controller.{name}": value for name, value in bad.items()}
    without = flight_figures(bench.compare(values).now)["greatest push [N]"]
    limited = bench.compare(values | {"pilot.controller.limits.push_barrier": True})
    assert without > 12.0 and flight_figures(limited.now)["greatest push [N]"] < 0.6 * without


@pytest.mark.slow
def test_a_saved_setting_is_flown_by_paint(tmp_path, capsys):
    """The files come back equal, and the command line flies them: a heavier push on a short board."""
    base = Setting()
    paint = dataclasses.replace(base.scene.paint, stroke_m=0.1, rows=1)
    board = dataclasses.replace(base.scene.board, width_m=0.2)
    base = dataclasses.replace(base, scene=dataclasses.replace(base.scene, paint=paint, board=board))
    setting = turned(base, {"scene.paint.push_n": 8.0, "pilot.controller.weights.push": 1.0})
    preset, scene = save_setting(setting, tmp_path / "mine.toml")
    assert Setting(pilot=PilotConfig.from_toml(preset), scene=load_scene(scene)) == setting
    words = ["--preset", str(preset), "--scene", str(scene), "--out", str(tmp_path / "run")]
    assert cli.main(["paint", *words, "--law", "qp", "--features", "geometric", "--no-video", "--json"]) == 0
    flown = json.loads(capsys.readouterr().out)["laws"]["qp"]
    assert flown["completed"] and flown["force_peak_n"] > 7.5


def test_a_preset_that_would_ring_is_not_saved(tmp_path):
    ringing = turned(Setting(), {"pilot.controller.gains.force_kfp": 3.0})
    with pytest.raises(ConfigError, match="force_kfp"):
        save_setting(ringing, tmp_path / "ringing.toml")
    assert not (tmp_path / "ringing.toml").exists()
    with pytest.raises(ConfigError, match=r"ends in \.toml"):
        save_setting(Setting(), tmp_path / "preset.txt")


@pytest.mark.parametrize("name", ["~no_such_user_here/x.toml", "nul\0.toml"])
def test_a_name_that_is_no_path_is_refused(name):
    with pytest.raises(ConfigError):
        load_setting(name)
    with pytest.raises(ConfigError):
        save_setting(Setting(), name)
