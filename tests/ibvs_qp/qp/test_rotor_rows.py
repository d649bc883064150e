"""The tick against the linear-quadratic regulator of the motors' lag and the last command."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from controller_scenes import Wall, attitude, exact_thrusts, line_references, measured, pack
from law_only import evaluate_law
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import brentq

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig, VehicleParams, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import HORIZONTAL, Reference
from ibvs_qp.model.interaction_matrix import endpoint_line_row
from ibvs_qp.symbolic.signals import places

TICK_S, LAG_S = 0.004, VehicleParams().motor_lag_s


@dataclass(frozen=True)
class Regulator:
    """u = k_u u_last - (1 - k_u) (k_p e + k_d (e' + T a)): the optimum of sum q_e e^2 + q_v e'^2 + (u - u_last)^2."""

    kp: float
    kd: float
    lead_s: float
    filter_s: float

    def command(self, error: float, rate: float, now: float, last: float) -> float:
        share = math.exp(-TICK_S / self.filter_s)
        return share * last - (1.0 - share) * (self.kp * error + self.kd * (rate + self.lead_s * now))


def regulator(error_weight: float, rate_weight: float) -> Regulator:
    """By the Riccati equation of e'' = a, a' = (u - a) / tau over one tick, with the last command as a state."""
    continuous = np.zeros((4, 4))
    continuous[0, 1] = continuous[1, 2] = 1.0
    continuous[2, 2:] = -1.0 / LAG_S, 1.0 / LAG_S
    step = expm(continuous * TICK_S)
    transition, change = step, step[:, 3:]  # the command is the last one and its change
    cost = np.diag([error_weight, rate_weight, 0.0, 0.0])
    riccati = solve_discrete_are(transition, change, cost, np.eye(1), balanced=True)
    gain = np.linalg.solve(1.0 + change.T @ riccati @ change, change.T @ riccati @ transition)[0]
    forgotten = gain[3]  # 1 - k_u
    kp, kd, ka = gain[:3] / forgotten
    return Regulator(kp=kp, kd=kd, lead_s=ka / kd, filter_s=-TICK_S / math.log(1.0 - forgotten))


def speed_regulator(rate_weight: float) -> Regulator:
    """The same without a position; kd is the gain of the velocity."""
    continuous = np.zeros((3, 3))
    continuous[0, 1] = 1.0
    continuous[1, 1:] = -1.0 / LAG_S, 1.0 / LAG_S
    step = expm(continuous * TICK_S)
    riccati = solve_discrete_are(step, step[:, 2:], np.diag([rate_weight, 0.0, 0.0]), np.eye(1))
    change = step[:, 2:]
    gain = np.linalg.solve(1.0 + change.T @ riccati @ change, change.T @ riccati @ step)[0]
    return Regulator(kp=0.0, kd=gain[0] / gain[2], lead_s=gain[1] / gain[0], filter_s=-TICK_S / math.log(1.0 - gain[2]))


def regulator_with_lead(lead_s: float, rate_weight: float) -> Regulator:
    """One of a given lead: a program has one lead for roll, pitch and yaw."""

    def excess(exponent: float) -> float:
        return regulator(math.exp(exponent), rate_weight).lead_s - lead_s

    return regulator(math.exp(brentq(excess, -4.0, 13.0, xtol=1e-14)), rate_weight)


def test_a_riccati_regulator_is_a_lead_and_a_filter() -> None:
    """Its gains against Bellman's equation: no other command costs less over a long horizon."""
    best = regulator(3e3, 30.0)

    def cost(law: Regulator) -> float:
        error, rate, now, last, total = 1.0, 0.5, -0.3, 0.2, 0.0
        step = expm(TICK_S * np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, -1 / LAG_S, 1 / LAG_S], [0, 0, 0, 0]]))
        for _ in range(3000):
            command = law.command(error, rate, now, last)
            total += 3e3 * error**2 + 30.0 * rate**2 + (command - last) ** 2
            error, rate, now, last = step @ np.array([error, rate, now, command])
        return total

    for name in ("kp", "kd", "lead_s", "filter_s"):
        for factor in (0.97, 1.03):
            other = dataclasses.replace(best, **{name: getattr(best, name) * factor})
            assert cost(other) > cost(best)


