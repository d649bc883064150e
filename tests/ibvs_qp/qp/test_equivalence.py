"""The program against the closed-form law, OSQP against the exact solver, and what may not change a thrust."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import (
    CEILING,
    FLOOR,
    dense,
    exact_thrusts,
    line_references,
    measured,
    moved_by_turn,
    pack,
    random_tick,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from law_only import evaluate_law
from scipy.optimize import lsq_linear
from small_vehicle import SmallVehicle

import ibvs_qp
from allocation import TAROT_T960, control_effectiveness
from ibvs_qp.analytic import analytic_thrusts
from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig, Gains, LimitSettings, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.frames import R_BODY_CAMERA, camera_twist_matrix
from ibvs_qp.measurement import Reference
from ibvs_qp.model.interaction_matrix import endpoint_line_row, line_interaction_matrix
from ibvs_qp.model.reach import LEAST_GAP, thrust_window
from ibvs_qp.qp.explain import active_limits
from ibvs_qp.qp.solver import AcceptedSolution

RNG = np.random.default_rng
LAST = np.array([11.0, 12.0, 10.5, 11.5, 12.5, 11.2])


@pytest.fixture(scope="module")
def free() -> HybridController:
    """Without barriers: nothing limits but the thrust window, which the tests open wide."""
    return HybridController(ControllerConfig(barriers=False))


def closed_form(controller: HybridController, share: float, last: np.ndarray) -> np.ndarray:
    """Weighted least squares over all wishes at once, in numpy, from the set-points and the vehicle's numbers."""
    config, setpoints = controller.config, controller.setpoints
    vehicle, weights, gains = config.vehicle, config.weights, config.gains
    matrix = control_effectiveness(vehicle.geometry)
    inertia = np.array([vehicle.mass_kg] * 3 + list(vehicle.inertia_kg_m2))
    per_thrust, drift = matrix / inertia[:, None], setpoints.bias_wrench / inertia
    before = per_thrust @ last + drift  # where the filters start
    kept, kept_along = (math.exp(-config.tick_s / time) for time in (gains.line_filter_s, gains.push_filter_s))
    rows: list[tuple[np.ndarray, float, float]] = []  # row on the acceleration, wish, weight
    selection = np.eye(6)
    selection[:3, :3] -= np.outer(setpoints.normal, setpoints.normal)
    selection[3:, 3:] *= 1.0 - share * (1.0 - gains.body_rotation_gain)
    twist = camera_twist_matrix(np.array(vehicle.camera_position_m))
    for line in setpoints.lines:
        image = line_interaction_matrix(line.rho, line.theta, setpoints.plane)
        at_tip = endpoint_line_row(image, line.theta, line.tip) @ twist @ selection
        wanted = -(gains.line_kp * line.error + gains.line_kd * line.rate + gains.line_ki * line.integral)
        wanted += kept * (at_tip @ before - wanted)
        turn = -(gains.theta_kp * line.angle_error + gains.theta_kd * line.angle_rate)
        rows.append((at_tip, wanted, weights.line * line.weight))
        rows.append((image[1] @ twist @ selection, turn, weights.line_angle * line.weight))
    turning = share * np.array([setpoints.normal @ moved_by_turn(setpoints, axis) for axis in np.eye(3)])
    along = vehicle.mass_kg * np.concatenate((setpoints.normal, turning))
    rows.append((along, setpoints.push_command, weights.push * share))
    standoff = setpoints.standoff_command + kept_along * (along @ before - setpoints.standoff_command)
    rows.append((along, standoff, weights.push * (1.0 - share)))
    for axis, weight in ((0, weights.level), (1, weights.level), (2, weights.yaw)):
        rows.append((np.eye(6)[3 + axis], setpoints.angular[axis], weight))
    for direction, wish, fixed in (
        (setpoints.right, setpoints.velocity_command[0], setpoints.free[0]),
        (setpoints.down, setpoints.velocity_command[1], setpoints.free[1]),
    ):
        rows.append((np.concatenate((direction, np.zeros(3))), wish, weights.velocity * fixed))
    height, weight = setpoints.step.outputs["height_command"].item(), weights.height
    rows.append((np.concatenate((setpoints.down, np.zeros(3))), height, weight))
    jacobian = [math.sqrt(w) * (row @ per_thrust) for row, _, w in rows]
    target = [math.sqrt(w) * (wish - row @ drift) for row, wish, w in rows]
    for weight, centre in ((weights.effort, last), (weights.smoothness, last + setpoints.step.inputs["thrust_change"])):
        jacobian += list(math.sqrt(weight) * np.eye(6))
        target += list(math.sqrt(weight) * centre)
    return np.linalg.lstsq(np.array(jacobian), np.array(target), rcond=None)[0]


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), lines=st.integers(0, 2), share=st.floats(0.0, 1.0))
def test_without_limits_the_program_is_the_closed_form_law(
    free: HybridController, seed: int, lines: int, share: float
) -> None:
    free.reset()
    measurement, reference = random_tick(np.random.default_rng(seed), lines)
    pack(free, measurement, reference, share=share, last=LAST)
    assert len(free.setpoints.lines) == lines
    assert np.abs(exact_thrusts(free) - closed_form(free, share, LAST)).max() < 1e-6


