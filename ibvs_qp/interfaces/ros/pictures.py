"""``sensor_msgs/Image`` and ``CameraInfo`` to pictures and intrinsics, and back; BadMessage for unusable ones."""

from __future__ import annotations

import itertools
import struct
import sys
from typing import Any, NamedTuple

import cv2
import numpy as np

from ibvs_qp.interfaces.ros.messages import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, BadMessage, header, message, type_of
from ibvs_qp.vision.picture.settings import DISTORTION_SIZES

#: First bytes of the formats.
_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
#: Markers of a JPEG whose segment has the size: start of frame, in all its kinds.
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
#: Markers without a segment: fill bytes, TEM and restarts.
_BARE = frozenset((0xFF, 0x01, *range(0xD0, 0xD9)))
#: Head of compressedDepth: kind, and the two parameters of the quantised inverse depth.
_DEPTH_HEAD = struct.Struct("<iff")


def colour(message: Any, longest_side: int) -> np.ndarray:
    """Colour of a compressed picture, uint8 (H, W, 3)."""
    pixels = _decoded(bytes(message.data), cv2.IMREAD_COLOR, longest_side)
    # The names of the format are those of the picture before; the plugin compresses blue first, as OpenCV does.
    return np.ascontiguousarray(pixels[..., ::-1])


def depth(message: Any, longest_side: int) -> np.ndarray:
    """Depth of a compressed picture [m], float32 (H, W), 0 where invalid."""
    kind, data = message.format.replace(";", " ").split(), bytes(message.data)
    if "rvl" in kind or "RVL" in kind:
        raise BadMessage("compressedDepth in RVL is not read: record it with png")
    head = _DEPTH_HEAD.size if "compressedDepth" in kind else 0
    pixels = _decoded(data[head:], cv2.IMREAD_UNCHANGED, longest_side)
    if pixels.dtype != np.uint16 or pixels.ndim != 2:
        raise BadMessage("compressed depth is no PNG of 16 bits")
    if "32FC1" not in kind:
        return pixels.astype(np.float32) * np.float32(1e-3)
    if head == 0:
        raise BadMessage("compressed depth in 32FC1 has no parameters")
    _, a, b = _DEPTH_HEAD.unpack_from(data)
    with np.errstate(all="ignore"):
        metres = np.float32(a) / (pixels.astype(np.float32) - np.float32(b))
    return np.where((pixels > 0) & np.isfinite(metres) & (metres > 0.0), metres, np.float32(0.0))


def _decoded(data: bytes, flags: int, longest_side: int) -> np.ndarray:
    """Pixels of a file in memory whose sides are known to be allowed before it is unpacked."""
    width, height = _size(data)
    if not (1 <= width <= longest_side and 1 <= height <= longest_side):
        raise BadMessage("size out of range")
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags | cv2.IMREAD_IGNORE_ORIENTATION if flags > 0 else flags)
    if pixels is None:
        raise BadMessage("compressed picture is damaged")
    return pixels


def _size(data: bytes) -> tuple[int, int]:
    """Width and height by the head of a PNG or JPEG [px]."""
    try:
        if data.startswith(_PNG):
            width, height = struct.unpack_from(">II", data, 16)
            place = len(_PNG)
            while data[place + 4 : place + 8] != b"IEND":  # OpenCV reserves memory for any stated length
                place += 12 + int(struct.unpack_from(">I", data, place)[0])
            return width, height
        if data.startswith(_JPEG):
            place = 2
            while data[place] == 0xFF:
                if data[place + 1] in _FRAMES:
                    height, width = struct.unpack_from(">HH", data, place + 5)
                    return width, height
                if data[place + 1] in _BARE:
                    place += 1 if data[place + 1] == 0xFF else 2
                    continue
                place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    except (struct.error, IndexError):
        raise BadMessage("compressed picture is damaged") from None
    raise BadMessage("compressed picture is neither JPEG nor PNG")


#: Channels of the colour encodings, in the order red, green, blue.
_RGB, _BGR = (0, 1, 2), (2, 1, 0)
_COLOURS = {"rgb8": (3, _RGB), "bgr8": (3, _BGR), "rgba8": (4, _RGB), "bgra8": (4, _BGR), "mono8": (1, (0, 0, 0))}
#: Encodings of two bytes per pixel with half the colour, and OpenCV's conversions: luma second, and luma first.
_HALF_COLOURS = {"yuv422": cv2.COLOR_YUV2RGB_UYVY, "uyvy": cv2.COLOR_YUV2RGB_UYVY,
                 "yuv422_yuy2": cv2.COLOR_YUV2RGB_YUY2, "yuyv": cv2.COLOR_YUV2RGB_YUY2}  # fmt: skip
#: Numbers of the depth encodings, and their unit [m] (REP 118).
_DEPTHS = {"16UC1": ("u2", 1e-3), "32FC1": ("f4", 1.0)}
#: Longest side of a picture [px].
LONGEST_SIDE = 4096
#: Lens models of ROS with OpenCV's coefficients.
LENS_MODELS = ("plumb_bob", "rational_polynomial")
#: Largest difference of the coefficients of one lens [-].
LENS_ERROR = 1e-6
_FRAME = "camera_color_optical_frame"


