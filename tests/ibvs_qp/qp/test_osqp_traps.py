"""Traps of OSQP, each shown on the bare solver first and then caught by its guard; and every named way out.

Each guard was taken out once, and the test beside it failed:

===================================================  ================================================================
trap, and what guards against it                     test that fails without the guard
===================================================  ================================================================
no solution is a finite number: status is asked      garbage_with_a_good_status_does_not_fly_either
a result that is no number: x and y must be finite   garbage_with_a_good_status_does_not_fly_either
a result beyond its bounds: hard rows are judged     an_iterate_that_breaks_a_hard_row_does_not_fly
one NaN poisons the warm start: data must be finite  data_that_is_not_finite_never_reaches_the_workspace
an update with l > u is dropped: refused before      crossed_bounds_are_refused_and_leave_no_trace
strided arrays are misread: copied contiguous        strided_arrays_and_other_types_are_read_as_meant
lengths are not checked: refused                     an_array_of_another_length_is_refused
updates write into what was handed over: copies      nothing_handed_to_the_set_up_is_shared_with_the_caller
of values, and of patterns                           arrays_handed_to_the_solver_stay_as_they_were
adapted rho outlives a warm start from nothing:      reset_restores_the_first_solve_to_the_bit
a reset sets up anew
bounds within 1e-4 turn a row into an equality:      bounds_of_thrusts_stay_a_millinewton_apart
a millinewton is kept between them
===================================================  ================================================================
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import osqp
import pytest
from controller_scenes import CEILING, FLOOR, line_references, measured, random_tick
from scipy import sparse
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import analytic_thrusts
from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig, LimitSettings, SolverSettings
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.model.reach import thrust_window
from ibvs_qp.qp.solver import BOUND_SLIP, Solution
from ibvs_qp.qp.solvers.osqp import OUTCOMES, OsqpSolver

#: Status value of OSQP.
SOLVED = 1
#: What OSQP 1.1 writes into x when it found no solution: its NaN pattern read as a number.
GARBAGE = 2143289344.0


def bare(lower: float = 0.0, upper: float = 1.0, **settings: object) -> osqp.OSQP:
    """min 1/2 x^2 - x with lower <= x <= upper, twice: the smallest program."""
    solver = osqp.OSQP()
    box = (np.full(2, lower), np.full(2, upper))
    solver.setup(sparse.eye(2, format="csc"), -np.ones(2), sparse.eye(2, format="csc"), *box, verbose=False, **settings)
    return solver


def flying(ticks: int = 5, config: ControllerConfig | None = None) -> HybridController:
    """A controller in the middle of a hover with two lines."""
    controller = HybridController(config)
    for tick in range(ticks):
        controller.step(measured(tick), Reference(lines=line_references(2)))
    return controller


def data_of(controller: HybridController) -> list[np.ndarray]:
    data = controller.engine.data
    return [array.copy() for array in (data.p, data.q, data.a, data.lower, data.upper)]


# ------------------------------------------------------------------------------------------ what goes wrong without


def test_bare_osqp_answers_an_infeasible_program_with_a_finite_number() -> None:
    solver = osqp.OSQP()
    rows = sparse.csc_matrix(np.vstack((np.eye(2), np.ones(2))))
    solver.setup(
        sparse.eye(2, format="csc"), np.zeros(2), rows, np.array([0.0, 0, 5]), np.array([1.0, 1, 6]), verbose=False
    )
    result = solver.solve(raise_error=False)
    assert result.info.status_val != SOLVED
    assert np.isfinite(result.x).all()  # so a check for finiteness lets it fly
    np.testing.assert_array_equal(result.x, GARBAGE)


def test_bare_osqp_never_recovers_from_one_nan() -> None:
    solver = bare(max_iter=50)
    assert solver.solve(raise_error=False).info.status_val == SOLVED
    solver.update(q=np.array([math.nan, -1.0]))
    solver.solve(raise_error=False)
    solver.update(q=-np.ones(2))
    for _ in range(3):
        result = solver.solve(raise_error=False)
        assert result.info.status_val != SOLVED or not np.isfinite(result.x).all()


def test_bare_osqp_drops_an_update_with_crossed_bounds() -> None:
    solver = bare(0.0, 0.5)
    solver.solve(raise_error=False)
    solver.update(l=np.full(2, 3.0), u=np.full(2, 2.0))
    result = solver.solve(raise_error=False)
    assert result.info.status_val == SOLVED  # "solved", for the old bounds
    np.testing.assert_allclose(result.x, 0.5, atol=1e-3)


def test_bare_osqp_writes_into_matrices_that_it_was_given() -> None:
    matrix, rows = sparse.eye(2, format="csc"), sparse.eye(2, format="csc")
    solver = osqp.OSQP()
    solver.setup(matrix, -np.ones(2), rows, np.zeros(2), np.ones(2), verbose=False)
    solver.update(Px=np.array([5.0, 5.0]))
    touched = not np.array_equal(matrix.data, [1.0, 1.0])
    solver.update(Ax=np.array([7.0, 7.0]))
    assert touched or not np.array_equal(rows.data, [1.0, 1.0])


def test_bare_osqp_reads_through_the_gaps_of_a_strided_array() -> None:
    solver = bare()
    solver.update(q=np.array([-0.2, 9.0, -0.6, 9.0])[::2])  # -0.2 and -0.6 are meant
    result = solver.solve(raise_error=False)
    assert result.info.status_val == SOLVED
    np.testing.assert_allclose(result.x, [0.2, 0.0], atol=1e-3)  # -0.2 and 9 were read


def test_bare_osqp_reads_beyond_the_end_of_a_short_array() -> None:
    solver, memory = bare(), np.array([-0.2, -0.6])
    solver.update(q=memory[:1])  # one number for two variables; what lies behind it is ours, luckily
    result = solver.solve(raise_error=False)
    assert result.info.status_val == SOLVED
    np.testing.assert_allclose(result.x, [0.2, 0.6], atol=1e-3)


def test_bare_osqp_keeps_its_adapted_step_size_when_it_is_started_afresh() -> None:
    solver = osqp.OSQP()
    rows = sparse.csc_matrix([[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    box = (np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.7, 0.7]))
    fine = {"eps_abs": 1e-9, "eps_rel": 1e-9, "check_termination": 5, "adaptive_rho_interval": 25, "scaling": 2}
    solver.setup(sparse.diags([1.0, 1e3], format="csc"), -np.ones(2), rows, *box, verbose=False, **fine)
    first = solver.solve(raise_error=False)
    assert first.info.rho_updates > 0
    solver.warm_start(x=np.zeros(2), y=np.zeros(3))
    second = solver.solve(raise_error=False)
    assert first.info.iter != second.info.iter and not np.array_equal(first.x, second.x)


def test_bare_osqp_builds_its_matrix_anew_where_bounds_come_within_1e_4() -> None:
    """A row of less width counts as an equality, a thousand times stiffer: one iteration from one start tells."""

    def after_one_iteration(width: float) -> np.ndarray:
        solver = bare(max_iter=1, scaling=0)
        solver.update(l=np.full(2, 0.5), u=np.full(2, 0.5 + width))
        return solver.solve(raise_error=False).x

    assert np.abs(after_one_iteration(1e-3) - after_one_iteration(1.1e-4)).max() < 1e-3
    assert np.abs(after_one_iteration(1.1e-4) - after_one_iteration(0.9e-4)).max() > 0.1


# -------------------------------------------------------------------------------------------------------- the guards


#: OSQP's own object and its wrapper: an update that is refused is an error code here and silence there.
both_ways = pytest.mark.parametrize("direct", [True, False])


def solver_of(controller: HybridController, direct: bool = True) -> OsqpSolver:
    """A solver of its own for the program of a controller."""
    return OsqpSolver(controller.problem, replace(controller.config.solver, direct=direct))


def test_an_infeasible_program_is_never_believed() -> None:
    controller = flying()
    p, q, a, lower, upper = data_of(controller)
    solver = OsqpSolver(controller.problem, controller.config.solver)
    raw = solver.solve(p, q, np.zeros_like(a), np.full_like(lower, 1.0), np.full_like(upper, 2.0))  # 0 x >= 1
    assert raw is not None and raw.status is None
    assert np.isfinite(raw.x).all() and np.abs(raw.x).max() == GARBAGE
    assert controller.engine.accepts(raw._replace(y=np.zeros(len(lower)))) is None


def test_garbage_with_a_good_status_does_not_fly_either() -> None:
    engine = flying().engine
    rows = len(engine.data.lower)

    def outcome(status: int, x: np.ndarray, y: np.ndarray) -> Outcome | None:
        return engine.accepts(Solution(x=x, y=y, status=OUTCOMES.get(status), iterations=1))

    for value in (GARBAGE, math.nan, math.inf, -math.inf):
        assert outcome(SOLVED, np.full(9, value), np.zeros(rows)) is None
    assert outcome(SOLVED, np.full(9, 20.0), np.full(rows, math.nan)) is None
    inside = np.append(0.5 * (engine.data.lower + engine.data.upper)[:6], np.zeros(3))
    assert outcome(SOLVED, inside, np.zeros(rows)) is Outcome.SOLVED
    assert outcome(SOLVED, inside, np.full(rows, math.nan)) is None  # prices and slacks are read as well
    assert outcome(SOLVED, np.append(inside[:-1], math.inf), np.zeros(rows)) is None
    for status in (3, 4, 5, 6, 8, 9, 10, 11):  # infeasible, unbounded, interrupted, unsolved: the number is chance
        assert outcome(status, inside, np.zeros(rows)) is None


@pytest.mark.parametrize("status", OUTCOMES.values())
def test_an_iterate_that_breaks_a_hard_row_does_not_fly(status: Outcome) -> None:
    """All thrusts within their boxes and no dual residual: a barrier without slack is broken none the less."""
    hard = ControllerConfig(limits=LimitSettings(hard_barriers=True))
    engine, row = flying(config=hard).engine, 6
    assert engine.problem.row_names[row] == "tilt_roll" and engine.problem.row_slack[row] < 0
    data = engine.data
    x, per_thrust = data.free.copy(), data.rows()[row]
    engine.dual_residual = lambda x, y: 0.0  # type: ignore[method-assign]
    prices, at = np.zeros(len(data.lower)), float(per_thrust @ x)
    newton = float(np.linalg.norm(per_thrust))  # one newton of thrust in the row's own unit
    for distance, flies in ((-1.0, True), (5e-4, True), (0.1, False)):
        for side in (data.upper, data.lower):
            kept = side[row]
            side[row] = at - distance * newton if side is data.upper else at + distance * newton
            raw = Solution(x=x, y=prices, status=status, iterations=1)
            assert (engine.accepts(raw) is not None) == flies
            side[row] = kept


@pytest.mark.parametrize("place", range(5))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@both_ways
def test_data_that_is_not_finite_never_reaches_the_workspace(place: int, value: float, direct: bool) -> None:
    controller = flying()
    clean, solver = (solver_of(controller, direct) for _ in range(2))
    data = data_of(controller)
    for one in (solver, clean):
        assert one.solve(*data).status is Outcome.SOLVED  # type: ignore[union-attr]
    broken = [array.copy() for array in data]
    broken[place][1] = value
    assert solver.solve(*broken) is None
    after, expected = solver.solve(*data), clean.solve(*data)
    assert after is not None and expected is not None and after.status is Outcome.SOLVED
    np.testing.assert_array_equal(after.x, expected.x)  # as if the bad tick had never been


@both_ways
def test_crossed_bounds_are_refused_and_leave_no_trace(direct: bool) -> None:
    controller = flying()
    solver = solver_of(controller, direct)
    p, q, a, lower, upper = data_of(controller)
    first = solver.solve(p, q, a, lower, upper)
    assert solver.solve(p, q, a, upper + 1.0, upper) is None
    again = solver.solve(p, q, a, lower, upper)
    assert first is not None and again is not None
    np.testing.assert_allclose(again.x, first.x, atol=1e-3)


@both_ways
def test_arrays_handed_to_the_solver_stay_as_they_were(direct: bool) -> None:
    """Every solve has arrays of its own: an update writes into the matrices of the set-up."""
    controller = flying()
    problem = controller.problem
    solver, data = solver_of(controller, direct), data_of(controller)
    handed = [[array * (1.0 + 0.01 * tick) for array in data] for tick in range(4)]
    kept = [[array.copy() for array in arrays] for arrays in handed]
    for arrays in handed:
        assert solver.solve(*arrays) is not None
    for arrays, before in zip(handed, kept, strict=True):
        for array, values in zip(arrays, before, strict=True):
            np.testing.assert_array_equal(array, values)
    np.testing.assert_array_equal(problem.p_pattern.data, 1.0)  # as it was made
    np.testing.assert_array_equal(problem.a_pattern.data, 1.0)


def test_nothing_handed_to_the_set_up_is_shared_with_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a release of OSQP does with arrays it was given, the program of the next tick does not reach them."""
    controller, given = flying(), []
    setup = osqp.OSQP.setup

    def seen(
        self: osqp.OSQP, p: sparse.csc_matrix, q: np.ndarray, a: sparse.csc_matrix, *rest: Any, **named: Any
    ) -> None:
        given.extend((p.data, q, a.data, *rest))
        setup(self, p, q, a, *rest, **named)

    monkeypatch.setattr(osqp.OSQP, "setup", seen)
    data = data_of(controller)
    solver_of(controller).solve(*data)
    assert len(given) == 5
    own = [*data, controller.problem.p_pattern.data, controller.problem.a_pattern.data]
    assert not any(np.shares_memory(one, other) for one in given for other in own)


