"""A bag through the pilot from the command line, and a tick of its log explained."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
from contract_schema import refusal

pytest.importorskip("rosbags", reason="needs the extra ros")
pytest.importorskip("mcap", reason="needs the extra log")

from ibvs_qp import HybridController, LineFeature, LineReference, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.config.settings import dump_toml
from ibvs_qp.interfaces.log import Recorder
from ibvs_qp.interfaces.ros.recording import is_bag
from ibvs_qp.interfaces.ros.topics import ACCEPTED, Topics
from ibvs_qp.interfaces.ros.write_bag import write_bag
from ibvs_qp.pilot.config import CameraConfig, PilotConfig
from sim.commands.cli import main

TICK, TICKS = 4_000_000, 200
TOOL_N = 0.35 * 9.81
#: Begin of a bag by the system's clock [ns].
EPOCH_NS = 1_763_000_000_000_000_000
BAGS = Path(__file__).parents[3] / "docs" / "bags.md"


def hover(ticks: int = TICKS, begin_ns: int = 0) -> list[SensorFrame]:
    """At rest before a wall of one grey."""
    rng, frames = np.random.default_rng(0), []
    rgb, depth = np.full((60, 106, 3), 120, np.uint8), np.full((60, 106), 0.9, np.float32)
    for tick in range(1, ticks + 1):
        stamp = begin_ns + tick * TICK
        image = RgbdFrame(rgb=rgb, depth=depth, intrinsics=(78.0, 78.0, 52.5, 29.5), stamp_ns=stamp - 1)
        frames.append(
            SensorFrame(
                stamp_ns=stamp,
                attitude=np.array([1.0, 0.0, 0.0, 0.0]),
                angular_velocity=rng.normal(0.0, 1e-3, 3),
                specific_force=np.array([0.0, 0.0, -9.81]) + rng.normal(0.0, 0.02, 3),
                wrench=np.array([0.0, 0.0, -TOOL_N, 0.0, 0.25 * TOOL_N, 0.0]) + rng.normal(0.0, 0.05, 6),
                wrench_stamp_ns=stamp,
                image=image if tick % 50 == 1 else None,
            )
        )
    return frames


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a bag, whose IMU has a name of its own, and the run of its flight."""
    folder = tmp_path_factory.mktemp("bag")
    write_bag(hover(begin_ns=EPOCH_NS), folder / "my bag", Topics(imu="/mavros/imu/data"))
    (folder / "topics.toml").write_text('imu = "/mavros/imu/data"\n')
    (folder / "bridge.toml").write_text('domain_id = 3\n[topics]\nimu = "/mavros/imu/data"\n')
    words = ["replay", str(folder / "my bag"), "--topics", str(folder / "topics.toml"), "--out", str(folder / "run")]
    assert main([*words, "--json"]) == 0
    return folder


