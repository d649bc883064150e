"""Experiments as data: every file is read, wrong keys are refused, levels become flights."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import sim.experiments
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import load_toml
from sim.experiments import FAIR, NAMES
from sim.experiments.design import Choice, design
from sim.experiments.figures import KINDS
from sim.experiments.spec import EVERY, SPECS, Bound, Criteria, Criterion, Experiment, experiment
from sim.experiments.verdict import GOALS, evaluate, verdicts
from sim.world.errors import WorldErrors, single_errors, world_errors
from sim.world.plant_scene import PlantScene
from sim.world.random_scene import EVALUATION, random_scene
from sim.world.worlds import in_world

#: Scenes of the seeds of experiment worlds.
SCENES = [random_scene(seed, EVALUATION) for seed in range(30)]


def test_every_file_has_a_name_and_every_name_a_file():
    assert {file.stem for file in SPECS.glob("*.toml")} == {*NAMES, FAIR}


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_is_complete(name):
    each = experiment(name)
    assert each.name == name
    assert {figure.kind for figure in each.figures} <= set(KINDS)
    assert all(criterion.reason and criterion.text for criterion in each.every_criterion())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("at_most = 6.5", "at_mots = 6.5", "did you mean 'at_most'"),
        ("at_most = 6.5", "at_most = 6.5\nat_least = 1.0", "needs one of at_most"),
        ('statistic = "every flight"', 'statistic = "mean"', "allowed are median, every flight"),
        ("seeds = 10", "seeds = 0", "seeds"),
        ("levels.stiffness_n_m = [5000.0]", "levels.stiffness_n_m = 5000.0", "quick"),
        ("[fixed]", "[fixde]", "did you mean 'fixed'"),
    ],
)
def test_wrong_files_are_refused_by_place(tmp_path, old, new, message):
    text = (SPECS / "approach.toml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "approach.toml"
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        load_toml(Experiment, file)


def test_a_dotted_path_that_does_not_exist_is_refused():
    wrong = dataclasses.replace(experiment("approach"), fixed={"scene.wall.stifness_n_m": 1.0})
    with pytest.raises(ConfigError, match="stiffness_n_m"):
        design(wrong, Choice())


def test_criteria_expand_to_variants_cells_and_bounds():
    group = Criteria(
        bounds=(Bound(text="{push_n:g} N", metric="a", at_most=1.0), Bound(text="b", metric="b", at_least=2.0)),
        where={"kind": "static"},
        cells=({"push_n": 5.0}, {"push_n": 7.5}),
        variants=("standard", "clipped"),
    )
    listed = list(group.expanded())
    assert [each.text for each in listed] == ["5 N", "b", "7.5 N", "b"] * 2
    assert [each.variant for each in listed] == ["standard"] * 4 + ["clipped"] * 4
    assert listed[2].where == {"kind": "static", "push_n": 7.5}
    assert (listed[1].least, listed[1].bound) == (True, 2.0)


@pytest.mark.parametrize(("good", "met"), [(30, True), (29, True), (28, False)])
def test_a_bound_may_hold_for_a_share_of_the_flights(good, met):
    bound = next(each for each in experiment("worlds").every_criterion() if each.share < 1.0 and each.every)
    done = [index < good for index in range(30)]
    verdict = evaluate(bound, {}, pl.DataFrame({"completed": done}), {})
    assert verdict.met is met and verdict.within == good
    median = next(each for each in experiment("worlds").every_criterion() if each.share < 1.0 and not each.every)
    rows = pl.DataFrame({"completed": done, median.metric: [0.004] * 30})
    assert evaluate(median, {}, rows, {}).met is met


@pytest.mark.slow
def test_levels_vary_from_the_last_to_the_first_and_laws_share_seeds():
    runs = design(experiment("friction"), Choice(seed=4))
    first = [(run.variant, run.params["friction"], run.law, run.seed) for run in runs[:21]]
    assert first[:10] == [("standard", 0.1, "qp", seed) for seed in range(4, 14)]
    assert first[10:20] == [("standard", 0.1, "paper", seed) for seed in range(4, 14)]
    assert first[20][1] == 0.3
    assert runs[0].plan.scene.wall.friction == 0.1
    holds = design(experiment("force-hold"), Choice())
    assert holds[0].keep and not holds[1].keep and not holds[0].trace
    assert all(run.trace for run in design(experiment("friction"), Choice(traces=True)))


def test_flights_that_need_pictures_are_left_out_of_geometric_ones():
    flown = {run.params["error"] for run in design(experiment("mismatch"), Choice(features="geometric"))}
    assert "camera turned 0.3 deg" in flown and not any("focal" in str(error) for error in flown)


def test_mismatch_flies_every_error_of_the_harsh_world_alone():
    """The sizes in the spec are those of the profile."""
    flown = [run.plan.scene.errors for run in design(experiment("mismatch"), Choice())]
    singles = single_errors(world_errors("harsh"))
    assert singles and [name for name, errors in singles.items() if errors not in flown] == []


def test_every_named_error_is_flown_and_changes_the_scene():
    each = experiment("mismatch")
    flown = {str(run.params["error"]): run for run in design(each, Choice())}
    assert flown.keys() == each.named["error"].keys() | {"nothing"}
    for name, run in flown.items():
        right = run.plan.scene.errors == WorldErrors() and run.plan.scene.plant == PlantScene()
        assert right == (name == "nothing")


@pytest.mark.parametrize("name", ["saturation", "friction", "gust", "sloped-edge", "rotor-derate"])
def test_where_rotors_saturate_every_allocator_flies_every_cell_ten_times(name):
    flown: dict[str, dict[str, list[int]]] = {}
    for run in design(experiment(name), Choice()):
        if run.variant in ("no-feedforward", "clipped"):
            continue
        controller = run.plan.config.controller
        cell = flown.setdefault(f"{run.params} {controller.reach_check}", {})
        cell.setdefault(f"{run.law} {controller.allocator}", []).append(run.seed)
    for cell, laws in flown.items():
        assert laws.keys() == {"qp clip", "paper clip", "paper sequential", "paper box"}, cell
        assert all(seeds == list(range(10)) for seeds in laws.values()), cell


@pytest.mark.parametrize("name", NAMES)
def test_every_cell_has_enough_pairs_for_a_significant_difference(name):
    each = experiment(name)
    assert all(flights.seeds >= 10 for flights in each.flights if flights.levels.get("kind") != ("map",))


@pytest.mark.slow
def test_worlds_flies_every_law_on_the_same_random_scenes_in_three_worlds():
    runs = design(experiment("worlds"), Choice(world="ideal"))
    laws = {(run.law, run.plan.config.controller.allocator) for run in runs}
    assert laws == {("qp", "clip"), ("paper", "clip"), ("paper", "sequential"), ("paper", "box")}
    assert len(runs) == 30 * (2 + 2 * len(laws))
    for run in runs:
        expected = in_world(SCENES[run.seed], str(run.params["world"]))
        assert run.plan.scene == expected and run.plan.options.features == "geometric"
    assert {run.params["world"] for run in runs} == {"ideal", "datasheet", "harsh"}
    shifted = design(experiment("worlds"), Choice(seed=5, quick=True))
    assert {run.plan.scene.board for run in shifted} == {SCENES[5].board}


SETS = sorted(file.stem for file in Path(sim.experiments.__file__).parent.glob("goals/*.toml"))
CRITERION = Criterion(text="path", metric="path_rms_m", ratio_at_most=0.8, before="before.csv")


@pytest.mark.parametrize("name", SETS)
def test_every_goal_has_flights_and_those_of_its_reference(name: str) -> None:
    spec = load_toml(Experiment, GOALS / f"{name}.toml")
    flown: dict[tuple, set[int]] = {}
    for run in design(spec, Choice(features="geometric")):
        flown.setdefault((run.law, tuple(sorted(run.params.items()))), set()).add(run.seed)
    before = pl.read_csv(GOALS / "before.csv")
    for goal in spec.every_criterion():
        cells = {
            key: seeds for key, seeds in flown.items() if key[0] == goal.law and set(goal.where.items()) <= set(key[1])
        }
        assert cells and min(len(seeds) for seeds in cells.values()) >= 5
        for (law, params), seeds in cells.items():
            if goal.against:
                assert flown[law, tuple(sorted((dict(params) | goal.against).items()))] >= seeds
            elif goal.before:
                same = [pl.col(f"param.{key}") == value for key, value in params]
                assert set(before.filter(*same).drop_nulls(goal.metric)["seed"]) >= seeds


def flights(kind: str, values: list[float | None], completed: bool = True) -> pl.DataFrame:
    facts = {"experiment": "goals", "law": "qp", "variant": "standard", "param.kind": kind, "completed": completed}
    rows = [facts | {"seed": seed, "path_rms_m": value} for seed, value in enumerate(values)]
    return pl.DataFrame(rows, schema_overrides={"path_rms_m": pl.Float64})


@pytest.mark.parametrize(("factor", "met"), [(0.7, True), (0.9, False)])
def test_a_ratio_is_that_of_flights_with_the_same_seed(factor: float, met: bool) -> None:
    old = flights("flat", [0.001 * (seed + 1) for seed in range(10)])
    new = old.with_columns(pl.col("path_rms_m") * factor).sample(fraction=1.0, shuffle=True, seed=1)
    found = evaluate(CRITERION, {}, new, {}, old)
    assert (found.median, found.worst) == pytest.approx((factor, factor)) and found.met is met


def test_a_flight_that_is_missing_or_failed_meets_nothing() -> None:
    old, good = flights("flat", [0.002] * 10), flights("lean", [0.001] * 10)
    for new, reference in (
        (flights("lean", [0.001] * 10, completed=False), old),
        (flights("lean", [None] + [0.001] * 9), old),
        (good, old.head(9)),
    ):
        assert not evaluate(CRITERION, {}, new, {}, reference).met
    assert evaluate(CRITERION, {}, good, {}, old).met


def test_reference_flights_are_those_of_the_same_law_and_other_parameters() -> None:
    spec = load_toml(Experiment, GOALS / "surfaces.toml")
    table = pl.concat((flights("flat", [0.002] * 10), flights("lean 10", [0.004] * 10)))
    (found,) = [each for each in verdicts(spec, table) if each.criterion.metric == "path_rms_m" and each.n]
    assert found.median == pytest.approx(2.0) and not found.met and not np.isnan(found.bound)


def test_a_goal_states_one_bound_and_a_ratio_its_reference() -> None:
    for refused, words in (
        ({"at_most": 1.0, "ratio_at_most": 1.0}, "needs one of"),
        ({"ratio_at_most": 1.0}, "either against or before"),
        ({"ratio_at_most": 1.0, "before": "before.csv", "statistic": EVERY}, "ratio of medians"),
    ):
        with pytest.raises(ConfigError, match=words):
            Bound(text="path", metric="path_rms_m", **refused)
