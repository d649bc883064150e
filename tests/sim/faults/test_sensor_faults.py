"""Faults of sensors and of time: what the pilot gets instead of a frame."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.frames import roll_pitch
from ibvs_qp.measurement import HORIZONTAL, FeatureFrame, LineFeature, RgbdFrame, SensorFrame
from ibvs_qp.validation.fields import SENSOR_FRAME
from sim.faults.camera import CameraFrozen, CameraJitter, CameraLatency, CameraLost, CameraReordered
from sim.faults.clock import ClockJump, LoopStall, SlowLoop, TicksSkipped
from sim.faults.fault import ChannelFault
from sim.faults.features import DepthFlipped, FeatureNan, LinesLost, PlaneLost, WrongLines
from sim.faults.force_torque import ForceTorqueBias, ForceTorqueLost, ForceTorqueNan, ForceTorqueStuck, ForceTorqueZero
from sim.faults.imu import AccelerometerBias, AttitudeStep, GyroBias, ImuNan, ImuStuck
from sim.faults.picture import PictureCovered

#: A tick and an F/T sample [ns]; every eighth tick brings a picture that is 60 ms old.
TICK, SAMPLE, PICTURE_TICKS, AGE = 4_000_000, 10_000_000, 8, 60_000_000
#: Ticks before the first one: no stamp is negative.
EARLY = 1000


def features(stamp_ns):
    number = stamp_ns // TICK
    line = LineFeature(
        rho=1e-3 * number, theta=0.5 * math.pi, covariance=1e-6 * np.eye(2), role=HORIZONTAL, stamp_ns=stamp_ns
    )
    return FeatureFrame(
        lines=(line, dataclasses.replace(line, track_id=1)),
        plane=(0.01, 0.02, 2.0, -1.0),
        stamp_ns=stamp_ns,
        velocity=np.array([0.1, 0.2, 0.3]),
        velocity_covariance=np.eye(3),
        velocity_stamp_ns=stamp_ns,
    )


def frames(count=80):
    """Frames of a vehicle at which every number changes with time."""
    for tick in range(EARLY, EARLY + count):
        now = tick * TICK
        yield SensorFrame(
            stamp_ns=now,
            attitude=np.array([1.0, 0.0, 0.0, 0.0]),
            angular_velocity=np.full(3, 1e-3 * tick),
            specific_force=np.array([0.0, 0.0, -9.81 + 1e-3 * tick]),
            wrench=np.full(6, 1e-2 * (now // SAMPLE)),
            wrench_stamp_ns=now // SAMPLE * SAMPLE,
            features=features(now - AGE) if tick % PICTURE_TICKS == 0 else None,
        )


def through(fault, count=80):
    """Pairs of the frame given and the frame that the pilot gets."""
    change = fault.filter(np.random.default_rng(0))
    return [(frame, change(frame)) for frame in frames(count)]


def pictures(pairs):
    """Delivered pictures: time of delivery and stamp [ns]."""
    return [(got.stamp_ns, got.features.stamp_ns) for _, got in pairs if got is not None and got.features is not None]


def test_a_lost_camera_delivers_nothing_and_the_rest_stays():
    pairs = through(CameraLost())
    assert not pictures(pairs)
    assert all(got.wrench is frame.wrench and got.attitude is frame.attitude for frame, got in pairs)


def test_latency_delays_delivery_and_keeps_the_stamps():
    extra = 0.12
    found = pictures(through(CameraLatency(extra_s=extra)))
    assert found[0] == ((EARLY * TICK) + round(extra * 1e9), EARLY * TICK - AGE)
    assert {now - stamp for now, stamp in found} == {AGE + round(extra * 1e9)}


def test_jitter_varies_the_delay_in_order():
    found = pictures(through(CameraJitter(jitter_s=0.1), 400))
    ages = [(now - stamp) * 1e-9 for now, stamp in found]
    assert min(ages) < 0.08 and 0.12 < max(ages) < 0.165
    assert [stamp for _, stamp in found] == sorted(stamp for _, stamp in found)


def test_reordered_pictures_come_in_swapped_pairs():
    stamps = [stamp for _, stamp in pictures(through(CameraReordered()))]
    step = PICTURE_TICKS * TICK
    assert np.diff(stamps).tolist()[:5] == [-step, 3 * step, -step, 3 * step, -step]


def test_a_frozen_camera_repeats_the_first_picture_with_fresh_stamps():
    pairs = through(CameraFrozen())
    seen = [(frame.features, got.features) for frame, got in pairs if frame.features is not None]
    assert len(seen) > 5
    for given, got in seen:
        assert got.stamp_ns == given.stamp_ns == got.velocity_stamp_ns == got.lines[0].stamp_ns
        assert got.lines[0].rho == seen[0][0].lines[0].rho


def test_plane_and_lines_can_be_lost_alone():
    for _, got in through(PlaneLost()):
        assert got.features is None or (got.features.plane is None and len(got.features.lines) == 2)
    for _, got in through(LinesLost()):
        assert got.features is None or (got.features.plane is not None and not got.features.lines)
    left = [len(got.features.lines) for _, got in through(LinesLost(share=0.5), 800) if got.features is not None]
    assert sum(left) / len(left) == pytest.approx(1.0, abs=0.25) and {0, 1, 2} == set(left)


def test_wrong_lines_are_some_of_them_and_far_off():
    pairs = [(f.features, g.features) for f, g in through(WrongLines(share=0.3, rho=0.2), 1600) if f.features]
    off = np.array([b.rho - a.rho for f, g in pairs for a, b in zip(f.lines, g.lines, strict=True)])
    assert np.mean(off != 0.0) == pytest.approx(0.3, abs=0.08) and 0.15 < np.abs(off).max() <= 0.2


def test_depth_is_mirrored_or_behind_the_camera():
    planes = {what: through(DepthFlipped(what=what))[0][1].features.plane for what in ("normal", "sign")}
    assert planes == {"normal": (-0.01, -0.02, 2.0, -1.0), "sign": (-0.01, -0.02, -2.0, -1.0)}


@pytest.mark.parametrize("field", ["plane", "rho", "theta", "covariance", "velocity", "velocity_covariance"])
def test_one_field_of_one_picture_is_not_a_number(field):
    got = [got.features for _, got in through(FeatureNan(field=field)) if got.features is not None]
    values = [np.asarray(getattr(f if hasattr(f, field) else f.lines[0], field)) for f in got]
    assert [bool(np.isnan(value).any()) for value in values] == [True] + [False] * (len(got) - 1)


def test_faults_of_features_refuse_pictures():
    rgb, depth = np.zeros((2, 2, 3), np.uint8), np.ones((2, 2), np.float32)
    image = RgbdFrame(rgb=rgb, depth=depth, intrinsics=(1.0, 1.0, 0.0, 0.0), stamp_ns=0)
    frame = dataclasses.replace(next(frames()), features=None, image=image)
    with pytest.raises(ConfigError, match="geometric"):
        PlaneLost().filter(np.random.default_rng(0))(frame)
    late = CameraLatency(extra_s=0.0).filter(np.random.default_rng(0))(frame)
    assert late is not None and late.image is image


def test_a_lost_force_sensor_has_an_old_stamp_and_a_stuck_one_a_fresh_one():
    for kind, fresh in ((ForceTorqueLost, False), (ForceTorqueStuck, True)):
        first, *_, last = through(kind())
        assert np.array_equal(last[1].wrench, first[0].wrench)
        assert (last[1].wrench_stamp_ns == last[0].wrench_stamp_ns) == fresh


def test_a_force_sensor_reads_nothing_zero_or_more():
    frame, got = through(ForceTorqueNan())[-1]
    assert np.isnan(got.wrench).all() and got.wrench_stamp_ns == frame.wrench_stamp_ns
    assert not through(ForceTorqueZero())[-1][1].wrench.any()
    frame, got = through(ForceTorqueBias(force_n=(-4.0, 0.0, 0.0)))[-1]
    assert got.wrench - frame.wrench == pytest.approx([-4.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_the_inertial_unit_is_stuck_or_not_a_number():
    first, *_, last = through(ImuStuck())
    assert np.array_equal(last[1].angular_velocity, first[0].angular_velocity) and last[1].stamp_ns == last[0].stamp_ns
    assert not np.array_equal(last[0].angular_velocity, first[0].angular_velocity)
    first, *_, last = through(ImuStuck(fresh=False))
    assert (last[1].attitude_stamp_ns, last[1].imu_stamp_ns) == (first[0].stamp_ns, first[0].stamp_ns)
    frame, got = through(ImuNan(output="specific_force"))[-1]
    assert np.isnan(got.specific_force).all() and got.attitude is frame.attitude
    assert np.isnan(through(ImuNan())[-1][1].attitude).all()


@pytest.mark.parametrize("row", SENSOR_FRAME.rows, ids=lambda row: row.name)
def test_every_channel_fails_in_three_ways(row):
    _, got = through(ChannelFault(channel=row.name, how="nan"))[-1]
    assert np.isnan(getattr(got, row.name)).all() and np.shape(getattr(got, row.name)) == row.shape
    for how in ("stuck", "lost"):
        first, *_, last = through(ChannelFault(channel=row.name, how=how))
        assert np.array_equal(getattr(last[1], row.name), getattr(first[0], row.name))
        since = getattr(first[0], row.stamp)
        expected = getattr(last[0], row.stamp) if how == "stuck" else first[0].stamp_ns if since is None else since
        assert getattr(last[1], row.stamp) == expected


def test_biases_and_steps_of_the_inertial_unit():
    frame, got = through(GyroBias(rate_deg_s=(3.0, 0.0, 0.0)))[-1]
    assert got.angular_velocity - frame.angular_velocity == pytest.approx([math.radians(3.0), 0.0, 0.0])
    frame, got = through(AccelerometerBias(force_m_s2=(0.0, 0.5, 0.0)))[-1]
    assert got.specific_force - frame.specific_force == pytest.approx([0.0, 0.5, 0.0])
    for turn, expected in (((3.0, 0.0, 0.0), (3.0, 0.0)), ((0.0, -2.0, 0.0), (0.0, -2.0))):
        assert np.degrees(roll_pitch(through(AttitudeStep(turn_deg=turn))[-1][1].attitude)) == pytest.approx(expected)


def test_a_clock_leap_moves_what_is_taken_after_it():
    first, *_, last = through(ClockJump(offset_s=-2.0))
    assert first[1].stamp_ns == first[0].stamp_ns - 2_000_000_000
    assert first[1].features.stamp_ns == first[0].features.stamp_ns  # captured before
    assert last[1].wrench_stamp_ns == last[0].wrench_stamp_ns - 2_000_000_000
    late = [(f.features, g.features) for f, g in through(ClockJump(offset_s=-2.0)) if f.features][-1]
    assert late[1].stamp_ns == late[0].stamp_ns - 2_000_000_000 == late[1].lines[0].stamp_ns


def test_ticks_do_not_take_place():
    assert all(got is None for _, got in through(LoopStall()))
    skipped = np.mean([got is None for _, got in through(TicksSkipped(share=0.2), 2000)])
    assert skipped == pytest.approx(0.2, abs=0.03)
    taken = [index for index, (_, got) in enumerate(through(SlowLoop(rate_hz=50.0))) if got is not None]
    assert set(np.diff(taken)) == {5}


def line_from(*segment, kind="paint"):
    return LineFeature(
        rho=0.0, theta=0.5 * math.pi, covariance=np.eye(2), role=HORIZONTAL, segment=np.array(segment), kind=kind
    )


def spoilt(fault, *lines):
    """The lines that are left of some in one frame."""
    frame = FeatureFrame(lines=lines, plane=None, stamp_ns=0)
    return fault.filter(np.random.default_rng(0))(dataclasses.replace(next(frames(1)), features=frame)).features.lines


def test_lines_of_one_kind_are_lost():
    board, paint = line_from((0, 0), (1, 0), kind="board"), line_from((0, 0), (1, 0))
    assert spoilt(LinesLost(kind_of_line="paint"), board, paint) == (board,)
    assert spoilt(LinesLost(kind_of_line="board"), board, paint) == (paint,)


def test_a_cover_cuts_lines_to_their_longest_clear_piece():
    cover = PictureCovered(right=0.1, half_width=0.1, half_height=0.05)
    (cut,) = spoilt(cover, line_from((-0.3, 0.0), (0.3, 0.0)))
    assert cut.segment == pytest.approx(np.array([[-0.3, 0.0], [0.0, 0.0]]), abs=0.005)
    beside = line_from((-0.3, 0.1), (0.3, 0.1))
    assert spoilt(cover, beside) == (beside,)
    assert spoilt(cover, line_from((0.03, 0.0), (0.21, 0.0))) == ()


def test_a_cover_hides_colour_and_depth_of_its_part_of_the_picture():
    picture = RgbdFrame(
        rgb=np.full((60, 80, 3), 100, np.uint8),
        depth=np.ones((60, 80), np.float32),
        intrinsics=(80.0, 80.0, 39.5, 29.5),
        stamp_ns=0,
    )
    cover = PictureCovered(right=0.25, half_width=0.1, half_height=0.2)
    frame = dataclasses.replace(next(frames(1)), features=None, image=picture)
    got = cover.filter(np.random.default_rng(0))(frame).image
    assert got.rgb.dtype == np.uint8 and got.depth.dtype == np.float32
    assert (got.rgb[30, 60] == 255).all() and got.depth[30, 60] == 0.0
    assert (got.rgb[:, :45] == 100).all() and got.depth[:, :45].all()
    assert 0.0 < np.mean(got.depth == 0.0) == pytest.approx(math.pi * 8 * 16 / (60 * 80), rel=0.1)
    assert (picture.rgb == 100).all()
