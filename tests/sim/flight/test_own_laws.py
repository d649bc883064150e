"""Control laws, tasks and limits of the user's by ``module:Class``: flown by every tool, refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from contract_schema import refusal

import ibvs_qp
from ibvs_qp import HybridController, Outcome, PaperController
from ibvs_qp.config.errors import ConfigError
from sim.commands.cli import main
from sim.experiments.design import Choice, design
from sim.experiments.scenes import short_job
from sim.experiments.spec import experiment
from sim.fault_matrix.design import Choice as FaultChoice
from sim.fault_matrix.design import design as fault_flights
from sim.flight.closed_loop import make_pilot
from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.own_law import own_law
from sim.rivals import LEXICOGRAPHIC, MPC
from sim.sweep import Planned, load_spec
from sim.sweep.design import configuration_hash

CONFIG = ibvs_qp.preset("qp").controller
POLICY = f"{Path(__file__).parents[3] / 'examples' / 'own_controller.py'}:ResidualPolicy"
#: A module of a user.
MODULE = """
import numpy as np
from ibvs_qp import PaperController
from ibvs_qp.limits import Limit
from ibvs_qp.model.rows import LimitRow, TaskRow
from ibvs_qp.tasks import Task

class Half(PaperController):
    def thrusts(self, measurement, reference):
        return 0.5 * super().thrusts(measurement, reference)

class Undefined(PaperController):
    def thrusts(self, measurement, reference):
        return np.full(6, np.nan)

class Quiet(Task):
    def rows(self, model):
        return [TaskRow(name="quiet", unit="N", expression=model.thrust[0], target=4.0, weight=0.1)]

class Cap(Limit):
    def rows(self, model):
        return [LimitRow(name="cap", unit="N", expression=model.thrust[1], lower=-1e3, upper=40.0, slack_weight=1e3)]

class Raises(Task):
    def rows(self, model):
        return model.nothing

class Other:
    pass
"""
EXPERIMENT = """
name = "policy"
title = "A learned policy in gusts"
about = "One stroke."
columns = [{ metric = "path_rms_m" }]
params = { wind = "gust [N rms]" }

[variants.policy]
words = "a residual policy on the analytic law"
controller = "POLICY"
laws = ["paper"]

[variants.quiet]
words = "with a task of ours"
rows = ["own.py:Quiet"]
laws = ["qp"]