@both_ways
@pytest.mark.parametrize("place", range(5))
def test_strided_arrays_and_other_types_are_read_as_meant(place: int, direct: bool) -> None:
    controller = flying()
    data = data_of(controller)
    plain, solver = solver_of(controller, direct), solver_of(controller, direct)
    for one in (plain, solver):
        one.solve(*data)
    expected = plain.solve(*data)
    assert expected is not None
    strided = list(data)
    strided[place] = np.repeat(data[place], 2)
    strided[place][1::2] = 77.0
    strided[place] = strided[place][::2]
    found = solver.solve(*strided)
    assert found is not None
    np.testing.assert_array_equal(found.x, expected.x)
    single = [array.astype(np.float32) for array in data]
    expected, found = plain.solve(*(array.astype(float) for array in single)), solver.solve(*single)
    assert expected is not None and found is not None
    np.testing.assert_array_equal(found.x, expected.x)


@both_ways
@pytest.mark.parametrize("place", range(5))
@pytest.mark.parametrize("change", [-1, 1])
def test_an_array_of_another_length_is_refused(place: int, change: int, direct: bool) -> None:
    controller = flying()
    solver, data = solver_of(controller, direct), data_of(controller)
    first = solver.solve(*data)
    wrong = list(data)
    wrong[place] = np.resize(data[place], len(data[place]) + change)
    with pytest.raises(ValueError, match="entries"):
        solver.solve(*wrong)
    again = solver.solve(*data)
    assert first is not None and again is not None
    np.testing.assert_allclose(again.x, first.x, atol=1e-3)


