"""Every row of the program against finite differences of the geometry or a formula written out by hand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from controller_scenes import (
    Wall,
    attitude,
    dense,
    exact_thrusts,
    image_line,
    line_references,
    measured,
    moved_by_turn,
    pack,
    random_tick,
    without_rotors,
)
from law_only import evaluate_law
from scipy.spatial.transform import Rotation

from allocation import control_effectiveness
from ibvs_qp.analytic import analytic_wrench
from ibvs_qp.config import ControllerConfig, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.frames import R_BODY_CAMERA, align_line
from ibvs_qp.limits.limit import barrier_bounds
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Reference
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.vision import endpoint_line_row, line_interaction_matrix


@pytest.fixture(scope="module")
def controller() -> HybridController:
    return HybridController()


@pytest.fixture(scope="module")
def plain() -> HybridController:
    return HybridController(without_rotors())


def rows(controller: HybridController, thrusts: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """(achieved, asked, weight) of every task row of the packed program."""
    data = controller.engine.data
    achieved, asked, weights = controller.problem.report(data.point, thrusts)
    names = [row.name for row in controller.problem.task_rows]
    assert len(set(names)) == len(names)
    return {name: (achieved[i], asked[i], weights[i]) for i, name in enumerate(names)}


def accelerations(controller: HybridController, thrusts: np.ndarray) -> np.ndarray:
    """Body acceleration by Newton and Euler, from the vehicle's numbers alone."""
    vehicle, setpoints = controller.config.vehicle, controller.setpoints
    wrench = control_effectiveness(vehicle.geometry) @ thrusts + setpoints.bias_wrench
    return wrench / np.array([vehicle.mass_kg] * 3 + list(vehicle.inertia_kg_m2))


def tip_error(wall: Wall, twist: np.ndarray, offset: float, angle: float, seen: tuple[float, float]) -> np.ndarray:
    """(e, theta) of a line on the wall after a small body motion, for the tip's image point of before."""
    back = Rotation.from_rotvec(-twist[3:]).as_matrix()
    rays = [R_BODY_CAMERA.T @ (back @ (p - twist[:3]) - wall.camera) for p in wall.points(offset, angle)]
    rho, theta = align_line(*image_line(*rays), seen[1])
    foot = R_BODY_CAMERA.T @ (wall.foot - wall.camera)
    return np.array([rho - (foot[0] * math.cos(theta) + foot[1] * math.sin(theta)) / foot[2], theta])


CASES = [
    # roll, pitch, wall turn, offset, slope, role: negative rho, both roles, rolled, yawed, sloped, all at once
    (0.0, 0.0, 0.0, 0.05, 0.0, HORIZONTAL),
    (0.0, 0.0, 0.0, 0.12, 0.0, HORIZONTAL),
    (0.0, 0.0, 0.0, -0.05, 0.0, VERTICAL),
    (0.1, 0.0, 0.0, 0.05, 0.0, HORIZONTAL),
    (0.0, 0.08, 0.0, -0.05, 0.0, VERTICAL),
    (0.0, 0.0, 0.15, 0.05, 0.0, HORIZONTAL),
    (0.0, 0.0, 0.15, 0.1, 0.0, VERTICAL),
    (0.0, 0.0, 0.0, 0.05, 0.1, HORIZONTAL),
    (0.05, -0.04, -0.12, 0.07, -0.08, HORIZONTAL),
    (-0.06, 0.03, 0.1, -0.09, 0.07, VERTICAL),
]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("share", "held"), [(0.0, False), (1.0, False), (1.0, True)])
def test_line_rows_are_the_motion_of_the_line_at_the_tip(
    controller: HybridController, case: tuple, flip: bool, share: float, held: bool
) -> None:
    roll, pitch, turn, offset, slope, role = case
    angle = slope + (0.5 * math.pi if role == HORIZONTAL else 0.0)
    quaternion = attitude(roll, pitch)
    wall = Wall(quaternion, 0.02, turn)
    seen = wall.line(offset, angle, role, flip=flip)
    reference = Reference(lines=line_references(2), contact=True, push_force=5.0)
    controller.reset()
    tick = measured(0, attitude=quaternion, plane=wall.plane, lines=(seen,))
    pack(controller, tick, reference, share=share)
    if held:  # touching, and no speed is asked for: friction holds the tip, which turns with the body as it is
        controller.setpoints.step.inputs["contact.touching"][0] = 1.0
        evaluate_law(controller.setpoints, controller.problem.values)
    slot = 0 if role == HORIZONTAL else 1  # a slot belongs to a reference, found or not
    rng = np.random.default_rng(5)
    turn_share = 1.0 if held else 1.0 - share * (1.0 - controller.config.gains.body_rotation_gain)
    for _ in range(3):
        thrusts = rng.uniform(5.0, 20.0, 6)
        motion = accelerations(controller, thrusts)
        motion[:3] -= wall.normal * float(wall.normal @ motion[:3])
        motion[3:] *= turn_share
        step = 1e-5
        nominal = (0.0, 0.5 * math.pi if role == HORIZONTAL else 0.0)
        change = tip_error(wall, step * motion, offset, angle, nominal) - tip_error(
            wall, -step * motion, offset, angle, nominal
        )
        found = rows(controller, thrusts)
        expected = change / (2 * step)
        assert found[f"line_{slot}"][0] == pytest.approx(expected[0], abs=1e-6)
        assert found[f"line_{slot}_angle"][0] == pytest.approx(expected[1], abs=1e-6)


