"""Loop margin: exact where there is no feedback, true to the flown contact, and a refusal that says what to mend."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from closed_loop_rigs import HoldPainter, run, short_scene, wall
from fresh_equations import fresh_equations

import ibvs_qp
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.contact_margin import (
    LEAST_DAMPING_RATIO,
    STIFFNESS_RATIOS,
    BrushSettings,
    ContactLoop,
    contact_mode_damping,
    contact_sensitivity,
    least_margin,
    require_margin,
)
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.model import reach
from ibvs_qp.pilot import Pilot, PilotConfig
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand
from ibvs_qp.pilot.presets import FOLDER
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.surroundings import World
from sim.world.scene import ForceTorqueScene, ImuScene, Scene

#: Mean age of the force in the simulated loop beyond its latency: half a period of 100 Hz [s].
HALF_SAMPLE = 0.005
#: Time of the step of the push command from the start of the hold [s], and its size [N].
STEP_TIME, STEP = 4.0, 2.0


def with_gains(**gains: float) -> ControllerConfig:
    config = ControllerConfig()
    return dataclasses.replace(config, gains=dataclasses.replace(config.gains, **gains))


class StepPainter(HoldPainter):
    """Holds, with a step of the push command."""

    def step(self, inputs: PainterInput) -> PaintingCommand:
        command = super().step(inputs)
        late = self.phase == "paint" and inputs.time_s - self.entered > STEP_TIME
        return dataclasses.replace(command, push=command.push + STEP) if late else command


def quiet_scene(stiffness: float, latency: float, distance: float) -> Scene:
    """Sensors without noise, so that the ringing of one step can be read from the true push."""
    scene = short_scene(wall=wall(stiffness_n_m=stiffness))
    return dataclasses.replace(
        scene,
        start=dataclasses.replace(scene.start, distance_m=distance),
        force_torque=ForceTorqueScene(sigma_n=0.0, sigma_nm=0.0, bias_n=0.0, latency_s=latency),
        imu=ImuScene(gyro_density=0.0, accel_density=0.0, attitude_bias_deg=0.0, attitude_noise_deg=0.0),
        camera=dataclasses.replace(scene.camera, depth_noise_relative=0.0),
    )


def pushed(
    stiffness: float, latency: float, seconds: float, distance: float = 0.2, **gains: float
) -> tuple[ControllerConfig, float, np.ndarray]:
    """Controller, estimated over true stiffness, and true push at 250 Hz over a hold with a step of the command."""
    scene = quiet_scene(stiffness, latency, distance)
    options = FlightOptions(features="geometric", video=False)
    config = unsupervised(pilot_config(scene, options))
    gained = dataclasses.replace(config.controller.gains, **gains)
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, gains=gained))
    pilot, world = Pilot(config), World(scene, options, config)
    pilot.painter = StepPainter(config.painting, seconds + 1.0)
    push: list[float] = []

    def note() -> None:
        if pilot.painter.phase == "paint":
            push.append(world.plant.contact_normal_force)

    run(pilot, world, lambda: len(push) >= 250 * seconds, note, limit_s=60.0)
    return config.controller, pilot.setpoints.contact.stiffness / stiffness, np.array(push)


def ringing(push: np.ndarray, dt: float, least: float = 0.05) -> tuple[float, float]:
    """Damping ratio and frequency [Hz] by the decrement of the extremes of more than ``least`` [N] about the end."""
    error = push - push[-50:].mean()
    turns = np.flatnonzero(np.diff(np.sign(np.diff(error)))) + 1
    large = [turn for turn in turns if abs(error[turn]) > least]
    decrement = np.log(abs(error[large[0]] / error[large[-1]])) / (len(large) - 1)
    ratio = float(decrement / math.hypot(math.pi, decrement))
    half_period = dt * (large[-1] - large[0]) / (len(large) - 1)
    return ratio, 0.5 / half_period / math.sqrt(1.0 - ratio**2)


@pytest.mark.slow
@pytest.mark.usefixtures(fresh_equations.__name__)
@pytest.mark.parametrize("force_kfp", [0.8, 1.6, 2.2])  # with the shipped 0.02 nothing rings
def test_predicts_the_ringing_of_the_flown_contact(force_kfp: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reach, "RISE", 1e3)  # a step that is slewed in is no step
    # From farther away: the estimator of distance and rate has settled, as the model of the loop assumes.
    config, believed, push = pushed(1500.0, 0.004, 6.2, distance=0.45, force_kfp=force_kfp)
    margins = [
        contact_mode_damping(config, 1500.0, 30.0, 0.004 + HALF_SAMPLE, gusts=gusts, believed=believed)
        for gusts in (True, False)
    ]
    start = int(250 * STEP_TIME) + 10
    ratio, frequency = ringing(push[start : start + 500], 0.004)
    # The ringing itself counts as gusts in part: the flight is between the two.
    ratios, frequencies = (
        [getattr(each, name) for each in margins] for name in ("least_damping_ratio", "frequency_hz")
    )
    assert min(ratios) - 0.05 <= ratio <= max(ratios) + 0.05
    assert 0.95 * min(frequencies) <= frequency <= 1.05 * max(frequencies)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "latency", "gains"),
    [
        (3500.0, 0.004, {}),
        (1500.0, 0.004, {"force_kfp": 8.0}),
        (1500.0, 0.04, {"force_kfp": 4.0}),
        (1500.0, 0.04, {}),
        (1500.0, 0.004, {"force_kfi": 20.0}),
    ],
)
def test_holds_where_a_margin_is_and_oscillates_where_none_is(stiffness: float, latency: float, gains: dict) -> None:
    config, believed, push = pushed(stiffness, latency, 6.5, **gains)
    margin = contact_mode_damping(config, stiffness, 30.0, latency + HALF_SAMPLE, believed=believed)
    last = push[-500:]
    if margin.least_damping_ratio >= LEAST_DAMPING_RATIO:
        assert last.std() <= 0.15
    else:  # in the end it may throw the tip off the wall
        assert margin.least_damping_ratio < -0.04
        assert last.std() >= 0.5


def test_without_feedback_it_is_the_damped_oscillator() -> None:
    free = with_gains(force_kfp=0.0, force_kfi=0.0, force_ksp=0.0, force_ksd=0.0)
    still = dict.fromkeys(("calm_noise", "gust_noise", "slow_noise"), 1e-3)  # forces that the filter does not learn
    estimation = dataclasses.replace(free.contact.estimation, **still)
    free = dataclasses.replace(free, contact=dataclasses.replace(free.contact, estimation=estimation))
    for stiffness in (500.0, 1500.0, 10_000.0):
        margin = contact_mode_damping(free, stiffness, 30.0, 0.009)
        assert margin.least_damping_ratio == pytest.approx(30.9 / (2.0 * math.sqrt(6.0 * stiffness)), rel=0.01)
        assert margin.least_damping_ratio == pytest.approx(margin.passive_damping_ratio, rel=0.01)
        assert margin.frequency_hz == pytest.approx(math.sqrt(stiffness / 6.0) / (2.0 * math.pi), rel=0.01)
    overdamped = contact_mode_damping(free, 100.0, 500.0, 0.009)
    assert overdamped.least_damping_ratio > 0.99  # what oscillates at all is the filter of the push


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_contact_bears_a_wrong_stiffness(law: str) -> None:
    config = ibvs_qp.preset(law).controller
    assert contact_sensitivity(config) <= 2.0
    for ratio in STIFFNESS_RATIOS:
        assert contact_sensitivity(config, ratio) <= 2.3


@pytest.mark.parametrize("gain", [0.02, 0.8, 3.0])
def test_poles_and_sensitivity_are_of_one_loop(gain: float) -> None:
    """As many poles outside the unit circle as the return difference winds around zero, the open loop being stable."""
    loop = ContactLoop(with_gains(force_kfp=gain, force_kfi=0.5), 1500.0, 30.0, 0.009)
    growing = sum(2 if pole.imag > 1e-6 else 1 for pole in loop.poles() if pole.real > 1e-9)
    assert growing == (2 if gain > 2.0 else 0)
    assert growing or loop.sensitivity == pytest.approx(peak_by_response(loop), rel=0.02)


def peak_by_response(loop: ContactLoop) -> float:
    """Largest steady amplitude of the rotors' force that a swinging force of 1 N at their input causes, by ticks."""
    matrix, command, row = loop._open()
    peak, period = 0.0, loop.tick
    for frequency in np.geomspace(5.0, 60.0, 25):
        state, amplitude = np.zeros(len(matrix)), 0.0
        for k in range(4000):
            rotors = row @ state + math.sin(frequency * k * period)
            state = matrix @ state + command * rotors
            amplitude = max(amplitude, abs(rotors)) if k > 3000 else 0.0
        peak = max(peak, amplitude)
    return peak


