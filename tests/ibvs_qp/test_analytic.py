"""The paper's law, corrected: against the law written out by hand, and details that keep it stable."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import (
    CEILING,
    FLOOR,
    TICK_NS,
    Wall,
    attitude,
    line_references,
    measured,
    moved_by_turn,
    random_tick,
    without_rotors,
)
from law_only import evaluate_law
from small_vehicle import SmallVehicle

from allocation import control_effectiveness
from ibvs_qp.analytic import PaperController, analytic_setpoints, analytic_thrusts, analytic_wrench
from ibvs_qp.command import Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.frames import camera_twist_matrix
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Reference
from ibvs_qp.model.interaction_matrix import endpoint_line_row, line_interaction_matrix
from ibvs_qp.model.setpoints import Setpoints

CONFIG = ControllerConfig()
#: For the law written out by hand, and with the rows of its lines as printed.
PLAIN = without_rotors(CONFIG)
PRINTED = replace(PLAIN, analytic_line_point="centre", analytic_angle_row=True)
MASS = CONFIG.vehicle.mass_kg
MASSES = np.array([MASS] * 3 + list(CONFIG.vehicle.inertia_kg_m2))


def terms_of(seed: int, lines: int, weight: float, config: ControllerConfig = CONFIG) -> Setpoints:
    setpoints = analytic_setpoints(config)
    setpoints.update(*random_tick(np.random.default_rng(seed), lines, lean=0.2 * (seed % 2)))
    setpoints.step.inputs["contact_weight"][0] = weight
    evaluate_law(setpoints)
    return setpoints


def stacked(setpoints: Setpoints) -> tuple[np.ndarray, np.ndarray]:
    """L in body axes and K_p e + K_d de + K_i int e: a rho row per line and one angle row."""
    gains, rows, feedback = PLAIN.gains, [], []
    twist = camera_twist_matrix(np.array(CONFIG.vehicle.camera_position_m))
    for line in setpoints.lines:
        rows.append(line_interaction_matrix(line.rho, line.theta, setpoints.plane)[0] @ twist)
        feedback.append(gains.line_kp * line.rho_error + gains.line_kd * line.rho_rate + gains.line_ki * line.integral)
    level = sorted(setpoints.lines, key=lambda line: abs(line.rho))[0]
    rows.append(line_interaction_matrix(level.rho, level.theta, setpoints.plane)[1] @ twist)
    feedback.append(gains.theta_kp * level.angle_error + gains.theta_kd * level.angle_rate)
    return np.array(rows), np.array(feedback)


@pytest.mark.parametrize("lines", [0, 1, 2])
@pytest.mark.parametrize("weight", [0.0, 0.4, 1.0])
def test_the_wrench_is_the_law_by_hand(lines: int, weight: float) -> None:
    for seed in range(15):
        setpoints = terms_of(seed, lines, weight, PRINTED)
        normal = setpoints.normal
        null = np.concatenate(
            (
                normal * (1.0 - weight) * setpoints.standoff_command / MASS
                + setpoints.right * setpoints.velocity_command[0]
                + setpoints.down * setpoints.velocity_command[1],
                setpoints.angular,
            )
        )
        acceleration = null
        if lines:
            matrix, feedback = stacked(setpoints)
            inverse = np.linalg.pinv(matrix, rcond=0.05)
            acceleration = -inverse @ feedback + (np.eye(6) - inverse @ matrix) @ null
        servo = MASSES * acceleration
        tip = MASSES[:3] * (acceleration[:3] + moved_by_turn(setpoints, acceleration[3:]))
        selection = weight * np.outer(normal, normal)
        force = normal * setpoints.push_command
        expected = servo + np.concatenate((selection @ (force - tip), np.zeros(3)))
        np.testing.assert_allclose(analytic_wrench(setpoints), expected, atol=1e-8)


def test_full_contact_keeps_the_force_command() -> None:
    """Lambda' = lambda n n^T: along n the push alone accelerates the tip. The printed R diag(0,0,lambda) cancels it."""
    for seed in range(10):
        setpoints = terms_of(seed, 2, 1.0)
        wrench = analytic_wrench(setpoints)
        along = setpoints.normal @ (wrench[:3] + MASS * moved_by_turn(setpoints, wrench[3:] / MASSES[3:]))
        assert along == pytest.approx(setpoints.push_command, abs=1e-9)
        none = terms_of(seed, 0, 0.0)
        assert none.normal @ analytic_wrench(none)[:3] == pytest.approx(none.standoff_command, abs=1e-9)


