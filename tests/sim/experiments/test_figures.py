"""Figures of the experiments from made-up rows: failed flights, missing traces, bounds and the map's verdict."""

from __future__ import annotations

import polars as pl
import pytest
from matplotlib.figure import Figure
from synthetic_trace import synthetic_trace

from sim.experiments import figures as drawing
from sim.experiments.design import Choice, designs
from sim.experiments.figures import CRASH, Results, draw, plot_medians
from sim.experiments.spec import experiment
from sim.sweep.parts import PARAM


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