LINE, LEVEL, PUSH, SPEED = regulator(300.0, 15.0), regulator(900.0, 8.0), regulator(200.0, 20.0), speed_regulator(40.0)
YAW = regulator_with_lead(LEVEL.lead_s, 4.0)
#: Stiffness of a wall that is none [N/m].
SOFT = 1e-8
AXES = ("roll", "pitch", "yaw", "right", "down", "line", "push")


def lag_controller() -> HybridController:
    """The program with these regulators in its gains, and nothing else that asks for thrust."""
    config = ControllerConfig()
    mass = config.vehicle.mass_kg
    gains = dataclasses.replace(
        config.gains,
        line_kp=LINE.kp,
        line_kd=LINE.kd,
        line_ki=0.0,
        line_lead_s=LINE.lead_s,
        line_filter_s=LINE.filter_s,
        attitude_kp=LEVEL.kp,
        attitude_kd=LEVEL.kd,
        attitude_filter_s=LEVEL.filter_s,
        yaw_kp=YAW.kp,
        yaw_kd=YAW.kd,
        yaw_filter_s=YAW.filter_s,
        velocity_kp=SPEED.kd,
        velocity_ki=0.0,
        velocity_lead_s=SPEED.lead_s,
        velocity_filter_s=SPEED.filter_s,
        force_ksp=mass * PUSH.kp,
        force_ksd=mass * PUSH.kd,
        force_kfp=0.0,
        force_kfi=0.0,
        push_lead_s=PUSH.lead_s,
        push_filter_s=PUSH.filter_s,
        body_rotation_gain=1.0,
    )
    rate = dataclasses.replace(config.angular_rate, lead_s=LEVEL.lead_s)
    weights = dataclasses.replace(Weights(), line_angle=0.0)
    for name in ("effort", "smoothness"):  # below their range, which keeps programs of more than six rotors convex
        object.__setattr__(weights, name, 0.0)
    # Without feed-forward the observer of the external wrench rests in contact; the lead has that of the tick before.
    changes = {
        "gains": gains,
        "angular_rate": rate,
        "weights": weights,
        "barriers": False,
        "contact_feedforward": False,
        "brush": dataclasses.replace(config.brush, damping_n_s_m=0.0),
    }
    return HybridController(dataclasses.replace(config, **changes))


@pytest.fixture(scope="module")
def controller() -> HybridController:
    return lag_controller()


@pytest.mark.parametrize(
    ("axis", "guided"),
    [(axis, guided) for guided in (False, True) for axis in (*AXES, "all") if axis != ("down" if guided else "line")],
)
def test_without_active_limits_the_tick_is_the_regulator(controller: HybridController, axis: str, guided: bool) -> None:
    """With a level line it takes the place of the velocity down."""
    rng = np.random.default_rng(AXES.index(axis) if axis in AXES else 99)
    moved = {name: float(rng.normal()) if axis in (name, "all") else 0.0 for name in AXES}
    vehicle, setpoints = controller.config.vehicle, controller.setpoints
    controller.reset()
    wall = Wall(quaternion := attitude(0.02 * moved["roll"], 0.02 * moved["pitch"]), 0.02, 0.05 * moved["yaw"])
    lines = (wall.line(0.05 + 0.01 * moved["line"], 0.5 * math.pi, HORIZONTAL),) if guided else ()
    tick = measured(
        0,
        attitude=quaternion,
        angular_velocity=0.05 * np.array([moved["roll"], moved["pitch"], moved["yaw"]]),
        plane=wall.plane,
        lines=lines,
        velocity=0.05 * (moved["right"] * wall.right + (moved["down"] + moved["line"]) * wall.down),
    )
    reference = Reference(lines=line_references(1) if guided else (), contact=True, push_force=0.0)
    pack(controller, tick, reference, share=1.0)
    now, last = thrusts_moved(controller, moved)
    inputs = setpoints.step.inputs
    # A wall so soft that its reaction is none, and sensors so noisy that the filter of the push believes its model.
    inputs["contact.touching"][0], inputs["contact.stiffness"][0] = 1.0, SOFT
    inputs["contact.push_noise"][0] = inputs["contact.acceleration_noise"][0] = 1e6
    begun = [-0.004 * moved["push"] * SOFT, -0.03 * moved["push"], 0.0, 0.0]
    state(controller, "push_kalman.begun")[:], state(controller, "push_kalman.state")[:] = 1.0, begun
    state(controller, "push_kalman.covariance")[:] = 0.0
    inertia = np.array([vehicle.mass_kg] * 3 + list(vehicle.inertia_kg_m2))
    per_thrust = control_effectiveness(vehicle.geometry) / inertia[:, None]
    for _ in range(2):  # the bias wrench first; then a rate estimate that the gyro confirms
        evaluate_law(setpoints, controller.problem.values)
        given, gone = (per_thrust @ thrusts + setpoints.bias_wrench / inertia for thrusts in (now, last))
        state(controller, "angular_rate")[:] = (
            inputs["angular_velocity"] - TICK_S * setpoints.step.outputs["angular_acceleration"]
        )
    expected = regulated(controller, quaternion, wall, given, gone, penetration=(begun[0] / SOFT, begun[1]))
    assert exact_thrusts(controller) == pytest.approx(
        np.linalg.solve(per_thrust, expected - setpoints.bias_wrench / inertia), abs=1e-9
    )


