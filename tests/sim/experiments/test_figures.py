"""Figures of the experiments from made-up rows: failed flights, missing traces, bounds and the map's verdict."""

from __future__ import annotations

import itertools

import polars as pl
import pytest
from matplotlib.figure import Figure
from press_trace import press_trace

from sim.experiments.design import Choice, designs
from sim.experiments.figures import Results, draw, force_hold
from sim.experiments.figures.common import CRASH
from sim.experiments.figures.force_map import map_caption, map_cells
from sim.experiments.figures.medians import plot_medians
from sim.experiments.spec import experiment
from sim.sweep.parts import PARAM

GAINS, WALLS = (1.0, 5.0), (1500.0, 10000.0)


def table_of(name: str, **figures: float) -> pl.DataFrame:
    """One completed row per flight of an experiment's quick design."""
    rows = [
        {"experiment": name, "law": run.law, "variant": run.variant, "seed": run.seed, "completed": True, "log": None}
        | {PARAM + key: value for key, value in run.params.items()}
        | figures
        for run in designs(name, Choice(quick=True))
    ]
    return pl.DataFrame(rows, schema_overrides={"log": pl.String}, infer_schema_length=None)


def the_map(bad: float) -> pl.DataFrame:
    """A map in which direct control deviates by `bad` at five times the gain on the soft wall, all else by 0.1 N."""
    rows = []
    for law, variant, gain, wall in itertools.product(("qp", "paper"), ("standard", "direct"), GAINS, WALLS):
        worse = variant == "direct" and (gain, wall) == (5.0, 1500.0)
        rows.append(
            {"law": law, "variant": variant, "seed": 0, "completed": True, "contact_share": 1.0}
            | {"force_std_n": bad if worse else 0.1, PARAM + "kind": "map"}
            | {PARAM + "force_gain": gain, PARAM + "stiffness_n_m": wall, PARAM + "delay_s": 0.024}
        )
    return pl.DataFrame(rows)


def test_failed_flights_are_crosses_and_enter_no_median():
    rows = pl.DataFrame({"completed": [True, True, False, False], PARAM + "x": [1.0] * 4, "y": [1.0, 3.0, 60.0, None]})
    axes = Figure().subplots()
    plot_medians(axes, rows, "x", "y", "#0b6f9e", top=5.0)
    assert sum(line.get_gid() == CRASH for line in axes.lines) == 2
    (middle,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert list(middle.get_ydata()) == [2.0]  # type: ignore[arg-type]


def test_the_caption_counts_the_cells_of_the_map():
    shown, refuted = (map_caption(the_map(bad), pl.DataFrame()) for bad in (0.8, 0.2))
    assert shown.startswith("Direct force control oscillates") and "but not at the shipped gains" in shown
    assert "impedance 0 of 8 cells" in shown and "direct force control 2 of 8 cells" in shown
    assert "none below 5 times" in shown
    assert refuted.startswith("Direct force control does not oscillate") and "2 of 8 cells" not in refuted


def test_a_hold_that_crashed_has_lost_the_wall():
    table = the_map(0.1).with_columns(pl.col(PARAM + "force_gain").eq(1.0).alias("completed"))
    cells = map_cells(table)
    assert (cells["lost"] == (cells[PARAM + "force_gain"] == 5.0)).all()


@pytest.mark.parametrize("logged", ["standard", "direct"])
def test_a_variant_without_a_log_shows_no_reference(monkeypatch, tmp_path, logged):
    table = table_of("force-hold", force_std_n=0.1, contact_share=1.0)

    def trace(results, rows):
        if rows["variant"].first() != logged:
            return None
        made = press_trace()
        made.arrays["line_error_px"] = 0.0 * made.t[:, None].repeat(2, 1)
        return made

    monkeypatch.setattr(force_hold, "stored_trace", trace)
    figures = draw(Results(experiment("force-hold"), table, tmp_path))
    panels = figures["force-hold-1.5kNm"][1].axes[:2]
    empty, drawn = panels if logged == "direct" else panels[::-1]
    assert len(drawn.lines) == 3
    assert not empty.lines and empty.texts[0].get_text() == "not flown"


def test_derating_without_a_reach_still_draws(tmp_path):
    table = table_of("rotor-derate").with_columns(pl.lit(None, pl.Float64).alias("reach_n"))
    assert draw(Results(experiment("rotor-derate"), table, tmp_path))


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
