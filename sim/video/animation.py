"""The animation of the README: flies the default scene under the QP law and writes it as an animated WebP, faster.

Usage: ``python -m sim.video.animation docs/images/flight.webp``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.storage.atomic import replaced
from sim.video.film import film_frames
from sim.world.scene import Scene
from sim.world.worlds import DEFAULT_WORLD, in_world

#: How much faster than the flight it plays, its pictures per second, and how long the last one stays [ms].
SPEED_UP, RATE_HZ, LAST_MS = 4.0, 10.0, 2500
#: Width [px]: that of the text of a README. Quality of WebP: 100 is the best.
WIDTH, QUALITY = 832, 50


def write_webp(frames: Iterable[np.ndarray], file: Path, rate_hz: float = RATE_HZ) -> None:
    """Write pictures as an animated WebP that repeats for ever.

    Args:
        frames: uint8 RGB of one size.
        file: Where to write.
        rate_hz: Pictures per second [Hz].
    """
    pictures = []
    for frame in frames:
        height = round(WIDTH * frame.shape[0] / frame.shape[1])
        pictures.append(Image.fromarray(cv2.resize(frame, (WIDTH, height), interpolation=cv2.INTER_AREA)))
    times = [round(1e3 / rate_hz)] * (len(pictures) - 1) + [LAST_MS]
    first, *rest = pictures
    with replaced(file) as partial:
        first.save(
            partial, "WEBP", save_all=True, append_images=rest, duration=times, loop=0, quality=QUALITY, method=6
        )


def main(file: Path) -> None:
    """Fly the default scene with seed 0 and write its animation."""
    scene, options = in_world(Scene(), DEFAULT_WORLD), FlightOptions(compiled=True)
    write_webp(film_frames({"qp": fly(scene, options)}, RATE_HZ / SPEED_UP), file)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
