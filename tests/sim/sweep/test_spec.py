"""Specs of sweeps: names, values, order, draws, refusals, and runs that are made where they are flown."""

from __future__ import annotations

import dataclasses
import itertools
import pickle
import tomllib
from pathlib import Path

import numpy as np
import pytest

import sim
from ibvs_qp.config.errors import ConfigError
from sim.sweep import Planned, Run, load_spec
from sim.sweep.design import Refusal
from sim.sweep.setup import Setup, changed, unit_of, value_at
from sim.sweep.spec import fractions, parse_spec

SPECS = sorted((Path(next(iter(sim.__path__))) / "sweep" / "specs").glob("*.toml"))
GRID = """
name = "grid"
laws = ["qp", "paper"]
seed = 7
seeds = 2
[fixed]
job.hold_s = 1.0
[grid]
scene.wall.friction = [0.1, 0.5]
"pilot.controller.gains.force_kfp" = { low = 0.1, high = 0.4, steps = 3, scale = "log" }
"""
DRAWN = """
samples = {samples}
draw = "{draw}"
[random]
scene.plant.mass_kg = {{ low = 5.0, high = 7.0 }}
scene.board.clutter = {{ low = 0, high = 3 }}
scene.wind.mean_m_s.1 = {{ low = -2.0, high = 2.0 }}
pilot.controller.line_profile = ["tip", "paper"]
"""


def planned(text: str) -> Planned:
    return Planned(parse_spec(tomllib.loads(text), Path()))


def test_a_grid_is_every_combination_under_every_law_and_seed():
    design = planned(GRID)
    assert len(design) == 2 * 3 * 2 * 2
    places = [design.place(index) for index in range(len(design))]
    assert [(place.law, place.seed) for place in places[:4]] == [("qp", 7), ("qp", 8), ("paper", 7), ("paper", 8)]
    gains = sorted({place.params["pilot.controller.gains.force_kfp"] for place in places})
    assert gains == pytest.approx([0.1, 0.2, 0.4])
    assert len({(p.law, p.seed, *p.params.values()) for p in places}) == len(places)


def test_a_run_flies_what_its_row_says():
    run = planned(GRID).run(23)
    assert isinstance(run, Run)
    plan = run.plan
    assert (plan.scene.wall.friction, plan.options.law, plan.options.seed) == (0.5, "paper", 8)
    assert plan.config.controller.gains.force_kfp == pytest.approx(0.4) and plan.config.law == "paper"
    assert plan.job.hold_s == 1.0  # type: ignore[union-attr]
    assert run.params["pilot.controller.gains.force_kfp"] == plan.config.controller.gains.force_kfp


@pytest.mark.parametrize("draw", ["random", "sobol"])
def test_draws_lie_in_their_ranges_and_more_of_them_keep_the_first(draw):
    few, many = (planned(DRAWN.format(samples=count, draw=draw)) for count in (5, 40))
    places = [many.place(index).params for index in range(40)]
    assert [few.place(index).params for index in range(5)] == places[:5]
    assert few.block(0, 5).name == many.block(0, 5).name
    for params in places:
        assert 5.0 <= params["scene.plant.mass_kg"] <= 7.0
        assert params["scene.board.clutter"] in (0, 1, 2, 3)
    assert {params["pilot.controller.line_profile"] for params in places} == {"tip", "paper"}
    run = many.run(3)
    assert isinstance(run, Run)
    assert run.plan.scene.wind.mean_m_s == (0.0, places[3]["scene.wind.mean_m_s.1"], 0.0)


