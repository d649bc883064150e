"""Settings that follow from vehicle, camera and law: values, files, other vehicles; stated ones remain."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ibvs_qp
from allocation import Rotor, RotorGeometry
from ibvs_qp.config import ConfigError, ContactSettings, ControllerConfig, Gains, LimitSettings, VehicleParams
from ibvs_qp.config.contact_margin import LEAST_DAMPING_RATIO, least_margin
from ibvs_qp.config.field_of_view import field_of_view
from ibvs_qp.config.settings import Derived, from_dict, to_dict
from ibvs_qp.estimation.turned_camera import TurnedCamera, straightened
from ibvs_qp.pilot import PilotConfig

LIGHT = VehicleParams(mass_kg=3.0, motor_lag_up_s=0.09, motor_lag_down_s=0.14)


def with_vehicle(**parts: Any) -> ControllerConfig:
    return ControllerConfig(vehicle=VehicleParams(**parts))


def view_of(config: ControllerConfig) -> tuple[float, float, float, float]:
    limits = config.limits
    return limits.view_left, limits.view_right, limits.view_up, limits.view_down


def test_the_tarot_has_the_bounds_that_were_tuned() -> None:
    config = ControllerConfig()
    assert view_of(config) == pytest.approx((-0.48, 0.48, -0.35, 0.35), abs=3e-3)
    assert (config.contact.depth_min_m, config.contact.depth_max_m) == (0.53, 0.63)
    assert config.limits.yaw_deg == pytest.approx(10.0, abs=0.6)


def test_bounds_follow_the_focal_length_and_the_principal_point() -> None:
    focal = 240.0 / math.tan(math.radians(35.0))
    wide = with_vehicle(camera_intrinsics_px=(focal, focal, 319.5, 239.5)).limits
    assert wide.view_down == pytest.approx(math.tan(math.radians(35.0)) - 0.033 * 640 / focal)
    assert wide.view_up == pytest.approx(-wide.view_down)
    limits, usual = with_vehicle(camera_intrinsics_px=(625.22, 625.22, 299.5, 269.5)).limits, ControllerConfig().limits
    assert limits.view_down - usual.view_down == pytest.approx(-30.0 / 625.22)
    assert limits.view_up - usual.view_up == pytest.approx(-30.0 / 625.22)
    assert limits.view_left - usual.view_left == pytest.approx(20.0 / 625.22)


@pytest.mark.parametrize("turn_deg", [(0.0, -8.0, 0.0), (0.0, 12.0, 0.0), (0.0, 0.0, 10.0), (5.0, -6.0, 4.0)])
def test_ends_of_a_turned_picture_lie_on_its_border(turn_deg: tuple[float, float, float]) -> None:
    vehicle = VehicleParams(camera_turn_deg=turn_deg)
    view, back = field_of_view(vehicle), TurnedCamera(turn_deg).rotation.T
    fx, fy, cx, cy = vehicle.camera_intrinsics_px
    x, y = 0.5 * (view.left + view.right), 0.5 * (view.up + view.down)
    for point in ((x, view.up), (x, view.down), (view.left, y), (view.right, y)):
        ray = back @ (*point, 1.0)
        column, row = fx * ray[0] / ray[2] + cx, fy * ray[1] / ray[2] + cy
        assert -0.6 - 640 * 0.06 <= column <= 640 * 1.06 and -0.6 - 480 * 0.06 <= row <= 480 * 1.06
    if turn_deg[1] == -8.0:
        assert view.up == pytest.approx(-math.tan(math.radians(21.0 - 8.0)), abs=1e-3)


def test_yaw_has_half_of_the_room_to_the_wall() -> None:
    assert VehicleParams().strike_yaw_deg == pytest.approx(19.0, abs=0.5)
    assert with_vehicle(tip_position_m=(1.2, 0.0, 0.0)).limits.yaw_deg == 10.0
    short = VehicleParams(tip_position_m=(0.65, 0.0, 0.0))
    struck = math.radians(short.strike_yaw_deg)
    normal = np.array((math.cos(struck), math.sin(struck), 0.0))
    hub, axis = short.geometry.positions[4], short.geometry.axes[4]
    reach = normal @ hub + short.propeller_radius_m * math.sqrt(1.0 - (normal @ axis) ** 2)
    assert reach == pytest.approx(normal @ short.tip_position_m, abs=2e-3)
    assert ControllerConfig(vehicle=short).limits.yaw_deg == pytest.approx(0.5 * math.degrees(struck), abs=0.5)


def test_a_stated_value_wins_and_remains() -> None:
    config = ControllerConfig(
        contact=ContactSettings(depth_min_m=0.55), limits=LimitSettings(view_down=0.3, yaw_deg=7.0)
    )
    longer = dataclasses.replace(config, vehicle=VehicleParams(tip_position_m=(0.71, 0.0, 0.0)))
    for each in (config, longer, from_dict(ControllerConfig, to_dict(config))):
        assert (each.contact.depth_min_m, each.limits.view_down, each.limits.yaw_deg) == (0.55, 0.3, 7.0)
    assert (config.contact.depth_max_m, longer.contact.depth_max_m) == (0.63, 0.64)


def test_derived_values_follow_the_vehicle_and_stay_out_of_files() -> None:
    config = ControllerConfig()
    longer = dataclasses.replace(config, vehicle=VehicleParams(tip_position_m=(0.9, 0.0, 0.0)))
    assert (longer.contact.depth_min_m, longer.contact.depth_max_m) == (0.73, 0.83)
    changed = dataclasses.replace(
        longer, contact=dataclasses.replace(longer.contact, ramp_s=2.0), vehicle=VehicleParams()
    )
    assert changed.contact.depth_min_m == 0.53
    table = to_dict(longer)
    assert not {"depth_min_m", "depth_max_m"} & set(table["contact"])
    assert not {"yaw_deg", "view_up", "view_down", "view_left", "view_right"} & set(table["limits"])
    assert from_dict(ControllerConfig, table) == longer


def test_a_straightened_camera_keeps_the_bounds_of_the_turned_one() -> None:
    turned = with_vehicle(camera_turn_deg=(0.0, -8.0, 0.0))
    assert view_of(straightened(turned)) == view_of(turned) != view_of(ControllerConfig())


def test_a_flat_quadrotor_is_refused() -> None:
    rotors = tuple(Rotor(name=f"r{k}", azimuth_deg=45.0 + 90.0 * k - 180.0, spin=1 - 2 * (k % 2)) for k in range(4))
    geometry = RotorGeometry(rotors=rotors, circle_radius_m=0.3, torque_ratio_m=0.02)
    message = "vehicle.geometry = 4 rotors is refused: they give 4 of 6 directions of a wrench"
    with pytest.raises(ConfigError, match=re.escape(message)):
        ControllerConfig(vehicle=VehicleParams(geometry=geometry, mass_kg=3.0))


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_a_preset_that_names_only_law_and_vehicle_has_that_laws_gains(law: str, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f'law = "{law}"\n[controller.vehicle]\nmass_kg = 6.0\n')
    assert PilotConfig.from_toml(file).controller.gains == ibvs_qp.preset(law).controller.gains
    file.write_text(f'law = "{law}"\n[controller.vehicle]\nmass_kg = 3.0\n[controller.gains]\nforce_ksd = 50.0\n')
    gains, tuned = PilotConfig.from_toml(file).controller.gains, ibvs_qp.preset(law).controller.gains
    assert gains.force_ksd == 50.0 and gains.force_ksp == pytest.approx(0.5 * tuned.force_ksp)
    assert gains.line_kp == tuned.line_kp


def test_gains_follow_law_and_vehicle_through_replacements() -> None:
    config = PilotConfig(law="paper")
    lighter = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=LIGHT))
    compiled = lighter.controller.on_backend("compiled")
    assert compiled.gains == lighter.controller.gains != config.controller.gains
    other = dataclasses.replace(lighter, law="qp")
    assert other.controller.gains.attitude_kp == pytest.approx(0.25 * Gains().attitude_kp)
    assert type(other.controller.gains.attitude_kp) is Derived


def test_slower_motors_slow_every_loop_alike() -> None:
    slow, tuned = ControllerConfig(vehicle=LIGHT).gains, Gains()
    assert slow.line_kd == pytest.approx(0.5 * tuned.line_kd)
    assert slow.line_ki == pytest.approx(0.125 * tuned.line_ki)
    assert slow.force_ksd == pytest.approx(0.5 * 0.5 * tuned.force_ksd)
    assert slow.force_kfp == tuned.force_kfp


def test_faster_motors_change_leads_and_filters_alone() -> None:
    fast = VehicleParams(motor_lag_up_s=0.02, motor_lag_down_s=0.03)
    slow, quick = (ControllerConfig(vehicle=vehicle).gains for vehicle in (LIGHT, fast))
    times = {field.name for field in dataclasses.fields(Gains) if field.metadata["unit"] == "s"}
    assert len(times) == 8
    for name, tuned in vars(Gains()).items():
        ratio = fast.motor_lag_s / VehicleParams().motor_lag_s if name in times else 1.0
        assert getattr(quick, name) == pytest.approx(ratio * tuned)
        assert name not in times or getattr(slow, name) == pytest.approx(2.0 * tuned)


@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize("mass", [2.0, 4.0, 12.0])
@pytest.mark.parametrize("lag", [0.03, 0.1])
def test_scaled_gains_damp_the_contact(law: str, mass: float, lag: float) -> None:
    vehicle = VehicleParams(mass_kg=mass, motor_lag_up_s=lag, motor_lag_down_s=lag)
    config = PilotConfig(law=law, controller=ControllerConfig(vehicle=vehicle)).controller
    assert least_margin(config, config.brush).least_damping_ratio > 1.5 * LEAST_DAMPING_RATIO