def test_a_bag_prints_phases_refusals_and_counts(flown: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = json.loads((flown / "run" / "bag.json").read_text())
    assert (content["frames"], content["pictures"], content["left_out"], content["differences"]) == (TICKS, 4, {}, [])
    assert sum(content["outcomes"].values()) == sum(content["safety"].values()) == TICKS
    words = ["replay", str(flown / "my bag"), "--topics", str(flown / "bridge.toml"), "--out", str(flown / "two")]
    assert main(words) == 0
    text = capsys.readouterr().out
    assert f"{TICKS} frames in 0.80 s, 4 with a picture" in text and "left out of the bag: nothing" in text
    assert f"Log: {flown / 'two' / 'bag.mcap'}" in text
    assert "at the end: start, waits for wall" in text
    assert main(["replay", str(flown / "my bag" / "metadata.yaml"), *words[2:-1], str(flown / "three")]) == 0


def test_its_log_replays_and_explains(flown: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(flown / "run" / "bag.mcap")
    assert main(["replay", log]) == 0
    assert f"Bit-identical over {TICKS} ticks." in capsys.readouterr().out
    assert main(["explain", log, "--at", "0.5", "--json"]) == 0
    tick = json.loads(capsys.readouterr().out)
    assert tick["t"] == pytest.approx(0.5, abs=0.002) and tick["phase"] != "own loop"
    np.testing.assert_allclose(tick["thrusts"], tick["flown_thrusts"], atol=0.05)
    assert {task["name"] for task in tick["tasks"]} >= {"roll", "pitch", "yaw"}
    assert main(["explain", str(flown / "run"), "--at", "0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == tick
    for at, words in (("2.0", "the log lasts from 0 to 0.80 s"), ("-1", "the log begins at 0")):
        assert main(["explain", log, "--at", at]) == 2
        assert words in capsys.readouterr().err


def test_a_bag_that_is_refused_in_flight_or_makes_no_frame_leaves_no_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_bag(hover(120)[1:], tmp_path / "bag")
    preset = dump_toml(PilotConfig(camera=CameraConfig(distortion=(0.1, 0.0, 0.0, 0.0, 0.0))))
    (tmp_path / "lens.toml").write_text(preset)
    write_bag([dataclasses.replace(each, wrench=np.full(6, np.nan)) for each in hover(9)[1:]], tmp_path / "blind")
    for words, text in (
        (["bag", "--preset", "lens.toml"], "the lens of camera_info"),
        (["blind"], "no frame can be made; left out: 8 times wrench: not finite"),
    ):
        places = [word if word.startswith("--") else str(tmp_path / word) for word in words]
        assert main(["replay", *places, "--out", str(tmp_path / "run")]) == 2
        assert text in capsys.readouterr().err and not (tmp_path / "run").exists()


def test_phases_begin_at_the_first_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(hover(1500, EPOCH_NS)[1:], tmp_path / "bag", Topics(color=""))
    assert main(["replay", str(tmp_path / "bag"), "--out", str(tmp_path / "run"), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["phases"] and all(0.0 <= begin_s < 6.0 for begin_s, _, _ in content["phases"])


def test_the_log_of_an_own_loop_explains_the_tick_that_it_flew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    controller, flown = HybridController(), []
    reference = Reference(standoff=0.2, lines=(LineReference(rho=-0.1, theta=np.pi / 2, role="horizontal"),))
    line = LineFeature(rho=-0.09, theta=np.pi / 2, covariance=1e-6 * np.eye(2), role="horizontal")
    with Recorder(tmp_path / "own.mcap", controller) as recorder:
        for tick in range(1, 41):
            measurement = Measurement(
                stamp_ns=tick * TICK,
                attitude=np.array([1.0, 0.0, 0.0, 0.0]),
                angular_velocity=np.zeros(3),
                specific_force=np.array([0.0, 0.0, -9.81]),
                contact_wrench=np.zeros(6),
                wrench_stamp_ns=tick * TICK,
                lines=(dataclasses.replace(line, rho=line.rho + 1e-4 * tick),),
                plane=(0.0, 0.0, 1.25, -1.0),
                plane_stamp_ns=tick * TICK,
            )
            flown.append(recorder.step(measurement, reference))
    assert main(["explain", str(tmp_path / "own.mcap"), "--at", "0.1", "--json"]) == 0
    tick = json.loads(capsys.readouterr().out)
    assert tick["phase"] == "own loop"
    np.testing.assert_allclose(tick["flown_thrusts"], flown[25].thrusts, rtol=0.0, atol=1e-12)
    achieved = {task["name"]: task["achieved"] for task in tick["tasks"]}
    for report in flown[25].tasks:
        assert achieved[report.name] == pytest.approx(report.achieved, abs=2e-3), report.name


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["{bag}"], "no topic /imu/data for imu .* of such a type are /mavros/imu/data"),
        (["{bag}", "--topics", "{bag}/metadata.yaml"], "metadata.yaml"),
        (["{bag}", "--repair", "x"], "--repair is for logs"),
        (["{folder}/nothing.mcap"], "nothing.mcap"),
        (["{folder}/topics.toml"], "no MCAP file"),
    ],
)
def test_refusals_are_one_line(
    flown: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words, text
) -> None:
    monkeypatch.chdir(tmp_path)
    filled = [word.format(bag=flown / "my bag", folder=flown) for word in words]
    assert re.search(text, refusal(["replay", *filled], capsys))
    assert not any(tmp_path.rglob("*.mcap"))


def test_logs_and_bags_are_told_by_content(flown: Path) -> None:
    assert is_bag(flown / "my bag") and is_bag(next((flown / "my bag").glob("*.mcap")))
    assert not is_bag(flown / "run" / "bag.mcap") and not is_bag(flown / "topics.toml")


def test_the_page_has_every_role_and_type() -> None:
    page = BAGS.read_text(encoding="utf-8")
    for role, types in ACCEPTED.items():
        (row,) = (line for line in page.splitlines() if line.startswith(f"| `{role}` |"))
        assert all(each.replace("/msg/", "/") in row for each in types), role
