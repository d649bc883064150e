"""Deliberate tilt where a thrust limit would bound the push: least tilt, permission, and what it does in flight."""

from __future__ import annotations

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from reach_oracle import OCTOROTOR, RIGHT, TIP, WEIGHT
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from symbolic_block import Block

from allocation import TAROT_T960, WrenchFacets, tilted_push_reach
from ibvs_qp.config import ControllerConfig, LimitSettings
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.inputs import Body, Contact
from ibvs_qp.model.inputs import Target
from ibvs_qp.model.model import Model
from ibvs_qp.model.reach import push_planes, push_reach
from ibvs_qp.model.trim_tilt import TRIM_FRACTION, TrimTilt
from ibvs_qp.pilot import PilotConfig

LAYOUTS = {"six": TAROT_T960, "eight": OCTOROTOR}
LIMIT_DEG = 2.0


def config(layout: str, trim_deg: float = LIMIT_DEG) -> ControllerConfig:
    vehicle = VehicleParams(geometry=LAYOUTS[layout])
    return ControllerConfig(vehicle=vehicle, limits=LimitSettings(trim_deg=trim_deg))


def settled(
    layout: str,
    push: float,
    friction: float,
    *,
    touching: float = 1.0,
    attitude: tuple[float, float] = (0.0, 0.0),
    most: np.ndarray | None = None,
) -> np.ndarray:
    """Roll and pitch to fly [rad], and level reach [N], after some seconds of a slide to the left.

    ``attitude`` is the roll and pitch flown [rad], ``most`` the upper thrust limits.
    """
    made, count = config(layout), LAYOUTS[layout].count
    body_from_level = Rotation.from_euler("ZYX", (0.0, attitude[1], attitude[0])).inv()

    def build(signals):
        body, contact, target = Body.of(signals), Contact.of(signals), Target.of(signals)
        trim = TrimTilt(signals, made)
        static = ca.vertcat(WEIGHT * body.down, ca.DM.zeros(3))
        travel = ca.DM(body_from_level.apply(-0.05 * RIGHT))
        planes = push_planes(signals, made.vehicle, contact.normal, travel, ca.SX(friction), static)
        push_reach(signals, planes)
        trim.update(planes, body, contact, target)
        return ca.vertcat(signals.outputs["trim_tilt"], signals.outputs["level_reach"])

    block, found = Block(build), np.zeros(3)
    block.contact(touching=touching)
    inputs = {
        "attitude": body_from_level.inv().as_quat(scalar_first=True),
        "normal": body_from_level.apply((1.0, 0.0, 0.0)),
        "thrust_low": np.full(count, 1.2),
        "thrust_high": np.full(count, 52.56) if most is None else most,
        "reference.push": push,
        "reference.press": 1.0,
    }
    for _ in range(2000):
        found = block(**inputs)
    return found


def least_tilt(layout: str, push: float, friction: float) -> np.ndarray:
    """The same angles by a general optimiser, with gravity, push and friction turned in full [rad], (2,)."""
    facets = WrenchFacets(LAYOUTS[layout])

    def rooms(angles: np.ndarray) -> np.ndarray:
        body = Rotation.from_euler("ZYX", (0.0, angles[1], angles[0])).inv()
        force = push / TRIM_FRACTION * body.apply((1.0, 0.0, 0.0) - friction * RIGHT)
        wrench = np.concatenate((force - body.apply((0.0, 0.0, WEIGHT)), np.cross(TIP, force)))
        low, high = facets.rooms(wrench, 1.2, 52.56)
        return np.concatenate((-low, high))

    inside = {"type": "ineq", "fun": rooms}
    return minimize(lambda angles: 1e3 * angles @ angles, np.zeros(2), constraints=inside, options={"ftol": 1e-12}).x


@pytest.mark.parametrize(("layout", "push", "friction"), [("six", 8.8, 0.8), ("six", 15.0, 0.3), ("six", 6.0, 0.8)])
def test_it_is_the_least_tilt_that_allows_the_push(layout: str, push: float, friction: float) -> None:
    expected = least_tilt(layout, push, friction)
    assert np.abs(expected).max() < math.radians(LIMIT_DEG)
    for flown in ((0.0, 0.0), expected):
        found = settled(layout, push, friction, attitude=tuple(flown))
        np.testing.assert_allclose(found[:2], expected, atol=math.radians(0.05))


def test_eight_rotors_have_more_planes() -> None:
    facets, limits = WrenchFacets(OCTOROTOR), (WEIGHT, TIP, 1.2, 52.56)
    sideways = {"friction": 0.8, "travel": -RIGHT}
    level = tilted_push_reach(facets, *limits, tilt=0.0, **sideways)[0]
    most = tilted_push_reach(facets, *limits, tilt=math.radians(LIMIT_DEG), **sideways)[0]
    push = TRIM_FRACTION * (0.5 * level + 0.5 * most)
    np.testing.assert_allclose(settled("eight", push, 0.8)[:2], least_tilt("eight", push, 0.8), atol=math.radians(0.05))


def test_a_push_beyond_reach_takes_the_permission_and_no_more() -> None:
    angles = settled("six", 40.0, 0.8)[:2]
    assert np.abs(angles).max() == pytest.approx(math.radians(LIMIT_DEG), rel=1e-3)
    assert np.abs(angles).max() <= math.radians(LIMIT_DEG) * (1.0 + 1e-9)


@pytest.mark.parametrize(("push", "touching"), [(5.0, 1.0), (40.0, 0.0)])
def test_the_vehicle_is_level_within_reach_and_off_the_wall(push: float, touching: float) -> None:
    np.testing.assert_allclose(settled("six", push, 0.8, touching=touching)[:2], 0.0, atol=1e-12)


@pytest.mark.parametrize("rotor", range(6))
def test_off_the_wall_a_weak_rotor_tilts_nothing(rotor: int) -> None:
    most = np.full(6, 52.56)
    most[rotor] = 5.0  # no level hover
    np.testing.assert_array_equal(settled("six", 10.0, 0.8, touching=0.0, most=most)[:2], 0.0)


@pytest.mark.parametrize("attitude", [(0.0, 0.0), (-0.03, -0.02), (0.02, 0.03)])
def test_the_reach_of_level_flight_is_known_at_any_attitude(attitude: tuple[float, float]) -> None:
    facets, limits = WrenchFacets(TAROT_T960), (WEIGHT, TIP, 1.2, 52.56)
    level, _ = tilted_push_reach(facets, *limits, tilt=0.0, friction=0.8, travel=-RIGHT)
    assert settled("six", 5.0, 0.8, attitude=attitude)[2] == pytest.approx(level, abs=1e-6)


def test_without_permission_the_program_is_that_of_before() -> None:
    names = Model(ControllerConfig()).signals
    assert not [name for name in (*names.states, *names.outputs) if name.startswith(("trim_tilt", "level_reach"))]


def test_the_supervisor_acts_beyond_the_trim() -> None:
    controller = ControllerConfig(limits=LimitSettings(trim_deg=8.0))
    with pytest.raises(ConfigError, match=r"limits.trim_deg = 8.0 deg is refused: allowed is 0 to 7.48 deg"):
        PilotConfig(controller=controller)
    PilotConfig(controller=dataclasses.replace(controller, limits=LimitSettings(trim_deg=7.0)))
