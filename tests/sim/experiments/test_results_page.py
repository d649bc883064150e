"""What the results page says of variants and of clipping, from made-up rows whose answers are known."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from sim.experiments.balance import balance
from sim.experiments.clipping import clipping
from sim.experiments.page import Section, results_page
from sim.experiments.spec import experiment
from sim.experiments.wording import cell, rounded
from sim.experiments.worth import worth
from sim.sweep.parts import frame


def rows(name: str, law: str, variant: str, errors: Sequence[float | None], **more) -> list[dict]:
    metric = {"saturation": "force_error_rms_n", "paint": "tilt_rms_deg", "force-hold": "settle_s"}[name]
    facts = {"experiment": name, "law": law, "variant": variant, "reason": "crash: flip"}
    return [
        facts | {"seed": seed, "completed": error is not None, metric: error} | more
        for seed, error in enumerate(errors)
    ]


def press(push: float, limits: list, clipped: list, analytic: list) -> list[dict]:
    cell = {"param.kind": "static", "param.push_n": push, "param.friction": 0.3}
    return [
        *rows("saturation", "qp", "no-reach-check", limits, **cell),
        *rows("saturation", "qp", "clipped", clipped, **cell),
        *rows("saturation", "paper", "no-reach-check", analytic, **cell),
    ]


def test_who_clips_better_follows_the_rows():
    none = [None, None]
    table = frame(
        press(25.0, [4.0, 4.0], [0.1, 0.1], [0.4, 0.4])
        + press(27.5, [0.1, 0.1], [0.11, 0.1], [0.4, 0.4])
        + press(30.0, [9.0, 9.0], none, none)
        + press(35.0, none, none, none)
    )
    said = [line for line in clipping(table).splitlines() if line.startswith("- ")]
    assert said[0] == "- 25 N: clipping wins (the QP's thrusts clipped afterwards)."
    assert said[1].startswith(
        "- 27.5 N: no difference (the QP with its limits and the QP's thrusts clipped afterwards)"
    )
    assert said[2].startswith("- 30 N: the QP with its limits wins; all flights of")
    assert said[3] == "- 35 N: no flight ends as planned."
    assert clipping(table.filter(pl.col("variant") != "clipped")) == ""


def test_a_variant_that_changes_nothing_is_said_to_do_nothing():
    base = [0.12, 0.13, 0.11, 0.12]
    flights = rows("paint", "qp", "standard", base) + rows("paint", "qp", "no-barriers", [e + 1e-4 for e in base])
    flights += rows("paint", "qp", "no-ramp", [e + 1.0 for e in base])
    text = worth([(experiment("paint"), frame(flights))])
    assert "*no-barriers*, QP law: no effect here; over 4 pairs" in text and "*no-ramp*, QP law" not in text


def test_few_pairs_are_too_few_and_chance_is_named():
    flights = rows("paint", "qp", "standard", [1.0] * 5) + rows("paint", "paper", "standard", [2.0] * 5)
    assert "| paint | 5 of 5 | 5 of 5 | 0 | 0 | 0 | 0 | 1 |" in balance([(experiment("paint"), frame(flights))])
    flights = rows("paint", "qp", "standard", [1.0] * 20) + rows("paint", "paper", "standard", [2.0] * 20)
    text = balance([(experiment("paint"), frame(flights))])
    assert "| paint | 20 of 20 | 20 of 20 | 1 | 1 | 0 | 0 | 0 |" in text and "Comparisons with enough pairs: 1;" in text


def test_cells_are_words_and_maps_are_folded():
    derate = {"kind": "derate", "rotor": "mid_right", "share": 0.5, "told": False}
    assert cell(experiment("rotor-derate"), derate) == (
        "derate, rotor mid right, remaining thrust 0.5, not reported to the pilot"
    )
    assert cell(experiment("force-hold"), {"stiffness_n_m": 1500.0}) == "wall 1500 N/m"
    assert (rounded(-0.001, 2), rounded(0.001, 2, plus=True), rounded(1.0, 1, plus=True)) == ("0.00", "0.00", "+1.0")
    flights = [
        row for kind in ("hold", "map") for row in rows("force-hold", "qp", "standard", [1.0], **{"param.kind": kind})
    ]
    flown = [Section(experiment=experiment("force-hold"), table=frame(flights), figures={})]
    page = results_page(flown, "Made up.", "ibvs-qp experiment {name}", "force-hold")
    assert (
        "| map |" in page.split("<details>")[1].split("</details>")[0] and "| map |" not in page.split("<details>")[0]
    )
