"""The animation of the README: small, of the flight, and repeated for ever."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from sim.video.animation import LAST_MS, RATE_HZ, WIDTH, write_webp

README = Path(__file__).parents[3] / "README.md"


def test_every_picture_is_kept_at_its_time(tmp_path):
    frames = [np.full((200, 2 * WIDTH, 3), 20 * number, np.uint8) for number in range(10)]
    write_webp(frames, tmp_path / "grey.webp")
    with Image.open(tmp_path / "grey.webp") as image:
        assert (image.size, image.n_frames, image.info["loop"]) == ((WIDTH, 100), 10, 0)
        grey, times = [], []
        for number in range(10):
            image.seek(number)
            grey.append(np.asarray(image.convert("RGB")).mean())
            times.append(image.info["duration"])
    assert np.abs(np.array(grey) - 20 * np.arange(10)).max() < 3.0
    assert times == [1e3 / RATE_HZ] * 9 + [LAST_MS]


def test_the_readme_shows_a_whole_flight_in_less_than_3_mb():
    file = README.parent / "docs/images/flight.webp"
    assert "(docs/images/flight.webp)" in README.read_text(encoding="utf-8")
    assert file.stat().st_size < 3e6
    with Image.open(file) as image:
        assert image.size[0] == WIDTH and image.n_frames > 80