def test_with_limits_that_do_not_bind_as_well() -> None:
    controller = HybridController()
    compared = 0
    for seed in range(100):
        controller.reset()
        rng = np.random.default_rng(seed)
        share = float(rng.uniform())
        tick = random_tick(rng, seed % 3, lean=0.2 * (seed % 2))
        pack(controller, *tick, share=share, last=LAST, window=(FLOOR, CEILING))
        data = controller.engine.data
        solution = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        assert solution is not None
        if np.abs(solution[1]).max() < 1e-9:
            compared += 1
            assert np.abs(solution[0][:6] - closed_form(controller, share, LAST)).max() < 1e-6
    assert compared >= 20


@pytest.mark.parametrize("lines", [1, 2])
def test_in_the_paper_profile_the_program_converges_to_the_paper_law(lines: int) -> None:
    """Free air, line weight growing against one weight of all null-space wishes: 1e-4 N at the end."""
    mass, null = ControllerConfig().vehicle.mass_kg, 1.0
    wishes = {"level": null, "yaw": null, "velocity": null, "push": null / mass**2}
    errors = []
    for weight in (1e2, 1e3, 1e4, 1e6):
        weights = Weights(line=weight, effort=1e-9, smoothness=0.0, line_sigma=1.0, **wishes)
        gains = Gains(push_filter_s=0.0)  # the analytic law has no filter of the stand-off
        printed = ControllerConfig(gains=gains, analytic_line_point="centre", analytic_angle_row=True)
        config = replace(printed, weights=weights, line_profile="paper", barriers=False)
        controller, worst = HybridController(config), 0.0
        for seed in range(5):
            controller.reset()
            pack(controller, *random_tick(np.random.default_rng(seed), lines), share=0.0)
            law = analytic_thrusts(controller.setpoints)
            worst = max(worst, float(np.abs(exact_thrusts(controller) - law).max()))
        errors.append(worst)
    print(f"{lines} lines: largest difference {errors} N")
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-4


# --------------------------------------------------------------------------------- OSQP against the exact solver


