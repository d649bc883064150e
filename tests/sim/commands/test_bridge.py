"""``ibvs-qp bridge`` without a network, and ROS bags in ``ibvs-qp detect``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from dds_loopback import environment, require_dds

pytest.importorskip("rosbags", reason="needs the extra ros")

from ibvs_qp import RgbdFrame, SensorFrame
from ibvs_qp.ros.messages import typestore
from ibvs_qp.ros.write_bag import write_bag
from sim.commands.cli import main
from sim.detection.truth import FAMILIES, render_frame, sample_scene


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_dry_run_lists_topics_and_checks_and_connects_to_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    Path("b.toml").write_text('output = "thrust_and_torque"\nnamespace = "/uav_1"\n[topics]\nwrench = "/wrist"\n')
    assert main(["bridge", "--dry-run", "--config", "b.toml"]) == 0
    text = capsys.readouterr().out
    assert "subscribes  /uav_1/fmu/out/sensor_combined " in text  # what the file does not name stays
    assert "subscribes  /wrist " in text and "/uav_1/fmu/in/vehicle_torque_setpoint" in text and "  - " in text
    assert main(["bridge", "--dry-run", "--json", "--config", "b.toml", "--preset", "octorotor_qp"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan["schema"] == 1 and plan["rate_hz"] == 250.0
    names = {each["dds_topic"]: each["dds_type"] for each in plan["publishes"]}
    assert names["rt/uav_1/fmu/in/vehicle_thrust_setpoint"] == "px4_msgs::msg::dds_::VehicleThrustSetpoint_"


def test_the_vehicle_may_come_from_px4s_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "octorotor_qp", "--px4", "octo.params"]) == 0
    Path("b.toml").write_text("[curve]\nthrust_max_n = 20.0\n")
    assert main(["bridge", "--dry-run", "--vehicle", "octo.params"]) == 0
    capsys.readouterr()
    assert main(["bridge", "--dry-run", "--vehicle", "octo.params", "--config", "b.toml"]) == 2
    assert "curve.thrust_max_n = 20.0 N is refused" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("rate = 3", "rate"),
        ('output = "pwm"', "output"),
        ("link_timeout_s = 2.0", "link_timeout_s"),
        ('[topics]\nimu = "no topic"', "topics.imu"),
        ('[topics]\nwrench_axes = "enu"', "topics.wrench_axes"),
    ],
)
def test_settings_are_refused_by_name(capsys: pytest.CaptureFixture[str], text: str, named: str) -> None:
    Path("b.toml").write_text(text)
    assert main(["bridge", "--dry-run", "--config", "b.toml"]) == 2
    error = capsys.readouterr().err
    assert named in error and error.count("\n") == 1


def test_a_bridge_that_hears_nothing_waits_and_ends(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    require_dds()
    monkeypatch.setenv("CYCLONEDDS_URI", environment()["CYCLONEDDS_URI"])
    Path("b.toml").write_text("domain_id = 220\n")
    assert main(["bridge", "--config", "b.toml", "--duration", "0.3", "--json"]) == 0
    status = json.loads(capsys.readouterr().out)
    assert status["state"] == "waiting" and status["commands"] == 0 and 60 <= status["timing"]["ticks"] <= 80


@pytest.mark.parametrize(
    ("library", "words", "extra"),
    [("rosbags.typesys", ["detect", "bag"], "ros"), ("cyclonedds.domain", ["bridge", "--duration", "0.1"], "dds")],
)
def test_a_missing_extra_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, library: str, words: list[str], extra: str
) -> None:
    bag()
    typestore.cache_clear()
    monkeypatch.setitem(sys.modules, library, None)
    assert main(words) == 2
    error = capsys.readouterr().err
    assert f"the extra {extra}: pip install -c constraints.txt -e '.[{extra}]'" in error and error.count("\n") == 1


def bag() -> None:
    truth = render_frame(sample_scene(FAMILIES["near wall"], 1))
    image = truth.frame
    image = RgbdFrame(rgb=image.rgb, depth=image.depth, intrinsics=image.intrinsics, stamp_ns=10**9)
    frame = SensorFrame(
        stamp_ns=10**9,
        attitude=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_velocity=np.zeros(3),
        specific_force=np.array([0.0, 0.0, -9.81]),
        wrench=np.zeros(6),
        wrench_stamp_ns=10**9,
        image=image,
    )
    write_bag([frame], "bag")
    assert truth.seed is not None
    Path("seed").write_text(" ".join(map(str, truth.seed)))


def test_detect_reads_the_pictures_of_a_bag(capsys: pytest.CaptureFixture[str]) -> None:
    bag()
    seed = Path("seed").read_text().split()
    assert main(["detect", "bag", "--json", "--seed-pixel", *seed, "--overlay", "drawn"]) == 0
    (frame,) = json.loads(capsys.readouterr().out)["frames"]
    assert frame["color"] == "bag/000000_1000000000" and frame["refused"] is None
    assert sum(guide is not None for guide in frame["guides"].values()) >= 2
    assert [file.name for file in Path("drawn").iterdir()] == ["bag_000000_1000000000_overlay.png"]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["bag", "--rgb", "x.png"], "give either"),
        (["--topics", "t.toml", "--sequence", "."], "--topics is for a ROS bag"),
        (["bag", "--topics", "t.toml"], "no topic /other for color"),
        (["seed"], "no readable ROS 2 bag"),
        (["nothing"], "cannot read nothing"),
    ],
)
def test_bags_are_refused_in_one_line(capsys: pytest.CaptureFixture[str], words: list[str], named: str) -> None:
    bag()
    Path("t.toml").write_text('color = "/other"\n')
    capsys.readouterr()
    assert main(["detect", *words]) == 2
    error = capsys.readouterr().err
    assert named in error and error.count("\n") == 1