def test_absent_lines_weigh_nothing_and_their_place_stays(controller: HybridController) -> None:
    controller.reset()
    pack(controller, *random_tick(np.random.default_rng(0), 2))
    two = rows(controller, np.full(6, 11.0))
    pack(controller, *random_tick(np.random.default_rng(0), 0, tick=1))
    none = rows(controller, np.full(6, 11.0))
    assert list(two) == list(none)
    assert two["line_0"][2] > 0 and two["line_1"][2] > 0
    for slot in range(controller.config.line_slots):
        assert none[f"line_{slot}"][2] == none[f"line_{slot}_angle"][2] == 0.0


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_every_other_task_row_by_hand(plain: HybridController, share: float) -> None:
    rng, controller = np.random.default_rng(7), plain
    weights, gains = controller.config.weights, controller.config.gains
    for lean in np.linspace(-0.25, 0.25, 20):
        controller.reset()
        last = rng.uniform(8.0, 14.0, 6)
        pack(controller, *random_tick(rng, 2, lean=lean), share=share, last=last)
        thrusts, setpoints = rng.uniform(2.0, 30.0, 6), controller.setpoints
        right, down = weights.velocity * setpoints.free[0], weights.velocity * setpoints.free[1]
        motion = accelerations(controller, thrusts)
        vehicle = controller.config.vehicle
        force = (motion[:3] + share * moved_by_turn(setpoints, motion[3:])) * vehicle.mass_kg  # in contact the tip's
        found = rows(controller, thrusts)
        expected = {
            "push": (setpoints.normal @ force, setpoints.push_command, weights.push * share),
            "standoff": (setpoints.normal @ force, setpoints.standoff_command, weights.push * (1 - share)),
            "roll": (motion[3], setpoints.angular[0], weights.level),
            "pitch": (motion[4], setpoints.angular[1], weights.level),
            "yaw": (motion[5], setpoints.angular[2], weights.yaw),
            "velocity_right": (setpoints.right @ motion[:3], setpoints.velocity_command[0], right),
            "velocity_down": (setpoints.down @ motion[:3], setpoints.velocity_command[1], down),
        }
        height = controller.setpoints.step.outputs["height_command"].item()
        expected["height"] = (setpoints.down @ motion[:3], height, weights.height)
        for i, name in enumerate(controller.config.vehicle.geometry.names):
            expected[f"effort_{name}"] = (thrusts[i], last[i], weights.effort)
            expected[f"smooth_{name}"] = (thrusts[i], last[i], weights.smoothness)
        for name, values in expected.items():
            np.testing.assert_allclose(found[name], values, rtol=1e-9, atol=1e-9, err_msg=name)
        for slot, line in enumerate(setpoints.lines):
            wanted = -(gains.line_kp * line.error + gains.line_kd * line.rate + gains.line_ki * line.integral)
            angle = -(gains.theta_kp * line.angle_error + gains.theta_kd * line.angle_rate)
            np.testing.assert_allclose(found[f"line_{slot}"][1:], (wanted, weights.line * line.weight))
            np.testing.assert_allclose(found[f"line_{slot}_angle"][1:], (angle, weights.line_angle * line.weight))
        assert set(found) == set(expected) | {
            f"line_{slot}{end}" for slot in range(controller.config.line_slots) for end in ("", "_angle")
        }


