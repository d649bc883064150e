"""A picture of a frame with its surface, lines and guides."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.errors import ConfigError
from sim.detection.draw import draw_detection
from sim.detection.run import FrameResult


def write_overlay(result: FrameResult, folder: Path) -> Path | None:
    """Write NAME_overlay.png into a folder; returns its path, or None for an unreadable frame.

    Raises:
        ConfigError: When the file cannot be written.
    """
    if result.frame is None:
        return None
    name = re.sub(r"[^\w.-]+", "_", str(Path(result.entry.color).with_suffix(""))).strip("_")
    file = folder / f"{name}_overlay.png"
    drawn = draw_detection(result.frame.rgb, result.detection, result.entry.seed)
    _, data = cv2.imencode(".png", cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR))
    try:
        file.write_bytes(np.asarray(data).tobytes())
    except OSError as error:
        raise ConfigError(f"cannot write {file}: {error.strerror or error}") from None
    return file
