"""``sensor_msgs/CompressedImage``: JPEG and PNG of image_transport's plugins "compressed" and "compressedDepth"."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np

from ibvs_qp.interfaces.ros.messages import BadMessage

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