@pytest.mark.parametrize("lines", [0, 1, 2])
def test_height_row_asks_for_nothing_new_where_nothing_is_limited(lines: int) -> None:
    wide = {"barriers": False}
    with_it = HybridController(ControllerConfig(**wide))
    without = HybridController(ControllerConfig(weights=Weights(height=0.0), **wide))
    for seed in range(10):
        thrusts = []
        for controller in (with_it, without):
            controller.reset()
            pack(controller, *random_tick(np.random.default_rng(seed), lines))
            thrusts.append(exact_thrusts(controller))
        np.testing.assert_allclose(thrusts[0], thrusts[1], atol=0.06)  # of 27 N


STANDOFFS = {
    "approach": (0.3, Reference()),
    "landing": (0.004, Reference(contact=True, push_force=5.0)),
    "retreat": (0.1, Reference(standoff=0.5)),
    "tilted": (0.3, Reference(tilt=np.array([0.1, 0.0]))),
    "unknown wall": (None, Reference()),
}


@pytest.mark.parametrize("case", STANDOFFS)
def test_the_force_to_the_stand_off_is_filtered_as_the_push(case: str) -> None:
    """The target moves from the force of the last thrusts by 1 - exp(-dt / T) of the way to the approach law's."""
    distance, reference = STANDOFFS[case]
    level, rng = np.array([1.0, 0.0, 0.0, 0.0]), np.random.default_rng(2)
    plane = None if distance is None else Wall(level, distance).plane
    controller, compared = HybridController(), 0
    config = controller.config
    kept = 0.0 if case == "tilted" else math.exp(-config.tick_s / config.gains.push_filter_s)
    for tick in range(20):
        last = rng.uniform(8.0, 14.0, 6)
        pack(controller, measured(tick, plane=plane), reference, share=0.0, last=last)
        setpoints = controller.setpoints
        before = float(setpoints.normal @ accelerations(controller, last)[:3]) * config.vehicle.mass_kg
        wanted = setpoints.standoff_command
        found = rows(controller, np.full(6, 11.0))["standoff"][1]
        assert found == pytest.approx(wanted + kept * (before - wanted), abs=1e-9)
        compared += abs(before - wanted) > 0.5
    assert compared > 10


def test_the_analytic_law_has_no_filter_that_feeds_the_lines_back() -> None:
    """Force along n of the last thrusts, of which a part serves the lines, does not enter the next command."""
    controller, wall = HybridController(), Wall(np.array([1.0, 0.0, 0.0, 0.0]), 0.6)
    commands, targets, wrenches = [], [], []
    for last in (np.full(6, 11.3), np.array([14.0, 14.0, 10.0, 10.0, 10.0, 10.0])):
        controller.reset()
        seen = measured(0, plane=wall.plane, lines=(wall.line(0.09, 0.5 * math.pi, HORIZONTAL),))
        pack(controller, seen, Reference(lines=line_references(1)), share=0.0, last=last)
        commands.append(controller.setpoints.standoff_command)
        wrenches.append(controller.setpoints.normal @ analytic_wrench(controller.setpoints)[:3])
        targets.append(rows(controller, last)["standoff"][1])
    assert commands[0] == pytest.approx(commands[1], abs=1e-9) and commands[0] > 1.0
    assert wrenches[0] == pytest.approx(wrenches[1], abs=0.05)  # the line row itself has a filter
    assert targets[1] - targets[0] > 1.0, "the row of the QP has the filter"


DEFICITS = [(-1.0, 0.05, 0.2), (-1.0, 2.0, 0.4), (-1.0, 0.02, 0.08), (1.0, 2.0, -0.4)]


@pytest.mark.parametrize(("side", "given_up", "deficit"), DEFICITS)
def test_the_filter_of_the_push_adds_what_limits_removed(side: float, given_up: float, deficit: float) -> None:
    """It starts from the last command and that part: 4 times the wrench given up, and 0.4 N, at most."""
    controller, reference = HybridController(), Reference(push_force=5.0, contact=True)
    last = 11.3 + side * 5.0 * controller.setpoints.inverse[:, 0]  # 5 N away from the wall, or towards it
    falling = np.array([side * 5.0 / controller.config.vehicle.mass_kg, 0.0, -9.81])
    kept = math.exp(-controller.config.tick_s / controller.config.gains.push_filter_s)
    targets = []
    for given in (0.0, given_up):
        controller.reset()
        for tick in range(3):
            controller.setpoints.note(last, given * (tick == 2))
            pack(controller, measured(tick, specific_force=falling), reference, share=1.0, last=last)
        targets.append(controller.setpoints.push_command)
    assert targets[1] - targets[0] == pytest.approx(kept * deficit, abs=1e-9)


