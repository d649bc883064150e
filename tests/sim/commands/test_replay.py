"""``ibvs-qp replay``, and the log that ``ibvs-qp paint --log mcap`` writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from recorded_flights import record

from ibvs_qp.pilot.presets import FOLDER
from sim.commands.cli import main
from sim.flight.flight_log import load_run

POSES = ("/vehicle/pose", "/truth/pose")
SCENE = "[paint]\nrows = 1\nstroke_m = 0.2\n"


def paint(folder: Path, *words: str) -> Path:
    """Run folder of a short flight."""
    (folder / "scene.toml").write_text(SCENE)
    scene = ["--law", "qp", "--scene", str(folder / "scene.toml")]
    assert main(["paint", "--log", "mcap", "--no-video", *scene, "--out", str(folder / "run"), "--json", *words]) == 0
    return folder / "run"


@pytest.mark.slow
def test_a_painted_flight_replays_to_the_bit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flown = paint(tmp_path, "--features", "geometric")
    capsys.readouterr()
    assert main(["replay", str(flown / "flight_qp.mcap"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    ticks = len(load_run(flown)["qp"].t)
    assert said["same"] and said["first"] is None and said["ticks"] == ticks > 2000 and said["complete"]
    assert main(["replay", str(flown / "flight_qp.mcap")]) == 0
    assert f"Bit-identical over {ticks} ticks." in capsys.readouterr().out


@pytest.mark.slow
def test_the_log_has_pictures_poses_and_the_truth_apart(tmp_path: Path) -> None:
    flown = paint(tmp_path, "--image-size", "424x240")
    trace, found = load_run(flown)["qp"], dict[str, list]()
    with open(flown / "flight_qp.mcap", "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, content))
    assert not list(flown.glob("partial-*"))
    truth = {topic for topic in found if topic.startswith("/truth/")}
    assert truth == {"/truth/state", "/truth/tf", "/truth/pose", "/truth/vehicle", "/truth/board"}
    assert len(found["/camera/image"]) > 0.95 * 30.0 * (trace.t[-1] - 1.0)
    control, states = found["/control"], found["/truth/state"]
    assert len(control) == len(states) == len(trace.t)
    np.testing.assert_array_equal([row.command.thrusts[0] for _, row in control], trace.thrusts[:, 0])
    assert max(row.push_reference_n for _, row in control) == 5.0 and max(row.push_n for _, row in control) > 4.9
    np.testing.assert_allclose([row.tip_m[0] for _, row in states], trace.tip[:, 0], atol=1e-12)
    assert [row.phase for _, row in control] == [trace.phases[index] for index in trace.phase]
    # Estimate and truth of the pose lie in one frame at the wall; the estimate drifts along it by a few millimetres.
    # Along the normal it stays at the wall for 0.3 s when the tip leaves, until the planes contradict it.
    (stamps, estimates), (true_stamps, truths) = (zip(*found[topic], strict=True) for topic in POSES)
    settled = np.array(stamps) > 5_000_000_000
    for axis, bound in (("x", 0.03), ("y", 0.05), ("z", 0.05)):
        estimated, real = ([getattr(pose.pose.position, axis) for pose in poses] for poses in (estimates, truths))
        off = np.array(estimated) - np.interp(stamps, true_stamps, real)
        assert np.abs(off[settled]).max() < bound, axis


@pytest.mark.slow
def test_another_preset_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.mcap"
    record(file, "press_beyond_reach", "pilot", 1700)
    assert main(["replay", str(file), "--preset", "tarot_t960_paper"]) == 0
    said = capsys.readouterr().out
    assert "thrusts: difference" in said and "push task" in said and "limit thrust_" in said
    assert main(["replay", str(file), "--preset", str(FOLDER / "tarot_t960_qp.toml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ticks"] == 1700
    assert main(["replay", str(file), "--preset", "octorotor_qp"]) == 2
    assert "'8 rotors' is refused: the log has 6" in capsys.readouterr().err


def test_a_cut_log_is_repaired(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.mcap"
    record(file, "rotor_loss", "pilot", 600)
    file.write_bytes(file.read_bytes()[: 2 * file.stat().st_size // 3])
    assert main(["replay", str(file), "--repair", str(tmp_path / "b.mcap")]) == 0
    said = capsys.readouterr().out
    assert "Bit-identical" in said and "The log has no end" in said and "Written:" in said
    assert main(["replay", str(tmp_path / "b.mcap")]) == 0
    assert "Bit-identical" in capsys.readouterr().out
    assert main(["replay", str(file), "--repair", str(tmp_path / "b.mcap")]) == 2
    assert "File exists" in capsys.readouterr().err
