"""``ibvs-qp tune`` with made-up flights: search, resume, choice, verdict on unseen seeds, files, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import polars as pl
import pytest
from contract_schema import refusal

import ibvs_qp
import sim.sweep.flying
import sim.tune.flights
from ibvs_qp.pilot import PilotConfig
from sim.commands.cli import main
from sim.rivals import MPC
from sim.tune.finalists import Finalist, best_of, fly_finalists
from sim.tune.flights import CHOICE_SEED, REPORT_SEED, SEARCH_SEED, WORLD, checks, flights, seeds, training
from sim.tune.objectives import (
    OBJECTIVES,
    PAINT,
    SATURATED,
    SLIDE,
    STEEP,
    Score,
    allowed,
    contact_damping,
    cost,
    front,
    gain_over,
    less_damped,
    ranked,
    refused,
    score,
)
from sim.tune.record import differences, objection
from sim.tune.search import SearchPlan, finished, open_study, search
from sim.tune.space import BY_HAND, GAIN_RANGES, Subject, from_unit, to_unit
from sim.world.errors import world_errors
from sim.world.random_scene import EVALUATION, TUNING, random_scene

pytest.importorskip("optuna", reason="tuning needs the extra tune")

#: Trials of a search that reach into its second generation.
START = 18
#: Trials of two whole generations.
GENERATIONS = 29
#: Where the made-up flights are best: softer than the shipped gains, within the ranges.
BEST = {"line_kp": 90.0, "force_ksd": 100.0, "attitude_kp": 100.0}
#: Flights with less `line_kp` fail: those by hand, neither law's.
SLACK = 70.0


def made_up_flight(scene, options, *, config, **_):
    """Every objective grows with the distance from `BEST`, a little with the seed; a slack line loop fails."""
    gains = config.controller.gains
    off = sum(math.log(getattr(gains, name) / best) ** 2 for name, best in BEST.items())
    wobble = 1.0 + 0.01 * math.sin(options.seed + len(scene.wind.mean_m_s) * scene.wall.friction)
    figures = {each.name: 0.05 * each.failed * (0.2 + off) * wobble for each in OBJECTIVES}
    figures["delivered_share"] = 1.0 / (1.2 + off) / wobble
    return SimpleNamespace(outcome={"completed": gains.line_kp > SLACK}, reason="", figures=figures)


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are made up; the list holds their seeds."""
    count: list[int] = []

    def fly(scene, options, **named):
        count.append(options.seed)
        return made_up_flight(scene, options, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.setattr(sim.sweep.flying, "outcome", lambda trace: trace.outcome)
    for name in ("paint_figures", "slide_figures"):
        monkeypatch.setattr(sim.tune.flights, name, made_up_figures)
    monkeypatch.setattr("sim.tune.space.require_margin", lambda *_: None)
    monkeypatch.setattr("sim.tune.space.motion_sensitivity", lambda *_: {"line": 1.5})
    monkeypatch.setattr("sim.tune.space.contact_sensitivity", lambda *_: 1.5)
    monkeypatch.chdir(tmp_path)
    return count


def made_up_figures(trace):
    return trace.figures


def plan(trials: int, storage: str, **changes) -> SearchPlan:
    settings = {"seed": 0, "flights": 1, "features": "geometric", "jobs": 1} | changes
    return SearchPlan(
        law="qp",
        shipped=ibvs_qp.preset("qp"),
        other=ibvs_qp.preset("paper"),
        trials=trials,
        storage=storage,
        **settings,
    )


def searched(trials: int, storage: str, **changes):
    wanted = plan(trials, storage, **changes)
    study = open_study(wanted)
    search(wanted, study, lambda _: None)
    return finished(study)


@pytest.mark.slow
def test_the_search_begins_at_the_shipped_gains_and_betters_them(flown):
    trials = searched(80, "a.log")
    gains, shipped = trials[0]
    assert gains == Subject(ibvs_qp.preset("qp")).values and len(trials) == 80
    assert trials[1][0] == gains | Subject(ibvs_qp.preset("paper")).values
    assert trials[2][0] == gains | BY_HAND
    best = ranked({number: each for number, (_, each) in trials.items()}, shipped)
    assert best and gain_over(trials[best[0]][1], shipped) < -0.3
    for gains, _ in trials.values():
        assert all(0.999 * low <= gains[name] <= 1.001 * high for name, (low, high) in GAIN_RANGES.items())


@pytest.mark.slow
def test_the_same_seed_is_the_same_search_and_a_resumed_one_too(flown):
    once, again = searched(START + 4, "a.log"), searched(START + 4, "b.log")
    assert once == again
    searched(START + 1, "c.log")
    before = len(flown)
    assert searched(START + 4, "c.log") == once
    assert len(flown) - before == 3 * len(training())
    assert searched(4, "d.log", seed=1)[3] != once[3]


@pytest.mark.slow
def test_a_killed_trial_leaves_no_trace_in_the_search(flown, monkeypatch):
    whole, once = sim.sweep.flying.fly, searched(GENERATIONS, "a.log")

    def dies(*arguments, **named):
        if len(flown) % 3 == 2:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    searched(START + 1, "b.log")
    flown.clear()
    monkeypatch.setattr(sim.sweep.flying, "fly", dies)
    with pytest.raises(KeyboardInterrupt):
        searched(GENERATIONS, "b.log")
    monkeypatch.setattr(sim.sweep.flying, "fly", whole)
    again = searched(GENERATIONS, "b.log")
    assert sorted(gains["line_kp"] for gains, _ in again.values()) == sorted(
        gains["line_kp"] for gains, _ in once.values()
    )


def test_a_preset_whose_contact_would_ring_is_not_flown(flown, monkeypatch):
    from ibvs_qp.config.errors import ConfigError

    def ringing(*_):
        raise ConfigError("rings")

    monkeypatch.setattr("sim.tune.space.require_margin", ringing)
    assert searched(2, "a.log")[1][1] == refused()
    assert len(flown) == len(training()), "the start flies: the others are compared with it"


def test_a_preset_close_to_instability_is_not_flown(flown, monkeypatch):
    monkeypatch.setattr("sim.tune.space.motion_sensitivity", lambda *_: {"attitude": 1.5, "line": 2.1})
    assert searched(2, "a.log")[1][1] == refused()
    assert len(flown) == len(training())


def test_a_preset_that_bears_no_other_lag_is_not_flown(flown, monkeypatch):
    monkeypatch.setattr("sim.tune.space.motion_sensitivity", lambda _, lag=1.0: {"line": 2.4 if lag > 1.0 else 1.9})
    assert searched(2, "a.log")[1][1] == refused()


def test_search_choice_and_report_fly_seeds_of_their_own():
    subject, flown = Subject(ibvs_qp.preset("paper")).having({"line_kp": 11.0}), training() | checks()
    spans = [
        {run.seed for run in flights(flown, subject, "tuned", seeds(first, seed, 10), "geometric")}
        for first in (SEARCH_SEED, CHOICE_SEED, REPORT_SEED)
        for seed in (0, 1)
    ]
    assert {len(span) for span in spans} == {10 * len(flown)}, "every scene has seeds of its own"
    assert sum(map(len, spans)) == len(set().union(*spans))
    runs = flights(flown, subject, "tuned", (5,), "geometric")
    assert {run.law for run in runs} == {"paper"} and {run.plan.config.controller.gains.line_kp for run in runs} == {
        11.0
    }
    assert len({run.params["scene"] for run in runs}) == len({run.plan.scene for run in runs}) == 9
    tasks = {run.params["scene"]: run.params["task"] for run in runs}
    assert {scene for scene, task in tasks.items() if task == SLIDE} == {"sticking slide"}
    assert tasks["saturated slide"] == SATURATED
    assert [run.params["scene"] for run in runs if not run.plan.config.controller.reach_check] == ["saturated slide"]


def test_the_rival_flies_its_weights_on_the_preset_of_the_qp():
    subject = Subject(ibvs_qp.preset("qp"), rival=True).having({"line": 1234.0})
    options = flights(training(), subject, "tuned", (5,), "geometric")[0].plan.options
    assert (options.law, options.controller, options.controller_settings) == ("qp", MPC, subject.weights)
    assert subject.values["line"] == 1234.0 and "line = 1234.0" in subject.to_toml()


@pytest.mark.parametrize("span", [(0.0, 0.115), (4.0, 400.0)])
def test_places_in_a_range_go_from_its_lower_end_to_its_upper_one(span):
    assert from_unit(0.0, *span) == span[0] and from_unit(1.0, *span) == pytest.approx(span[1])
    assert from_unit(to_unit(0.3 * span[1], *span), *span) == pytest.approx(0.3 * span[1])


def test_no_scene_of_the_search_is_one_of_the_evaluation():
    textures = {each.scene.board.texture_seed % 2 for each in (training() | checks()).values()}
    assert textures == {random_scene(0, TUNING).board.texture_seed % 2}
    assert textures != {random_scene(0, EVALUATION).board.texture_seed % 2}
    assert all(each.scene.errors == world_errors(WORLD) for each in training().values())


def test_failed_flights_count_with_the_worst():
    row = {"completed": True, "param.task": PAINT, **{each.name: 0.5 * each.failed for each in OBJECTIVES}}
    lost = {**row, "completed": False}
    unknown = {**row, "path_rms_m": None}
    assert score([row, lost]).failed == 0.5
    painted = [each for each in OBJECTIVES if PAINT in each.tasks]
    found = [value for value in score([row, lost]).values if math.isfinite(value)]
    assert found == pytest.approx([0.75 * each.failed for each in painted])
    assert score([unknown]).values[1] == OBJECTIVES[1].failed
    slide = {**row, "param.task": SLIDE, "delivered_share": 0.9}
    delivered = [each.name for each in OBJECTIVES].index("delivered_share")
    assert score([slide, {**slide, "completed": False}]).values[delivered] == pytest.approx(0.5 * (0.9 + 0.1))


def test_the_rule_of_choice():

    def made(force: float, path: float, tilt: float, thrust_rate: float, failed: float = 0.0) -> Score:
        """Values far beyond the least difference that matters; a slide's objectives are missing."""
        values = {"force_rms_n": force, "path_rms_m": path, "tilt_peak_deg": tilt, "jitter_n_s": thrust_rate}
        return Score(tuple(1e9 * values.get(each.name, math.nan) for each in OBJECTIVES), failed)

    shipped = made(1.0, 1.0, 1.0, 1.0)
    scores = {
        0: shipped,
        1: made(0.5, 0.5, 1.2, 0.5),  # clearly worse in one
        2: made(0.9, 0.9, 0.9, 1.2),  # rotors may be a quarter busier
        3: made(0.8, 0.9, 0.9, 1.0),
        4: made(0.1, 0.1, 0.1, 0.1, failed=0.1),
        5: made(1.0, 1.0, 1.0, 1.01),
    }
    assert ranked(scores, shipped) == [3, 2]
    assert not allowed(scores[1], shipped) and not allowed(scores[4], shipped)
    assert front(scores) == [1, 3]
    assert gain_over(made(*[math.e] * 4), shipped) == pytest.approx(1.0)
    assert less_damped(0.3, 0.3) == 0.0 and less_damped(0.135, 0.3) == pytest.approx(math.log(2.0))
    assert cost(scores[2], shipped) == gain_over(scores[2], shipped)
    assert cost(scores[1], shipped) == pytest.approx(gain_over(scores[1], shipped) + STEEP * math.log(1.2 / 1.1))
    stuck = next(each for each in OBJECTIVES if each.name == "stuck_share")
    assert stuck.ratio(0.0, 0.005) == pytest.approx(0.5), "half a per cent is the least difference that matters"


@pytest.mark.slow
def test_command_writes_preset_trials_figures_and_verdict(flown, capsys):
    words = ["tune", "--trials", "24", "--unseen", "4", "--json", "--out", "run"]
    assert main(words) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["schema"], content["law"], content["trials"]) == (1, "qp", 24)
    preset = PilotConfig.from_toml(content["preset"]) if content["chosen"] else None
    assert preset is not None and Subject(preset).values == content["gains"]
    assert (
        Path(content["preset"])
        .read_text()
        .startswith("# Gains found by `ibvs-qp tune --law qp --trials 24 --unseen 4`")
    )
    everywhere = [each for each in content["unseen"] if each["scene"] == "all"]
    assert [each["objective"] for each in everywhere] == [each.name for each in OBJECTIVES]
    flights_of = {PAINT: 7, SLIDE: 1, SATURATED: 1}
    counts = {each.name: 4 * sum(flights_of[task] for task in each.tasks) for each in OBJECTIVES}
    assert all(each["n"] == counts[each["objective"]] and each["verdict"] == "better" for each in everywhere)
    assert {seed // 1000 for seed in flown} == {1, 2, 3}
    for name in ("qp-front.png", "qp-unseen.png"):
        assert Path("run/figures", name).stat().st_size > 10_000
    assert json.loads(Path("run/qp.json").read_text())["gains"] == content["gains"]
    page = Path("run/report_qp.md").read_text()
    assert "verdict" in page and "better" in page
    flown.clear()
    assert main(words) == 0 and not flown


def test_nothing_better_keeps_the_shipped_preset(flown, monkeypatch, capsys):
    shipped = ibvs_qp.preset("paper").controller.gains
    for name in BEST:
        monkeypatch.setitem(BEST, name, getattr(shipped, name))
    assert main(["tune", "--law", "paper", "--trials", "4", "--json", "--out", "run"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["chosen"] is None and content["unseen"] == []
    assert PilotConfig.from_toml(content["preset"]) == ibvs_qp.preset("paper")
    assert "shipped preset stays" in Path("run/report_paper.md").read_text()


@pytest.mark.slow
def test_a_journal_gives_the_same_choice_without_the_flights_of_the_search(flown, capsys):
    words = ["tune", "--trials", "24", "--unseen", "4", "--json"]
    assert main([*words, "--out", "run"]) == 0
    once = json.loads(capsys.readouterr().out)
    flown.clear()
    assert main([*words, "--storage", "run/journal.log", "--out", "again"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert {seed // 1000 for seed in flown} == {2, 3}
    same = ("law", "seed", "features", "trials", "front", "finalists", "chosen", "gains", "unseen")
    assert {name: again[name] for name in same} == {name: once[name] for name in same}


@pytest.mark.slow
def test_a_trial_that_rings_more_is_no_finalist(flown, monkeypatch, tmp_path):
    trials = searched(24, "a.log")
    wanted = plan(24, "a.log")

    def chosen(folder: str) -> int | None:
        return best_of(fly_finalists(wanted, trials, 2, tmp_path / folder, lambda *_: None))

    first = chosen("first")
    assert first is not None
    # The same figures, but the best finalist rings a little more: it does not come as far as to fly.
    best, firm = trials[first][0]["line_kp"], contact_damping(wanted.shipped)
    with monkeypatch.context() as patch:
        ringing = lambda config: (0.89 if config.controller.gains.line_kp == best else 1.0) * firm  # noqa: E731
        patch.setattr("sim.tune.finalists.contact_damping", ringing)
        assert chosen("ringing") not in (first, None)


def test_a_finalist_clearly_worse_in_one_scene_may_not_replace_the_shipped():
    def finalist(**scenes: float) -> Finalist:
        by_scene = {name: made(value) for name, value in scenes.items()}
        return Finalist(made(sum(scenes.values()) / len(scenes)), by_scene, 0.3)

    def made(value: float) -> Score:
        return Score(tuple(1.0 if each.name == "delivered_share" else value for each in OBJECTIVES), 0.0)

    shipped = finalist(job=1.0, sticking=1.0, gusts=1.0)
    assert finalist(job=0.7, sticking=1.2, gusts=0.7).may_replace(shipped)
    assert not finalist(job=0.7, sticking=1.3, gusts=0.7).may_replace(shipped)
    assert not finalist(job=1.0, sticking=1.1, gusts=1.0).may_replace(shipped)


def test_ctrl_c_says_how_to_go_on(flown, monkeypatch, capsys):
    def stops(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sim.sweep.flying, "fly", stops)
    assert main(["tune", "--trials", "4", "--json", "--out", "run"]) == 130
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "go on with: ibvs-qp tune --trials 4" in err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--trials", "0"], "--trials"),
        (["--jobs", "0"], "--jobs"),
        (["--seed", "-2"], "--seed"),
        (["--preset", "nowhere.toml"], "nowhere.toml"),
        (["--law", "both"], "qp"),
        (["--storage", "sqlite:////nowhere/at/all.db", "--trials", "1"], "sqlite:////nowhere/at/all.db"),
        (["--storage", "mysterious://x", "--trials", "1"], "mysterious://x"),
    ],
)
def test_refusals_are_one_line(flown, capsys, words, named):
    assert named in refusal(["tune", "--json", "--out", "run", *words], capsys)


def test_a_storage_of_another_search_is_refused(flown, capsys):
    assert main(["tune", "--trials", "1", "--json", "--out", "run"]) == 0
    assert main(["tune", "--trials", "1", "--json", "--out", "run", "--flights", "2"]) == 2
    assert "another --out" in capsys.readouterr().err


def unseen(before: list[bool], after: list[bool]) -> pl.DataFrame:
    """Flights of both presets; one that does not complete has no figures."""
    rows = [
        {"variant": name, "param.scene": "job", "param.task": PAINT, "seed": seed, "completed": done}
        | {each.name: 1.0 if done else None for each in OBJECTIVES}
        for name, flights in (("shipped", before), ("tuned", after))
        for seed, done in enumerate(flights)
    ]
    return pl.DataFrame(rows, schema_overrides={each.name: pl.Float64 for each in OBJECTIVES})


def test_what_completes_less_often_or_has_no_figure_is_not_recommended():
    assert objection(unseen([True, True, False], [True, True, False])) == ""
    assert "completes 1 of 3 unseen flights, the preset of the start 2" in objection(
        unseen([True, True, False], [True, False, False])
    )
    nothing = unseen([False, False], [False, False])
    assert "no figure for force_rms_n" in objection(nothing)
    assert {each["verdict"] for each in differences(nothing)} == {"none"}
    lost = Finalist(Score((0.5,) * len(OBJECTIVES), 0.5), {"job": Score((0.1,) * len(OBJECTIVES), 1.0)}, 0.3)
    start = Finalist(Score((1.0,) * len(OBJECTIVES), 0.5), {"job": Score((1.0,) * len(OBJECTIVES), 1.0)}, 0.3)
    assert not lost.may_replace(start)