def test_signs_of_the_wishes(controller: HybridController) -> None:
    """A vehicle that rolls right, noses up, faces left of the wall or drifts right is asked to undo just that."""
    reference = Reference(lines=line_references(2))

    def asked(name: str, **changes: object) -> float:
        controller.reset()
        pack(controller, measured(0, **changes), reference)
        return rows(controller, np.full(6, 11.0))[name][1]

    level = np.array([1.0, 0.0, 0.0, 0.0])
    assert asked("roll", attitude=attitude(roll=0.02)) < 0 < asked("roll", attitude=attitude(roll=-0.02))
    assert asked("pitch", attitude=attitude(pitch=0.02)) < 0 < asked("pitch", attitude=attitude(pitch=-0.02))
    assert asked("yaw", plane=Wall(level, 0.3, turn=0.1).plane) > 0 > asked("yaw", plane=Wall(level, 0.3, -0.1).plane)
    assert asked("roll", angular_velocity=np.array([0.1, 0, 0])) < 0
    assert asked("velocity_right", velocity=np.array([0.0, 0.1, 0.0])) < 0
    assert asked("velocity_down", velocity=np.array([0.0, 0.0, 0.1])) < 0
    assert asked("standoff", plane=Wall(level, 0.6).plane) > 0 > asked("standoff", plane=Wall(level, 0.1).plane)
    near = Wall(level, 0.3)
    # A guide too far below the tip: its rho must shrink, so the vehicle sinks.
    assert asked("line_0", lines=(near.line(0.09, 0.5 * math.pi, HORIZONTAL),), plane=near.plane) < 0


@pytest.mark.parametrize("turn", [0.0, 0.1])
@pytest.mark.parametrize("role", [HORIZONTAL, VERTICAL])
def test_line_error_vanishes_where_the_tip_will_meet_the_wall(
    controller: HybridController, turn: float, role: str
) -> None:
    """Endpoint closed loop: roll, yaw and slope move the picture but not the tip's distance to the line."""
    angle = 0.5 * math.pi if role == HORIZONTAL else 0.0
    for roll, slope in ((0.0, 0.0), (0.03, 0.0), (0.0, 0.03), (-0.03, 0.02)):
        quaternion = attitude(roll)
        wall = Wall(quaternion, 0.05, turn)
        depth = float(R_BODY_CAMERA[:, 2] @ (wall.foot - wall.camera))
        for offset in (0.0, 0.004, -0.004):
            seen = wall.line(offset, angle + slope, role)
            rho = -0.08 / depth if role == HORIZONTAL else 0.0
            reference = Reference(lines=(type(line_references(1)[0])(rho=rho, theta=angle, role=role),))
            controller.reset()
            pack(controller, measured(0, attitude=quaternion, plane=wall.plane, lines=(seen,)), reference)
            error = controller.setpoints.lines[0].error * depth
            assert error == pytest.approx(offset, abs=2e-4)  # a perspective second order remains


