"""Rotor layouts beside the hexarotor, for tests that must not lean on the number six."""

from __future__ import annotations

from allocation import Rotor, RotorGeometry

#: A flat octorotor with 13 inch propellers and alternating 30 degree tilt: fully actuated, two redundant rotors.
OCTOROTOR = RotorGeometry(
    rotors=tuple(
        Rotor(name=f"rotor_{index}", azimuth_deg=22.5 + 45.0 * index, spin=1 if index % 2 == 0 else -1)
        for index in range(8)
    ),
    circle_radius_m=0.46,
    tilt_deg=30.0,
    torque_ratio_m=0.020,
)