def test_one_angle_row_only() -> None:
    """Two lines that disagree about the roll by a degree do not pitch the vehicle; stacked as printed they would."""
    wall = Wall(attitude(), 0.0)
    seen = (wall.line(0.05, 0.5 * math.pi + 0.02, HORIZONTAL), wall.line(-0.12, -0.02, VERTICAL))
    setpoints = analytic_setpoints(PRINTED)
    setpoints.update(measured(0, plane=wall.plane, lines=seen), Reference(lines=line_references(2), contact=True))
    assert len(setpoints.lines) == 2
    matrix, feedback = stacked(setpoints)
    assert matrix.shape == (3, 6)
    both = np.vstack((matrix, setpoints.lines[1].matrix[1]))
    gains = PLAIN.gains
    doubled = np.append(feedback, gains.theta_kp * setpoints.lines[1].angle_error + gains.theta_kd * 0.0)
    printed = -np.linalg.pinv(both) @ doubled
    assert abs(analytic_wrench(setpoints)[4] / MASSES[4]) < 0.1 * abs(printed[4])


def test_thrusts_are_the_pseudo_inverse_of_the_whole_wrench() -> None:
    matrix = control_effectiveness(CONFIG.vehicle.geometry)
    for seed in range(10):
        setpoints = terms_of(seed, seed % 3, 0.5)
        wrench = matrix @ analytic_thrusts(setpoints)
        np.testing.assert_allclose(wrench + setpoints.bias_wrench, analytic_wrench(setpoints), atol=1e-8)


def test_line_rates_are_those_of_the_rows() -> None:
    """The rates, written out without arrays, against the interaction matrix times the twist."""
    for seed in range(10):
        measurement, reference = random_tick(np.random.default_rng(seed), 2)
        setpoints = analytic_setpoints(CONFIG)
        setpoints.update(measurement, reference)
        velocity = measurement.velocity - setpoints.normal * float(setpoints.normal @ measurement.velocity)
        wanted = reference.velocity[0] * setpoints.right + reference.velocity[1] * setpoints.down
        twist = np.concatenate((velocity, measurement.angular_velocity))
        for line in setpoints.lines:
            matrix = line.matrix
            row = matrix[0] + (line.tip[0] * math.sin(line.theta) - line.tip[1] * math.cos(line.theta)) * matrix[1]
            assert line.rate == pytest.approx(row @ twist - row[:3] @ wanted, abs=1e-9)
            assert line.rho_rate == pytest.approx(matrix[0] @ twist - matrix[0][:3] @ wanted, abs=1e-9)
            assert line.angle_rate == pytest.approx(matrix[1] @ twist, abs=1e-9)


def test_clipping_is_reported_with_rotor_side_and_amount() -> None:
    controller, limit = PaperController(), np.full(6, CEILING)
    limit[3] = 9.0
    vehicle = SmallVehicle(controller.config)
    for _ in range(30):
        command = controller.step(vehicle.measure(thrust_max=limit), Reference(standoff=0.1))
        vehicle.fly(command.thrusts)
    (active,) = command.active_limits
    assert active.name == f"thrust_{CONFIG.vehicle.geometry.names[3]}" and active.side == "upper"
    assert command.thrusts[3] == pytest.approx(9.0, abs=2e-3)
    matrix = control_effectiveness(CONFIG.vehicle.geometry)
    np.testing.assert_allclose(command.unallocated_wrench, matrix[:, 3] * active.slack, atol=1e-9)
    assert command.outcome is Outcome.SOLVED


def test_free_commands_clip_nothing_and_respect_box_and_rate() -> None:
    controller, vehicle = PaperController(), SmallVehicle(CONFIG)
    last = None
    for tick in range(400):
        jump = np.array([0.3, -0.3]) * (tick > 200)
        command = controller.step(vehicle.measure(0), Reference(standoff=0.1, velocity=jump))
        assert (command.thrusts >= FLOOR).all() and (command.thrusts <= CEILING).all()
        if last is not None:
            assert np.abs(command.thrusts - last).max() <= 500.0 * 0.004 + 1e-9
        if 100 < tick < 200:
            assert command.active_limits == () and np.abs(command.unallocated_wrench).max() < 1e-9
        last = command.thrusts
        vehicle.fly(command.thrusts)


def test_holds_a_push_in_a_small_closed_loop() -> None:
    controller, vehicle = PaperController(), SmallVehicle(CONFIG, distance=0.05)
    pushes = []
    for tick in range(2000):
        wish = Reference(push_force=5.0, contact=tick > 200, standoff=0.05, lines=line_references(2))
        command = controller.step(vehicle.measure(), wish)
        vehicle.fly(command.thrusts)
        pushes.append(-vehicle.contact[0])
    assert command.mode == "contact"
    assert np.mean(pushes[-250:]) == pytest.approx(5.0, abs=0.3)
    assert np.linalg.norm(vehicle.attitude.as_rotvec()) < math.radians(1.0)


