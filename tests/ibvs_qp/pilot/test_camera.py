"""Perception loads before a flight or beside it; a step never waits for it, and its results do not depend on when."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from recorded_inputs import recording

from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.perception_loader import PerceptionLoader
from tests.replay.cases import CASES

#: A step on a busy machine [s]; loading takes 0.3 s and more.
LONGEST_STEP = 0.1
LOADING = "image: perception is loading"


def pictures() -> list[SensorFrame]:
    return [frame for frame in recording("paint_qp").frames if frame.image is not None]


def new_pilot() -> Pilot:
    return Pilot(CASES["paint_qp"].config())


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Loading hangs until it is set, as with a slow compiler."""
    opened, construct = threading.Event(), PerceptionLoader._construct

    def late(loader: PerceptionLoader):
        assert opened.wait(5.0)
        return construct(loader)

    monkeypatch.setattr(PerceptionLoader, "_construct", late)
    return opened


def test_a_picture_before_perception_is_refused_by_name_and_blocks_no_step(gate: threading.Event) -> None:
    pilot, seen = new_pilot(), pictures()
    for frame in seen[:4]:
        begin = time.perf_counter()
        command = pilot.step(frame)
        assert time.perf_counter() - begin < LONGEST_STEP
        assert command.rejected == (LOADING,) and pilot.perception_result is None
    pilot.reset()
    gate.set()
    pilot.prepare()
    assert pilot.step(seen[0]).rejected == () and pilot.perception_result is not None


@pytest.mark.parametrize("perception", ["own", "paper"])
def test_a_prepared_pilot_sees_its_first_picture(perception: str) -> None:
    seen = pictures()
    pilots = [Pilot(replace(CASES["paint_qp"].config(), perception=perception)) for _ in range(3)]
    for pilot, picture in zip(pilots, (None, seen[5].image, seen[0].image), strict=True):
        pilot.prepare(picture)
    pilots[1].prepare()
    for frame in seen[:12]:
        commands = [pilot.step(frame) for pilot in pilots]
        assert LOADING not in commands[0].rejected
        for pilot, command in zip(pilots[1:], commands[1:], strict=True):
            np.testing.assert_array_equal(command.thrusts, commands[0].thrusts)
            assert pilot.perception_result is not None and pilots[0].perception_result is not None
            assert pilot.perception_result.features.plane == pilots[0].perception_result.features.plane
    pilots[0].reset()
    assert LOADING not in pilots[0].step(seen[0]).rejected, "a reset keeps what is loaded"


def test_features_load_no_perception(gate: threading.Event) -> None:
    pilot, before = Pilot(), set(threading.enumerate())
    for frame in recording("rotor_loss").frames[:40]:
        pilot.step(frame)
    assert set(threading.enumerate()) <= before and not gate.is_set()


def test_perception_that_cannot_be_loaded_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: PerceptionLoader):
        raise ImportError("no OpenCV")

    monkeypatch.setattr(PerceptionLoader, "_construct", missing)
    pilot, (first, second, *_) = new_pilot(), pictures()
    with pytest.raises(RuntimeError, match="perception: ImportError in missing"):
        pilot.prepare()
    for frame in (first, second):
        command = pilot.step(frame)
        assert [reason for reason in command.rejected if reason.startswith("image: perception: ImportError")]
    assert np.isfinite(command.thrusts).all()


@pytest.mark.parametrize(
    ("noise", "doubt"),
    [(0.0, ""), (0.03, "depth scatters by at least 1."), (0.06, "depth scatters by 6.")],
)
def test_noise_of_the_depth_picture_reaches_the_supervisor_as_the_cause(
    noise: float, doubt: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pilot, rng, doubts = new_pilot(), np.random.default_rng(0), []
    pilot.prepare()
    watch = pilot.supervision.watch

    def watched(tick, response) -> None:
        doubts.append(tick.plane_doubt)
        watch(tick, response)

    monkeypatch.setattr(pilot.supervision, "watch", watched)
    for seen in pictures()[:20]:
        assert seen.image is not None
        depth = seen.image.depth * (1.0 + noise * rng.standard_normal(seen.image.depth.shape))
        image = replace(seen.image, depth=depth.astype(seen.image.depth.dtype))
        rejected = pilot.step(replace(seen, image=image)).rejected
        assert (f"image: {doubts[-1]}" in rejected) == doubts[-1].endswith("holds together")
    assert any(found.startswith(doubt) for found in doubts) and (noise > 0.0) == any(doubts)
