"""Every example runs, without the simulator, and does what its text says."""

from __future__ import annotations

import functools
import math
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rclpy_stand_in
from scipy.spatial.transform import Rotation

from ibvs_qp import ControllerConfig, Measurement, PaperController, Reference
from ibvs_qp.controller import HybridController

ROOT = Path(__file__).parents[2]

NUMBER = re.compile(r"-?\d+\.\d+")
#: Presets hold the settings of perception, which needs OpenCV; the controller alone does not.
WITHOUT_OPENCV = ("plain_python", "own_limit", "own_task")
#: Modules of the others.
SHARED = ("rigid_body", "drawn_camera")
#: Need ROS, or the simulator (tests/sim/gym_env): they have tests of their own.
ROS, SIMULATED = "ros2_node", "gym_policies"
EXAMPLES = sorted(file.stem for file in (ROOT / "examples").glob("*.py") if file.stem not in (*SHARED, ROS, SIMULATED))
#: Runs a script where the simulator and everything that draws cannot be imported.
ALONE = """
import importlib.abc, os, runpy, sys

class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("sim", "mujoco", "matplotlib", "tests", *sys.argv[2:]):
            raise ImportError(f"{name} is not installed here")

sys.meta_path.insert(0, Missing())
sys.path.insert(0, os.path.dirname(sys.argv[1]))
sys.argv = sys.argv[1:2]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def run(script: Path) -> str:
    command = [sys.executable, "-c", ALONE, str(script), *(["cv2"] if script.stem in WITHOUT_OPENCV else [])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


@functools.cache
def printed(name: str) -> str:
    return run(ROOT / "examples" / f"{name}.py")


def test_every_example_has_a_test() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    missing = [name for name in EXAMPLES if f'printed("{name}")' not in text]
    assert not missing
    assert all(len((ROOT / "examples" / f"{name}.py").read_text().splitlines()) <= 70 for name in EXAMPLES)


@pytest.mark.slow
def test_plain_python_presses_and_slides() -> None:
    rows = re.findall(
        r"([\d.]+) s +(\w+) +push +(-?[\d.]+) N +height error +([-+][\d.]+) mm +slid +([-+][\d.]+) m +(\w+)",
        printed("plain_python"),
    )
    assert len(rows) == 12
    pressed = [row for row in rows if float(row[0]) >= 5.0]  # the last centimetre is flown at 12 mm/s
    assert all(row[1] == "contact" and row[5] == "solved" for row in pressed)
    assert np.abs([float(row[2]) - 5.0 for row in pressed]).max() <= 0.5
    assert np.abs([float(row[3]) for row in pressed]).max() <= 3.0
    assert float(rows[-1][4]) == pytest.approx(-0.35, abs=0.03)


def glue(name: str) -> int:
    """Lines of an example after its imports, without texts."""
    text = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8")
    lines = re.sub(r'""".*?"""', "", text, flags=re.DOTALL).splitlines()
    first = max(index for index, line in enumerate(lines) if re.match(r"(from|import) ", line))
    return sum(bool(line.strip()) for line in lines[first + 1 :])


def test_a_simulator_is_wired_up_in_few_lines() -> None:
    assert glue("plain_python") <= 40
    assert glue("other_simulator") + glue("rigid_body") <= 150


@pytest.mark.slow
def test_other_simulator_paints_two_rows_at_the_push_asked_for() -> None:
    text = printed("other_simulator")
    assert "failed: False all rows painted" in text and "by paint edge" in text
    middle, highest = map(float, re.findall(r"push ([\d.]+) N, at most ([\d.]+) N", text)[0])
    assert middle == pytest.approx(5.0, abs=0.1) and highest < 6.0


def test_own_path_is_a_strategy_in_sixty_lines() -> None:
    assert printed("own_path") == "", "`ibvs-qp paint --strategy` flies it"
    assert len((ROOT / "examples" / "own_path.py").read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.slow  # a flight with pictures
def test_pilot_flies_a_job_by_drawn_pictures_of_a_plain_board_flush_with_its_wall() -> None:
    text = printed("pilot")
    assert "done, failed: False" in text and "by paint edge" in text and "refused" not in text
    begin, end = (float(re.findall(rf" ([\d.]+) s  {event}  row 1", text)[0]) for event in ("paint", "climb"))
    assert end - begin < 7.0  # 0.4 m at 0.1 m/s: the lines give the velocity where the flow has no points


def test_own_perception_finds_the_edge_below_the_brush() -> None:
    found = re.findall(r"(\w+) +edge ([\d.]+) mm", printed("own_perception"))
    assert len(found) == 5 and found[-1][0] == "survey"
    assert [float(offset) for _, offset in found] == pytest.approx([50.0] * 5, abs=2.0)


def test_own_detector_reports_an_honest_covariance() -> None:
    sys.path.insert(0, str(ROOT / "examples"))
    try:
        example = runpy.run_path(str(ROOT / "examples" / "own_perception.py"))
    finally:
        sys.path.pop(0)
    vehicle = example["Vehicle"](ControllerConfig().vehicle)
    camera = example["DrawnCamera"](example["BOARD_M"])
    left, right = np.array((0.85, -0.45, 0.05)), np.array((0.85, 0.05, 0.05))
    for roll in (0.0, 3.0, 8.0):
        vehicle.turn = Rotation.from_euler("x", roll, degrees=True)
        picture = camera.picture(vehicle, 1)
        line = example["line_of"](example["edge_pixels"](picture), picture, side=-1, track_id=1)
        truth = vehicle.edge(left, right, 1, track=1)
        error = np.array((line.rho - truth.rho, line.theta - truth.theta))
        assert error @ np.linalg.solve(line.covariance, error) < 5.0**2


def test_rgbd_files_are_read_and_seen() -> None:
    text = printed("rgbd_files")
    assert [float(far) for far in re.findall(r"wall at ([\d.]+) m", text)] == pytest.approx([0.65] * 3, abs=0.005)
    lines = re.findall(r"board (horizontal|vertical) +rho ([-+][\d.]+) .* side -1", text)
    assert len(lines) == 4  # after the first picture
    assert dict(lines) == {"horizontal": "-0.0452", "vertical": "+0.0763"}


def test_own_task_slows_the_rotors_it_names() -> None:
    shipped, quiet = ([float(number) for number in NUMBER.findall(line)] for line in printed("own_task").splitlines())
    assert max(quiet[0], quiet[7]) < 6.0 < 8.0 < min(shipped)
    assert sum(quiet) == pytest.approx(sum(shipped), rel=0.01)


def test_own_limit_bounds_the_climb_and_has_a_price() -> None:
    shipped, limited = (
        [float(number) for number in NUMBER.findall(line)] for line in printed("own_limit").splitlines()
    )
    config = ControllerConfig()
    first = 1.0 - math.exp(-config.tick_s / config.gains.velocity_filter_s)  # what the filter lets through at once
    assert shipped[0] == pytest.approx(first * config.gains.velocity_kp, abs=0.05) and shipped[1] == 0.0
    assert 0.5 <= limited[0] <= 0.65 and limited[1] > 10.0


def test_added_rows_are_named_and_absent_by_weight_zero() -> None:
    example = runpy.run_path(str(ROOT / "examples" / "own_task.py"))
    climb = runpy.run_path(str(ROOT / "examples" / "own_limit.py"))["ClimbLimit"](50.0)
    quiet = example["QuietRotors"]("r0", "r7")
    controller = HybridController(example["CONFIG"], tasks=[quiet], limits=[climb])
    plain = HybridController(example["CONFIG"])
    names = [row.name for row in controller.problem.task_rows]
    assert names[-2:] == ["quiet_r0", "quiet_r7"] and controller.problem.row_names[-1] == "climb"
    assert controller.problem.variable_names[-1] == "slack_climb"
    quiet.set_target(4.0)
    rise = Reference(standoff=0.3, velocity=np.array([0.0, -1.0]))
    command = controller.step(example["HOVER"], rise)
    assert {"quiet_r0", "quiet_r7"} <= {task.name for task in command.tasks}
    controller.reset()
    quiet.set_target(4.0, weight=0.0)
    ours, theirs = (one.step(example["HOVER"], rise) for one in (controller, plain))
    np.testing.assert_allclose(ours.wrench, theirs.wrench, atol=5e-3)
    # Not the thrusts: what two redundant rotors share is left to the pull to the last thrusts, a thousand times weaker.
    assert "quiet_r0" not in {task.name for task in ours.tasks}


def test_the_own_vehicle_hovers() -> None:
    text = printed("own_vehicle")
    assert "not actuated: nothing" in text and "solved: thrusts" in text
    low, high, push = map(float, re.findall(r"hover: ([\d.]+) to ([\d.]+) N; greatest push ([\d.]+) N", text)[0])
    assert 8.0 < low <= high < 12.0 and push > 20.0


def test_a_log_replays_bit_identically_and_shows_the_commands_of_weaker_rotors() -> None:
    text = printed("replay_log")
    assert "1000 ticks recorded" in text and "bit-identical: True" in text
    differing, most_n = re.findall(r"rotors of 12 N: (\d+) ticks differ.*by ([\d.]+) N", text, re.DOTALL)[0]
    assert int(differing) > 900 and 1.0 < float(most_n) < 3.0


def test_the_bag_shows_the_board() -> None:
    text = printed("ros2_bag")
    assert text.startswith("250 frames, messages ignored: {}")
    distance, edges = re.findall(r"tip ([\d.]+) m from the board, (\d) of its edges seen", text)[0]
    assert float(distance) == pytest.approx(0.4, abs=0.002) and edges == "2"
    assert "survey: guide" in text and "'solved': 2" in text


def test_own_controller_adds_a_policy_to_the_analytic_law(tmp_path: Path) -> None:
    level = [float(number) for number in NUMBER.findall(printed("own_controller"))]
    example = runpy.run_path(str(ROOT / "examples" / "own_controller.py"))
    assert len((ROOT / "examples" / "own_controller.py").read_text(encoding="utf-8").splitlines()) <= 40
    rng = np.random.default_rng(0)
    np.savez(tmp_path / "policy.npz", hidden=rng.normal(size=(32, 10)), output=rng.normal(size=(6, 32)))
    law = example["ResidualPolicy"](ControllerConfig(), tmp_path / "policy.npz")
    still = {"angular_velocity": np.array([0.1, 0.0, 0.0]), "contact_wrench": np.zeros(6)}
    hover = Measurement(stamp_ns=4_000_000, wrench_stamp_ns=4_000_000, attitude=np.array([1.0, 0.0, 0.0, 0.0]), **still)
    learned = law.step(hover, Reference()).thrusts
    analytic = PaperController(ControllerConfig()).step(hover, Reference()).thrusts
    assert len(level) == 6 and len(set(level)) == 1 and 8.0 < level[0] < 14.0
    assert 0.0 < np.abs(learned - analytic).max() <= example["SHARE_N"]


def test_the_ros_node_answers_its_sensors_with_thrusts(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rosbags", reason="needs the extra ros")
    from ibvs_qp.interfaces.ros import pictures, samples
    from ibvs_qp.interfaces.ros.topics import Topics

    rclpy_stand_in.install(monkeypatch)
    script = runpy.run_path(str(ROOT / "examples" / f"{ROS}.py"))
    assert len((ROOT / "examples" / f"{ROS}.py").read_text().splitlines()) <= 60
    topics = Topics()
    node = script["PilotNode"](topics)
    ((period_s, tick),) = node.timers
    names = topics.names(("imu", "wrench", "color", "depth", "camera_info"))
    assert period_s == 0.004 and set(node.taken) == set(names.values())
    rgb, depth = np.full((60, 106, 3), 120, np.uint8), np.full((60, 106), 0.9, np.float32)
    weight = np.array([0.0, 0.0, -0.35 * 9.81, 0.0, 0.25 * 0.35 * 9.81, 0.0])
    for number in range(1, 101):
        node.now_ns = stamp = 10**9 + number * 4_000_000
        if number == 50:
            node.receive(topics.camera_info, pictures.from_intrinsics((78.0, 78.0, 52.5, 29.5), (60, 106), stamp))
            node.receive(topics.color, pictures.from_rgb(rgb, stamp))
            node.receive(topics.depth, pictures.from_depth(depth, stamp))
        tick()
        still = np.array([0.0, 0.0, -9.81])
        node.receive(topics.imu, samples.to_imu(stamp, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), still))
        node.receive(topics.wrench, samples.to_wrench(stamp, weight, topics.wrench_axes, topics.wrench_on))
    sent = node.published["/rotor_thrusts"]
    assert len(sent) == 99 and not node.held.ignored and node.held.pairs == 1 and node.prepared
    lift = 6 * np.cos(np.radians(30.0)) * np.mean(sent[-1].data)
    assert lift == pytest.approx(6.0 * 9.81, rel=0.05)
    node.receive(topics.imu, samples.to_imu(1, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), still))
    assert list(node.held.ignored) == ["imu: stamp is not of this computer's clock, or too old"]
