"""Results page and figures, from made-up rows whose answers are known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl
import pytest
from matplotlib.figure import Figure
from synthetic_trace import synthetic_trace

from sim.evaluate.figures import figure_of
from sim.experiments import FAIR, NAMES
from sim.experiments import figures as drawing
from sim.experiments.comparison import COMPLETED, GROUPS, Outcome, comparisons
from sim.experiments.design import Choice, designs
from sim.experiments.figures import CRASH, Results, draw, plot_medians
from sim.experiments.page import Fields, results_page
from sim.experiments.spec import experiment
from sim.experiments.verdict import cell, rounded
from sim.sweep.parts import PARAM, frame

TILT = "tilt_rms_deg"
#: 0.1 deg matter.
SPREAD = [0.0, 0.01, 0.02, 0.03, 0.04, 0.05]


def rows(name: str, law: str, variant: str, errors: Sequence[float | None], metric: str = TILT, **more) -> list[dict]:
    facts = {"experiment": name, "law": law, "variant": variant, "reason": "crash: flip"}
    return [
        facts | {"seed": seed, "completed": error is not None, metric: error} | more
        for seed, error in enumerate(errors)
    ]


def one(name: str, metric: str, *flights: list[dict]):
    """The only comparison of a figure."""
    found = comparisons(experiment(name), frame([row for part in flights for row in part]))
    (each,) = (each for each in found if each.metric == metric)
    return each


@pytest.mark.parametrize(
    ("gap", "count", "outcome"),
    [
        (1.0, 6, Outcome.WON),
        (-1.0, 6, Outcome.LOST),
        (1.0, 5, Outcome.FEW),
        (0.07, 6, Outcome.NEITHER),  # certain, and its interval reaches below 0.1 deg
        (0.0, 6, Outcome.NEITHER),
    ],
)
def test_a_difference_is_certain_and_large_or_it_is_no_verdict(gap, count, outcome):
    qp = rows("worlds", "qp", "standard", [1.0] * count)
    analytic = rows("worlds", "paper", "standard", [1.0 + gap + part for part in SPREAD[:count]])
    found = one("worlds", TILT, qp, analytic)
    assert (found.outcome, found.pairs, found.least) == (outcome, count, 0.1)
    assert found.worse == pytest.approx(-gap - 0.5 * (SPREAD[count // 2] + SPREAD[(count - 1) // 2]))


@pytest.mark.parametrize(
    ("qp", "analytic", "outcome"),
    [
        ([1.0] * 6, [None] * 6, Outcome.WON),
        ([None] * 7 + [1.0], [1.0] * 7 + [None], Outcome.NEITHER),
        ([None] * 8, [1.0] * 8, Outcome.LOST),
        ([1.0] * 5, [None] * 5, Outcome.FEW),
    ],
)
def test_failed_flights_are_compared_by_the_sign_test(qp, analytic, outcome):
    found = one("paint", COMPLETED, rows("paint", "qp", "standard", qp), rows("paint", "paper", "standard", analytic))
    assert found.outcome is outcome


def test_a_figure_of_which_more_is_better_is_worse_when_it_is_less():
    qp, analytic = (
        rows("paint", law, "standard", [share] * 6, "contact_share") for law, share in (("qp", 0.90), ("paper", 0.99))
    )
    found = one("paint", "contact_share", qp, analytic)
    assert found.worse == pytest.approx(9.0) and found.outcome is Outcome.LOST  # [%]


def test_an_opponent_meets_the_same_variant_of_the_qp_and_a_part_meets_the_whole():
    cases = [("qp", "standard", 1.0), ("qp", "no-reach-check", 2.0), ("paper", "standard", 3.0)]
    cases += [("paper", "no-reach-check", 5.0), ("paper", "no-reach-check-box", 6.0), ("paper", "shared-gains", 4.0)]
    table = frame([row for law, variant, error in cases for row in rows("worlds", law, variant, [error] * 6)])
    gaps = {each.opponent: -each.worse for each in comparisons(experiment("worlds"), table) if each.metric == TILT}
    assert gaps == {
        "QP law, no-reach-check": 1.0,
        "analytic law": 2.0,
        "analytic law, no-reach-check": 3.0,
        "analytic law, no-reach-check-box": 4.0,
        "analytic law, shared-gains": 3.0,
    }


@pytest.mark.parametrize("name", [*NAMES, FAIR])
def test_every_figure_of_merit_has_a_threshold_and_every_group_known_figures(name):
    assert all(figure_of(each.metric).least[0] > 0.0 for each in experiment(name).columns if each.better)
    assert all(figure_of(metric) for metrics in GROUPS.values() for metric in metrics)


def page(name: str, flights: list[dict], **figures: tuple[str, Path]) -> str:
    fields = Fields(experiment(name), frame(flights), figures)
    return results_page([fields], "Made up.", "ibvs-qp experiment {name} --quick")


def test_the_page_counts_wins_and_names_losses_failures_and_figures():
    flights = rows("worlds", "qp", "standard", [1.0] * 6)
    flights += rows("worlds", "paper", "standard", [2.0] * 6) + rows("worlds", "paper", "box", [0.5] * 6 + [None])
    text = page("worlds", flights, worlds=("Every world", Path("figures/worlds.png")))
    assert "| analytic law | 1 | 0 | 0 | 1 | 0 |" in text and "| analytic law, box | 0 | 1 | 0 | 1 | 0 |" in text
    assert "| worse | all | analytic law, box | tilt, rms, deg | 0.5 (0.5 to 0.5) | 0.1 | 6 |" in text
    assert "- analytic law, box, all, seeds 6: crash: flip" in text
    assert "![Every world](figures/worlds.png)" in text and "`ibvs-qp experiment worlds --quick`" in text
    assert "{{" not in text and "-0.00" not in text


def test_without_an_opponent_nothing_is_compared():
    text = page("worlds", rows("worlds", "qp", "standard", [1.0] * 6))
    assert "| opponent |" not in text and "| 6 of 6 |" in text


def test_cells_are_words_and_maps_are_left_to_their_figure():
    derate = {"kind": "derate", "rotor": "mid_right", "share": 0.5, "told": False}
    assert cell(experiment("rotor-derate"), derate) == (
        "derate, rotor mid right, remaining thrust 0.5, not reported to the pilot"
    )
    assert cell(experiment("force-hold"), {"stiffness_n_m": 1500.0}) == "wall 1500 N/m"
    assert (rounded(-0.001, 2), rounded(0.001, 2), rounded(float("nan"), 1)) == ("0.00", "0.00", "–")
    flights = [
        row
        for kind in ("hold", "map")
        for row in rows("force-hold", "qp", "standard", [1.0], "settle_s", **{"param.kind": kind})
    ]
    text = page("force-hold", flights)
    assert "| map |" not in text and "| hold |" in text and "1 more cells are in the figure" in text


def table_of(name: str, **figures: float) -> pl.DataFrame:
    """One completed row per flight of an experiment's quick design."""
    rows = [
        {"experiment": name, "law": run.law, "variant": run.variant, "seed": run.seed, "completed": True, "log": None}
        | {PARAM + key: value for key, value in run.params.items()}
        | figures
        for run in designs(name, Choice(quick=True))
    ]
    return pl.DataFrame(rows, schema_overrides={"log": pl.String}, infer_schema_length=None)