[[flights]]
measure = "paint"
features = "geometric"
levels = { variant = ["standard", "policy", "quiet"], wind = [1.0] }
paths = { wind = ["scene.wind.gust_n_rms"] }
fixed = { "scene.paint.stroke_m" = 0.3, "scene.paint.rows" = 1, "scene.board.width_m" = 0.4 }
"""
SWEEP = """
job = "paint"
controller = "own.py:Half"
seeds = 2
[fixed]
scene.paint.stroke_m = 0.3
scene.board.width_m = 0.4
[grid]
scene.wind.mean_m_s.0 = [0.5, 1.0]
[tied]
scene.wind.mean_m_s.1 = "scene.wind.mean_m_s.0"
"""


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty current folder with the user's module."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(MODULE)
    return tmp_path


def pilot(options):
    scene = short_job(0.3, rows=1)
    return make_pilot(scene, options, pilot_config(scene, options), PaintJob())


def test_a_law_of_the_users_flies_in_place_of_the_law(folder):
    own = pilot(FlightOptions(controller="own.py:Half", features="geometric")).controller
    assert type(own).__name__ == "Half" and isinstance(own, PaperController)
    for name in (MPC, LEXICOGRAPHIC, POLICY):
        assert type(own_law(FlightOptions(controller=name), CONFIG)).__name__ == name.rpartition(":")[2]
    assert own_law(FlightOptions(), CONFIG) is None


def test_tasks_and_limits_join_the_program(folder):
    law = own_law(FlightOptions(rows=("own.py:Quiet", "own.py:Cap")), CONFIG)
    assert isinstance(law, HybridController)
    assert "quiet" in [row.name for row in law.problem.task_rows] and "cap" in law.problem.row_names


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"controller": "own.py:Other"}, r"Other is no subclass of ibvs_qp\.checked_law\.CheckedLaw"),
        ({"controller": "nowhere:Law"}, "nowhere cannot be imported"),
        ({"rows": ("own.py:Other",)}, r"no subclass of ibvs_qp\.tasks\.Task or ibvs_qp\.limits\.Limit"),
        ({"rows": ("own.py:Raises",)}, "rows own.py:Raises: AttributeError"),
        ({"rows": ("own.py:Quiet",), "law": "paper"}, "tasks and limits join the QP law only"),
        ({"rows": ("own.py:Quiet",), "controller": "own.py:Half"}, "tasks and limits join the QP law only"),
    ],
)
def test_refusals_name_the_class_and_the_reason(folder, options, words):
    with pytest.raises(ConfigError, match=words):
        own_law(FlightOptions(**options), CONFIG)


def test_paint_refuses_before_a_flight(folder, capsys):
    words = ["paint", "--features", "geometric", "--no-video", "--out", "run", "--controller", "own.py:Other"]
    assert "Other is no subclass" in refusal(words, capsys)
    assert not (folder / "run").exists()


def test_thrusts_that_are_not_finite_become_a_hold(folder):
    law = own_law(FlightOptions(controller="own.py:Undefined"), CONFIG)
    still = {"attitude": np.array([1.0, 0.0, 0.0, 0.0]), "angular_velocity": np.zeros(3), "contact_wrench": np.zeros(6)}
    command = law.step(ibvs_qp.Measurement(stamp_ns=1, wrench_stamp_ns=1, **still), ibvs_qp.Reference())
    assert command.outcome is Outcome.HOLD and np.isfinite(command.thrusts).all()


def test_an_experiment_of_the_users_has_its_own_variants(folder):
    (folder / "policy.toml").write_text(EXPERIMENT.replace("POLICY", POLICY))
    spec = experiment("policy.toml")
    assert spec is experiment("policy")
    flown = {(run.variant, run.law): run for run in design(spec, Choice())}
    assert set(flown) == {("standard", "qp"), ("standard", "paper"), ("policy", "paper"), ("quiet", "qp")}
    assert flown["policy", "paper"].plan.options.controller == POLICY
    before = configuration_hash(flown["quiet", "qp"])
    assert before != configuration_hash(flown["standard", "qp"])


@pytest.mark.parametrize(
    ("wrong", "right", "words"),
    [
        ("path_rms_m", "path_rms", "path_rms_m"),
        ('["standard", "policy", "quiet"]', '["polizy"]', "polizy"),
        ("wind = [1.0] }", "gust = [1.0] }", "it lacks wind of params"),
    ],
)
def test_a_misspelt_experiment_is_refused(folder, wrong, right, words):
    text = EXPERIMENT.replace("POLICY", POLICY).replace('"policy"', '"misspelt"', 1)
    (folder / "misspelt.toml").write_text(text.replace(wrong, right))
    experiment.cache_clear()
    with pytest.raises(ConfigError, match=words):
        experiment("misspelt.toml")


def test_a_sweep_flies_a_law_of_the_users_and_ties_parameters(folder):
    (folder / "own.toml").write_text(SWEEP)
    design = Planned(load_spec(folder / "own.toml"))
    run = design.run(3)
    assert run.plan.options.controller == "own.py:Half" and run.params == {"scene.wind.mean_m_s.0": 1.0}
    assert run.plan.scene.wind.mean_m_s[:2] == (1.0, 1.0)
    (folder / "own.toml").write_text(SWEEP.replace('= "scene.wind.mean_m_s.0"', '= "scene.wall.friction"'))
    with pytest.raises(ConfigError, match=r"allowed are the varied paths scene\.wind\.mean_m_s\.0"):
        load_spec(folder / "own.toml")


def test_the_fault_matrix_flies_a_law_of_the_users():
    runs = fault_flights(FaultChoice(quick=True, pattern="gyro bias*", controller=POLICY))
    assert runs and all(run.plan.options.controller == POLICY for run in runs)


@pytest.mark.slow
def test_paint_flies_the_example_and_names_it(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text("[paint]\nrows = 1\nstroke_m = 0.3\n[board]\nwidth_m = 0.4\n")
    words = ["paint", "--features", "geometric", "--no-video", "--scene", "short.toml", "--out", "run", "--json"]
    assert main([*words, "--controller", POLICY]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["controller"] == POLICY and list(summary["laws"]) == ["qp"] and summary["laws"]["qp"]["completed"]
    assert "own_controller.py:ResidualPolicy" in (tmp_path / "run" / "report.html").read_text()