def state(controller: HybridController, name: str) -> np.ndarray:
    """A state of the law at the packed tick: a view."""
    signals = controller.setpoints.model.signals
    states = controller.setpoints.step.point[sum(symbol.numel() for symbol in signals.inputs.values()) :]
    return states[places(signals.states)[name]]


def thrusts_moved(controller: HybridController, moved: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Lagged thrusts of this tick and the last command, (6,) each, as the law's states."""
    setpoints, vehicle = controller.setpoints, controller.config.vehicle
    wrench = np.array([0.0, moved["right"], moved["down"] + moved["line"], moved["roll"], moved["pitch"], moved["yaw"]])
    away = np.linalg.solve(control_effectiveness(vehicle.geometry), wrench * (0.0, 2.0, 2.0, 0.2, 0.2, 0.2))
    hover = np.full(6, 11.3)
    before, last = hover + away, hover - 0.7 * away
    state(controller, "motor_thrust")[:], state(controller, "motor_ready")[:] = before, 1.0
    inputs = setpoints.step.inputs
    inputs["thrust_last"][:], inputs["commanded"][0], inputs["thrust_change"][:] = last, 1.0, 0.0
    lag = np.where(last > before, vehicle.motor_lag_up_s, vehicle.motor_lag_down_s)
    return before + (1.0 - np.exp(-TICK_S / lag)) * (last - before), last


def regulated(
    controller: HybridController,
    quaternion: np.ndarray,
    wall: Wall,
    given: np.ndarray,
    gone: np.ndarray,
    penetration: tuple[float, float],
) -> np.ndarray:
    """Accelerations that the regulators command, from the states of each axis, (6,).

    Penetration and its rate are those of the tick before; the filter of the push predicts them to this one.
    """
    setpoints = controller.setpoints
    inputs = setpoints.step.inputs
    rate = inputs["angular_velocity"]
    angles = np.array([setpoints.roll, setpoints.pitch, setpoints.yaw])
    wanted = np.zeros(6)
    for axis in range(3):
        law = LEVEL if axis < 2 else YAW
        wanted[3 + axis] = law.command(angles[axis], rate[axis], given[3 + axis], gone[3 + axis])
    velocity = inputs["velocity"]
    right, down = (
        SPEED.command(0.0, direction @ velocity, direction @ given[:3], direction @ gone[:3])
        for direction in (wall.right, wall.down)
    )
    rate_now = penetration[1] + TICK_S * wall.normal @ given[:3]
    normal = -PUSH.command(
        penetration[0] + TICK_S * rate_now,
        rate_now,
        wall.normal @ given[:3],
        wall.normal @ gone[:3],
    )
    wanted[:3] = right * wall.right + down * wall.down - normal * wall.normal
    if not setpoints.lines:
        return wanted
    (line,) = setpoints.lines
    row = endpoint_line_row(line.matrix, line.theta, line.tip)
    row[:3] -= wall.normal * (row[:3] @ wall.normal)
    image = LINE.command(line.error, line.rate, row @ given, row @ gone)
    lateral = image - row[3:] @ wanted[3:] - (row[:3] @ wall.right) * right
    return wanted + np.concatenate(((lateral / (row[:3] @ wall.down) - down) * wall.down, np.zeros(3)))