def test_bounds_of_thrusts_stay_a_millinewton_apart() -> None:
    """Ten times the width at which OSQP takes a row for an equality, whatever the limits ask for."""
    last, floor, ceiling = np.full(6, 20.0), np.full(6, FLOOR), np.full(6, CEILING)
    for low, high in ((20.0, 20.0), (25.0, 15.0), (FLOOR, FLOOR), (CEILING, CEILING), (0.0, 0.0), (99.0, 99.0)):
        for step in (0.0, 2.0, 100.0):
            least, most = thrust_window(last, np.full(6, low), np.full(6, high), step, floor, ceiling)
            assert (most - least > 0.999e-3).all()


def test_buffers_are_contiguous_doubles_of_fixed_length() -> None:
    controller = flying()
    data, problem = controller.engine.data, controller.problem
    for array in (data.p, data.q, data.a, data.lower, data.upper, data.point):
        assert array.dtype == np.float64 and array.flags.c_contiguous
    sizes = len(data.p), len(data.a), len(data.q), len(data.lower)
    for tick in range(5, 25):
        controller.step(*random_tick(np.random.default_rng(tick), tick % 3, tick))
        assert (len(data.p), len(data.a), len(data.q), len(data.lower)) == sizes
    assert sizes[:2] == (problem.p_pattern.nnz, problem.a_pattern.nnz)


