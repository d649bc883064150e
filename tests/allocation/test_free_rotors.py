"""Rotors with positions, axes and torque ratios of their own."""

import math
from dataclasses import replace

import numpy as np
import pytest

from allocation import TAROT_T960, Rotor, RotorGeometry, control_effectiveness
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict, to_dict
from ibvs_qp.config.vehicle import VehicleParams

UP = (0.0, 0.0, -1.0)
FORWARD = (1.0, 0.0, 0.0)


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
    right, front, pusher = control_effectiveness(geometry).T
    np.testing.assert_allclose(right, [0, 0, -1, -0.5, 0, 0.03], atol=1e-15)
    np.testing.assert_allclose(front, [0, 0, -1, 0, 0.5, -0.02], atol=1e-15)
    np.testing.assert_allclose(pusher, [1, 0, 0, -0.02, 0.2, 0], atol=1e-15)


def test_the_circle_written_out_rotor_by_rotor_is_the_same() -> None:
    places, axes = TAROT_T960.positions.tolist(), TAROT_T960.axes.tolist()
    rotors = tuple(
        Rotor(name=rotor.name, spin=rotor.spin, position_m=tuple(place), axis=tuple(axis))
        for rotor, place, axis in zip(TAROT_T960.rotors, places, axes, strict=True)
    )
    free = RotorGeometry(rotors=rotors, torque_ratio_m=0.020)
    np.testing.assert_allclose(control_effectiveness(free), control_effectiveness(TAROT_T960), atol=1e-15)


def test_a_rotor_on_the_circle_may_state_its_axis_alone() -> None:
    tilt = math.radians(28.0)
    turned = Rotor(name="mid_right", spin=-1, azimuth_deg=90.0, axis=(math.sin(tilt), 0.0, -math.cos(tilt)))
    geometry = RotorGeometry(
        rotors=(turned, *TAROT_T960.rotors[1:]), torque_ratio_m=0.02, circle_radius_m=0.48, tilt_deg=30.0
    )
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


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e308])
@pytest.mark.parametrize("name", ["circle_radius_m", "tilt_deg", "torque_ratio_m", "hub_height_m"])
def test_a_geometry_has_finite_lengths(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        replace(TAROT_T960, **{name: value})


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e308])
@pytest.mark.parametrize("name", ["azimuth_deg", "torque_ratio_m"])
def test_a_rotor_has_finite_values(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        replace(TAROT_T960.rotors[0], **{name: value})


def test_the_number_of_rotors_is_limited() -> None:
    with pytest.raises(ValueError, match="65 given, 1 to 64"):
        replace(TAROT_T960, rotors=TAROT_T960.rotors[:1] * 65)
