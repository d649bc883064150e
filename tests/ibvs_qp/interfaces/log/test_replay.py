"""Recorded flights replay bit-identically; another controller differs, where it says."""

from __future__ import annotations

import copy
import dataclasses
from pathlib import Path
from typing import Any

import pytest
from recorded_flights import flown, logged, record
from recorded_inputs import overwrite

import ibvs_qp.interfaces.log.recorder
import ibvs_qp.interfaces.log.writer
from ibvs_qp import ControllerConfig, HybridController, Pilot, PilotConfig, SafetySettings, preset
from ibvs_qp.command import SafetyState
from ibvs_qp.config.errors import ConfigError, IbvsQpError
from ibvs_qp.config.files import parse_toml
from ibvs_qp.config.settings import from_dict
from ibvs_qp.interfaces.log import Recorder, compare_preset, read_log, repair, replay
from sim.commands.cli import main
from tests.replay.cases import CASES


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pilot", "controller", "assured"])
@pytest.mark.parametrize("case", ["rotor_loss", "broken_inputs", "paint_paper_law"])
def test_replays_to_the_bit(tmp_path: Path, case: str, kind: str) -> None:
    recorder = record(tmp_path / "a.mcap", case, kind, 1500)
    assert recorder.dropped == 0 and recorder.problem == ""
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 1500 and result.complete and result.missing == 0, result


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_ten_thousand_ticks_replay_to_the_bit(tmp_path: Path) -> None:
    subject, inputs = flown("heavy_noise", "pilot")
    frames = [given[0] for given in inputs]
    span = frames[-1].stamp_ns - frames[0].stamp_ns + 4_000_000
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        for lap in range(4):  # from lap to lap the inputs jump, which the estimators and the supervisor meet, too
            for frame in frames[: 10_000 - lap * len(frames)]:
                stamps = {name: getattr(frame, name) + lap * span for name in ("stamp_ns", "wrench_stamp_ns")}
                recorder.step(dataclasses.replace(frame, **stamps))
                recorder.writer.wait_for_room()
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 10_000, result


def test_a_supervised_pilot_replays_to_the_bit(tmp_path: Path) -> None:
    """With its fixed thrusts: no frame comes until the supervisor ends the flight; then a reset."""
    config = dataclasses.replace(CASES["rotor_loss"].config(), safety=SafetySettings())
    _, inputs = flown("rotor_loss", "pilot")
    frames = [given[0] for _, given in zip(range(600), inputs, strict=False)]
    states = set()
    with Recorder(tmp_path / "a.mcap", Pilot(config)) as recorder:
        for _ in range(2):
            for index, frame in enumerate(frames):
                states.add(recorder.step(frame if index % 50 and index < 300 else None).safety)
                recorder.writer.wait_for_room()
            recorder.reset()
    assert {SafetyState.NOMINAL, SafetyState.TERMINATED} <= states
    flight = read_log(tmp_path / "a.mcap")
    calls = [tick.given.call for tick in flight.ticks()]
    assert calls.count("reset") == 2 and calls.count("supervisor") > 100
    assert from_dict(PilotConfig, parse_toml(flight.facts["config"], "x")) == config
    result = replay(flight)
    assert result.same and result.ticks == 1200, result


