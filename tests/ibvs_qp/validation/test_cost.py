"""A tick costs the same whatever the size of its inputs: it looks at a few lines and at no giant array."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import measured
from recorded_inputs import recording
from references import good_reference

from ibvs_qp.analytic import PaperController
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import FeatureFrame, LineFeature, LineReference, Measurement, Reference, RgbdFrame, SensorFrame
from ibvs_qp.pilot import Pilot
from tests.replay.cases import CASES

LAWS = [HybridController, PaperController]
MANY = 10**6
#: Far above a tick's 0.2 ms on a busy machine, far below the seconds that so many lines or numbers would take [s].
LONGEST_STEP = 0.1
#: A gigabyte-sized array without memory: whoever copies it, runs out of it.
GIANT = np.broadcast_to(0.0, (10**11,))
PICTURE = RgbdFrame(
    rgb=np.broadcast_to(np.uint8(0), (10**6, 10**6, 3)),
    depth=np.broadcast_to(np.float32(0.5), (10**6, 10**6)),
    intrinsics=(600.0, 600.0, 5e5, 5e5),
    stamp_ns=4_000_000,
)


class Counted(LineFeature):
    """A line that counts how often it is looked at."""

    looks = 0

    def __getattribute__(self, name: str) -> Any:
        if name == "rho":
            Counted.looks += 1
        return super().__getattribute__(name)


COUNTED = Counted(rho=5.0, theta=0.0, covariance=np.eye(2), role="horizontal")


def in_time(step: Callable[[], Any]) -> Any:
    begin = time.perf_counter()
    command = step()
    assert time.perf_counter() - begin < LONGEST_STEP
    assert np.isfinite(command.thrusts).all()
    return command


@pytest.mark.parametrize("law", LAWS)
def test_of_a_million_lines_four_per_slot_are_looked_at(law: Callable[[], Any]) -> None:
    controller = law()
    controller.step(measured(0), good_reference())
    slots = controller.config.line_slots
    wanted = LineReference(rho=0.0, theta=0.0, role="vertical")
    Counted.looks = 0
    command = in_time(lambda: controller.step(measured(1, lines=(COUNTED,) * MANY), Reference(lines=(wanted,) * MANY)))
    assert Counted.looks <= 2 * 4 * slots, "to check it, and to copy it"
    assert command.rejected == (
        f"lines: {MANY} given, only the first {4 * slots} are looked at",
        f"reference.lines: {MANY} given, room for line_slots = {slots}",
    )
    in_time(lambda: controller.step(measured(2, lines=(None,) * MANY), Reference(lines=[3] * MANY)))  # type: ignore[arg-type]


def test_a_pilot_looks_at_as_many() -> None:
    pilot, frame = Pilot(), recording("rotor_loss").frames[0]
    in_time(lambda: pilot.step(frame))
    Counted.looks = 0
    seen = FeatureFrame(lines=(COUNTED,) * MANY, plane=None, stamp_ns=frame.stamp_ns)
    command = in_time(lambda: pilot.step(replace(recording("rotor_loss").frames[1], features=seen)))
    assert Counted.looks <= 2 * 4 * pilot.config.controller.line_slots
    assert command.rejected[0].startswith(f"features.lines: {MANY} given")


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("giant", [GIANT, [0.0] * MANY, "x" * MANY])
def test_no_giant_is_copied_into_a_controller(law: Callable[[], Any], giant: Any) -> None:
    controller = law()
    controller.step(measured(0), good_reference())
    for tick, field in enumerate(fields(Measurement), 1):
        seen = measured(tick, **{field.name: giant})
        in_time(lambda seen=seen: controller.step(seen, good_reference()))
    for tick, field in enumerate(fields(Reference), 100):
        wanted = replace(good_reference(), **{field.name: giant})
        in_time(lambda wanted=wanted, tick=tick: controller.step(measured(tick), wanted))


@pytest.mark.parametrize("giant", [GIANT, [0.0] * MANY, "x" * MANY])
def test_no_giant_is_copied_into_a_pilot(giant: Any) -> None:
    flight, pilot = recording("rotor_loss"), CASES["rotor_loss"].pilot()
    for tick, field in enumerate(fields(SensorFrame)):
        frame = replace(flight.frames[tick], **{field.name: giant})
        in_time(lambda frame=frame: pilot.step(frame))
    for tick, field in enumerate(fields(FeatureFrame), 100):
        seen = replace(FeatureFrame(lines=(), plane=None, stamp_ns=tick * 4_000_000), **{field.name: giant})
        in_time(lambda seen=seen, tick=tick: pilot.step(replace(flight.frames[tick], features=seen)))
    pilot.thrust_limits = giant
    pilot.thrust_limits = (giant, giant)


def test_a_picture_beyond_any_camera_is_refused_by_name() -> None:
    pilot, frame = Pilot(), recording("rotor_loss").frames[0]
    pilot.prepare()
    pilot.step(frame)
    now = recording("rotor_loss").frames[1]
    command = in_time(lambda: pilot.step(replace(now, image=replace(PICTURE, stamp_ns=now.stamp_ns))))
    assert command.rejected == ("image: picture of 1000000 x 1000000 px is too large",)
