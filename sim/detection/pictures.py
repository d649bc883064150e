"""Colour and depth pictures from files of many kinds, as one registered frame."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.config.files import UnreadableFile, read_bytes
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.camera import to_color
from ibvs_qp.vision.picture.settings import RgbdCameraSettings
from sim.storage.arrays import no_library_output, read_npy, read_npz
from sim.storage.limits import LARGEST_PICTURE, LONGEST_SIDE


class PictureError(IbvsQpError):
    """An unreadable picture, or two that do not match."""


def read_frame(
    color: Path,
    depth: Path | None,
    intrinsics: tuple[float, float, float, float],
    depth_units_per_metre: float,
    stamp_ns: int = 0,
    camera: RgbdCameraSettings | None = None,
) -> RgbdFrame:
    """Read a pair of pictures.

    Args:
        color: Colour or grey picture, 8 or 16 bits.
        depth: Depth, 8 or 16 bits or floating point (PNG, TIFF, npy, npz), or None for all invalid.
        intrinsics: (fx, fy, cx, cy) [px].
        depth_units_per_metre: Depth values per metre.
        stamp_ns: Time of capture.
        camera: The camera, or None for one whose depth is registered to colour.

    Raises:
        PictureError: When a file cannot be read or both pictures differ in size and depth is to be registered.
    """
    camera = camera or RgbdCameraSettings()
    rgb = read_color(color, camera.color_bits)
    height, width = rgb.shape[:2]
    metres = np.zeros((height, width), np.float32) if depth is None else read_depth(depth, depth_units_per_metre)
    if camera.registered and metres.shape != (height, width):
        raise PictureError(
            f"{depth} is {metres.shape[-1]} x {metres.shape[0]} px but {color} is {width} x {height} px: "
            "depth must be registered to colour, or depth_intrinsics given"
        )
    return RgbdFrame(rgb=rgb, depth=metres, intrinsics=intrinsics, stamp_ns=stamp_ns)


def read_color(file: Path, bits: int = 16) -> np.ndarray:
    """RGB, uint8 (H, W, 3); 16 bits, of which so many are in use, become 8, grey becomes three equal channels.

    Raises:
        PictureError: When the file is no such picture.
    """
    picture = _read(file, "colour")
    picture = to_color(picture, bits)
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    if picture.dtype != np.uint8 or channels not in (3, 4):
        raise PictureError(f"{file} is no colour picture of 8 or 16 bits ({picture.dtype}, {channels} channels)")
    if file.suffix.lower() in _READERS:  # arrays are RGB already
        return np.ascontiguousarray(picture[..., :3])
    code = cv2.COLOR_BGR2RGB if channels == 3 else cv2.COLOR_BGRA2RGB
    return cv2.cvtColor(picture, code)


def read_depth(file: Path, units_per_metre: float) -> np.ndarray:
    """Depth [m], float32 (H, W), 0 where invalid.

    Raises:
        PictureError: When the file is no depth picture.
    """
    picture = _read(file, "depth")
    if picture.ndim == 3:
        if not (picture == picture[..., :1]).all():
            raise PictureError(f"{file} has {picture.shape[2]} different channels: it is a colour picture, not depth")
        picture = picture[..., 0]
    if not (np.issubdtype(picture.dtype, np.integer) or np.issubdtype(picture.dtype, np.floating)):
        raise PictureError(f"{file} has type {picture.dtype}: depth must be integer or floating point")
    with np.errstate(invalid="ignore", over="ignore"):
        metres = (picture / units_per_metre).astype(np.float32)
    return np.where(np.isfinite(metres) & (metres > 0.0), metres, np.float32(0.0))


def _read(file: Path, kind: str) -> np.ndarray:
    """Content of a file as an array of two or three dimensions."""
    try:
        picture = _READERS.get(file.suffix.lower(), _decoded)(file)
    except UnreadableFile as error:
        raise PictureError(f"cannot read the {kind} picture {file}: {error.reason}") from None
    if picture is None or picture.ndim not in (2, 3) or min(picture.shape) < 1:
        raise PictureError(f"cannot read the {kind} picture {file}: it is no picture (PNG, JPEG, TIFF, npy, npz)")
    if max(picture.shape[:2]) > LONGEST_SIDE:
        raise PictureError(f"{file} is {picture.shape[1]} x {picture.shape[0]} px: at most {LONGEST_SIDE} are read")
    return picture


def _decoded(file: Path) -> np.ndarray | None:
    content = np.frombuffer(read_bytes(file, LARGEST_PICTURE), np.uint8)
    with no_library_output():
        try:
            return cv2.imdecode(content, cv2.IMREAD_UNCHANGED)
        except cv2.error:  # an empty file, or more pixels than OpenCV may decode
            return None


def _only_array(file: Path) -> np.ndarray | None:
    arrays = list(read_npz(file, LARGEST_PICTURE, LARGEST_PICTURE).values())
    return arrays[0] if len(arrays) == 1 else None


#: Readers of array files by suffix.
_READERS = {".npy": lambda file: read_npy(file, LARGEST_PICTURE), ".npz": _only_array}