def test_draws_are_uniform_and_of_one_seed():
    for kind in ("random", "sobol"):
        numbers = fractions(kind, 4096, 3, 1)
        assert np.allclose(numbers.mean(axis=0), 0.5, atol=0.02) and numbers.min() >= 0.0 and numbers.max() < 1.0
        assert not np.array_equal(numbers, fractions(kind, 4096, 3, 2))


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[grid]\nscene.wall.fricton = [0.1]", ("scene.wall.fricton", "did you mean", "friction")),
        ("[grid]\nscene.wall.friction = [0.1, 9.0]", ("scene.wall.friction = 9.0", "[0, 1.5]")),
        ("[fixed]\nscene.plant.mass_kg = 50.0", ("scene.plant.mass_kg = 50.0 kg", "[2, 20] kg")),
        ("samples = 2\n[random]\nscene.plant.mass_kg = {low = 1.0, high = 7.0}", ("mass_kg = 1.0 kg", "[2, 20] kg")),
        ("samples = 2\n[random]\nscene.plant.mass_kg = {low = 7.0, high = 5.0}", ("mass_kg = [7, 5]", "low <= high")),
        ("[random]\nscene.plant.mass_kg = {low = 5.0, high = 7.0}", ("samples", "[random]")),
        ("samples = 3", ("samples", "[random]")),
        ("[grid]\njob.hold_s = [-1.0]", ("job.hold_s = -1.0 s", "[0, 600] s")),
        ("[grid]\njob.hold = [1.0]", ("job.hold", "hold_s")),
        ('job = "paint"\n[grid]\njob.hold_s = [1.0]', ("job.hold_s", "no settings")),
        ("[grid]\nwall.friction = [0.1]", ("wall.friction", "scene.", "pilot.")),
        ("[grid]\nscene.wall = [0.1]", ("scene.wall is a section", "friction")),
        ("[grid]\nscene.wind.mean_m_s.3 = [1.0]", ("scene.wind.mean_m_s.3", "0 to 2")),
        ("[grid]\nscene.wind.mean_m_s = [[0.0, 1.0, 0.0]]", ("single values", "mean_m_s.0")),
        ("[grid]\nscene.wall.friction = {low = 0.1, high = 0.3}", ("friction.steps = 0",)),
        ("[grid]\nscene.wall.friction = {low = 0.0, high = 0.3, steps = 3, scale = 'log'}", ("low > 0",)),
        ("[grid]\nscene.wall.friction = []", ("at least one value",)),
        ("[grid]\npilot.painting.push_n = [4.0, 6.0]", ("pilot.painting.push_n", "scene.paint")),
        ("[grid]\npilot.law = ['qp', 'paper']", ("pilot.law", "laws")),
        ("[fixed]\njob.hold_s = 1.0\n[grid]\njob.hold_s = [1.0]", ("[fixed]", "[grid]")),
        ("seeds = 0", ("seeds = 0", "[1, 1e+06]")),
        ("laws = ['both']", ("laws", "qp and paper")),
        ("name = 'a/b'", ("name = 'a/b'", "letters")),
        ("sees = 2", ("sees", "seeds")),
        ("grid = 3", ("grid must be a table",)),
        ("[fixed]\nscene.plant.mass_kg = 'heavy'", ("scene.plant.mass_kg", "float")),
    ],
)
def test_refusals_name_field_value_and_range(tmp_path, text, named):
    file = tmp_path / "spec.toml"
    file.write_text(text)
    with pytest.raises(ConfigError) as refusal:
        load_spec(file)
    message = str(refusal.value)
    assert "\n" not in message and str(file) in message
    for word in named:
        assert word in message


def test_values_that_are_refused_together_make_a_row_with_the_reason():
    design = planned("[grid]\npilot.controller.brush.stiffness_min_n_m = [1000.0]\nscene.wall.friction = [0.1]")
    together = changed(
        Setup(), {"pilot.controller.brush.stiffness_max_n_m": 900.0, "pilot.controller.brush.stiffness_min_n_m": 500.0}
    )
    spec = dataclasses.replace(
        design.spec, setups={"qp": dataclasses.replace(together, job=design.spec.setups["qp"].job)}
    )
    run = Planned(spec).run(0)
    assert isinstance(run, Refusal)
    assert "stiffness_min_n_m = 1000.0 N/m" in run.reason and run.params["scene.wall.friction"] == 0.1


def test_a_point_that_cannot_be_flown_makes_a_row_with_the_reason():
    design = planned("[grid]\nscene.force_torque.latency_s = [0.004, 0.05]")
    flown, refused = design.run(0), design.run(1)
    assert isinstance(flown, Run) and isinstance(refused, Refusal)
    assert "force_torque.latency_s = 0.05 s" in refused.reason and "safety.wrench_age_s = 0.03 s" in refused.reason


def test_a_block_is_small_and_the_same_elsewhere():
    design = planned(DRAWN.format(samples=100_000, draw="random"))
    block = design.block(70_000, 70_100)
    design.place(5)  # caches what must not travel
    sent = pickle.dumps(block)
    assert len(sent) < 20_000
    there = pickle.loads(sent)
    assert there.name == block.name and there.count == 100
    made = list(itertools.islice(there.make(), 3))
    assert [run.params for run in made] == [design.place(70_000 + index).params for index in range(3)]


def test_name_of_a_block_tells_what_is_flown(monkeypatch):
    design = planned(GRID)
    names = {design.block(start, start + 2).name for start in range(0, len(design), 2)}
    names.add(planned(GRID.replace("hold_s = 1.0", "hold_s = 1.5")).block(0, 2).name)
    monkeypatch.setattr("sim.sweep.planned.code_hash", lambda: "other code")
    names.add(planned(GRID).block(0, 2).name)
    assert len(names) == len(design) / 2 + 2


@pytest.mark.parametrize("file", SPECS, ids=lambda file: file.stem)
def test_shipped_specs_load(file):
    design = Planned(load_spec(file))
    assert len(design) > 100 and isinstance(design.run(len(design) - 1), Run)
    assert design.spec.settings.name == file.stem


def test_paths_have_units_and_values():
    assert unit_of("scene.plant.mass_kg") == "kg" and unit_of("scene.wind.mean_m_s.1") == "m/s"
    assert unit_of("job.hold_s") == "s" and unit_of("pilot.controller.gains.line_kp") == "1/s^2"
    assert unit_of("sigma_f_n") == "" and unit_of("scene.nowhere.x") == ""
    assert value_at(Setup(), "scene.wind.mean_m_s.1") == 0.0
