"""Computations of notebooks 05 and 06, beside the test cells of the notebooks."""

import dataclasses
import itertools
from typing import Any

import numpy as np
import polars as pl
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from sim.evaluate.figures import MORE
from sim.notebook.internals import record_program
from sim.notebook.noise import (
    FIGURES,
    FORCE,
    VS,
    averaged_samples,
    differences_table,
    effects,
    read_sweep,
    success,
    success_table,
    sweep_or_sample,
)
from sim.notebook.noise_sample import SEEDS, sample_runs
from sim.notebook.solver_figures import draw_race
from sim.notebook.solvers import (
    Contender,
    Result,
    exact_solutions,
    optimality_residual,
    osqp_workspace,
    race,
    race_table,
    transition,
)


def made_table(vs_power: float, force_power: float, seeds: int = 4) -> pl.DataFrame:
    rng, rows = np.random.default_rng(3), []
    for vs in (0.02, 0.08, 0.12):
        for force in (1.0, 2.0, 3.0):
            for law in ("qp", "paper"):
                for seed in range(seeds):
                    value = 0.05 * vs**vs_power * force**force_power * float(np.exp(rng.normal(0.0, 0.02)))
                    settings = {"experiment": "noise-sweep", "law": law, "variant": "standard", "seed": seed}
                    ended = {"completed": not (vs > 0.1 and seed == 0), "reason": "flown", VS: vs, FORCE: force}
                    figures = {"path_rms_m": value * (2.0 if law == "paper" else 1.0), "force_rms_n": 0.2 * force}
                    rows.append(settings | ended | figures)
    return pl.DataFrame(rows)


def test_effects_find_exponents_and_parts():
    found = effects(made_table(0.7, 0.0), "qp", FIGURES[0])
    assert found["vs"] == pytest.approx(0.7, abs=0.03) and found["force"] == pytest.approx(0.0, abs=0.03)
    assert found["vs_part"] > 0.98 and found["force_part"] < 0.05 and found["flights"] == 33


def test_averaged_samples_undo_the_root_of_n():
    _, samples = averaged_samples(made_table(1.0, 0.0), "qp")
    assert samples == {1.0: pytest.approx(25.0), 2.0: pytest.approx(25.0), 3.0: pytest.approx(25.0)}


def test_pairs_and_completion_are_reported():
    table = made_table(1.0, 0.0)
    assert success(table).filter((pl.col("law") == "qp") & (pl.col(VS) == 0.12))["completed"].to_list() == [0.75] * 3
    assert "3 of 4" in success_table(table) and "QP better" not in differences_table(table, FIGURES[0])


def test_a_difference_is_significant_from_six_pairs_on():
    words = differences_table(made_table(1.0, 0.0, seeds=6), FIGURES[0])
    # where a flight failed, five pairs are left
    assert words.count("QP better") == 6 and words.count("significant from 6 pairs on") == 3
    shares = dataclasses.replace(FIGURES[0], better=MORE)
    assert differences_table(made_table(1.0, 0.0, seeds=6), shares).count("analytic law better") == 6


def test_a_wrong_file_is_named_and_the_sample_stands_in(tmp_path):
    other = tmp_path / "other.parquet"
    pl.DataFrame({"a": [1]}).write_parquet(other)
    for file, words in (
        (str(tmp_path / "none.parquet"), "no table in"),
        (str(other), "no table of flights"),
        (__file__, "cannot read"),
    ):
        with pytest.raises(ConfigError, match=words):
            read_sweep(file)
    table, problem = sweep_or_sample(str(other))
    assert "no table of flights" in problem and table.height == len(sample_runs(SEEDS))


@pytest.fixture(scope="module")
def programs():
    """Programs of a vehicle in front of a wall at random states, some beyond its thrust.

    Every one is the first of a flight: from one random state to the next, the rate of the thrusts limits nearly all.
    """
    from controller_scenes import random_tick

    controller, rng, found = HybridController(), np.random.default_rng(1), []
    for tick in range(60):
        controller.reset()
        controller.step(*random_tick(rng, 2, tick))
        found.append(record_program(controller))
    return found