def test_reset_restores_the_first_solve_to_the_bit() -> None:
    """The adapted step size survives in OSQP and shows in the last bits of its iterates; a reset drops it too."""
    ticks = [random_tick(np.random.default_rng(tick), tick % 3, tick) for tick in range(60)]
    controller = HybridController()
    first = [controller.step(*tick) for tick in ticks]
    controller.reset()
    second = [controller.step(*tick) for tick in ticks]
    for one, two in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.thrusts, two.thrusts)
        assert (one.outcome, one.iterations, one.mode) == (two.outcome, two.iterations, two.mode)
        np.testing.assert_array_equal(one.unallocated_wrench, two.unallocated_wrench)
    np.testing.assert_array_equal(HybridController().step(*ticks[0]).thrusts, first[0].thrusts)


# ------------------------------------------------------------------------------------------------- every way out


#: One iteration per tick.
CUT_SHORT = SolverSettings(max_iterations=1, check_interval=1)


def from_the_last_solution(controller: HybridController) -> HybridController:
    """A controller whose solver starts from the last solution at every tick, and so needs many iterations."""
    solve = controller.engine.solver.solve
    controller.engine.solver.solve = lambda *data, initial=None: solve(*data)  # type: ignore[method-assign]
    return controller


def outcomes_of(controller: HybridController, ticks: int = 40) -> list[Outcome]:
    vehicle = SmallVehicle(controller.config)
    found = []
    for _ in range(ticks):
        command = controller.step(vehicle.measure(), Reference(standoff=0.1, lines=line_references(2, 0.6)))
        assert np.isfinite(command.thrusts).all()
        assert (command.thrusts >= FLOOR).all() and (command.thrusts <= CEILING).all()
        vehicle.fly(command.thrusts)
        found.append(command.outcome)
    assert abs(vehicle.position[2]) < 0.05 and np.linalg.norm(vehicle.attitude.as_rotvec()) < 0.05
    return found


