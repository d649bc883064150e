"""``ibvs-qp experiment`` and ``compare`` with made-up flights: contract, files, resume, interrupt, refusals."""

from __future__ import annotations

import json
from itertools import accumulate

import numpy as np
import polars as pl
import pytest
from contract_schema import refusal
from press_trace import press_trace
from synthetic_trace import Errors, synthetic_trace

import ibvs_qp
import sim.sweep.flying
from ibvs_qp.config.contact_margin import contact_mode_damping
from ibvs_qp.pilot.presets import FOLDER
from sim.commands.cli import main
from sim.experiments.design import Choice, designs
from sim.experiments.variants import VARIANTS, with_force_gain
from sim.flight.jobs import PressJob
from sim.sweep import run_sweep
from sim.world.scene import ForceTorqueScene, WallScene


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are made up and counted; runs go to a temporary directory."""
    flights: list[str] = []

    def fly(scene, options, *, config, job, faults):
        flights.append(options.law)
        if isinstance(job, PressJob):
            trace = press_trace(scene=scene, bias_n=0.05 if options.law == "qp" else 0.2)
            trace.law = options.law
            trace.arrays["friction_true"] = np.zeros((len(trace.t), 2))
            return trace
        return synthetic_trace(Errors(push_error_n=0.1), scene, options.law, options.seed)

    def outcome(trace):
        return {"completed": trace.claimed, "claimed": trace.claimed, "reason": trace.reason}

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.setattr(sim.sweep.flying, "outcome", outcome)  # made-up presses do not retreat
    monkeypatch.chdir(tmp_path)
    return flights


def test_json_follows_the_contract(flown, tmp_path, capsys):
    assert main(["experiment", "force-hold", "--quick", "--jobs", "1", "--json", "--out", "run"]) == 0
    out, err = capsys.readouterr()
    assert err == "" and out.count("\n") == 1
    content = json.loads(out)
    assert (content["schema"], content["name"], content["quick"]) == (1, "force-hold", True)
    table = pl.read_parquet(content["data_file"])
    assert table.height == len(flown) == sum(cell["n"] for cell in content["cells"])
    for cell in content["cells"]:
        assert {"law", "variant", "params", "n", "completed", "metrics"} <= set(cell)
        assert cell["law"] in ("qp", "paper") and cell["completed"] == cell["n"]
        assert {"median", "low", "high"} == set(cell["metrics"]["settle_s"])
    assert json.loads((tmp_path / "run" / "force-hold.json").read_text()) == content
    assert (tmp_path / "run" / "figures" / "force-hold-force.png").stat().st_size > 10_000
    page = (tmp_path / "run" / "results.md").read_text()
    assert "0.050" in page and "figures/force-hold-force.png" in page
    assert "| better |" not in page and "| worse |" not in page  # one pair decides nothing


def test_the_same_folder_flies_nothing_twice(flown, capsys):
    main(["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"])
    count = len(flown)
    main(["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"])
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert len(flown) == count > 0
    assert first["cells"] == second["cells"]


def test_interrupt_keeps_what_was_flown_and_says_how_to_go_on(flown, monkeypatch, capsys):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flown) == 2:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    assert main(["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"]) == 130
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert content["interrupted"] and sum(cell["n"] for cell in content["cells"]) == 2
    assert err.count("\n") == 1 and "go on with: ibvs-qp experiment approach" in err
    monkeypatch.setattr(sim.sweep.flying, "fly", whole)
    assert main(["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"]) == 0
    assert len(flown) == 4


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["experiment", "nope"], "force-hold"),
        (["experiment", "paint", "--jobs", "0"], "--jobs"),
        (["experiment", "paint", "--seed", "-1"], "--seed"),
        (["compare", "nowhere", "nowhere"], "nowhere"),
    ],
)
def test_refusals_are_one_line(flown, capsys, words, named):
    assert named in refusal(words, capsys)
    assert not flown


def same(one, other):
    """Whether two summaries have the same cells; traces hold signals in single precision."""
    for a, b in zip(one["cells"], other["cells"], strict=True):
        assert (a["law"], a["params"], a["n"], a["completed"]) == (b["law"], b["params"], b["n"], b["completed"])
        for name, figure in a["metrics"].items():
            assert b["metrics"][name] == pytest.approx(figure, rel=1e-5, abs=1e-6), name
    return True


@pytest.mark.slow
def test_figures_are_computed_again_from_the_traces(flown, monkeypatch, tmp_path, capsys):
    words = ["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"]
    main([*words, "--traces"])
    count, content = len(flown), json.loads(capsys.readouterr().out)
    main([*words, "--again"])
    assert len(flown) == count > 1 and same(content, json.loads(capsys.readouterr().out))
    next((tmp_path / "run" / "parts" / "logs").glob("*.trace.npz")).unlink()
    for part in (tmp_path / "run" / "parts").glob("*.parquet"):  # of another version of the code
        part.unlink()
    main([*words, "--again"])
    assert len(flown) == count + 1 and same(content, json.loads(capsys.readouterr().out))
    next((tmp_path / "run" / "parts" / "logs").glob("*.trace.npz")).write_bytes(b"damaged")
    assert main([*words, "--again"]) == 2
    assert "remove it, and the flight is flown again" in capsys.readouterr().err


def test_traces_of_another_configuration_are_flown_anew(flown, monkeypatch):
    words = ["experiment", "approach", "--quick", "--jobs", "1", "--json", "--out", "run"]
    main([*words, "--traces"])
    count = len(flown)
    main([*words, "--again", "--world", "harsh"])
    assert len(flown) == 2 * count > 0


def test_all_cut_short_still_reports_what_was_flown(flown, monkeypatch, capsys):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flown) == 2:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    assert main(["experiment", "all", "--quick", "--jobs", "1", "--json", "--out", "run"]) == 130
    content = json.loads(capsys.readouterr().out)
    assert sum(cell["n"] for cell in content["cells"]) == 2
    assert {entry["experiment"] for entry in content["verdicts"]} == {"force-hold"}


def test_the_time_left_goes_by_expected_flying_time(flown, tmp_path):
    quick = Choice(quick=True)
    flights = designs("friction", quick) + designs("force-hold", quick)[:1]
    finished: list[float] = []
    run_sweep(flights, tmp_path, progress=lambda *counts: finished.append(counts[3]))
    expected = [0.0, *accumulate(run.expected_s for run in flights)]
    assert finished == pytest.approx([passed / expected[-1] for passed in expected])
    assert len({run.expected_s for run in flights}) > 1


def test_the_page_says_how_to_redo_it_with_the_same_choices(flown, tmp_path):
    words = ["experiment", "approach", "--quick", "--seed", "3", "--features", "geometric"]
    (tmp_path / "run" / "figures").mkdir(parents=True)
    (tmp_path / "run" / "figures" / "of-an-earlier-page.png").touch()
    assert main([*words, "--jobs", "1", "--json", "--out", "run"]) == 0
    assert {file.name for file in (tmp_path / "run" / "figures").iterdir()} == {"approach.png"}
    page = (tmp_path / "run" / "results.md").read_text()
    assert "Command: `ibvs-qp experiment approach --quick --features geometric --seed 3`" in page
    assert "too few for such an interval" in page and "-0.00" not in page and "_n_m" not in page


@pytest.mark.parametrize("size", [["--quick"], pytest.param([], marks=pytest.mark.slow)])
def test_plan_flies_nothing(flown, tmp_path, capsys, size):
    assert main(["experiment", "all", "--plan", *size]) == 0
    assert "all: " in capsys.readouterr().out
    assert not flown and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_compare_pairs_two_folders(flown, capsys):
    for seed, folder in (("0", "a"), ("0", "b")):
        main(["experiment", "approach", "--quick", "--jobs", "1", "--json", "--seed", seed, "--out", folder])
    capsys.readouterr()
    assert main(["compare", "a", "b", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["cells"] and all(cell["differences"]["settle_s"]["median"] == 0.0 for cell in content["cells"])
    assert main(["compare", "a", "b"]) == 0


def predicted_damping(law: str, variant: str, gain: float, stiffness: float, delay_s: float) -> float:
    """Least damping ratio of the contact that the linear loop predicts."""
    config = with_force_gain(VARIANTS[variant].apply(ibvs_qp.preset(law)), gain).controller
    age = delay_s + 0.5 / ForceTorqueScene().rate_hz
    return contact_mode_damping(config, stiffness, WallScene().damping_n_s_m, age).least_damping_ratio


def test_gain_and_delay_take_damping_and_impedance_gives_it():
    assert predicted_damping("qp", "direct", 3.0, 1500.0, 0.024) < 0.0
    assert predicted_damping("qp", "standard", 1.0, 1500.0, 0.024) > predicted_damping(
        "qp", "direct", 1.0, 1500.0, 0.024
    )
    assert predicted_damping("qp", "standard", 2.0, 1500.0, 0.048) < predicted_damping(
        "qp", "standard", 2.0, 1500.0, 0.004
    )


PAIR = [str(FOLDER / "tarot_t960_qp.toml"), str(FOLDER / "tarot_t960_paper.toml")]
SHORT = ["--quick", "--features", "geometric", "--seeds", "1", "--jobs", "1", "--json"]


@pytest.fixture
def flights(monkeypatch, tmp_path):
    """Flights are synthetic and counted."""
    flights: list[str] = []

    def fly(scene, options, *, config, job, faults):
        flights.append(options.law)
        return synthetic_trace(Errors(push_error_n=0.1), scene, options.law, options.seed)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    monkeypatch.chdir(tmp_path)
    return flights


@pytest.mark.slow
def test_two_presets_fly_the_same_short_job(tmp_path, capsys):
    assert main(["compare", *PAIR, *SHORT, "--out", str(tmp_path / "run")]) == 0
    content = json.loads(capsys.readouterr().out)
    (cell,) = content["cells"]
    assert (cell["law"], cell["n"], cell["completed"]) == ("own", 1, [1, 1])
    path = cell["differences"]["path_rms_m"]
    assert 0.0 < path["a"] < 0.01 and 0.0 < path["b"] < 0.01 and path["a"] != path["b"]
    assert content["run_dir"] == str(tmp_path / "run") and not content["interrupted"]


def test_presets_fly_the_law_that_they_name(flights, capsys):
    assert main(["compare", *PAIR, *SHORT]) == 0
    assert flights == ["qp", "paper"]
    assert json.loads(capsys.readouterr().out)["cells"][0]["n"] == 1


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([*PAIR, "--seeds", "0"], "--seeds"),
        ([*PAIR, "--jobs", "0"], "--jobs"),
        ([PAIR[0], "."], "is a file and . a folder"),
        ([PAIR[0], "nowhere.toml"], "nowhere.toml does not exist"),
    ],
)
def test_refusals_are_one_line_and_fly_nothing(flights, capsys, words, named):
    assert named in refusal(["compare", *words], capsys)
    assert not flights


@pytest.mark.parametrize("done", [0, 1])
def test_interrupt_names_the_folder_and_goes_on(flights, monkeypatch, capsys, done):
    whole = sim.sweep.flying.fly

    def fly(*arguments, **named):
        if len(flights) == done:
            raise KeyboardInterrupt
        return whole(*arguments, **named)

    monkeypatch.setattr(sim.sweep.flying, "fly", fly)
    assert main(["compare", *PAIR, *SHORT, "--out", "run"]) == 130
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert content["interrupted"] and content["cells"] == []
    assert "finished flights are in" in err and "go on with: ibvs-qp compare" in err and "--out run" in err
    monkeypatch.setattr(sim.sweep.flying, "fly", whole)
    assert main(["compare", *PAIR, *SHORT, "--out", "run"]) == 0
    assert len(flights) == 2