def test_the_reference_meets_the_optimality_conditions_and_others_do_not(programs):
    exact, residuals = exact_solutions(programs)
    assert residuals.max() < 1e-9 and 0 < sum(program.limited for program in programs) < len(programs)
    assert optimality_residual(programs[0], exact[0] + 1e-3, np.zeros(len(programs[0].lower))) > 1e-7


def test_free_thrusts_are_the_solution_where_no_limit_is_violated(programs):
    exact, _ = exact_solutions(programs)
    for program, x in zip(programs, exact, strict=True):
        difference = float(np.abs(x[: len(program.free)] - program.free).max())
        assert program.limited or difference < 1e-6


def test_a_race_measures_errors_of_every_tick(programs):
    exact, _ = exact_solutions(programs)
    settings = {"max_iter": 20_000, "check_termination": 5, "adaptive_rho_interval": 25}
    tight, loose = (
        race(osqp_workspace(str(each), settings | {"eps_abs": each, "eps_rel": each}), programs, exact)
        for each in (1e-9, 1e-1)
    )
    assert tight.errors_n.max() < 1e-3 < loose.errors_n.max() and not np.isnan(tight.errors_n).any()
    assert len(tight.times_us) == len(programs) and (tight.iterations > 0).all()
    assert race_table([tight, loose], reference="1e-09").count("\n") == 3


def test_a_transition_is_half_limited(programs):
    limited = np.array([program.limited for program in programs])
    part = limited[transition(programs, 10)]
    assert len(part) == 10 and abs(part.mean() - 0.5) <= abs(limited.mean() - 0.5) + 1e-9
    with pytest.raises(ValueError, match="61 ticks requested, 60 recorded"):
        transition(programs, 61)


#: Time of a tick [us], its 99 %, and thrust error [N] of the contenders of notebook 05 on one computer.
RACE = {
    "DAQP, workspace": (11.5, 12.0, 1.4e-11),
    "OSQP 1e-3": (20.2, 22.1, 2.2),
    "OSQP 1e-4": (21.6, 26.6, 1.5),
    "OSQP 1e-5": (23.5, 33.3, 1.9e-2),
    "OSQP defaults": (24.6, 25.5, 1.6e-2),
    "OSQP 1e-6": (26.3, 60.5, 1.9e-3),
    "shipped": (28.0, 48.4, 1.0e-14),
    "OSQP 1e-8": (30.0, 74.5, 1.9e-5),
    "OSQP, shipped settings": (74.2, 98.0, 5.0e-6),
    "DAQP in CasADi": (168.0, 176.0, 1.2e-11),
    "qpsolvers daqp": (293.0, 318.0, 1.3e-11),
    "qpsolvers proxqp": (326.0, 373.0, 2.8e-6),
    "qpsolvers piqp": (387.0, 425.0, 9.2e-4),
    "qpsolvers clarabel": (473.0, 507.0, 6.8e-3),
    "qpsolvers osqp": (712.0, 782.0, 4.9e-2),
    "qpsolvers quadprog": (290.0, 302.0, 1.2e-11),
}


def test_names_in_the_race_of_solvers_cover_neither_each_other_nor_a_dot() -> None:
    def never(_: object) -> Any:
        pytest.fail("no contender runs here")

    families = {"DAQP": "active set", "OSQP": "OSQP, workspace", "qpso": "qpsolvers", "ship": "shipped"}
    results = [
        Result(
            contender=Contender(name=name, family=families[name[:4]], make=never),
            times_us=np.r_[np.full(99, middle), np.full(2, late)],
            errors_n=np.full(101, error),
            iterations=np.zeros(101),
        )
        for name, (middle, late, error) in RACE.items()
    ]
    figure = draw_race(results)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    boxes = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_text() in RACE}
    assert boxes.keys() == RACE.keys()
    for first, second in itertools.combinations(boxes, 2):
        assert not boxes[first].padded(4.0, 0.0).overlaps(boxes[second]), (first, second)
    for name, (middle, _, error) in RACE.items():
        place = axes.transData.transform((middle, error))
        assert not any(box.contains(*place) for box in boxes.values()), name