def test_a_solver_cut_short_is_accepted_by_residual_or_replaced_by_the_exact_one() -> None:
    short = outcomes_of(from_the_last_solution(HybridController(ControllerConfig(solver=CUT_SHORT))))
    assert set(short) <= {Outcome.SOLVED, Outcome.CAPPED_ACCEPTED, Outcome.EXACT_FALLBACK}
    assert Outcome.EXACT_FALLBACK in short


def test_a_capped_solution_that_flies_is_as_near_as_promised() -> None:
    settings = SolverSettings(max_iterations=15, check_interval=5, accept_residual=1e-2)
    controller = from_the_last_solution(HybridController(ControllerConfig(solver=settings)))
    vehicle, capped = SmallVehicle(controller.config), 0
    rng, reference = np.random.default_rng(2), Reference()
    for tick in range(400):
        if tick % 40 == 0:
            reference = Reference(velocity=rng.uniform(-0.1, 0.1, 2), standoff=0.1)
        seen = vehicle.measure(0)
        command = controller.step(seen, reference)
        if command.outcome is Outcome.CAPPED_ACCEPTED:
            capped += 1
            data = controller.engine.data
            exact = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
            assert exact is not None
            assert np.abs(command.thrusts - exact[0][:6]).max() < 10 * settings.accept_residual
        vehicle.fly(command.thrusts)
    assert capped > 0


def test_without_any_solver_the_analytic_law_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    controller = flying()
    monkeypatch.setattr(controller.engine.solver, "solve", lambda *data, initial: None)
    command = controller.step(measured(6), Reference(lines=line_references(2)))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK
    np.testing.assert_allclose(command.thrusts, analytic_thrusts(controller.setpoints), atol=1e-9)