class Camera(NamedTuple):
    """Camera of the raw pictures."""

    intrinsics: tuple[float, float, float, float]  # (fx, fy, cx, cy) [px]
    shape: tuple[int, int]  # height and width [px]
    distortion: tuple[float, ...]  # coefficients of the lens in OpenCV's order

    def has_lens(self, distortion: tuple[float, ...]) -> bool:
        """Whether the lens has these coefficients; missing ones are 0."""
        pairs = itertools.zip_longest(self.distortion, distortion, fillvalue=0.0)
        return all(abs(one - other) <= LENS_ERROR for one, other in pairs)


def to_rgb(image: Any) -> np.ndarray:
    """Colour of an ``Image`` or ``CompressedImage``, uint8 (H, W, 3)."""
    if type_of(image) == COMPRESSED_IMAGE:
        return colour(image, LONGEST_SIDE)
    if image.encoding in _HALF_COLOURS:
        pairs = _rows(image, 2).reshape(image.height, image.width, 2)
        if image.width % 2:
            raise BadMessage("encoding needs an even width")
        return cv2.cvtColor(pairs, _HALF_COLOURS[image.encoding])
    if image.encoding not in _COLOURS:
        raise BadMessage("encoding is no colour of 8 bits")
    channels, order = _COLOURS[image.encoding]
    pixels = _rows(image, channels).reshape(image.height, image.width, channels)
    return np.ascontiguousarray(pixels[..., order])


def to_depth(image: Any) -> np.ndarray:
    """Depth of an ``Image`` or ``CompressedImage`` [m], float32 (H, W), 0 where invalid."""
    if type_of(image) == COMPRESSED_IMAGE:
        return depth(image, LONGEST_SIDE)
    if image.encoding not in _DEPTHS:
        raise BadMessage("encoding is not 16UC1 or 32FC1")
    kind, unit = _DEPTHS[image.encoding]
    number = np.dtype(kind).newbyteorder(">" if image.is_bigendian else "<")
    metres = _rows(image, number.itemsize).view(number).astype(np.float32)
    if unit != 1.0:
        metres *= np.float32(unit)
    return np.where(np.isfinite(metres) & (metres > 0.0), metres, np.float32(0.0))


def to_camera(info: Any, rectified: bool = False) -> Camera:
    """Camera of a ``sensor_msgs/CameraInfo`` with a camera matrix and a lens model of OpenCV.

    Args:
        info: The message.
        rectified: Whether its pictures are rectified: their camera is P, without a lens.
    """
    shape = int(info.height), int(info.width)
    if rectified:
        p = np.asarray(info.p, float)
        if not (np.isfinite(p).all() and min(p[0], p[5]) > 1.0):
            raise BadMessage("no projection matrix P")
        return Camera((float(p[0]), float(p[5]), float(p[2]), float(p[6])), shape, ())
    k = np.asarray(info.k, float)
    if not (np.isfinite(k).all() and min(k[0], k[4]) > 1.0):
        raise BadMessage("no camera matrix")
    if info.distortion_model not in (LENS_MODELS if np.any(info.d) else (*LENS_MODELS, "")):  # simulators name none
        raise BadMessage("distortion_model is not plumb_bob or rational_polynomial")
    if len(info.d) not in DISTORTION_SIZES or not np.isfinite(info.d).all():
        raise BadMessage(f"d has not {', '.join(map(str, DISTORTION_SIZES))} finite coefficients")
    return Camera((float(k[0]), float(k[4]), float(k[2]), float(k[5])), shape, tuple(map(float, info.d)))


def from_rgb(rgb: np.ndarray, stamp_ns: int) -> Any:
    """``sensor_msgs/Image`` in rgb8."""
    return _image(np.ascontiguousarray(rgb, np.uint8), "rgb8", stamp_ns)


def from_depth(depth: np.ndarray, stamp_ns: int) -> Any:
    """``sensor_msgs/Image`` in 32FC1: depth [m] without rounding."""
    return _image(np.ascontiguousarray(depth, np.float32), "32FC1", stamp_ns)


def from_intrinsics(intrinsics: tuple[float, ...], shape: tuple[int, ...], stamp_ns: int) -> Any:
    """``sensor_msgs/CameraInfo`` of (fx, fy, cx, cy) [px] and a picture's shape, without distortion."""
    fx, fy, cx, cy = intrinsics
    k = np.array((fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0))
    return message(
        CAMERA_INFO,
        header=header(stamp_ns, _FRAME),
        height=shape[0],
        width=shape[1],
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=k,
        r=np.eye(3).ravel(),
        p=np.insert(k, (3, 6, 9), 0.0),
    )


def _rows(image: Any, pixel_bytes: int) -> np.ndarray:
    """Bytes of the pixels, (H, W pixel_bytes), without the padding of the rows."""
    height, width, step = int(image.height), int(image.width), int(image.step)
    if not (1 <= height <= LONGEST_SIDE and 1 <= width <= LONGEST_SIDE):
        raise BadMessage("size out of range")
    if step < width * pixel_bytes or len(image.data) != height * step:
        raise BadMessage("size does not fit the data")
    return np.ascontiguousarray(np.asarray(image.data).reshape(height, step)[:, : width * pixel_bytes])


def _image(pixels: np.ndarray, encoding: str, stamp_ns: int) -> Any:
    return message(
        IMAGE,
        header=header(stamp_ns, _FRAME),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=int(sys.byteorder == "big"),
        step=pixels.strides[0],
        data=pixels.reshape(-1).view(np.uint8),
    )
