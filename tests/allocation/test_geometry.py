"""Rotors on a circle and free ones: signs, the wrench by hand, refusals; and what the rotors of a vehicle can do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reach_oracle import FULL, IDLE, TIP

from allocation import TAROT_T960, Rotor, RotorGeometry, control_effectiveness
from allocation.actuation import Actuation, actuation
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict, to_dict
from ibvs_qp.config.vehicle import VehicleParams

UP, FORWARD, B = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), control_effectiveness(TAROT_T960)


@pytest.mark.parametrize(
    ("rotor", "front", "right", "yaw_sign"),
    [
        ("mid_right", 0.5, 0.0, -1),
        ("mid_left", 0.5, 0.0, 1),
        ("front_left", -0.25, -0.4330127, -1),
        ("rear_right", -0.25, -0.4330127, 1),
        ("front_right", -0.25, 0.4330127, 1),
        ("rear_left", -0.25, 0.4330127, -1),
    ],
)
def test_lateral_force_and_yaw_sign_of_each_rotor(rotor: str, front: float, right: float, yaw_sign: int) -> None:
    column = B[:, TAROT_T960.names.index(rotor)]
    np.testing.assert_allclose(column[:3], [front, right, -math.cos(math.radians(30.0))], atol=1e-7)
    # A counter-clockwise rotor drags the vehicle clockwise (+z) and its tilt pushes the same way.
    assert column[5] * yaw_sign == pytest.approx(0.48 * 0.5 + 0.020 * math.cos(math.radians(30.0)), abs=1e-12)


def test_wrench_of_free_rotors_by_hand() -> None:
    """Levers 0.5 m, axes along the body's: forces, lever moments and drag torques read off the drawing."""
    geometry = RotorGeometry(
        rotors=(
            Rotor(name="right", spin=1, position_m=(0.0, 0.5, 0.1), axis=UP, torque_ratio_m=0.03),
            Rotor(name="front", spin=-1, position_m=(0.5, 0.0, 0.0), axis=UP),
            Rotor(name="pusher", spin=1, position_m=(0.0, 0.0, 0.2), axis=FORWARD),
        ),
        torque_ratio_m=0.02,
    )
    by_hand = [[0, 0, -1, -0.5, 0, 0.03], [0, 0, -1, 0, 0.5, -0.02], [1, 0, 0, -0.02, 0.2, 0]]
    np.testing.assert_allclose(control_effectiveness(geometry).T, by_hand, atol=1e-15)


def test_the_circle_written_out_rotor_by_rotor_is_the_same() -> None:
    rows = zip(TAROT_T960.rotors, TAROT_T960.positions.tolist(), TAROT_T960.axes.tolist(), strict=True)
    rotors = tuple(Rotor(name=r.name, spin=r.spin, position_m=tuple(p), axis=tuple(a)) for r, p, a in rows)
    free = RotorGeometry(rotors=rotors, torque_ratio_m=0.020)
    np.testing.assert_allclose(control_effectiveness(free), B, atol=1e-15)


def test_a_rotor_on_the_circle_may_state_its_axis_alone() -> None:
    tilt = math.radians(28.0)
    turned = Rotor(name="mid_right", spin=-1, azimuth_deg=90.0, axis=(math.sin(tilt), 0.0, -math.cos(tilt)))
    geometry = replace(TAROT_T960, rotors=(turned, *TAROT_T960.rotors[1:]))
    np.testing.assert_array_equal(geometry.positions, TAROT_T960.positions)
    np.testing.assert_array_equal(geometry.axes[1:], TAROT_T960.axes[1:])
    np.testing.assert_allclose(geometry.axes[0], [math.sin(tilt), 0.0, -math.cos(tilt)], atol=1e-15)


def test_a_vehicle_file_may_state_free_rotors() -> None:
    rotors = [
        {"name": f"r{i}", "spin": 1 - 2 * (i % 2), "position_m": [0.4, 0.1 * i, 0.0], "axis": [0.0, 0.0, -1.0]}
        for i in range(6)
    ]
    vehicle = from_dict(VehicleParams, {"geometry": {"rotors": rotors, "torque_ratio_m": 0.01}})
    np.testing.assert_allclose(vehicle.geometry.positions[3], [0.4, 0.3, 0.0])
    assert from_dict(VehicleParams, to_dict(vehicle)) == vehicle


@pytest.mark.parametrize(
    ("rotor", "named"),
    [
        ({"axis": [0.0, 0.0, -2.0], "azimuth_deg": 0.0}, "odd: axis: .* length 2, must be a unit vector"),
        ({"axis": [0.0, 0.0, -1.0]}, "odd: azimuth_deg, or position_m and axis, is needed"),
        ({"azimuth_deg": 0.0}, "circle_radius_m: 0.0 m, must be > 0 m"),
        ({"azimuth_deg": 0.0, "torque_ratio_m": -0.1}, "odd: torque_ratio_m: -0.1 m, must be >= 0 m"),
        ({"position_m": [0.0, math.inf, 0.0], "axis": [0.0, 0.0, -1.0]}, "odd: position_m: .* must be finite"),
        ({"azimuth_deg": 0.0, "axes": [0.0, 0.0, -1.0]}, "did you mean 'axis'"),
    ],
)
def test_impossible_rotors_are_refused_by_name(rotor: dict[str, object], named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        from_dict(RotorGeometry, {"rotors": [{"name": "odd", "spin": 1, **rotor}], "torque_ratio_m": 0.02})


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e308])
@pytest.mark.parametrize(
    ("whole", "name"),
    [(TAROT_T960, name) for name in ("circle_radius_m", "tilt_deg", "torque_ratio_m", "hub_height_m")]
    + [(TAROT_T960.rotors[0], name) for name in ("azimuth_deg", "torque_ratio_m")],
)
def test_rotors_have_finite_values(whole: RotorGeometry | Rotor, name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        replace(whole, **{name: value})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=name):
        replace(whole, **{name: -value})  # type: ignore[arg-type]


def test_the_number_of_rotors_is_limited() -> None:
    with pytest.raises(ValueError, match="65 given, 1 to 64"):
        replace(TAROT_T960, rotors=TAROT_T960.rotors[:1] * 65)


def circle(count: int, tilt_deg: float = 0.0) -> RotorGeometry:
    rotors = tuple(
        Rotor(name=f"r{index}", azimuth_deg=360.0 * (index + 0.5) / count - 180.0, spin=1 - 2 * (index % 2))
        for index in range(count)
    )
    return RotorGeometry(rotors=rotors, circle_radius_m=0.4, tilt_deg=tilt_deg, torque_ratio_m=0.02)


def found_of(geometry: RotorGeometry, mass: float) -> Actuation:
    limits = (np.full(geometry.count, limit) for limit in (IDLE, FULL))
    return actuation(geometry, mass * 9.81, TIP, *limits)


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
