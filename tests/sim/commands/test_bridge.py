"""``ibvs-qp bridge`` without a network, and ROS bags in ``ibvs-qp detect``."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from contract_schema import refusal
from dds_loopback import environment, require_dds

pytest.importorskip("rosbags", reason="needs the extra ros")

import ibvs_qp.interfaces.ros.write_bag as write_bag_module
from ibvs_qp import RgbdFrame, SensorFrame
from ibvs_qp.interfaces.ros.messages import typestore
from ibvs_qp.interfaces.ros.write_bag import write_bag
from ibvs_qp.vision.picture.camera import Lens
from sim.commands.cli import main
from tests.support.truth import FAMILIES, render_frame, sample_scene
from tests.support.truth.accuracy import line_errors
from tests.support.truth.devices import REALSENSE_D435


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
    assert named in refusal(["bridge", "--dry-run", "--config", "b.toml"], capsys)


def test_a_bridge_that_hears_nothing_waits_and_ends(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    require_dds()
    monkeypatch.setenv("CYCLONEDDS_URI", environment()["CYCLONEDDS_URI"])
    Path("b.toml").write_text("domain_id = 220\n")
    assert main(["bridge", "--config", "b.toml", "--duration", "0.3", "--json"]) == 0
    status = json.loads(capsys.readouterr().out)
    assert status["state"] == "waiting" and status["commands"] == 0 and 60 <= status["timing"]["ticks"] <= 80


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["tarot_t960_qp", "octorotor_qp"])
def test_a_dry_run_shows_the_thrust_at_full_command_that_px4_gets_too(
    capsys: pytest.CaptureFixture[str], preset: str
) -> None:
    assert main(["vehicle", preset, "--px4", "v.params"]) == 0
    capsys.readouterr()
    assert main(["bridge", "--preset", preset, "--dry-run", "--json"]) == 0
    full = json.loads(capsys.readouterr().out)["curve"]["thrust_max_n"]
    assert f"CA_ROTOR0_CT\t{full:g}\t" in Path("v.params").read_text()
    assert main(["bridge", "--preset", preset, "--dry-run"]) == 0
    assert f"rotors      {full:g} N at full command" in capsys.readouterr().out


def started(*words: str, **streams: object) -> subprocess.Popen[bytes]:
    require_dds()
    Path("b.toml").write_text("domain_id = 221\n")
    command = [sys.executable, "-m", "sim.commands.cli", "bridge", "--config", "b.toml", *words]
    return subprocess.Popen(command, env=environment(), **streams)  # type: ignore[call-overload]


@pytest.mark.slow
def test_a_reader_that_left_does_not_end_the_bridge() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with started("--duration", "0.5", stdout=writing) as process:
        os.close(writing)
        assert process.wait(60) == 0


@pytest.mark.slow
def test_ctrl_c_ends_with_the_timing(tmp_path: Path) -> None:
    with started(stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        last = process.stdout.read().decode().splitlines()
        assert process.wait(60) == 130
    assert first.startswith(b"waiting: imu") and last[-2].startswith("waiting: imu")
    assert " ticks, " in last[-1] and " overruns; " in last[-1]


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
    assert f"the extra {extra}: pip install -c constraints.txt -e '.[{extra}]'" in refusal(words, capsys)


def bag(image: RgbdFrame | None = None) -> None:
    truth = render_frame(sample_scene(FAMILIES["near wall"], 1))
    image = dataclasses.replace(image or truth.frame, stamp_ns=10**9)
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


@pytest.mark.slow
def test_depth_of_a_camera_beside_is_registered_by_the_settings(capsys: pytest.CaptureFixture[str]) -> None:
    truth = render_frame(sample_scene(FAMILIES["realsense_d435"], 4))
    assert truth.raw is not None and truth.raw.depth.shape != truth.raw.rgb.shape[:2]
    bag(dataclasses.replace(truth.raw, depth=(1e-3 * truth.raw.depth).astype(np.float32)))
    settings = dataclasses.asdict(REALSENSE_D435.settings) | {"depth_units_per_metre": 1000.0}
    Path("camera.toml").write_text(tomli_w.dumps({"camera": settings}))
    Path("topics.toml").write_text("depth_registered = false\n")
    fx, fy, cx, cy = truth.frame.intrinsics
    ideal = (np.array([truth.seed]) - (cx, cy)) / (fx, fy)
    [seed] = Lens(REALSENSE_D435.distortion).pixels(ideal, truth.frame.intrinsics)
    words = ["detect", "bag", "--camera", "camera.toml", "--seed-pixel", *map(str, seed.tolist()), "--json"]
    assert main([*words, "--topics", "topics.toml"]) == 0
    (frame,) = json.loads(capsys.readouterr().out)["frames"]
    for side, edge in truth.edges.items():
        line = frame["guides"][side]
        assert line is not None, side
        assert line_errors(edge, line["rho"], line["theta"], truth.frame.intrinsics)[0] < 0.5
    assert main(words) == 2
    assert "colour and depth differ in size" in capsys.readouterr().err


def test_detect_straightens_the_lines_of_the_lens_in_the_bag(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def seen(*words: str) -> list[list[float]]:
        assert main(["detect", "bag", "--json", "--all", *words]) == 0
        (frame,) = json.loads(capsys.readouterr().out)["frames"]
        return [[line["rho"], line["theta"]] for line in frame["candidates"]]

    bag()
    plain, straight = seen(), seen("--distortion", "0.2", "0", "0", "0", "0")
    made = write_bag_module.pictures.from_intrinsics

    def bent(*words: object) -> object:
        info = made(*words)  # type: ignore[arg-type]
        info.d = np.array([0.2, 0.0, 0.0, 0.0, 0.0])
        return info

    monkeypatch.setattr(write_bag_module.pictures, "from_intrinsics", bent)
    shutil.rmtree("bag")
    bag()
    assert seen() == straight != plain == seen("--distortion", "0", "0", "0", "0", "0")


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
    assert named in refusal(["detect", *words], capsys)
