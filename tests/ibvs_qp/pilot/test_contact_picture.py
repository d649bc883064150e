"""What the camera has in view in contact: guides beside the tip, and how far they may lead."""

from __future__ import annotations

import dataclasses

import pytest

from ibvs_qp.config import ControllerConfig, VehicleParams
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.contact_picture import contact_picture, hint_span
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.vehicle_check import check_vehicle

#: 70 degrees upright.
WIDE = VehicleParams(camera_intrinsics_px=(342.8, 342.8, 319.5, 239.5))


def test_guides_lead_as_far_as_the_picture_shows_them() -> None:
    usual, wide = PilotConfig(), PilotConfig(controller=ControllerConfig(vehicle=WIDE))
    assert usual.painting.guide_reach_m == pytest.approx(0.24, abs=1e-3)
    assert wide.painting.guide_reach_m > 0.35
    above = dataclasses.replace(usual, painting=PaintingConfig(start="top-right"))
    assert above.painting.guide_reach_m == pytest.approx(0.095 - 0.015, abs=1e-3)
    assert PilotConfig(painting=PaintingConfig(guide_reach_m=0.1)).painting.guide_reach_m == 0.1


def test_the_tip_and_a_guide_are_where_the_pinhole_has_them() -> None:
    picture = contact_picture(PilotConfig())
    assert picture.tip == pytest.approx((319.5, 239.5 - 625.22 * 0.08 / 0.5))
    assert picture.place(0.05) == pytest.approx(picture.tip[1] + 625.22 * 0.1)
    left, right = picture.beside(0.05)
    assert left == pytest.approx(0.5, abs=0.02) and right == pytest.approx(0.5, abs=0.02)
    assert picture.beside(0.3) == (0.0, 0.0)


def test_the_span_of_the_fresh_edge_begins_beside_the_brush() -> None:
    low, high = hint_span(VehicleParams(), 0.08, "horizontal", 1)
    assert (low, high) == pytest.approx((0.10, 0.50), abs=1e-3)
    beside = VehicleParams(camera_position_m=(0.20, 0.05, 0.08))
    assert hint_span(beside, 0.08, "horizontal", 1)[0] == pytest.approx(0.0, abs=1e-3)


def test_columns_need_a_guide_beside_the_brush() -> None:
    far = VehicleParams(camera_position_m=(0.20, -0.22, 0.08))
    rows = PilotConfig(controller=ControllerConfig(vehicle=far))
    columns = dataclasses.replace(rows, painting=PaintingConfig(pattern="columns", start="top-right"))
    assert "no guide position in view" in check_vehicle(rows, 5.0).problems[0]
    assert "column" in check_vehicle(columns, 5.0).problems[0]