def test_encoding_later_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything is copied or never changed: the thread sleeps to the end, the caller overwrites its arrays."""
    monkeypatch.setattr(ibvs_qp.interfaces.log.writer, "ROOM", 10**6)
    monkeypatch.setattr(ibvs_qp.interfaces.log.recorder, "PICTURE_ROOM", 10**6)
    work = ibvs_qp.interfaces.log.writer.LogWriter._work

    def late(self: Any) -> None:
        self._closing.wait()
        work(self)

    monkeypatch.setattr(ibvs_qp.interfaces.log.writer.LogWriter, "_work", late)
    for kind in ("pilot", "controller", "assured"):
        subject, inputs = flown("paint_qp", kind)
        with Recorder(tmp_path / f"{kind}.mcap", subject) as recorder:
            for _, given in zip(range(900), inputs, strict=False):
                own = copy.deepcopy(given)
                command = recorder.step(*own)
                overwrite(own)
                overwrite((command.thrusts, command.wrench, command.unallocated_wrench))
        result = replay(read_log(tmp_path / f"{kind}.mcap"))
        assert result.same and result.ticks == 900, (kind, result)


@pytest.mark.slow
def test_other_controllers_differ_and_say_where(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", "press_beyond_reach", "pilot", 1700)
    flight, config = read_log(tmp_path / "a.mcap"), CASES["press_beyond_reach"].config()
    assert compare_preset(flight, config).same
    result = compare_preset(flight, preset("paper"))
    assert not result.same and result.ticks == 1700 and 0.0 < result.thrust_rms_n < result.thrust_peak_n
    assert result.push_ticks > 100 and result.push_recorded_n != result.push_preset_n
    assert sum(result.limits_recorded.values()) > sum(result.limits_preset.values())
    with pytest.raises(ConfigError, match=r"8 rotors.* 6"):
        compare_preset(flight, preset("octorotor_qp"))
    heavier = dataclasses.replace(config.controller.vehicle, mass_kg=6.1)
    result = replay(flight, HybridController(dataclasses.replace(config.controller, vehicle=heavier)))
    assert result.first is not None and result.largest["thrusts"].amount > 0.1 and result.differing == 1700
    ticks = [result.first.tick, *(each.tick for each in result.largest.values())]
    assert min(ticks) == result.first.tick <= result.largest["thrusts"].tick < 1700


def test_a_controller_of_ones_own_is_replayed_by_its_owner(tmp_path: Path) -> None:
    class Own(HybridController):
        pass

    with Recorder(tmp_path / "a.mcap", Own(ControllerConfig())) as recorder:
        recorder.step(None, None)
    with pytest.raises(ConfigError, match=r"law of its own.*\.Own"):
        replay(read_log(tmp_path / "a.mcap"))
    assert replay(read_log(tmp_path / "a.mcap"), Own(ControllerConfig())).same


def test_a_repaired_log_has_the_same_ticks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path / "a.mcap", "rotor_loss", "controller", 600)
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    cut, mended = read_log(tmp_path / "cut.mcap"), tmp_path / "mended.mcap"
    before = replay(cut)
    assert before.same and 100 < before.ticks < 600 and not before.complete

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch, pytest.raises(IbvsQpError, match="No space left"):
        patch.setattr("ibvs_qp.interfaces.log.reader._copy", fail)
        repair(cut, mended)
    repair(cut, mended)  # the failed attempt left no file
    after = replay(read_log(mended))
    assert after.same and after.ticks == before.ticks and not after.complete  # the end is lost
    assert [topic for topic, _ in logged(mended)].count("/control") >= after.ticks
    with pytest.raises(IbvsQpError, match="cannot write"):
        repair(cut, mended)


def test_without_a_tick_nothing_is_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A log of a reset, and one whose first tick is missing."""
    with Recorder(tmp_path / "a.mcap", HybridController()) as recorder:
        recorder.reset()
    subject, inputs = flown("rotor_loss", "controller")
    with Recorder(tmp_path / "b.mcap", subject) as recorder:
        recorder._tick = 1
        recorder.step(*next(inputs))
    for file, missing in ((tmp_path / "a.mcap", 0), (tmp_path / "b.mcap", 1)):
        flight = read_log(file)
        for result in (replay(flight), compare_preset(flight, preset("qp"))):
            assert (result.same, result.ticks, result.missing) == (False, 0, missing)
        for words in ([], ["--preset", "tarot_t960_qp"]):
            assert main(["replay", str(file), *words]) == 0
            assert "Nothing was compared" in capsys.readouterr().out


def test_inputs_by_name_are_recorded_in_their_places(tmp_path: Path) -> None:
    subject, inputs = flown("rotor_loss", "controller")
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        for _, (measurement, reference) in zip(range(20), inputs, strict=False):
            recorder.step(reference=reference, measurement=measurement)
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 20 and recorder.dropped == 0
