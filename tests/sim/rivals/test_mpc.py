"""Prediction: its matrices by finite differences of an integration, and no offset under a constant disturbance."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from controller_scenes import Wall, line_references, measured, random_tick
from scipy.integrate import solve_ivp

from ibvs_qp.config import ControllerConfig
from ibvs_qp.measurement import Measurement, Reference
from sim.rivals.mpc import MpcController

#: States of the prediction: displacement and twist of six, and six thrusts.
STATES, ROTORS = 18, 6


@pytest.fixture(scope="module")
def controller() -> MpcController:
    law = MpcController(ControllerConfig())
    rng = np.random.default_rng(1)
    for tick in range(3):
        law.step(*random_tick(rng, 2, tick))
    return law


def matrices(law: MpcController) -> tuple[np.ndarray, ...]:
    """Generator, rows, start, offsets and weights of the last tick."""
    program, (generator, rows, start, offsets, weights) = law.program, law.setpoints.step.extra
    full = []
    for pattern, values in ((program.generator, generator), (program.rows, rows)):
        columns, row = pattern.get_ccs()[0], pattern.row()
        dense = np.zeros(pattern.shape)
        dense[row, np.repeat(np.arange(pattern.shape[1]), np.diff(columns))] = values
        full.append(dense)
    return *full, start, offsets.reshape(3, -1).T, weights


def integrated_cost(law: MpcController, commands: np.ndarray) -> float:
    """Cost of commands [N], (blocks, rotors), by integrating the linear model with a Runge-Kutta method."""
    generator, rows, start, offsets, weights = matrices(law)
    settings = law.settings
    owner = np.repeat(np.arange(len(settings.blocks)), settings.blocks)
    state, time, total = start, 0.0, 0.0
    steps = settings.steps(law.config.tick_s)
    for k, step in enumerate(steps):
        forced = np.concatenate((commands[owner[k]], [1.0]))
        flow = solve_ivp(
            lambda _, x, forced=forced: generator[:STATES] @ np.concatenate((x, forced)), (0.0, step), state,
            rtol=1e-10, atol=1e-12,
        )  # fmt: skip
        state, time = flow.y[:, -1], time + step
        error = rows @ np.concatenate((state, forced[:-1])) + offsets @ (1.0, time, 0.5 * time**2)
        total += 0.5 * step * (settings.terminal if k == len(steps) - 1 else 1.0) * float(weights @ error**2)
    before = np.vstack((law.setpoints.step.inputs["thrust_last"], commands[:-1]))
    return total + 0.5 * settings.thrust_change * settings.step_s * float(((commands - before) ** 2).sum())


def test_hessian_and_gradient_are_those_of_the_integrated_model(controller):
    p, q, *_ = controller.values
    size = len(q)
    hessian = np.zeros((size, size))
    hessian[controller.program.p_pattern.tocoo().row, controller.program.p_pattern.tocoo().col] = p
    hessian = hessian + np.triu(hessian, 1).T

    def cost(flat: np.ndarray) -> float:
        return integrated_cost(controller, flat.reshape(-1, ROTORS))

    at, rng = np.full(size, 10.0), np.random.default_rng(0)
    # The program is scaled: one direction fixes the scale, the others must agree with it. The cost is quadratic, so
    # central differences are exact for any step.
    slopes, curvatures = [], []
    for _ in range(6):
        d = rng.normal(size=size)
        up, middle, down = cost(at + d), cost(at), cost(at - d)
        slopes.append(0.5 * (up - down) / (d @ (hessian @ at + q)))
        curvatures.append((up - 2.0 * middle + down) / (d @ hessian @ d))
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-4)
    np.testing.assert_allclose(curvatures, slopes[0], rtol=1e-4)


def test_commands_stay_within_the_window_of_the_tick():
    law, rng, last = MpcController(ControllerConfig()), np.random.default_rng(2), None
    for tick in range(20):
        command = law.step(*random_tick(rng, 2, tick))
        if last is not None:
            assert np.abs(command.thrusts - last).max() <= 2.0 + 1e-9
        assert command.thrusts.min() >= 1.2 and command.thrusts.max() <= 52.56
        last = command.thrusts


@pytest.mark.parametrize(("felt", "distance"), [(4.0, 0.0), (0.0, 0.2)], ids=["contact", "approach"])
def test_along_the_normal_the_commands_follow_the_shipped_law(felt, distance):
    law = MpcController(ControllerConfig())
    wrench = np.array([-felt, 0.0, 0.0, 0.0, 0.0, 0.0])
    for tick in range(400):
        seen = measured(tick, contact_wrench=wrench, plane=Wall(np.array([1.0, 0.0, 0.0, 0.0]), distance).plane)
        law.step(seen, Reference(push_force=6.0, contact=True))
    setpoints = law.setpoints
    weight = setpoints.step.outputs["contact_weight"][0]
    wanted = weight * setpoints.push_command + (1.0 - weight) * setpoints.standoff_command
    wrench = setpoints.effectiveness @ setpoints.last + setpoints.bias_wrench
    assert (weight > 0.9) == (felt > 0.0)
    assert wanted > 2.0
    assert setpoints.normal @ wrench[:3] == pytest.approx(wanted, rel=0.1)  # weighted against the other errors


class SteadyVehicle:
    """A level point mass in front of a wall with rotor lag, pushed by a constant force that nothing measures."""

    def __init__(self, law: MpcController, force: np.ndarray) -> None:
        self.law, self.force = law, force
        self.position, self.velocity = np.array([0.0, 0.02, 0.0]), np.zeros(3)  # right of its line [m]
        self.thrusts = np.full(6, 11.3)

    def tick(self, index: int) -> None:
        """One control period, seen by sensors without noise."""
        specific = (self.law.setpoints.effectiveness @ self.thrusts)[:3] / 6.0 + self.force / 6.0
        self.thrusts += (self.law.step(*self.seen(index, specific)).thrusts - self.thrusts) * 0.004 / 0.0575
        wrench = self.law.setpoints.effectiveness @ self.thrusts
        self.velocity += 0.004 * ((wrench[:3] + self.force) / 6.0 + np.array([0.0, 0.0, 9.81]))
        self.position += 0.004 * self.velocity

    def seen(self, index: int, specific: np.ndarray) -> tuple[Measurement, Reference]:
        from ibvs_qp.measurement import HORIZONTAL, VERTICAL

        wall = Wall(np.array([1.0, 0.0, 0.0, 0.0]), 0.3 - self.position[0])
        depth = 0.5 + wall.distance
        lines = (
            wall.line(0.05 - self.position[2], 0.5 * np.pi, HORIZONTAL),
            wall.line(-0.05 - self.position[1], 0.0, VERTICAL),
        )
        seen = measured(
            index, specific_force=specific, velocity=self.velocity.copy(), lines=lines, plane=wall.plane,
        )  # fmt: skip
        return seen, Reference(standoff=0.3, lines=line_references(2, depth))


@pytest.mark.slow
@pytest.mark.parametrize("force", [(0.0, 2.0, 0.0), (0.0, 0.0, 3.0)], ids=["right", "down"])
def test_a_constant_force_leaves_no_offset(force):
    vehicle = SteadyVehicle(MpcController(ControllerConfig()), np.array(force))
    worst = 0.0
    for index in range(1500):
        vehicle.tick(index)
        if index < 250:
            worst = max(worst, float(np.abs(vehicle.position[1:]).max()))
    assert worst > 2e-3  # the force moved it
    assert np.abs(vehicle.position[1:]).max() < 5e-4


def test_settings_out_of_range_are_refused():
    from ibvs_qp.config.errors import ConfigError

    with pytest.raises(ConfigError):
        dataclasses.replace(MpcController(ControllerConfig()).settings, terminal=0.0)
