"""Late lines and velocities are carried to where they are now."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Measurement, Reference

CONFIG = ControllerConfig()
REFERENCE = Reference(standoff=0.2, lines=line_references(2))


def moving() -> SmallVehicle:
    """Turning and sliding in front of its wall, faster than a job does."""
    vehicle = SmallVehicle(CONFIG, distance=0.4)
    vehicle.omega, vehicle.velocity = np.array([0.3, -0.2, 0.25]), np.array([0.1, -0.2, 0.15])
    return vehicle


def stamped(seen: Measurement) -> Measurement:
    return replace(seen, lines=tuple(replace(line, stamp_ns=seen.stamp_ns) for line in seen.lines))


def delayed(now: Measurement, then: Measurement) -> Measurement:
    """Lines, plane and velocity of then in the measurement of now."""
    return replace(
        now,
        lines=then.lines,
        plane=then.plane,
        plane_stamp_ns=then.stamp_ns,
        velocity=then.velocity,
        velocity_stamp_ns=then.stamp_ns,
    )


def present(controller: HybridController, seen: Measurement) -> tuple[np.ndarray, np.ndarray]:
    """Lines (rho, theta) and velocity [m/s] that the law takes for those of now."""
    command = controller.step(seen, REFERENCE)
    assert command.rejected == ()
    lines = [(line.rho, line.theta) for line in controller.setpoints.lines]
    return np.array(lines), controller.setpoints.step.inputs["velocity"].copy()


@pytest.mark.parametrize("ticks", [5, 15, 40])
def test_lines_and_velocity_of_some_ticks_ago_are_those_of_now(ticks: int) -> None:
    vehicle, seen, late = moving(), deque[Measurement](), HybridController(CONFIG)
    for _ in range(80):
        seen.append(stamped(vehicle.measure()))
        now, then = seen[-1], seen[max(len(seen) - 1 - ticks, 0)]
        lines, velocity = present(late, delayed(now, then))
        vehicle.fly(vehicle.thrusts * 1.02)
    (true, speed), (old, old_speed) = present(HybridController(CONFIG), now), present(HybridController(CONFIG), then)
    assert len(lines) == 2
    assert np.abs(lines - true).max() < 0.05 * np.abs(old - true).max()
    assert np.abs(velocity - speed).max() < 0.15 * np.abs(old_speed - speed).max()


def test_what_is_not_late_stays_as_it_is() -> None:
    vehicle, controller = moving(), HybridController(CONFIG)
    for _ in range(3):
        for seen in (stamped(vehicle.measure()), vehicle.measure(stamp_ns=vehicle.measure().stamp_ns + 1_000_000)):
            lines, velocity = present(controller, seen)
            assert seen.velocity is not None
            np.testing.assert_array_equal(velocity, seen.velocity)
            np.testing.assert_allclose(lines[:, 0], [line.rho for line in seen.lines])
        vehicle.fly(vehicle.thrusts)


def test_a_controller_with_late_features_flies_the_same_path() -> None:
    """With 60 ms of latency that nothing makes up for, the path from 8 cm aside leaves the other by 20 mm."""
    paths = []
    for delay in (0, 15):
        controller = HybridController(CONFIG)
        vehicle, seen, path = SmallVehicle(CONFIG, distance=0.3), deque[Measurement](maxlen=delay + 1), []
        vehicle.position = vehicle.position + np.array([0.0, 0.06, 0.05])
        for _ in range(500):
            seen.append(stamped(vehicle.measure()))
            given = delayed(seen[-1], seen[0]) if delay else seen[-1]
            command = controller.step(given, REFERENCE)
            assert command.rejected == ()
            vehicle.fly(command.thrusts)
            path.append(vehicle.position)
        paths.append(np.array(path))
    assert np.abs(paths[1] - paths[0]).max() < 1e-3
    assert np.abs(paths[0][-1] - paths[0][0]).max() > 0.03