def test_more_gain_and_a_switched_off_impedance_cost_damping() -> None:
    ratios = [
        contact_mode_damping(with_gains(force_kfp=k), 1500.0, 30.0, 0.009).least_damping_ratio for k in (0, 0.7, 2)
    ]
    assert ratios[0] > ratios[1] > 0.1 > ratios[2]
    direct = dataclasses.replace(ControllerConfig(), impedance=False)
    assert (
        contact_mode_damping(direct, 1500.0, 30.0, 0.009).least_damping_ratio
        < contact_mode_damping(ControllerConfig(), 1500.0, 30.0, 0.009).least_damping_ratio - 0.05
    )


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.toml")), ids=lambda file: Path(file).stem)
def test_every_preset_keeps_the_margin(file: Path) -> None:
    margin = require_margin(PilotConfig.from_toml(file).controller)
    assert margin.least_damping_ratio >= LEAST_DAMPING_RATIO


@pytest.mark.parametrize(
    ("gains", "brush", "words"),
    [
        ({"force_kfp": 3.0}, {}, r"gains\.force_kfp = 3\.0 is refused: allowed is \[0, 1\.\d+"),
        ({"force_kfi": 30.0}, {}, r"gains\.force_kfi = 30\.0 1/s is refused: allowed is \[0, 10\.\d+\] 1/s "),
        ({"force_ksp": 4000.0}, {}, r"gains\.force_ksp = 4000\.0 N/m is refused: allowed is \[0, 2\d{3}\] N/m "),
        (
            {},
            {"stiffness_max_n_m": 4e4},
            r"brush\.stiffness_max_n_m = 40000\.0 N/m is refused: allowed is \[1000, 1\d{4}",
        ),
        ({}, {"stiffness_min_n_m": 38e3, "stiffness_max_n_m": 4e4}, r"brush\.damping_n_s_m = 30\.0 N s/m is refused"),
    ],
)
def test_a_refusal_names_field_value_and_what_is_allowed(gains: dict, brush: dict, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as refusal:
        require_margin(with_gains(**gains), BrushSettings(**brush))
    assert "damped at least 0.1" in str(refusal.value) and "Hz" in str(refusal.value)


@pytest.mark.parametrize("kind", [ControllerConfig, PilotConfig])
def test_a_file_whose_contact_would_ring_is_refused(tmp_path: Path, kind: type) -> None:
    ringing, file = with_gains(force_kfp=3.0), tmp_path / "preset.toml"
    file.write_text((ringing if kind is ControllerConfig else PilotConfig(controller=ringing)).to_toml())
    with pytest.raises(ConfigError, match=r"preset\.toml: (controller\.)?gains\.force_kfp = 3\.0 is refused"):
        kind.from_toml(file)


def test_the_allowed_value_holds_and_a_little_more_does_not() -> None:
    with pytest.raises(ConfigError) as refusal:
        require_margin(with_gains(force_kfp=3.0))
    allowed = float(str(refusal.value).split("[0, ")[1].split("]")[0])
    assert least_margin(with_gains(force_kfp=0.999 * allowed)).least_damping_ratio >= LEAST_DAMPING_RATIO
    assert least_margin(with_gains(force_kfp=1.01 * allowed)).least_damping_ratio < LEAST_DAMPING_RATIO


def test_a_brush_cannot_be_inside_out() -> None:
    with pytest.raises(ConfigError, match=r"stiffness_min_n_m = 5000\.0 N/m"):
        BrushSettings(stiffness_min_n_m=5000.0)


@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize("vibration", [0.0, 0.1, 0.5, 1.0, 5.0])
def test_vibration_takes_no_contact_below_the_damping_of_its_wall(law: str, vibration: float) -> None:
    config = ibvs_qp.preset(law).controller
    for stiffness in (500.0, 1500.0, 4000.0, 10_000.0):
        margin = contact_mode_damping(config, stiffness, 30.0, 0.009, vibration)
        assert margin.least_damping_ratio >= min(LEAST_DAMPING_RATIO, margin.passive_damping_ratio)
