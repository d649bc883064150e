"""Computations of notebooks 04 to 06, beside the test cells of the notebooks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import polars as pl
import pytest

from allocation import WrenchFacets
from ibvs_qp.config import SolverSettings
from ibvs_qp.controller import HybridController
from sim.bench.qp import qpsolvers_problem
from sim.evaluate.figures import MORE
from sim.notebook.internals import record_program
from sim.notebook.noise import (
    FIGURES,
    FORCE,
    VS,
    averaged_samples,
    differences_table,
    effects,
    success,
    success_table,
    sweep_or_sample,
)
from sim.notebook.solvers import (
    draw_race,
    exact_solutions,
    optimality_residual,
    race,
    race_table,
    transition,
    workspace,
)
from sim.notebook.vehicle import DOWN, FRONT, YAW, Duties, abilities, after_loss, cheapest, design_map, vehicle_case


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
        table, problem = sweep_or_sample(file)
        assert words in problem and table.height == 108


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
    first = qpsolvers_problem(HybridController().problem, programs[0].values)
    assert optimality_residual(first, exact[0] + 1e-3, np.zeros(len(programs[0].values.lower))) > 1e-7


def test_free_thrusts_are_the_solution_where_no_limit_is_violated(programs):
    exact, _ = exact_solutions(programs)
    for program, x in zip(programs, exact, strict=True):
        difference = float(np.abs(x[: len(program.free)] - program.free).max())
        assert program.limited or difference < 1e-6


def test_a_race_measures_errors_of_every_tick(programs):
    exact, _ = exact_solutions(programs)
    tight, loose = (
        race(workspace(str(each), SolverSettings(tolerance=each, max_iterations=20_000)), programs, exact)
        for each in (1e-9, 1e-1)
    )
    assert tight.errors_n.max() < 1e-3 < loose.errors_n.max() and not np.isnan(tight.errors_n).any()
    assert len(tight.times_us) == len(programs) and (tight.iterations > 0).all()
    assert race_table([tight, loose], reference="1e-09").count("\n") == 3
    assert [text.get_text() for text in draw_race([tight, loose]).axes[0].get_yticklabels()] == ["0.1", "1e-09"]


def test_a_transition_is_half_limited(programs):
    limited = np.array([program.limited for program in programs])
    part = limited[transition(programs, 10)]
    assert len(part) == 10 and abs(part.mean() - 0.5) <= abs(limited.mean() - 0.5) + 1e-9
    with pytest.raises(ValueError, match="61 ticks requested, 60 recorded"):
        transition(programs, 61)


WEAK = vehicle_case(weak_rotor="rear_left", fraction=0.5)


@pytest.mark.parametrize("case", [vehicle_case(), vehicle_case(mass_kg=7.5, tilt_deg=22.0), WEAK])
def test_cuts_end_where_the_set_ends(case):
    facets = WrenchFacets(case.geometry)

    def attainable(wrench: list[float]) -> bool:
        low, high = facets.rooms(np.array(wrench), case.lower, case.upper)
        return bool((low <= 0.0).all() and (high >= 0.0).all())

    side, level = case.cut(np.zeros(6), FRONT, -DOWN), case.level_cut()
    for corners, wrench in (
        (side, lambda front, up: [front, 0.0, -up, 0.0, 0.0, 0.0]),
        (level, lambda right, front: [front, right, -case.weight_n, 0.0, 0.0, 0.0]),
    ):
        middle = corners.mean(axis=0)
        for corner in corners:
            assert attainable(wrench(*(middle + 0.999 * (corner - middle))))
            assert not attainable(wrench(*(middle + 1.001 * (corner - middle))))
    push = case.cut(-case.weight_n * DOWN, FRONT, YAW)[:, 0].max()
    assert push == pytest.approx(case.reach().push, abs=1e-6)
    assert np.linalg.norm(level, axis=1).min() >= case.level_force_n - 1e-6


def test_level_hover_is_impossible_without_a_rotor():
    lost = vehicle_case(weak_rotor="mid_right", fraction=0.0)
    assert lost.level_cut().shape == (0, 2) and math.isnan(lost.reach().push)
    force, lean, yaw = after_loss(vehicle_case(weak_rotor="mid_right", fraction=0.0, thrust_min_n=0.0))
    # Published for this geometry: 0.289 m g, 16.1 deg, or 17 N m of yaw moment.
    assert force == pytest.approx(0.289 * lost.weight_n, rel=2e-3)
    assert lean == pytest.approx(16.1, abs=0.05) and yaw == pytest.approx(17.5, abs=0.05)
    assert np.isnan(after_loss(lost)).all()


def test_weak_rotors_bound_the_push_from_above_or_below():
    mid = [vehicle_case(weak_rotor="mid_right", fraction=each).reach().push for each in (0.5, 0.4, 0.3, 0.25, 0.2)]
    assert mid[:4] == pytest.approx([22.4, 14.5, 6.7, 2.7], abs=0.05) and math.isnan(mid[4])
    outer = vehicle_case(weak_rotor="front_left", fraction=0.15).reach()
    assert (outer.least, outer.push) == pytest.approx((10.3, 30.4), abs=0.05)


def test_a_push_within_reach_satisfies_the_limits_of_every_rotor():
    case = vehicle_case(mass_kg=5.0, tilt_deg=35.0)
    for push, inside in ((0.99 * case.reach().push, True), (1.01 * case.reach().push, False)):
        thrusts = case.push_thrusts(push)
        assert bool(((thrusts >= case.lower) & (thrusts <= case.upper)).all()) is inside


def test_the_cheapest_design_meets_every_duty_and_no_cheaper_one_does():
    duties = Duties(push_n=15.0, sliding_push_n=8.0, friction=0.5, gust_n=9.0, least_mass_kg=5.0)
    designs = design_map(duties, np.arange(15.0, 41.0, 1.0), np.arange(4.0, 8.1, 0.5))
    chosen = cheapest(designs)
    assert chosen is not None
    figures = abilities(chosen, duties.friction)
    assert figures["greatest push, standing still [N]"] >= 15.0 and figures["greatest push, any travel [N]"] >= 8.0
    assert chosen.level_force_n >= 9.0
    cheaper = designs.filter(pl.col("power_w") < chosen.hover_power_w - 1e-9)
    assert cheaper.height > 0 and (cheaper["margin"] < 0.0).all()
    assert cheapest(design_map(Duties(push_n=1e3), np.array([30.0]), np.array([6.0]))) is None