class Flight:
    """A closed loop under random demands, gusts and sensor noise, with rotors derated now and then."""

    def __init__(self, seed: int, ticks: int, config: ControllerConfig | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.controller = HybridController(config)
        self.error: list[float] = []
        self.dual: list[float] = []
        self.outside: list[float] = []
        self.outcomes: list[Outcome] = []
        self.iterations: list[int] = []
        self.limited = 0
        self.solution: AcceptedSolution | None = None
        solve = self.controller.engine.solve

        def remembered() -> AcceptedSolution | None:
            self.solution = solve()
            return self.solution

        self.controller.engine.solve = remembered  # type: ignore[method-assign]
        vehicle, gust, limit = SmallVehicle(self.controller.config, distance=0.03), np.zeros(3), np.full(6, CEILING)
        count, reference = 2, Reference()
        for tick in range(ticks):
            if tick % 250 == 0:
                count = int(rng.integers(0, 3))
                reference = Reference(
                    push_force=float(rng.uniform(2.0, 25.0)),
                    contact=bool(rng.uniform() < 0.8),
                    standoff=0.05,
                    velocity=rng.uniform(-0.1, 0.1, 2) * (count == 0),
                    lines=line_references(count),
                )
                limit = np.where(rng.uniform(size=6) < 0.25, rng.uniform(10.0, 16.0, 6), CEILING)
            gust = 0.99 * gust + rng.normal(0.0, 0.3, 3)
            seen = vehicle.measure(count, thrust_max=limit)
            noisy = replace(
                seen,
                angular_velocity=seen.angular_velocity + rng.normal(0.0, 0.003, 3),
                contact_wrench=seen.contact_wrench + rng.normal(0.0, 0.3, 6) * [1, 1, 1, 0.1, 0.1, 0.1],
                specific_force=seen.specific_force + rng.normal(0.0, 0.1, 3),
            )
            command = self.controller.step(noisy, reference)
            self._judge(command)
            vehicle.fly(command.thrusts, gust)

    def _judge(self, command: Command) -> None:
        engine = self.controller.engine
        data = engine.data
        self.outcomes.append(command.outcome)
        self.iterations.append(command.iterations)
        self.limited += bool(command.active_limits)
        if command.outcome is not Outcome.SOLVED:
            return
        exact = engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        assert exact is not None
        self.error.append(float(np.abs(command.thrusts - exact[0][:6]).max()))
        raw = self.solution
        assert raw is not None
        p, q, a, lower, upper = dense(self.controller)
        gradient = np.linalg.solve(p, p @ raw.x + q + a.T @ raw.y)
        self.dual.append(float(np.abs(gradient).max()))
        rows = a @ raw.x
        self.outside.append(float(np.maximum(lower - rows, rows - upper)[:6].max()))


@pytest.fixture(scope="module")
def flight() -> Flight:
    return Flight(3, 2000)


def test_osqp_agrees_with_the_exact_solver_while_limits_come_and_go(flight: Flight) -> None:
    error = np.array(flight.error)
    print(
        f"OSQP - DAQP [N]: median {np.median(error):.1e} p99 {np.quantile(error, 0.99):.1e} max {error.max():.1e}; "
        f"iterations median {np.median(flight.iterations):.0f} p99 {np.quantile(flight.iterations, 0.99):.0f}; "
        f"limited {flight.limited} of {len(flight.outcomes)}, "
        + ", ".join(f"{name} {flight.outcomes.count(name)}" for name in set(flight.outcomes))
    )
    assert flight.limited > 500
    assert np.quantile(error, 0.99) < 5e-3
    assert error.max() < 2e-2


def test_solutions_that_fly_meet_the_optimality_conditions(flight: Flight) -> None:
    dual, outside = np.array(flight.dual), np.array(flight.outside)
    print(f"KKT [N]: dual p99 {np.quantile(dual, 0.99):.1e} max {dual.max():.1e}, bounds max {outside.max():.1e}")
    assert np.quantile(dual, 0.99) < 5e-3 and dual.max() < 2e-2
    assert outside.max() < 2e-3
    assert flight.outcomes.count(Outcome.SOLVED) >= 0.999 * len(flight.outcomes)


# --------------------------------------------------------------------------------------------- what may not matter


def thrusts_of(controller: HybridController, tick: tuple) -> np.ndarray:
    controller.reset()
    pack(controller, *tick, share=0.6, last=LAST, window=(FLOOR, CEILING))
    return exact_thrusts(controller)


@pytest.mark.parametrize("lines", [1, 2])
def test_the_sign_in_which_a_line_is_written_does_not_matter(lines: int) -> None:
    controller = HybridController()
    for seed in range(10):
        one = thrusts_of(controller, random_tick(np.random.default_rng(seed), lines))
        two = thrusts_of(controller, random_tick(np.random.default_rng(seed), lines, flip=True))
        np.testing.assert_allclose(one, two, atol=1e-8)


def test_the_order_of_lines_does_not_matter() -> None:
    controller = HybridController()
    for seed in range(10):
        measurement, reference = random_tick(np.random.default_rng(seed), 2)
        one = thrusts_of(controller, (measurement, reference))
        turned = replace(measurement, lines=measurement.lines[::-1])
        np.testing.assert_allclose(one, thrusts_of(controller, (turned, reference)), atol=1e-8)
        turned_reference = replace(reference, lines=reference.lines[::-1])
        np.testing.assert_allclose(one, thrusts_of(controller, (turned, turned_reference)), atol=1e-8)


@pytest.mark.parametrize("heading", [0.5, math.pi, -2.0])
def test_the_heading_of_the_attitude_is_arbitrary(heading: float) -> None:
    controller = HybridController()
    for seed in range(10):
        one = thrusts_of(controller, random_tick(np.random.default_rng(seed), 2))
        two = thrusts_of(controller, random_tick(np.random.default_rng(seed), 2, heading=heading))
        np.testing.assert_allclose(one, two, atol=1e-8)


def test_the_scale_of_the_plane_does_not_matter() -> None:
    controller = HybridController()
    measurement, reference = random_tick(np.random.default_rng(4), 2)
    assert measurement.plane is not None
    one = thrusts_of(controller, (measurement, reference))
    for scale in (-1.0, 7.0):
        a, b, c, d = (scale * entry for entry in measurement.plane)
        two = thrusts_of(controller, (replace(measurement, plane=(a, b, c, d)), reference))
        np.testing.assert_allclose(one, two, atol=1e-8)


# ------------------------------------------------------------------------------------------- prices and windows


def test_the_price_of_a_limit_is_the_slope_of_the_cost() -> None:
    """Without noise at the limits, which moves the centre of the least squares."""
    controller = HybridController(ControllerConfig(limits=LimitSettings(thrust_noise_n=0.0)))
    limit = np.full(6, CEILING)
    limit[3] = 9.0  # below hover: this rotor is missed
    vehicle = SmallVehicle(controller.config)
    for _ in range(20):
        command = controller.step(vehicle.measure(thrust_max=limit), Reference(standoff=0.1))
        vehicle.fly(command.thrusts)
    name = controller.problem.row_names[3]
    (active,) = [entry for entry in command.active_limits if entry.name == name]
    assert active.side == "upper" and active.unit == "N" and active.slack == 0.0
    p, q, _, lower, upper = dense(controller)
    data, cost = controller.engine.data, []
    for change in (-1e-3, 1e-3):
        moved = upper.copy()
        moved[3] += change
        solution = controller.engine.exact.solve(data.p, q, data.a, lower, moved)
        assert solution is not None
        x = solution[0]
        cost.append(0.5 * x @ p @ x + q @ x)
    assert active.price == pytest.approx((cost[0] - cost[1]) / 2e-3, rel=1e-2)
    # What limits took away: the wrench without them less the wrench with them.
    wide = np.full_like(lower, 1e6)
    solution = controller.engine.exact.solve(data.p, q, data.a, -wide, wide)
    assert solution is not None
    lost = control_effectiveness(controller.config.vehicle.geometry) @ (solution[0][:6] - command.thrusts)
    assert np.abs(lost).max() > 0.5
    np.testing.assert_allclose(command.unallocated_wrench, lost, atol=0.01)


@pytest.mark.parametrize("noise", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("beyond", [0.2, 0.5, 0.9, 3.0])
@pytest.mark.parametrize("low", [True, False])
def test_noise_at_a_thrust_limit_is_clipped_and_the_weights_decide_about_the_rest(
    noise: float, beyond: float, low: bool
) -> None:
    """Two thrusts without limits lie that far beyond a common limit of the vehicle, lambda is 0.6."""
    limits = LimitSettings(thrust_noise_n=noise)
    controller, tick = HybridController(ControllerConfig(barriers=False, limits=limits)), random_tick(RNG(3), 2)
    controller.reset()
    pack(controller, *tick, share=0.6, last=LAST)
    free = controller.engine.data.free.copy()
    order = np.sort(free)
    bound = order[1] + beyond if low else order[-2] - beyond
    window = (bound, 1e3) if low else (-1e3, bound)
    controller.reset()
    pack(controller, *tick, share=0.6, last=LAST, window=window)
    np.testing.assert_allclose(controller.engine.data.free, free, atol=1e-9)
    p, *_ = dense(controller)
    excess = np.clip(free, *window) - free
    fading = np.maximum(5.0 * noise - np.abs(excess), 0.0) / 4.0
    centre = free + 0.6 * np.sign(excess) * np.minimum(np.abs(excess), fading)
    root = np.linalg.cholesky(p[:6, :6]).T
    expected = lsq_linear(root, root @ centre, window, method="bvls", tol=1e-14).x
    np.testing.assert_allclose(exact_thrusts(controller), expected, atol=1e-6)
    if np.abs(excess).max() <= noise:
        pack(controller, *tick, share=1.0, last=LAST, window=window)
        free = controller.engine.data.free
        if np.abs(np.clip(free, *window) - free).max() <= noise:
            np.testing.assert_allclose(exact_thrusts(controller), np.clip(free, *window), atol=1e-6)


def test_no_noise_is_clipped_off_the_wall_at_a_reported_limit_or_with_redundant_rotors() -> None:
    config, tick = ControllerConfig(barriers=False), random_tick(RNG(3), 2)

    def centre(config: ControllerConfig, share: float, reported: bool) -> tuple[np.ndarray, np.ndarray]:
        """Thrusts without limits and the program's centre, one rotor 0.3 N beyond its limit."""
        controller = HybridController(config)
        count, data = config.vehicle.geometry.count, controller.engine.data
        pack(controller, *tick, share=share, last=np.full(count, 11.3))
        limit = np.full(count, 1e4)
        limit[0] = data.free[0] - 0.3
        controller.reset()
        pack(controller, *tick, share=share, last=np.full(count, 11.3))
        controller.setpoints.step.inputs["thrust_high"][:] = limit
        if not reported:
            controller.setpoints.step.inputs["thrust_ceiling"][:] = limit
        evaluate_law(controller.setpoints, controller.problem.values)
        return data.free.copy(), data.unlimited[:count].copy()

    octorotor = replace(config, vehicle=ibvs_qp.preset("octorotor_qp").controller.vehicle)
    free, clipped = centre(config, 1.0, reported=False)
    assert free[0] - clipped[0] == pytest.approx(0.3, abs=0.01)
    for own, share, reported in ((config, 0.0, False), (config, 1.0, True), (octorotor, 1.0, False)):
        free, same = centre(own, share, reported)
        np.testing.assert_array_equal(same, free)


def test_a_clipped_thrust_is_reported_as_given_up() -> None:
    """A push of 30.5 N without noise, just beyond the reach of 30.4 N."""
    config = ControllerConfig(reach_check=False)
    controller, vehicle = HybridController(config), SmallVehicle(config, distance=0.005)
    reference = Reference(push_force=30.5, standoff=0.02, contact=True, lines=line_references(1))
    for _ in range(2000):
        command = controller.step(vehicle.measure(count=1), reference)
        vehicle.fly(command.thrusts)
    free = controller.engine.data.free
    lost = control_effectiveness(config.vehicle.geometry) @ (free - command.thrusts)
    assert not command.active_limits and command.thrusts.min() == pytest.approx(config.vehicle.thrust_min[0], abs=1e-3)
    assert np.abs(lost).max() > 0.02
    np.testing.assert_allclose(command.unallocated_wrench, lost, atol=1e-9)


def optimal_cost(controller: HybridController, row: int, side: str, change: float) -> float:
    """Least weighted squares, by task rows and slack, where one bound is moved by `change`."""
    data = controller.engine.data
    bounds = {"lower": data.lower.copy(), "upper": data.upper.copy()}
    bounds[side][row] += change
    solution = controller.engine.exact.solve(data.p, data.q, data.a, bounds["lower"], bounds["upper"])
    assert solution is not None
    achieved, asked, weights = controller.problem.report(data.point, solution[0][:6])
    cost = 0.5 * float(weights @ (achieved - asked) ** 2)
    return cost + 0.5 * float(data.hessian().diagonal()[6:] @ solution[0][6:] ** 2)


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("tilt_roll", "upper"),
        ("tilt_pitch", "lower"),
        ("push_ceiling", "upper"),
        (f"thrust_{TAROT_T960.names[2]}", "lower"),
    ],
)
def test_the_price_of_every_kind_of_limit_is_the_slope_of_the_cost(name: str, side: str) -> None:
    """The cost is worked out from weights, residuals, prices and slack: as the documents say it, halves and all."""
    controller = HybridController()
    controller.step(measured(0), Reference())
    data, row = controller.engine.data, controller.problem.row_names.index(name)
    at, sign = float(data.rows()[row, :6] @ data.free), 1.0 if side == "upper" else -1.0
    tight = data.upper if side == "upper" else data.lower
    tight[row] = at - sign * 0.5  # half a unit away from what the tasks want
    solution = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
    assert solution is not None
    (active,) = [limit for limit in active_limits(controller.problem, solution.x, solution.y) if limit.name == name]
    assert active.side == side
    step = 1e-3
    slope = (optimal_cost(controller, row, side, step) - optimal_cost(controller, row, side, -step)) / (2.0 * step)
    assert active.price == pytest.approx(-sign * slope, rel=1e-4)
    slot = controller.problem.row_slack[row]
    slack_weight = data.hessian()[slot, slot] if slot >= 0 else 0.0
    assert active.slack * slack_weight == pytest.approx(active.price if slack_weight else 0.0, rel=1e-6)


