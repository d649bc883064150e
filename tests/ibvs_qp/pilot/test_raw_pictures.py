"""The Pilot takes the pictures of a real camera: mono, 16-bit depth, and depth that is not registered to colour."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from recorded_inputs import recording

from ibvs_qp.measurement import RgbdFrame, SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.config import CameraConfig
from tests.replay.cases import CASES

COUNT = 6


def frames() -> list[SensorFrame]:
    return [frame for frame in recording("paint_qp").frames if frame.image is not None][:COUNT]


def pilot(**camera: Any) -> Pilot:
    made = Pilot(dataclasses.replace(CASES["paint_qp"].config(), camera=CameraConfig(**camera)))
    made.prepare()
    return made


def fly(made: Pilot, change: Any) -> tuple[str, ...]:
    rejected: tuple[str, ...] = ()
    for frame in frames():
        assert frame.image is not None
        image = dataclasses.replace(frame.image, **change(frame.image))
        rejected += made.step(dataclasses.replace(frame, image=image)).rejected
    return rejected


def millimetres(image: RgbdFrame) -> dict[str, Any]:
    return {"depth": np.rint(1000.0 * image.depth).astype(np.uint16)}


def mono(image: RgbdFrame) -> dict[str, Any]:
    return {"rgb": image.rgb[..., 1].copy()}


def test_16_bit_depth_of_a_stated_unit_gives_the_same_plane() -> None:
    plain, made = pilot(), pilot(depth_units_per_metre=1000.0)
    assert fly(plain, lambda _: {}) == fly(made, millimetres)
    assert (
        made.perception_result is not None
        and made.perception_result.features is not None
        and plain.perception_result is not None
    )
    assert made.perception_result.features.plane == pytest.approx(plain.perception_result.features.plane, abs=2e-3)
    assert made.picture is not None and made.picture.depth.dtype == np.float32


def test_16_bit_depth_without_a_unit_is_refused_by_name() -> None:
    reasons = fly(pilot(), millimetres)
    assert reasons.count("image: depth picture of type uint16, metres in floating point are needed") == COUNT


def test_a_mono_camera_flies() -> None:
    made = pilot()
    assert not [reason for reason in fly(made, mono) if reason.startswith("image")]
    assert (
        made.perception_result is not None
        and made.perception_result.features is not None
        and made.perception_result.features.plane is not None
    )
    assert made.picture is not None and (made.picture.rgb == made.picture.rgb[..., :1]).all()


def test_depth_of_a_camera_beside_gives_the_same_plane() -> None:
    """The recorded depth, as of a camera at the same place: registration alone is between the two pilots."""
    first = frames()[0].image
    assert first is not None
    plain = pilot()
    made = pilot(depth_intrinsics=tuple(map(float, first.intrinsics)), depth_translation_m=(0.0, 0.0, 0.0))
    assert fly(plain, lambda _: {}) == fly(made, lambda _: {})
    assert (
        made.perception_result is not None
        and made.perception_result.features is not None
        and plain.perception_result is not None
    )
    assert made.perception_result.features.plane == pytest.approx(plain.perception_result.features.plane, abs=2e-3)


def test_the_readout_time_moves_the_lines_of_a_turning_camera() -> None:
    plain, made = pilot(), pilot(readout_s=0.03)
    for each in (plain, made):
        for frame in frames():
            turning = dataclasses.replace(frame, angular_velocity=np.array((0.0, 0.0, 0.4)))
            each.step(turning)
    assert plain.perception_result is not None and made.perception_result is not None
    assert plain.perception_result.features.lines == () or plain.motion.lines.keys() == made.motion.lines.keys()
    pairs = [(line.offset, made.motion.lines[key].offset) for key, line in plain.motion.lines.items()]
    assert pairs and any(abs(one - other) > 1e-4 for one, other in pairs)
