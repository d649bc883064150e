"""Steps of the automatic exposure are taken out of the pictures."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.vision.picture.picture import ExposureSteps, brightness_ratio

FRAME_NS = 33_000_000


def picture(brightness: float, seed: int, shift: int = 0) -> np.ndarray:
    """A board of 200 grey levels with a dark edge, at a brightness, with sensor noise."""
    scene = np.full((480, 640, 3), 200.0)
    scene[300 + shift :] = (150.0, 120.0, 100.0)
    scene = scene * brightness + np.random.default_rng(seed).normal(0.0, 2.0, scene.shape)
    return np.clip(np.rint(scene), 0, 255).astype(np.uint8)


def test_the_same_light_passes_the_very_same_picture() -> None:
    steps = ExposureSteps()
    for tick in range(20):
        rgb = picture(1.0, tick, shift=2 * tick)  # the camera moves
        assert steps.level(rgb, 1 + tick * FRAME_NS) is rgb


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.75, 1.25])
def test_a_step_is_levelled_and_fades(step: float) -> None:
    steps, means = ExposureSteps(), []
    for tick in range(200):
        rgb = picture(1.0 if tick < 10 else step, tick)
        means.append(float(steps.level(rgb, 1 + tick * FRAME_NS)[:300].mean()))
    assert means[10] == pytest.approx(means[9], rel=0.02)
    assert np.abs(np.diff(means)).max() < 0.04 * means[0]  # no step is left
    assert means[-1] == pytest.approx(200.0 * step, rel=0.1)


def test_saturated_pixels_do_not_count() -> None:
    steps = ExposureSteps()
    steps.level(picture(1.0, 0), 1)
    steps.level(picture(1.5, 1), 1 + FRAME_NS)  # the board of 200 is cut off at 255
    assert steps.gain == pytest.approx(1.5, rel=0.02)


def test_a_pause_or_another_size_starts_anew() -> None:
    steps = ExposureSteps()
    steps.level(picture(1.0, 0), 1)
    later = picture(1.3, 1)
    assert steps.level(later, 1 + 20 * FRAME_NS) is later and steps.gain == 1.0
    small = picture(0.8, 2)[::2, ::2]
    assert steps.level(small, 1 + 21 * FRAME_NS) is small and steps.gain == 1.0


def test_brightness_is_compared_on_unsaturated_pixels_only() -> None:
    before, after = np.full((3, 20, 30), 100, np.uint8), np.full((3, 20, 30), 121, np.uint8)
    after[0, :, :20] = 255
    assert brightness_ratio(before, after) == pytest.approx(364.0 / 301.0)
    after[1, :, :29] = 255  # less than a twentieth is left
    assert brightness_ratio(before, after) == 1.0
