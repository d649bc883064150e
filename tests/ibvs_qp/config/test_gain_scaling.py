"""Gains that nobody states are those of the law, scaled to the vehicle; stated ones stay."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import ibvs_qp
from ibvs_qp.analysis.contact import LEAST_DAMPING_RATIO, least_margin
from ibvs_qp.config import ControllerConfig, Gains, VehicleParams
from ibvs_qp.config.settings import Derived
from ibvs_qp.pilot import PilotConfig

LIGHT = VehicleParams(mass_kg=3.0, motor_lag_up_s=0.09, motor_lag_down_s=0.14)


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
    fast = VehicleParams(motor_lag_up_s=0.02, motor_lag_down_s=0.03)
    quick = ControllerConfig(vehicle=fast).gains
    seconds = [field.name for field in dataclasses.fields(Gains) if field.metadata["unit"] == "s"]
    followed = {
        name: Derived(getattr(tuned, name) * fast.motor_lag_s / VehicleParams().motor_lag_s) for name in seconds
    }
    for name, gain in vars(dataclasses.replace(tuned, **followed)).items():
        assert getattr(quick, name) == pytest.approx(gain)


def test_leads_and_filters_follow_the_motors_lag() -> None:
    slow, tuned = ControllerConfig(vehicle=LIGHT).gains, Gains()
    leads = [field.name for field in dataclasses.fields(Gains) if field.metadata["unit"] == "s"]
    assert len(leads) == 8
    for name in leads:
        assert getattr(slow, name) == pytest.approx(2.0 * getattr(tuned, name))


@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize("mass", [2.0, 4.0, 12.0])
@pytest.mark.parametrize("lag", [0.03, 0.1])
def test_scaled_gains_damp_the_contact(law: str, mass: float, lag: float) -> None:
    vehicle = VehicleParams(mass_kg=mass, motor_lag_up_s=lag, motor_lag_down_s=lag)
    config = PilotConfig(law=law, controller=ControllerConfig(vehicle=vehicle)).controller
    assert least_margin(config, config.brush).least_damping_ratio > 1.5 * LEAST_DAMPING_RATIO
