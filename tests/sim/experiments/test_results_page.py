"""What the results page says of laws, allocators and variants, from made-up rows whose answers are known."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from sim.experiments import NAMES
from sim.experiments.comparison import allocators, comparisons
from sim.experiments.impedance_section import impedance_section
from sim.experiments.page import results_page
from sim.experiments.parts_section import parts_section
from sim.experiments.relevance import Effect, effect, threshold
from sim.experiments.spec import Column, experiment
from sim.experiments.tables import Section, tables_page
from sim.experiments.variants import VARIANTS
from sim.experiments.verdict_section import verdict_section
from sim.experiments.wording import cell, rounded
from sim.sweep.parts import PARAM, frame

ROOT = Path(__file__).parents[3]
#: Longest results page [lines].
MOST_LINES = 250
TILT = "tilt_rms_deg"


def rows(name: str, law: str, variant: str, errors: Sequence[float | None], metric: str = TILT, **more) -> list[dict]:
    facts = {"experiment": name, "law": law, "variant": variant, "reason": "crash: flip"}
    return [
        facts | {"seed": seed, "completed": error is not None, metric: error} | more
        for seed, error in enumerate(errors)
    ]


@pytest.mark.parametrize(
    ("median", "low", "high", "pairs", "found"),
    [
        (1.0, 0.5, 1.5, 6, Effect.FIRST),
        (-1.0, -1.5, -0.5, 6, Effect.SECOND),
        (1.0, 0.5, 1.5, 5, Effect.FEW),
        (0.08, 0.01, 0.3, 30, Effect.IRRELEVANT),  # certain, and below 0.1 deg
        (0.0, -0.05, 0.05, 30, Effect.IRRELEVANT),
        (0.3, -0.01, 0.6, 30, Effect.OPEN),
    ],
)
def test_a_difference_is_certain_and_large_or_it_is_no_verdict(median, low, high, pairs, found):
    difference = {"median": median, "sure_low": low, "sure_high": high, "pairs": pairs}
    assert effect(difference, Column(metric=TILT, label="tilt")) is found
    contrary = {Effect.FIRST: Effect.SECOND, Effect.SECOND: Effect.FIRST}.get(found, found)
    assert effect(difference, Column(metric=TILT, label="tilt", better=1)) is contrary


def test_thresholds_follow_the_unit_of_the_page():
    path = Column(metric="path_rms_m")
    small = {"median": 4e-4, "sure_low": 3e-4, "sure_high": 6e-4, "pairs": 9}
    assert effect(small, path) is Effect.IRRELEVANT
    assert effect({name: 2.0 * value for name, value in small.items()}, path) is Effect.FIRST


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_of_merit_has_a_threshold(name):
    assert all(threshold(column) > 0.0 for column in experiment(name).columns if column.better)


def test_allocators_are_variants_that_differ_in_nothing_else():
    assert allocators("standard") == {"clip": "standard", "sequential": "sequential", "box": "box"}
    assert set(allocators("no-ramp")) == {"clip"}


def test_the_best_allocator_decides_and_too_few_pairs_do_not():
    flights = rows("worlds", "qp", "standard", [1.0] * 6)
    flights += rows("worlds", "paper", "standard", [2.0] * 6) + rows("worlds", "paper", "box", [1.01] * 6)
    found = {each.allocator: each for each in comparisons(experiment("worlds"), frame(flights))}
    assert (found["clip"].effect, found["clip"].best) == (Effect.FIRST, False)
    assert (found["box"].effect, found["box"].best) == (Effect.IRRELEVANT, True)
    text = verdict_section([(experiment("worlds"), frame(flights))])
    assert "| worlds | – | 0 | 0 | 1 | 0 | 0 | clip 1 : 0, box 0 : 0 |" in text
    flights = rows("worlds", "qp", "standard", [1.0] * 6)
    flights += rows("worlds", "paper", "standard", [2.0] * 6) + rows("worlds", "paper", "box", [0.5] * 5 + [None])
    assert next(each for each in comparisons(experiment("worlds"), frame(flights)) if each.best).allocator == "clip"
    few = [row for row in flights if row["seed"] < 5]
    assert "| worlds | – | 0 | 0 | 0 | 0 | 1 |" in verdict_section([(experiment("worlds"), frame(few))])


@pytest.mark.parametrize(
    ("qp", "analytic", "words"),
    [
        ([1.0] * 6, [None] * 6, "| QP better: 6 against 0 pairs"),
        ([None] * 7 + [1.0], [1.0] * 7 + [None], "| undecided: 1 against 7 pairs"),
        ([None] * 8, [1.0] * 8, "| analytic better: 0 against 8 pairs"),
        ([1.0] * 5, [None] * 5, "| too few pairs |"),
    ],
)
def test_failed_flights_are_compared_by_the_sign_test(qp, analytic, words):
    flights = rows("paint", "qp", "standard", qp) + rows("paint", "paper", "standard", analytic)
    assert words in verdict_section([(experiment("paint"), frame(flights))])


def test_a_part_helps_hurts_or_does_not_matter():
    base = [0.12, 0.13, 0.11, 0.12, 0.12, 0.12]
    flights = rows("paint", "qp", "standard", base) + rows("paint", "qp", "no-barriers", [e + 1e-4 for e in base])
    flights += rows("paint", "qp", "no-ramp", [e + 1.0 for e in base])
    text = parts_section([(experiment("paint"), frame(flights))])
    assert "| paint | – | QP law | 6 and 6 of 6 | 1 | 0 | 0 | 0 | 0 | tilt, rms +1.00" in text
    assert "| paint | – | QP law | 6 and 6 of 6 | 0 | 0 | 1 | 0 | 0 | – |" in text


@pytest.mark.parametrize(
    ("direct_n", "oscillates_n", "said", "mechanism"),
    [(0.03, 2.0, "direct force control is steadier", True), (0.03, 0.01, "direct force control is steadier", False),
     (0.3, 2.0, "impedance is steadier", False), (0.1, 2.0, "No difference that matters", False)],
)  # fmt: skip
def test_the_mechanism_is_printed_only_if_the_data_show_it(direct_n, oscillates_n, said, mechanism):
    flights = []
    for variant, steady, far in (("standard", 0.1, 0.01), ("direct", direct_n, oscillates_n)):
        hold = {"param.kind": "hold", "param.stiffness_n_m": 1500.0, "param.force_gain": 1.0, "param.delay_s": 0.004}
        flights += rows("force-hold", "qp", variant, [steady] * 6, "force_rms_n", **hold)
        for gain, deviation in ((1.0, 0.01), (5.0, far)):
            place = hold | {"param.kind": "map", "param.force_gain": gain, "contact_share": 1.0}
            flights += rows("force-hold", "qp", variant, [deviation], "force_std_n", **place)
    text = impedance_section(experiment("force-hold"), frame(flights))
    assert said in text and ("Mechanism:" in text) is mechanism


def test_cells_are_words_and_maps_are_folded():
    derate = {"kind": "derate", "rotor": "mid_right", "share": 0.5, "told": False}
    assert cell(experiment("rotor-derate"), derate) == (
        "derate, rotor mid right, remaining thrust 0.5, not reported to the pilot"
    )
    assert cell(experiment("force-hold"), {"stiffness_n_m": 1500.0}) == "wall 1500 N/m"
    assert (rounded(-0.001, 2), rounded(0.001, 2, plus=True), rounded(1.0, 1, plus=True)) == ("0.00", "0.00", "+1.0")
    flights = [
        row
        for kind in ("hold", "map")
        for row in rows("force-hold", "qp", "standard", [1.0], "settle_s", **{"param.kind": kind})
    ]
    flown = [Section(experiment=experiment("force-hold"), table=frame(flights), figures={})]
    page = tables_page(flown, "Made up.", "ibvs-qp experiment {name}", "force-hold")
    assert (
        "| map |" in page.split("<details>")[1].split("</details>")[0] and "| map |" not in page.split("<details>")[0]
    )


def made_up(name: str) -> pl.DataFrame:
    """The record of an experiment with random figures: each law wins, loses and crashes somewhere."""
    spec, random, flights = experiment(name), np.random.default_rng(0), []
    for group in spec.flights:
        for values in itertools.product(*group.levels.values()):
            level = dict(zip(group.levels, values, strict=True))
            variant, params = str(level.get("variant", "standard")), {PARAM + each: level[each] for each in spec.params}
            for law in group.laws or VARIANTS[variant].laws:
                shift = random.normal(size=len(spec.columns))
                for seed in range(min(group.seeds, 6)):
                    figures = np.exp(3.0 * shift + 0.1 * random.normal(size=len(shift)))
                    flights += [
                        {"experiment": name, "law": law, "variant": variant, "seed": seed, "reason": "crash",
                         "completed": bool(random.random() < 0.99)}
                        | params | {"contact_share": 1.0, "force_std_n": 1.0}
                        | {column.metric: value for column, value in zip(spec.columns, figures, strict=True)}
                    ]  # fmt: skip
    return frame(flights)


def test_laws_in_place_of_the_qp_are_compared_with_it_and_without_an_analytic_law_there_is_no_verdict():
    facts = {"param.kind": "paint", "param.world": "datasheet"}
    base = [3e-3 + 1e-5 * seed for seed in range(6)]
    flights = [
        row
        for variant, gain in (("standard", 0.0), ("lexicographic", 1e-5), ("mpc", 2e-3))
        for row in rows("rivals", "qp", variant, [e - gain for e in base], "path_rms_straight_m", **facts)
    ]
    sections = [Section(experiment=experiment("rivals"), table=frame(flights), figures={})]
    page = results_page(sections, "Made up.", "ibvs-qp experiment {name}", "rivals")
    assert "## Verdict" not in page and "analytic" not in page
    assert "of 1 comparisons it is better in 0, the QP in 0; 1 do not matter" in page
    assert "of 1 comparisons it is better in 1, the QP in 0; 0 do not matter" in page
    assert "| *mpc* | path error, straights, rms | paint, world datasheet | -2.00" in page
    assert page.index("Cost of weights") < page.index("## Bounds")


@pytest.mark.slow
def test_the_page_of_a_whole_record_is_short():
    sections = [Section(experiment=experiment(name), table=made_up(name), figures={}) for name in NAMES]
    page = results_page(sections, "Made up.", "ibvs-qp experiment {name}", "all")
    assert page.index("## Verdict") < page.index("## Bounds")
    assert "more rows are in [tables.md]" in page
    assert page.count("\n") <= MOST_LINES


def test_the_shipped_page_is_short_and_its_figures_are_all_there_are():
    folder = ROOT / "docs" / "experiments"
    pages = [(folder / name).read_text(encoding="utf-8") for name in ("results.md", "tables.md")]
    assert pages[0].count("\n") <= MOST_LINES
    for figure in (folder / "figures").iterdir():
        assert any(f"(figures/{figure.name})" in page for page in pages), figure.name
