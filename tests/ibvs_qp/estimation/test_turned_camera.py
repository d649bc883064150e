"""Features of a turned camera, in the axes of a straight one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig, LimitSettings
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.turned_camera import OUT_OF_VIEW, TurnedCamera
from ibvs_qp.measurement import HORIZONTAL, FeatureFrame, LineFeature, Reference

Turn = tuple[float, float, float]
TURNS: list[Turn] = [(0.0, 15.0, 0.0), (0.0, 0.0, -20.0), (90.0, 0.0, 0.0), (10.0, -20.0, 15.0)]
COVARIANCE = np.array([[4e-6, 1e-6], [1e-6, 9e-6]])


def line_of(rho: float, theta: float, segment: np.ndarray | None = None) -> LineFeature:
    return LineFeature(rho=rho, theta=theta, covariance=COVARIANCE, role=HORIZONTAL, segment=segment, surface_side=1)


def seen(ends: np.ndarray) -> LineFeature:
    """Image of the line through two points in camera axes, (2, 3)."""
    x, y, z = np.cross(*ends)
    return line_of(-z / math.hypot(x, y), math.atan2(y, x), ends[:, :2] / ends[:, 2:])


def normal(line: LineFeature) -> np.ndarray:
    return np.array((math.cos(line.theta), math.sin(line.theta), -line.rho))


def turned(camera: TurnedCamera, line: LineFeature | None, plane: Any = None) -> FeatureFrame:
    rejected: list[str] = []
    found = camera.features(FeatureFrame(lines=(line,) if line else (), plane=plane, stamp_ns=5), rejected)
    assert rejected == []
    return found


@pytest.mark.parametrize("turn", TURNS)
def test_lines_segments_and_planes_are_those_of_a_straight_camera(turn: Turn) -> None:
    camera, rng = TurnedCamera(turn), np.random.default_rng(0)
    back = camera.rotation.T
    for _ in range(20):
        straight = rng.uniform((-0.15, -0.15, 0.6), (0.15, 0.15, 1.0), (2, 3))
        wall = np.array((*rng.uniform(-0.2, 0.2, 2), 1.0))
        wall /= float(wall @ straight[0])
        real = seen(straight @ back.T)
        found = turned(camera, real, (*(back @ wall).tolist(), -1.0))
        (line,), expected = found.lines, seen(straight)
        assert normal(line) == pytest.approx(normal(expected)) and line.surface_side == 1
        np.testing.assert_allclose(line.segment, expected.segment)
        np.testing.assert_allclose(found.plane, (*wall, -1.0), atol=1e-12)
        beside = rng.uniform((-0.3, -0.3, 0.5), (0.3, 0.3, 1.0))
        assert np.sign(normal(line) @ beside) == np.sign(normal(real) @ (back @ beside)), "side of the surface"


@pytest.mark.parametrize("turn", TURNS)
def test_the_covariance_follows_the_turn(turn: Turn) -> None:
    camera, step = TurnedCamera(turn), 1e-6
    rho, theta = 0.12, 1.3
    (line,) = turned(camera, line_of(rho, theta)).lines
    columns = []
    for change in ((step, 0.0), (0.0, step)):
        (moved,) = turned(camera, line_of(rho + change[0], theta + change[1])).lines
        columns.append(((moved.rho - line.rho) / step, (moved.theta - line.theta) / step))
    jacobian = np.array(columns).T
    np.testing.assert_allclose(line.covariance, jacobian @ COVARIANCE @ jacobian.T, rtol=1e-4)


def test_what_a_straight_camera_cannot_see_is_named() -> None:
    camera, rejected = TurnedCamera((0.0, 0.0, 90.0)), list[str]()
    frame = FeatureFrame(lines=(line_of(0.0, 0.0), line_of(0.1, 1.5)), plane=(0.0, 0.0, 2.0, -1.0), stamp_ns=5)
    found = camera.features(frame, rejected)
    assert len(found.lines) == 1 and found.plane is None
    assert rejected == [f"lines: 1 {OUT_OF_VIEW}", f"plane: {OUT_OF_VIEW}"]


@pytest.mark.slow
@pytest.mark.parametrize("law", [HybridController, PaperController])
@pytest.mark.parametrize("turn", [(0.0, 15.0, 0.0), (10.0, -20.0, 15.0)])
def test_a_controller_flies_a_turned_camera_like_a_straight_one(law: Callable[..., Any], turn: Turn) -> None:
    limits = LimitSettings(view_barrier=False)  # a turned camera has another field of view
    settings = [
        ControllerConfig(limits=limits, vehicle=vehicle)
        for vehicle in (VehicleParams(), VehicleParams(camera_turn_deg=turn))
    ]
    straight, real = (law(config) for config in settings)
    back = TurnedCamera([-angle for angle in turn])  # from the straight camera to the real one
    vehicle = SmallVehicle(ControllerConfig(), distance=0.3)
    reference = Reference(standoff=0.2, lines=line_references(2))
    vehicle.position = vehicle.position + np.array((0.0, 0.03, 0.02))
    for _ in range(100):
        measured = vehicle.measure()
        command = straight.step(measured, reference)
        other = real.step(back.measurement(replace(measured), []), reference)
        assert other.rejected == () and other.thrusts == pytest.approx(command.thrusts, abs=1e-6)
        vehicle.fly(command.thrusts)
