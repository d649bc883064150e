"""Stamps, axes, signs and pictures of single messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

pytest.importorskip("rosbags", reason="needs the extra ros")

from ibvs_qp.interfaces.ros import messages, pictures, samples
from ibvs_qp.interfaces.ros.messages import IMU, PX4_MSGS, SENSOR_COMBINED, VEHICLE_ATTITUDE, BadMessage, message

NOW = 1_700_000_000_123_456_789
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def imu(rate: Any = (0, 0, 0), force: Any = (0, 0, 0)) -> Any:
    return samples.to_imu(NOW, LEVEL, np.array(rate, float), np.array(force, float))


def px4_imu(gyro: Any = (0, 0, 0), force: Any = (0, 0, 0), **fields: Any) -> Any:
    vectors = {"gyro_rad": np.array(gyro, np.float32), "accelerometer_m_s2": np.array(force, np.float32)}
    return message(SENSOR_COMBINED, timestamp=5000, **vectors, **fields)


def changed(value: Any, **fields: Any) -> Any:
    for name, entry in fields.items():
        setattr(value, name, entry)
    return value


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_every_ros_stamp_returns(stamp: int) -> None:
    assert messages.from_ros(messages.header(stamp, "x").stamp) == stamp


@given(st.integers(0, 2**31 * 10**6 - 1))
def test_px4_stamps_lose_less_than_a_microsecond_and_never_lead(us: int) -> None:
    assert messages.to_px4(messages.from_px4(us)) == us == messages.to_px4(1000 * us + 999)


def test_stamps_of_ros_and_impossible_ones() -> None:
    stamp = messages.header(NOW, "x").stamp
    assert (stamp.sec, stamp.nanosec) == (1_700_000_000, 123_456_789)
    for sec, nanosec in ((-1, 0), (0, 10**9), (5, 2**32 - 1)):
        with pytest.raises(BadMessage):
            messages.from_ros(message("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec))
    for us in (2**31 * 10**6, 2**64 - 1):
        with pytest.raises(BadMessage):
            messages.from_px4(us)


def test_an_imu_at_rest_reads_up_in_ros_and_minus_down_here() -> None:
    value = imu([0.1, 0.2, 0.3], [0.0, 0.0, -9.81])
    assert (value.linear_acceleration.z, value.angular_velocity.y) == (9.81, -0.2)
    back = samples.inertial(value)
    assert back.stamp_ns == NOW
    np.testing.assert_array_equal(back.values["specific_force"], [0.0, 0.0, -9.81])
    np.testing.assert_array_equal(back.values["angular_velocity"], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(samples.attitude(value).values["attitude"], LEVEL, atol=1e-15)


def test_facing_north_is_a_yaw_of_90_degrees_in_ros() -> None:
    """Level and facing north: identity in NED; in ENU, yaw counts from east to the left."""
    ros = imu().orientation
    yaw = Rotation.from_quat([ros.x, ros.y, ros.z, ros.w]).as_euler("zyx", degrees=True)
    np.testing.assert_allclose(yaw, [90.0, 0.0, 0.0], atol=1e-9)


def test_px4_is_in_our_axes() -> None:
    sample = samples.inertial(px4_imu([0.1, 0.2, 0.3], [0.0, 0.5, -9.5]))
    np.testing.assert_allclose(sample.values["specific_force"], [0.0, 0.5, -9.5], rtol=1e-6)
    assert sample.stamp_ns == 5_000_000 and "attitude" not in sample.values
    q = np.array([0.8, 0.0, 0.6, 0.0], np.float32)
    sample = samples.attitude(message(VEHICLE_ATTITUDE, timestamp=9000, timestamp_sample=7000, q=q))
    assert sample.stamp_ns == 7_000_000  # of the raw data
    np.testing.assert_allclose(sample.values["attitude"], q, rtol=1e-6)


@pytest.mark.parametrize("axes", ["flu", "frd"])
@pytest.mark.parametrize("on", ["tool", "vehicle"])
def test_wrenches_return_in_all_conventions(axes: str, on: str) -> None:
    wrench = np.array([5.0, 1.0, -2.0, 0.1, 0.2, 0.3])
    value = samples.to_wrench(NOW, wrench, axes, on)
    np.testing.assert_array_equal(samples.wrench(value, axes, on).values["wrench"], wrench)
    # A push on the wall reads +x on the tool.
    assert value.wrench.force.x == (5.0 if on == "tool" else -5.0)
    assert value.wrench.force.z * (1 if on == "tool" else -1) == (2.0 if axes == "flu" else -2.0)


def test_numbers_that_are_no_numbers_are_bad() -> None:
    for wrong in (np.nan, np.inf):
        with pytest.raises(BadMessage, match="finite"):
            samples.inertial(px4_imu([wrong, 0, 0]))
    value = imu()
    value.orientation.w = value.orientation.z = 0.0  # of a driver without orientation
    with pytest.raises(BadMessage, match="name a topic as attitude"):
        samples.attitude(value)
    value.orientation.w = 0.5
    with pytest.raises(BadMessage, match="quaternion"):
        samples.attitude(value)


@pytest.mark.parametrize("absent", ["orientation", "angular_velocity", "linear_acceleration"])
def test_what_an_imu_marks_as_absent_is_bad(absent: str) -> None:
    value = changed(imu(), **{f"{absent}_covariance": np.array([-1.0, *np.zeros(8)])})
    with pytest.raises(BadMessage, match=absent.split("_")[0]):
        samples.attitude(value) if absent == "orientation" else samples.inertial(value)


def test_an_invalid_accelerometer_of_px4_is_bad() -> None:
    with pytest.raises(BadMessage, match="accelerometer"):
        samples.inertial(px4_imu(accelerometer_timestamp_relative=2**31 - 1))
    samples.inertial(px4_imu(accelerometer_timestamp_relative=-800))


def test_colours_and_padded_rows() -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    value = pictures.from_rgb(rgb, NOW)
    np.testing.assert_array_equal(pictures.to_rgb(value), rgb)
    np.testing.assert_array_equal(pictures.to_rgb(changed(value, encoding="bgr8")), rgb[..., ::-1])
    padded = np.zeros((5, 32), np.uint8)
    padded[:, :21] = rgb.reshape(5, 21)
    np.testing.assert_array_equal(pictures.to_rgb(changed(value, encoding="rgb8", step=32, data=padded.ravel())), rgb)


def test_depth_in_millimetres_and_metres_of_both_byte_orders() -> None:
    metres = np.array([[0.5, 1.25, 0.0]], np.float32)
    value = pictures.from_depth(metres, NOW)
    np.testing.assert_array_equal(pictures.to_depth(value), metres)
    for order, big in (("<", 0), (">", 1)):
        data = np.array([500, 1250, 0], f"{order}u2").view(np.uint8)
        changed(value, encoding="16UC1", is_bigendian=big, step=6, data=data)
        np.testing.assert_allclose(pictures.to_depth(value), metres, rtol=1e-6)
    value = pictures.from_depth(np.array([[np.nan, -1.0, np.inf]], np.float32), NOW)
    np.testing.assert_array_equal(pictures.to_depth(value), np.zeros((1, 3)))


def test_pictures_whose_size_does_not_fit_are_bad() -> None:
    for changes in (
        {"encoding": "yuv422"},
        {"height": 2**32 - 1, "width": 2**32 - 1},
        {"height": 0, "width": 0},
        {"width": 8},
        {"step": 20},
        {"data": np.zeros(3, np.uint8)},
    ):
        with pytest.raises(BadMessage):
            pictures.to_rgb(changed(pictures.from_rgb(np.zeros((5, 7, 3), np.uint8), NOW), **changes))


def camera_info(**changes: Any) -> Any:
    return changed(pictures.from_intrinsics((600.0, 601.0, 320.5, 240.5), (480, 640), NOW), **changes)


def test_a_camera_returns() -> None:
    info = camera_info()
    assert pictures.to_camera(info) == ((600.0, 601.0, 320.5, 240.5), (480, 640), (0.0,) * 5)
    np.testing.assert_array_equal(info.p.reshape(3, 4)[:, :3], info.k.reshape(3, 3))
    assert pictures.to_camera(camera_info(distortion_model="", d=np.zeros(0))).distortion == ()  # as of a simulator


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"k": np.zeros(9)}, "camera matrix"),  # an uncalibrated camera
        ({"distortion_model": "equidistant", "d": np.zeros(4)}, "distortion_model"),
        ({"distortion_model": "", "d": np.array([0.1, 0, 0, 0])}, "distortion_model"),
        ({"d": np.zeros(4_000_000)}, "coefficients"),
        ({"d": np.array([np.nan, 0, 0, 0])}, "coefficients"),
    ],
)
def test_cameras_of_another_model_are_bad(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(BadMessage, match=named):
        pictures.to_camera(camera_info(**changes))


def test_a_lens_is_the_same_with_zeros_for_missing_coefficients() -> None:
    camera = pictures.Camera((1.0, 1.0, 0.0, 0.0), (4, 6), (0.1, 0.0, 0.0, 0.0, 0.0))
    lenses = {(0.1, 0.0, 0.0, 0.0): True, (): False, (0.1, 0.0, 0.01, 0.0): False}
    assert {lens: camera.has_lens(lens) for lens in lenses} == lenses


@pytest.mark.parametrize("file", sorted(PX4_MSGS.glob("*.msg")), ids=lambda file: file.stem)
def test_types_of_px4_are_those_of_their_files(file: Path) -> None:
    """Names, types and order of the fields, read by a few lines of our own; zeros of all of them are a message."""
    name = f"px4_msgs/msg/{file.stem}"
    lines = [line.split("#")[0].split() for line in file.read_text().splitlines()]
    fields = [(words[1], words[0]) for words in lines if len(words) == 2]

    def text(description: Any) -> str:
        kind, (inner, size) = description
        return f"{inner[1][0]}[{size}]" if kind.name == "ARRAY" else inner

    assert [(field, text(description)) for field, description in messages.typestore().fielddefs[name][1]] == fields
    assert not any(messages.encoded(message(name), name)[4:])


@given(st.binary(max_size=400), st.sampled_from([IMU, SENSOR_COMBINED, VEHICLE_ATTITUDE, "sensor_msgs/msg/Image"]))
def test_any_bytes_are_a_message_or_bad(data: bytes, name: str) -> None:
    for header in (b"", b"\0\1\0\0"):
        try:
            messages.decoded(header + data, name)
        except BadMessage as error:
            assert str(error) == "undecodable"


def test_a_message_returns_from_its_bytes() -> None:
    data = messages.encoded(px4_imu([1, 2, 3], [4, 5, 6]), SENSOR_COMBINED)
    assert messages.encoded(messages.decoded(data, SENSOR_COMBINED), SENSOR_COMBINED) == data
