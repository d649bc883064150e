"""Pictures in a file: colour as JPEG, depth without noise as 16 bit PNG; the noise is added again at loading."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ibvs_qp import RgbdFrame

from .tables import Table

JPEG_QUALITY = 85
#: Step of the stored depth [m], and white noise per depth that is added at loading.
DEPTH_STEP_M, DEPTH_NOISE = 5e-4, 0.005


def picture_table(images: Sequence[RgbdFrame | None]) -> Table:
    """Columns of the pictures; `tick` says at which tick each came."""
    ticks = [tick for tick, image in enumerate(images) if image is not None]
    present = [image for image in images if image is not None]
    table = {
        "tick": np.array(ticks, np.int64),
        "stamp_ns": np.array([image.stamp_ns for image in present], np.int64),
        "intrinsics": np.array([image.intrinsics for image in present]).reshape(-1, 4),
    }
    for name, files in (("rgb", map(_encode_rgb, present)), ("depth", map(_encode_depth, present))):
        parts = list(files)
        table[name] = np.concatenate([np.zeros(0, np.uint8), *parts])
        table[f"{name}_bytes"] = np.array([len(part) for part in parts], np.int64)
    return table


def pictures_of(table: Table) -> dict[int, RgbdFrame]:
    """The pictures by tick, as they are replayed."""
    cuts = {name: np.split(table[name], np.cumsum(table[f"{name}_bytes"])) for name in ("rgb", "depth")}
    frames = {}
    for index, tick in enumerate(table["tick"].tolist()):
        stamp = int(table["stamp_ns"][index])
        rgb = cv2.imdecode(cuts["rgb"][index], cv2.IMREAD_COLOR)
        depth = DEPTH_STEP_M * cv2.imdecode(cuts["depth"][index], cv2.IMREAD_UNCHANGED)
        noise = np.random.default_rng(stamp).standard_normal(depth.shape)
        frames[tick] = RgbdFrame(
            rgb=np.ascontiguousarray(rgb[..., ::-1]),
            depth=(depth * (1.0 + DEPTH_NOISE * noise)).astype(np.float32),
            intrinsics=tuple(table["intrinsics"][index].tolist()),
            stamp_ns=stamp,
        )
    return frames


def _encode_rgb(image: RgbdFrame) -> np.ndarray:
    return cv2.imencode(".jpg", image.rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]


def _encode_depth(image: RgbdFrame) -> np.ndarray:
    steps = np.round(image.depth / DEPTH_STEP_M).astype(np.uint16)
    return cv2.imencode(".png", steps, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1]
