"""What the rotors of a vehicle can do."""

from __future__ import annotations

import numpy as np
import pytest

from allocation import TAROT_T960, Rotor, RotorGeometry
from allocation.actuation import Actuation, actuation

GRAVITY = 9.81


def circle(count: int, tilt_deg: float = 0.0) -> RotorGeometry:
    rotors = tuple(
        Rotor(name=f"r{index}", azimuth_deg=360.0 * (index + 0.5) / count - 180.0, spin=1 - 2 * (index % 2))
        for index in range(count)
    )
    return RotorGeometry(rotors=rotors, circle_radius_m=0.4, tilt_deg=tilt_deg, torque_ratio_m=0.02)


def found_of(geometry: RotorGeometry, mass: float) -> Actuation:
    lower, upper = (np.full(geometry.count, limit) for limit in (1.2, 52.56))
    return actuation(geometry, mass * GRAVITY, np.array((0.7, 0.0, 0.0)), lower, upper)


def test_the_hexarotor_is_fully_actuated() -> None:
    found = found_of(TAROT_T960, 6.0)
    assert found.missing == () and found.hovers and 2.0 < found.condition < 3.0
    assert found.hover == pytest.approx(np.full(6, 6.0 * 9.81 / 6.0 / np.cos(np.radians(30.0))), rel=1e-6)
    assert found.push is not None and found.push.push == pytest.approx(30.4, abs=0.1)
    assert found.sliding_push is not None and found.sliding_push.push < found.push.push
    assert found.level_reach == pytest.approx(15.2, abs=0.1)


@pytest.mark.parametrize("count", [4, 6, 8])
def test_a_flat_vehicle_lacks_the_lateral_forces(count: int) -> None:
    found = found_of(circle(count), 3.0)
    assert found.missing == ("force front", "force right")
    assert found.hovers and found.push is None and np.isinf(found.condition) and np.isinf(found.tilt_without).all()


def test_a_combined_direction_is_named_as_such() -> None:
    """Four rotors in a plane: lateral force and the moment about it come together."""
    found = found_of(circle(4, tilt_deg=20.0), 3.0)
    assert len(found.missing) == 2 and all(" force " in name or " moment " in name for name in found.missing)


def test_a_vehicle_that_is_too_heavy_does_not_hover() -> None:
    found = found_of(TAROT_T960, 40.0)
    assert not found.hovers and found.level_reach == -np.inf and found.missing == ()
