"""A flight's world hands its motion and its lost pictures to the camera and to the sensor model of lines."""

from __future__ import annotations

import numpy as np
import pytest
from defect_scenes import with_errors

from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.scene import Scene

#: Ticks of a fall without thrust; three pictures are captured, two of them in motion.
TICKS = 34


def seen(scene: Scene, features: str) -> list[np.ndarray]:
    """Pictures, or normals of the lines, of a fall."""
    options = FlightOptions(seed=1, features=features, image_size=(424, 240))
    world = World(scene, options, pilot_config(scene, options))
    found = []
    for _ in range(TICKS):
        frame = world.sense()
        if frame.image is not None:
            found.append(frame.image.rgb)
        elif frame.features is not None:
            found.append(np.array([(line.rho, line.theta) for line in frame.features.lines]))
        world.act(np.zeros(6))
    return found


@pytest.mark.parametrize("features", ["rendered", "geometric"])
def test_motion_reaches_the_rolling_shutter(features: str) -> None:
    ideal = seen(Scene(), features)
    skewed = seen(with_errors(Scene(), camera={"rolling_shutter_s": 0.05}), features)
    assert len(ideal) == len(skewed) >= 2
    assert not np.array_equal(ideal[-1], skewed[-1])


@pytest.mark.parametrize("features", ["rendered", "geometric"])
def test_lost_pictures_stay_away(features: str) -> None:
    assert len(seen(with_errors(Scene(), camera={"dropped": 0.9}), features)) < len(seen(Scene(), features))