def test_lines_have_no_standing_error_in_contact() -> None:
    """The push must not leak into the plane of the wall through the null space of the lines."""
    controller, vehicle = PaperController(), SmallVehicle(CONFIG, distance=0.05)
    vehicle.friction = 0.0  # nothing holds the tip but the law
    errors = []
    for tick in range(3000):
        reference = Reference(push_force=5.0, contact=tick > 200, standoff=0.05, lines=line_references(2))
        command = controller.step(vehicle.measure(), reference)
        vehicle.fly(command.thrusts)
        errors.append([line.rho_error / controller.setpoints.plane[2] for line in controller.setpoints.lines])
    assert command.mode == "contact"
    metres = np.abs(np.mean(errors[-500:], axis=0))  # 1 / plane[2] is the depth on the optical axis
    print(f"standing line errors {metres}")
    assert metres.max() < 2e-4


@pytest.mark.parametrize("allocator", ["clip", "sequential", "box"])
def test_every_allocator_stays_within_the_window(allocator: str) -> None:
    controller, last = PaperController(replace(CONFIG, allocator=allocator)), None
    clipped = PaperController(CONFIG)
    for tick in range(40):
        measurement, reference = random_tick(np.random.default_rng(tick), 2, tick)
        reference = replace(reference, push_force=35.0, contact=True)
        command = controller.step(measurement, reference)
        plain = clipped.step(measurement, reference)
        setpoints = controller.setpoints
        assert (command.thrusts >= setpoints.lower).all() and (command.thrusts <= setpoints.upper).all()
        free = analytic_thrusts(setpoints)
        beyond = ((free < setpoints.lower - 1e-9) | (free > setpoints.upper + 1e-9)).any()
        assert bool(command.active_limits) == beyond
        matrix = control_effectiveness(CONFIG.vehicle.geometry)
        np.testing.assert_allclose(command.unallocated_wrench, matrix @ (free - command.thrusts), atol=1e-9)
        if beyond and tick == 0 and allocator != "clip":
            assert np.abs(command.thrusts - plain.thrusts).max() > 1e-3
        last = command
    assert last is not None


def test_an_unknown_allocator_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"allocator = 'best'.*clip, sequential, box"):
        replace(CONFIG, allocator="best")


def test_reset_repeats_bit_identically_and_modes_are_named() -> None:
    controller = PaperController()
    ticks = [random_tick(np.random.default_rng(tick), tick % 3, tick) for tick in range(40)]
    first = [controller.step(*tick).thrusts for tick in ticks]
    controller.reset()
    np.testing.assert_array_equal(first, [controller.step(*tick).thrusts for tick in ticks])
    controller.reset()
    assert controller.step(measured(0), Reference()).mode == "free"
    assert controller.step(measured(1), Reference(contact=True)).mode == "approach"
    broken = controller.step(replace(measured(2), stamp_ns=TICK_NS), Reference())
    assert broken.mode == "hold" and broken.outcome is Outcome.HOLD


@pytest.mark.parametrize("point", ["centre", "tip"])
@pytest.mark.parametrize("angle", [True, False])
def test_the_switches_of_the_line_rows(point: str, angle: bool) -> None:
    """Unlimited thrusts give every followed error the image acceleration of the law; roll follows level flight."""
    config = replace(PLAIN, analytic_line_point=point, analytic_angle_row=angle)
    setpoints = analytic_setpoints(config)
    setpoints.update(*random_tick(np.random.default_rng(4), 2))
    setpoints.step.inputs["contact_weight"][0] = 0.0
    evaluate_law(setpoints)
    acceleration = analytic_wrench(setpoints) / MASSES
    for line in setpoints.lines:
        row = endpoint_line_row(line.matrix, line.theta, line.tip) if point == "tip" else line.matrix[0]
        error, rate = (line.error, line.rate) if point == "tip" else (line.rho_error, line.rho_rate)
        gains = config.gains
        wanted = -(gains.line_kp * error + gains.line_kd * rate + gains.line_ki * line.integral)
        assert line.analytic_command == pytest.approx(wanted, abs=1e-12)
        assert row @ acceleration == pytest.approx(wanted, abs=1e-9)
    level = min(setpoints.lines, key=lambda line: abs(line.rho))
    follows = level.matrix[1] @ acceleration == pytest.approx(level.angle_command, abs=1e-9)
    assert follows == angle