def test_limit_rows_by_hand(controller: HybridController) -> None:
    rng = np.random.default_rng(11)
    limits, names = controller.config.limits, controller.problem.row_names
    assert names[:6] == tuple(f"thrust_{name}" for name in controller.config.vehicle.geometry.names)
    assert names[6:9] == ("tilt_roll", "tilt_pitch", "yaw")
    assert names[9:] == ("view_horizontal", "view_vertical", "push_ceiling", "approach_speed")
    for _ in range(20):
        controller.reset()
        measurement, reference = random_tick(rng, 1)
        pack(controller, measurement, reference, window=(3.0, 17.0))
        _, _, a, lower, upper = dense(controller)
        setpoints = controller.setpoints
        thrusts, slack = rng.uniform(2.0, 30.0, 6), rng.normal(size=7)
        motion = accelerations(controller, thrusts)
        value = a @ np.concatenate((thrusts, slack))
        np.testing.assert_allclose(value[:6], thrusts)
        np.testing.assert_array_equal(lower[:6], np.full(6, 3.0))
        np.testing.assert_array_equal(upper[:6], np.full(6, 17.0))
        rates = measurement.angular_velocity
        for i, (angle, bound, pole) in enumerate(
            (
                (setpoints.roll, limits.tilt_deg, limits.tilt_rate_1_s),
                (setpoints.pitch, limits.tilt_deg, limits.tilt_rate_1_s),
                (setpoints.yaw, limits.yaw_deg, limits.yaw_rate_1_s),
            )
        ):
            room_up = value[6 + i] - upper[6 + i]
            bound = math.radians(bound)
            expected = motion[3 + i] - slack[i] - (pole**2 * (bound - angle) - 2 * pole * rates[i])
            assert room_up == pytest.approx(expected, abs=1e-9)
            room_down = value[6 + i] - lower[6 + i]
            expected = motion[3 + i] - slack[i] - (-(pole**2) * (bound + angle) - 2 * pole * rates[i])
            assert room_down == pytest.approx(expected, abs=1e-9)


def test_rows_of_view_push_and_approach_by_hand(controller: HybridController) -> None:
    rng, limits, mass = np.random.default_rng(12), controller.config.limits, controller.config.vehicle.mass_kg
    for _ in range(10):
        controller.reset()
        pack(controller, *random_tick(rng, 2))
        _, _, a, lower, upper = dense(controller)
        setpoints, thrusts = controller.setpoints, rng.uniform(2.0, 30.0, 6)
        motion = accelerations(controller, thrusts)
        along = float(setpoints.normal @ motion[:3])
        motion[:3] -= setpoints.normal * along
        seen = motion * np.repeat((1.0, float(limits.view_rotation)), 3)
        value = dict(zip(controller.problem.row_names, a @ np.append(thrusts, np.zeros(7)), strict=True))
        bounds = {name: (lower[i], upper[i]) for i, name in enumerate(controller.problem.row_names)}
        for line, bound in zip(setpoints.lines, (limits.view_down, limits.view_right), strict=True):
            name, pole = f"view_{line.role}", limits.view_rate_1_s
            drift = value[name] - bounds[name][1]  # constants of the row live in its bounds
            right, down = (setpoints.step.inputs[f"reference.velocity_{axis}"].item() for axis in ("right", "down"))
            wanted = line.matrix[0] @ np.append(right * setpoints.right + down * setpoints.down, np.zeros(3))
            room = pole**2 * (bound - line.rho) - 2.0 * pole * (line.rho_rate + wanted)
            assert drift == pytest.approx(line.matrix[0] @ seen - room, abs=1e-8)
        name = "approach_speed"
        inputs, outputs = setpoints.step.inputs, setpoints.step.outputs
        allowed, rate = outputs["approach_speed"].item(), inputs["contact.rate"].item()
        leaning = outputs["search_force"].item() / mass
        assert leaning >= 0.0
        room = limits.approach_rate_1_s * (limits.approach_speed_ratio * allowed + rate) + leaning
        assert value[name] - bounds[name][1] == pytest.approx(along - room, abs=1e-9)
        assert bounds["push_ceiling"][1] > 1e3  # in free air the ceiling is wide
        inputs["contact.touching"][0] = 1.0
        evaluate_law(setpoints, controller.problem.values)
        _, _, a, lower, upper = dense(controller)
        index = controller.problem.row_names.index("push_ceiling")
        stiffness = inputs["contact.stiffness"].item()
        room = limits.push_ceiling_ratio * setpoints.push_reference + 2.0 * math.sqrt(stiffness * mass) * min(
            rate + limits.push_quiet_m_s, 0.0
        )
        force = mass * (accelerations(controller, thrusts) @ np.append(setpoints.normal, np.zeros(3)))
        assert a[index, :6] @ thrusts - upper[index] == pytest.approx(force - room, abs=1e-8)