def test_the_tolerance_of_the_solver_takes_no_thrust_out_of_its_window(monkeypatch: pytest.MonkeyPatch) -> None:
    controller, solve = flying(), OsqpSolver.solve
    upper, shift = controller.engine.data.upper[:6], 0.5 * BOUND_SLIP

    def beyond(self: OsqpSolver, *data: np.ndarray, initial: np.ndarray | None = None) -> Solution | None:
        raw = solve(self, *data, initial=initial)
        assert raw is not None
        raw.x[:6] = upper + shift
        return raw

    monkeypatch.setattr(OsqpSolver, "solve", beyond)
    command = controller.step(measured(6), Reference(lines=line_references(2)))
    assert command.outcome is Outcome.SOLVED
    np.testing.assert_array_equal(command.thrusts, upper)


def test_the_analytic_law_keeps_to_what_a_weak_rotor_has(monkeypatch: pytest.MonkeyPatch) -> None:
    weak = np.full(6, CEILING)
    weak[2] = 8.0
    controller = HybridController()
    for tick in range(5):
        controller.step(measured(tick, thrust_max=weak), Reference(lines=line_references(2)))
    monkeypatch.setattr(controller.engine.solver, "solve", lambda *data, initial: None)
    command = controller.step(measured(6, thrust_max=weak), Reference(lines=line_references(2)))
    assert command.outcome is Outcome.ANALYTIC_FALLBACK and command.thrusts[2] <= 8.0 + 1e-9
    assert (command.thrusts >= FLOOR).all() and command.active_limits[0].name.startswith("thrust_")


def test_osqp_unbelieved_and_the_exact_solver_failing_leads_to_the_analytic_law() -> None:
    controller = from_the_last_solution(HybridController(ControllerConfig(solver=CUT_SHORT)))
    controller.engine.exact.solve = lambda *data: None  # type: ignore[method-assign]
    found = outcomes_of(controller)
    assert Outcome.ANALYTIC_FALLBACK in found and Outcome.EXACT_FALLBACK not in found


def test_everything_failing_leads_to_hold_and_back(monkeypatch: pytest.MonkeyPatch) -> None:
    controller = flying()
    with monkeypatch.context() as broken:
        broken.setattr(controller.engine, "solve", lambda: None)
        broken.setattr("ibvs_qp.controller.analytic_thrusts", lambda setpoints: np.full(6, math.nan))
        command = controller.step(measured(6), Reference())
    assert command.outcome is Outcome.HOLD and command.mode == "hold"
    assert command.thrusts.sum() * math.cos(math.radians(30)) == pytest.approx(6.0 * 9.81, rel=0.02)
    recovery = controller.config.solver.recovery_ticks
    outcomes = [controller.step(measured(tick), Reference()).outcome for tick in range(7, 7 + recovery)]
    assert outcomes == [Outcome.ANALYTIC_FALLBACK] * (recovery - 1) + [Outcome.SOLVED], "not at the first good one"


def test_the_first_test_of_residuals_confirms_the_solution_without_limits() -> None:
    controller, slow = flying(), from_the_last_solution(flying())
    for tick in range(6, 12):
        reference = Reference(lines=line_references(2), standoff=0.1 + 0.01 * tick)
        commands = [one.step(measured(tick), reference) for one in (controller, slow)]
        assert commands[0].outcome is commands[1].outcome is Outcome.SOLVED and not commands[0].active_limits
        assert commands[0].iterations == controller.config.solver.check_interval < commands[1].iterations
        np.testing.assert_allclose(commands[0].thrusts, commands[1].thrusts, atol=1e-6)


def test_nothing_ever_measured_is_plain_hover() -> None:
    controller = HybridController()
    command = controller.step(replace(measured(0), attitude=np.full(4, math.nan)), Reference())
    assert command.outcome is Outcome.HOLD and command.rejected
    np.testing.assert_allclose(command.wrench, [0, 0, -6.0 * 9.81, 0, 0, 0], atol=1e-9)


def test_exact_solver_reports_failure_instead_of_numbers() -> None:
    controller = flying()
    p, q, a, lower, upper = data_of(controller)
    assert controller.engine.exact.solve(p, np.full_like(q, math.nan), a, lower, upper) is None
    above = np.full_like(lower, 1.0)  # 0 x >= 1
    assert controller.engine.exact.solve(p, q, np.zeros_like(a), above, 9.0 * above) is None