def test_failed_flights_are_crosses_and_enter_no_median():
    rows = pl.DataFrame({"completed": [True, True, False, False], PARAM + "x": [1.0] * 4, "y": [1.0, 3.0, 60.0, None]})
    axes = Figure().subplots()
    plot_medians(axes, rows, "x", "y", "#0b6f9e", top=5.0)
    assert sum(line.get_gid() == CRASH for line in axes.lines) == 2
    (middle,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert list(middle.get_ydata()) == [2.0]  # type: ignore[arg-type]


@pytest.mark.parametrize("logged", ["standard", "direct"])
def test_stored_flights_have_the_figures_of_a_run_folder(monkeypatch, tmp_path, logged):
    table = table_of("force-hold", force_std_n=0.1, contact_share=1.0)

    made = synthetic_trace()
    monkeypatch.setattr(drawing, "stored_trace", lambda _, rows: made if rows["variant"].first() == logged else None)
    figures = draw(Results(experiment("force-hold"), table, tmp_path))
    name = "force-hold" if logged == "standard" else "force-hold-direct"
    maps = {f"force-hold-{variant}-map-force_std_n" for variant in ("standard", "direct")}
    assert set(figures) == {f"{name}-force", f"{name}-image_error"} | maps


def test_boxes_are_over_the_parameters_that_vary(tmp_path):
    figures = draw(Results(experiment("noise-sweep"), table_of("noise-sweep", path_rms_m=1.0), tmp_path))
    assert [len(figure.axes) for _, figure in figures.values()] == [2] and "noise-sweep-path_rms_m" in figures


@pytest.mark.parametrize(
    ("name", "metric", "bounds"), [("approach", "touch_peak_n", 1), ("friction", "yaw_rms_deg", 1)]
)
def test_curves_draw_their_bound_and_every_variant(tmp_path, name, metric, bounds):
    table = table_of(name, **{metric: 1.0})
    axes = draw(Results(experiment(name), table, tmp_path))[name][1].axes[0]
    labels = axes.get_legend_handles_labels()[1]
    assert labels.count("bound") == bounds
    assert len([label for label in labels if label != "bound"]) == table.select("law", "variant").n_unique()


def test_bars_show_every_variant_that_a_law_flew(tmp_path):
    each = experiment("worlds")
    figures = {panel.metric: 1.0 for panel in each.figures[0].panels}
    axes = draw(Results(each, table_of("worlds", **figures), tmp_path))["worlds"][1].axes[0]
    assert len(axes.get_legend_handles_labels()[1]) == 4