@pytest.mark.parametrize(("pole", "bound"), [(8.0, 0.0175), (5.0, 0.17)])
def test_a_barrier_at_its_bound_never_lets_the_angle_through(pole: float, bound: float) -> None:
    """The largest acceleration it allows leads up to the bound and not over it, from any state inside its set."""
    for start in np.linspace(-bound, 0.9 * bound, 5):
        angle, rate, step = start, 0.9 * pole * (bound - start), 1e-4  # dh/dt >= -p h: inside
        for _ in range(30000):
            _, upper = barrier_bounds(angle, rate, bound, pole)
            rate += step * float(upper)
            angle += step * rate
            assert angle <= bound + 1e-6
        assert angle == pytest.approx(bound, rel=0.01)  # and it is not needlessly tight


def test_barriers_can_be_left_out() -> None:
    bare = HybridController(ControllerConfig(barriers=False))
    assert len(bare.problem.row_names) == 6
    assert len(bare.problem.variable_names) == 6


@pytest.mark.parametrize("turns", [True, False])
def test_a_view_barrier_that_only_moves_the_vehicle_has_no_rotation(turns: bool) -> None:
    limits = dataclasses.replace(ControllerConfig().limits, view_rotation=turns)
    controller = HybridController(ControllerConfig(limits=limits))
    pack(controller, *random_tick(np.random.default_rng(3), 2), share=1.0)
    names = [row.name for row in controller.problem.limit_rows]
    matrix = dense(controller)[2]
    per_thrust = np.linalg.inv(controller.config.vehicle.mass_matrix) @ control_effectiveness(
        controller.config.vehicle.geometry
    )
    for role in (HORIZONTAL, VERTICAL):
        row = matrix[names.index(f"view_{role}"), :6] @ np.linalg.inv(per_thrust)
        assert (np.abs(row[3:]).max() > 1e-6) == turns
        assert np.abs(row[:3]).max() > 0.1


def height_target(config: ControllerConfig, seed: int, lines: int, share: float) -> tuple[float, float, Setpoints]:
    """Target and weight of the row on a random tick, and the setpoints of that tick."""
    controller = HybridController(config)
    pack(controller, *random_tick(np.random.default_rng(seed), lines), share=share)
    data, rows = controller.engine.data, controller.problem.task_rows
    _, targets, weights = controller.problem.report(data.point, np.zeros(6))
    place = [row.name for row in rows].index("height")
    return float(targets[place]), float(weights[place]), controller.setpoints


def last_motion(config: ControllerConfig, setpoints: Setpoints) -> np.ndarray:
    """Acceleration that the last thrusts command, by Newton and Euler, (6,)."""
    vehicle = config.vehicle
    wrench = control_effectiveness(vehicle.geometry) @ setpoints.last + setpoints.bias_wrench
    return wrench / np.array([vehicle.mass_kg] * 3 + list(vehicle.inertia_kg_m2))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_level_line_and_the_row_want_the_same(seed: int, share: float) -> None:
    """Behind the filter of line rows; their lead has no motor's thrust on the first tick."""
    config = ControllerConfig()
    target, weight, setpoints = height_target(config, seed, 1, share)
    (line,) = setpoints.lines
    turned = 1.0 - share * (1.0 - config.gains.body_rotation_gain)
    sideways = setpoints.free[0] * setpoints.velocity_command[0]
    twist = np.concatenate((target * setpoints.down + sideways * setpoints.right, turned * setpoints.angular))
    image = line_interaction_matrix(line.rho, line.theta, setpoints.plane)
    gains = config.gains
    wanted = -(gains.line_kp * line.error + gains.line_kd * line.rate + gains.line_ki * line.integral)
    assert line.matrix.shape == image.shape
    row = endpoint_line_row(line.matrix, line.theta, line.tip)
    last = last_motion(config, setpoints)
    last[:3] -= setpoints.normal * (setpoints.normal @ last[:3])
    last[3:] *= turned
    wanted += math.exp(-config.tick_s / gains.line_filter_s) * (row @ last - wanted)
    assert line.weight == pytest.approx(1.0) and setpoints.free[1] == pytest.approx(0.0)
    assert row @ twist == pytest.approx(wanted, abs=1e-9)
    assert weight == config.weights.height


def test_without_a_line_it_is_the_velocity_law() -> None:
    target, _, setpoints = height_target(ControllerConfig(), 3, 0, 0.0)
    assert target == pytest.approx(setpoints.velocity_command[1], abs=1e-12)


def test_the_published_law_has_no_such_row() -> None:
    controller = HybridController(ControllerConfig(line_profile="paper"))
    assert "height" not in {row.name for row in controller.problem.task_rows}
