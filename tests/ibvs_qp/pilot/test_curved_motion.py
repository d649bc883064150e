"""Motion along curved walls: the tip before a bulge moves farther than the place before it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact import no_contact
from ibvs_qp.estimation.wall_motion import unrolled
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.painting.command import PaintingCommand
from ibvs_qp.pilot.planning import FASTER, Planning

RADIUS_M, DISTANCE_M = 1.5, 0.2
FREE = no_contact(ControllerConfig())._replace(known=True, distance=DISTANCE_M)
MOVING = PaintingCommand(contact=False, standoff=DISTANCE_M, velocity=np.array([0.1, 0.1]))


def shrink(curvature: tuple[float, float, float], distance: float) -> np.ndarray:
    return np.array(unrolled(ca.DM(curvature), ca.DM(distance)))


def moved(curvature: tuple[float, float, float], descending: bool = False) -> np.ndarray:
    planning = Planning(PilotConfig(), None)
    if descending:
        planning.painter._abandoned = True
    return planning.reference(MOVING, FREE, curvature).velocity


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ways_are_those_of_circles_about_the_axis(sign: float) -> None:
    kappa = sign / RADIUS_M
    found = shrink((kappa, 0.0, 0.0), DISTANCE_M)
    assert found == pytest.approx(np.diag((RADIUS_M / (RADIUS_M + sign * DISTANCE_M), 1.0)))
    turned = shrink((0.5 * kappa, 0.5 * kappa, 0.5 * kappa), DISTANCE_M)  # an axis at 45 degrees
    assert np.linalg.eigvalsh(turned) == pytest.approx(sorted((1.0, found[0, 0])))


@pytest.mark.parametrize("distance", [0.5, 0.74, 1.2, 10.0])
def test_before_a_hollow_wall_the_way_stays_finite(distance: float) -> None:
    found = shrink((-2.0, 0.0, 0.0), distance)
    assert np.isfinite(found).all() and 0.0 < found[0, 0] <= 4.0 + 1e-9 and found[1, 1] == pytest.approx(1.0)


def test_the_vehicle_moves_faster_than_the_place_before_it() -> None:
    ahead = float(PilotConfig().controller.vehicle.tip_position_m[0]) + DISTANCE_M
    assert moved((0.0, 0.0, 0.0)) == pytest.approx([0.1, 0.1])
    assert moved((1.0 / RADIUS_M, 0.0, 0.0)) == pytest.approx([0.1 * (1.0 + ahead / RADIUS_M), 0.1])
    assert moved((-2.0, 0.0, 2.0)) == pytest.approx([0.1 * FASTER[0], 0.1 * min(1.0 + 2.0 * ahead, FASTER[1])])


def test_a_descent_is_not_scaled() -> None:
    assert moved((0.5, 0.0, 0.5), descending=True) == pytest.approx([0.1, 0.1])
