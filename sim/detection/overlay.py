"""A picture of a frame with what was found in it, for people."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from ibvs_qp.vision.survey.draw import draw_detection
from sim.detection.run import SeenFrame


class OverlayError(IbvsQpError):
    """A picture cannot be written."""


def write_overlay(seen: SeenFrame, folder: Path) -> Path | None:
    """Write NAME_overlay.png into a folder; returns its path, or None for a frame that could not be read.

    Raises:
        OverlayError: When the file cannot be written.
    """
    if seen.frame is None:
        return None
    name = re.sub(r"[^\w.-]+", "_", str(Path(seen.entry.color).with_suffix(""))).strip("_")
    file = folder / f"{name}_overlay.png"
    drawn = draw_detection(seen.frame.rgb, seen.result, seen.entry.seed)
    done, data = cv2.imencode(".png", cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR))
    try:
        if not done:
            raise OSError("the picture cannot be coded")
        file.write_bytes(np.asarray(data).tobytes())
    except OSError as error:
        raise OverlayError(f"cannot write {file}: {error.strerror or error}") from None
    return file