newtons = st.floats(-100.0, 200.0)
six = st.lists(newtons, min_size=6, max_size=6).map(np.array)


@settings(max_examples=300)
@given(last=st.lists(st.floats(FLOOR, CEILING), min_size=6, max_size=6).map(np.array), lower=six, upper=six)
def test_the_thrust_window_is_never_empty_and_respects_box_and_rate(
    last: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> None:
    step, floor, ceiling = 2.0, np.full(6, FLOOR), np.full(6, CEILING)
    low, high = thrust_window(last, lower, upper, step, floor, ceiling)
    assert (high - low >= 1e-3 - 1e-9).all()  # ten times what OSQP takes for an equality
    assert (low >= last - step - 1e-9).all() and (high <= last + step + 1e-9).all()
    assert (low >= FLOOR).all() and (high <= CEILING).all()
    fine = lower <= upper - LEAST_GAP
    reachable = fine & (lower <= last + step - LEAST_GAP) & (upper >= last - step + LEAST_GAP)
    reachable &= (upper >= FLOOR + LEAST_GAP) & (lower <= CEILING - LEAST_GAP)
    assert (low[reachable] >= lower[reachable] - 1e-9).all()
    assert (high[reachable] <= upper[reachable] + 1e-9).all()


def test_a_limit_lowered_in_flight_is_approached_at_the_rate_limit() -> None:
    last, floor, ceiling = np.full(6, 20.0), np.full(6, FLOOR), np.full(6, CEILING)
    for _ in range(10):
        low, high = thrust_window(last, floor, np.full(6, 8.0), 2.0, floor, ceiling)
        assert (high >= last - 2.0).all() and (low <= high).all()
        last = high
    np.testing.assert_allclose(last, 8.0, atol=2 * LEAST_GAP)


def test_camera_axes_of_the_plane_parameter(free: HybridController) -> None:
    """The plane handed to the rows is that of the filtered normal and distance: inverse depth along the axis."""
    measurement, reference = random_tick(np.random.default_rng(0), 1)
    free.reset()
    pack(free, measurement, reference)
    plane = free.setpoints.plane
    np.testing.assert_allclose(plane, measurement.plane, rtol=0.02, atol=0.02)
    np.testing.assert_allclose(R_BODY_CAMERA @ plane[:3] / np.linalg.norm(plane[:3]), free.setpoints.normal, atol=1e-9)
