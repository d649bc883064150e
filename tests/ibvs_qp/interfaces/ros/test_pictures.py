"""Pictures as people record them: compressed, with half the colour, rectified, late."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from ibvs_qp.interfaces.ros import pictures
from ibvs_qp.interfaces.ros.latest_samples import CLOCK_SET_NS, MOST_WAITING, WAITING_NS, LatestSamples
from ibvs_qp.interfaces.ros.messages import COMPRESSED_IMAGE, BadMessage, header, message
from ibvs_qp.interfaces.ros.samples import to_imu
from ibvs_qp.interfaces.ros.topics import Topics

REST = np.array([0.0, 0.0, -9.81])
#: Two halves of colours that JPEG and half colour keep.
RGB = np.zeros((48, 64, 3), np.uint8)
RGB[:, :32], RGB[:, 32:] = (200, 60, 20), (20, 90, 180)
DEPTH = np.linspace(0.3, 5.0, 48 * 64, dtype=np.float32).reshape(48, 64)


def compressed(kind: str, data: bytes) -> Any:
    return message(COMPRESSED_IMAGE, header=header(1, ""), format=kind, data=np.frombuffer(data, np.uint8))


def packed(ending: str, pixels: np.ndarray) -> bytes:
    return cv2.imencode(ending, pixels)[1].tobytes()


@pytest.mark.parametrize("kind", ["rgb8; jpeg compressed bgr8", "bgr8; png compressed bgr8", "jpeg", "png"])
def test_compressed_colour(kind: str) -> None:
    ending, error = (".jpg", 8) if "jpeg" in kind else (".png", 0)
    found = pictures.to_rgb(compressed(kind, packed(ending, RGB[..., ::-1])))
    inside = np.abs(found.astype(int) - RGB)[:, [*range(28), *range(36, 64)]]
    assert found.dtype == np.uint8 and inside.max() <= error


def test_compressed_depth_in_millimetres_and_in_metres() -> None:
    millimetres = np.round(1e3 * DEPTH).astype(np.uint16)
    millimetres[0, 0] = 0
    head = struct.pack("<iff", 0, 0.0, 0.0)
    for kind, data in (("16UC1; compressedDepth png", head), ("16UC1; compressedDepth", head), ("16UC1; png", b"")):
        found = pictures.to_depth(compressed(kind, data + packed(".png", millimetres)))
        np.testing.assert_allclose(found, 1e-3 * millimetres, atol=1e-6)
    # As image_transport quantises the inverse depth: d = a / z + b, of z_max and a step.
    a, b = 10.0 * 100.0, 1.0 - 10.0 * 100.0 / 10.0
    steps = np.round(a / DEPTH + b).astype(np.uint16)
    steps[0, 0] = 0
    data = struct.pack("<iff", 0, a, b) + packed(".png", steps)
    found = pictures.to_depth(compressed("32FC1; compressedDepth png", data))
    assert found[0, 0] == 0.0
    np.testing.assert_allclose(found.ravel()[1:], DEPTH.ravel()[1:], rtol=4e-3)


PNG = packed(".png", RGB)
HUGE = PNG[:16] + struct.pack(">II", 60_000, 60_000) + PNG[24:]


@pytest.mark.parametrize(
    ("read", "kind", "data", "reason"),
    [
        (pictures.to_rgb, "jpeg", b"", "neither JPEG nor PNG"),
        (pictures.to_rgb, "jpeg", b"\xff\xd8\xff", "damaged"),
        (pictures.to_rgb, "png", HUGE, "size out of range"),
        (pictures.to_rgb, "png", PNG[:60], "damaged"),
        (pictures.to_depth, "16UC1; compressedDepth rvl", b"abc", "RVL is not read"),
        (pictures.to_depth, "16UC1; png", PNG, "no PNG of 16 bits"),
        (pictures.to_depth, "32FC1; png", packed(".png", np.ones((4, 4), np.uint16)), "no parameters"),
    ],
)
def test_a_compressed_picture_of_no_use_is_named(read: Any, kind: str, data: bytes, reason: str) -> None:
    with pytest.raises(BadMessage, match=reason):
        read(compressed(kind, data))


@pytest.mark.parametrize("encoding", ["yuv422", "uyvy", "yuv422_yuy2", "yuyv"])
def test_pictures_with_half_the_colour(encoding: str) -> None:
    r, g, b = (RGB[..., channel].astype(float) for channel in range(3))  # BT.601, limited range
    luma = 16 + 0.257 * r + 0.504 * g + 0.098 * b
    blue, red = 128 - 0.148 * r - 0.291 * g + 0.439 * b, 128 + 0.439 * r - 0.368 * g - 0.071 * b
    colour = np.where(np.arange(64) % 2 == 0, blue, red)
    pairs = (colour, luma) if encoding in ("yuv422", "uyvy") else (luma, colour)
    image = pictures.from_rgb(RGB, 1)
    image.encoding, image.step, image.data = encoding, 128, np.dstack(pairs).round().astype(np.uint8).ravel()
    assert np.abs(pictures.to_rgb(image).astype(int) - RGB).max() <= 4


def test_rectified_pictures_have_the_camera_p_and_no_lens() -> None:
    info = pictures.from_intrinsics((70.0, 71.0, 40.0, 32.0), (48, 64), 1)
    info.d, info.p = np.array([0.1, -0.2, 0, 0, 0.1]), np.array([68.0, 0, 40.5, 0, 0, 69.0, 32.5, 0, 0, 0, 1, 0])
    raw, rectified = pictures.to_camera(info), pictures.to_camera(info, rectified=True)
    assert raw.intrinsics == (70.0, 71.0, 40.0, 32.0) and len(raw.distortion) == 5
    assert rectified == ((68.0, 69.0, 40.5, 32.5), (48, 64), ())
    info.p = np.zeros(12)
    with pytest.raises(BadMessage, match="no projection matrix"):
        pictures.to_camera(info, rectified=True)


def stream(hz: float, late_ns: int, apart_ns: int = 0, count: int = 40, drop: int = 0) -> tuple[int, LatestSamples]:
    """Pictures taken from a stream whose depth arrives later than the colour, without every so many of its pictures."""
    sent, info = [], pictures.from_intrinsics((70, 70, 32, 24), (48, 64), 1)
    for k in range(count):
        stamp = 10**9 + round(k * 1e9 / hz)
        sent.append((stamp, 1, "color", pictures.from_rgb(RGB, stamp)))
        if not drop or k % drop:
            sent.append((stamp + late_ns, 2, "depth", pictures.from_depth(DEPTH, stamp + apart_ns)))
    held, found = LatestSamples(Topics()), 0
    held.add("camera_info", info)
    for *_, role, value in sorted(sent, key=lambda each: each[:2]):
        held.add(role, value)
        found += held.take_picture() is not None
    held.finish()
    return found, held


@pytest.mark.parametrize(("hz", "late_ms"), [(15, 100), (30, 0), (30, 70), (60, 34), (90, 50), (90, 200)])
def test_depth_that_comes_late_loses_no_pair(hz: float, late_ms: int) -> None:
    found, held = stream(hz, 1_000_000 * late_ms)
    assert found == 40 and not held.ignored


def test_every_picture_without_a_pair_is_counted() -> None:
    found, held = stream(30.0, 50_000_000, drop=4)
    assert found == 30 and dict(held.ignored) == {"color: no depth within pair_s": 10}
    found, held = stream(30.0, 1_000_000, apart_ns=8_000_000)
    assert found == 0 and dict(held.ignored) == {
        "color: no depth within pair_s": 40, "depth: no colour within pair_s": 40,
    }  # fmt: skip
    assert sum(map(len, held._waiting.values())) <= 2 * (1 + WAITING_NS * 30 // 10**9)


def test_a_repeated_pair_and_one_that_no_frame_takes_are_counted_and_a_clock_that_was_set_is_followed() -> None:
    held = LatestSamples(Topics())
    held.add("camera_info", pictures.from_intrinsics((70, 70, 32, 24), (48, 64), 1))
    for stamp in (10 * CLOCK_SET_NS, 10 * CLOCK_SET_NS, 10 * CLOCK_SET_NS + 1000, CLOCK_SET_NS):
        held.add("color", pictures.from_rgb(RGB, stamp))
        held.add("depth", pictures.from_depth(DEPTH, stamp))
    picture = held.take_picture()
    assert picture is not None and picture.stamp_ns == CLOCK_SET_NS
    assert dict(held.ignored) == {
        "color: not newer than the last pair": 1,
        "depth: not newer than the last pair": 1,
        "color: a newer picture came before a frame": 2,
    }


def test_a_clock_that_steps_back_blinds_no_bridge_and_late_samples_stay_out() -> None:
    now = [10 * CLOCK_SET_NS]
    held = LatestSamples(Topics(), clock=lambda: now[0])
    imu = [
        to_imu(10 * CLOCK_SET_NS - ms * 1_000_000, np.array([1.0, 0, 0, 0]), np.zeros(3), REST) for ms in (5, 9, 800)
    ]
    assert held.add("imu", imu[0]) and not held.add("imu", imu[1])
    now[0] -= 790_000_000  # set back by less than a second
    assert held.add("imu", imu[2])
    held.add("camera_info", pictures.from_intrinsics((70, 70, 32, 24), (48, 64), 1))
    for step in (0, 500_000_000):
        now[0] -= step
        assert held.add("color", pictures.from_rgb(RGB, now[0])) and held.add(
            "depth", pictures.from_depth(DEPTH, now[0])
        )
    assert held.pairs == 2


def test_pictures_with_frozen_stamps_do_not_fill_the_memory() -> None:
    held = LatestSamples(Topics())
    for _ in range(100):
        held.add("color", pictures.from_rgb(RGB, 0))
    assert len(held._waiting["color"]) <= MOST_WAITING
    assert held.ignored["color: no depth within pair_s"] == 100 - MOST_WAITING


def test_a_jpeg_cannot_hide_its_size_behind_a_marker_without_a_segment() -> None:
    large = packed(".jpg", np.zeros((600, 600, 3), np.uint8))
    fake = struct.pack(">BBHBHHB", 0xFF, 0xC0, 17, 8, 16, 16, 3) + bytes(9)
    for marker in (b"\xff\x01", b"\xff\xd0", b"\xff\xff"):
        hidden = large[:2] + marker + struct.pack(">H", len(fake) + 2) + fake + large[2:]
        with pytest.raises(BadMessage):
            pictures.colour(compressed("jpeg", hidden), 512)
