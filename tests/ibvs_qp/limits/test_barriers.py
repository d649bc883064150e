"""Every barrier in closed loop: it binds where it must, is silent elsewhere, and without it the test fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from controller_scenes import line_references
from small_vehicle import SmallVehicle

from ibvs_qp.config import ControllerConfig, Gains, LimitSettings, VehicleParams, Weights
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import HORIZONTAL, LineReference, Reference

#: The disturbance comes after the controller has seen a few quiet ticks.
KICK_TICK = 5


@dataclass
class Flight:
    """What a closed loop under the program did: peaks after the start, and who bound when."""

    tilt_deg: float = 0.0
    yaw_deg: float = 0.0
    rho: float = 0.0
    push: float = 0.0
    closing: float = 0.0
    ticks: int = 0
    bound: dict[str, int] = field(default_factory=dict)

    def share(self, name: str) -> float:
        """Share of ticks on which a limit was active."""
        return sum(count for limit, count in self.bound.items() if limit.startswith(name)) / self.ticks


def fly(
    config: ControllerConfig,
    reference: Reference,
    seconds: float,
    *,
    distance: float = 0.1,
    lines: int = 0,
    prepare: Callable[[SmallVehicle], None] = lambda vehicle: None,
) -> Flight:
    vehicle, controller, flight = SmallVehicle(config, distance=distance), HybridController(config), Flight()
    for tick in range(round(seconds / config.tick_s)):
        if tick == KICK_TICK:
            prepare(vehicle)
        measurement = vehicle.measure(lines)
        command = controller.step(measurement, reference)
        roll, pitch, yaw = vehicle.attitude.as_euler("xyz", degrees=True)
        flight.tilt_deg = max(flight.tilt_deg, abs(roll), abs(pitch))
        flight.yaw_deg = max(flight.yaw_deg, abs(yaw))
        flight.push = max(flight.push, -float(vehicle.contact[0]))
        if vehicle.distance > 0.0:
            flight.closing = max(flight.closing, vehicle.velocity[0])
        if measurement.lines:
            flight.rho = max(flight.rho, abs(measurement.lines[0].rho))
        for limit in command.active_limits:
            flight.bound[limit.name] = flight.bound.get(limit.name, 0) + 1
        vehicle.fly(command.thrusts)
    flight.ticks = round(seconds / config.tick_s)
    return flight


def config(barrier: str = "", on: bool = True, limits: dict | None = None, **parts: object) -> ControllerConfig:
    """A configuration with one barrier's switch as told; ``limits`` are further limit settings."""
    switch = {f"{barrier}_barrier": on} if barrier else {}
    return ControllerConfig(limits=LimitSettings(**switch, **(limits or {})), **parts)  # type: ignore[arg-type]


def turning(axis: int, rate: float) -> Callable[[SmallVehicle], None]:
    """Start with a body rate [rad/s]."""

    def prepare(vehicle: SmallVehicle) -> None:
        vehicle.omega[axis] = rate

    return prepare


@pytest.mark.parametrize("axis", [0, 1])
def test_tilt_stays_within_its_bound_though_no_task_levels(axis: int) -> None:
    weights = Weights(level=0.0, effort=0.1)

    def tumble(on: bool) -> Flight:
        switch = config("tilt", on, weights=weights)
        return fly(switch, Reference(standoff=0.1), 1.0, prepare=turning(axis, 0.12))

    with_it, without = tumble(True), tumble(False)
    assert with_it.tilt_deg <= 1.1 and with_it.share("tilt") > 0.0
    assert without.tilt_deg > 3.0


def test_yaw_stays_clear_of_the_wall_though_no_task_faces_it() -> None:
    weights = Weights(yaw=0.0, effort=0.1)

    def turn(on: bool) -> Flight:
        return fly(config("yaw", on, weights=weights), Reference(standoff=0.1), 1.5, prepare=turning(2, 0.7))

    with_it, without = turn(True), turn(False)
    assert with_it.yaw_deg <= 10.5 and with_it.share("yaw") > 0.0
    assert without.yaw_deg > 19.0  # where the propellers strike


def test_a_guide_is_not_steered_out_of_the_picture() -> None:
    reference = Reference(standoff=0.1, lines=(LineReference(rho=0.6, theta=0.5 * math.pi, role=HORIZONTAL),))
    with_it, without = (fly(config("view", on), reference, 4.0, lines=1) for on in (True, False))
    assert with_it.rho <= 0.384 and with_it.share("view_horizontal") > 0.5
    assert without.rho > 0.384


@pytest.mark.slow
@pytest.mark.parametrize("mirrored", [False, True])
def test_view_ends_where_the_picture_ends(mirrored: bool) -> None:
    """A guide that a wide camera still shows is steered to its place; a camera turned up ends nearer to the axis."""
    angle = -0.5 * math.pi if mirrored else 0.5 * math.pi
    line = LineReference(rho=-0.6 if mirrored else 0.6, theta=angle, role=HORIZONTAL)
    reference = Reference(standoff=0.1, lines=(line,))
    wide = VehicleParams(camera_intrinsics_px=(342.8, 342.8, 319.5, 239.5))  # 70 deg
    assert fly(config(vehicle=wide), reference, 4.0, lines=1).rho > 0.55
    shifted = VehicleParams(camera_intrinsics_px=(625.22, 625.22, 319.5, 339.5))  # 100 px less below the axis
    assert fly(config(vehicle=shifted), reference, 4.0, lines=1).rho < 0.384 - 100.0 / 625.22


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [{"force_kfp": 2.0}, {"force_kfi": 7.0}])
def test_push_stays_below_its_ceiling_under_gains_that_oscillate(wrong: dict[str, float]) -> None:
    gains, reference = Gains(force_ksd=0.0, **wrong), Reference(push_force=5.0, contact=True)
    with_it, without = (
        fly(config("push", on, gains=gains, touch_ramp=False), reference, 3.0, distance=0.03) for on in (True, False)
    )
    assert with_it.push <= 1.8 * 5.0 and with_it.share("push_ceiling") > 0.05
    assert without.push > 2.0 * 5.0


def test_a_fast_approach_is_braked_before_it_touches() -> None:
    gains, reference = Gains(standoff_kd=0.5), Reference(push_force=5.0, contact=True)

    def ram(vehicle: SmallVehicle) -> None:
        vehicle.velocity[0] = 0.3

    with_it, without = (
        fly(config("approach", on, gains=gains), reference, 2.0, distance=0.12, prepare=ram) for on in (True, False)
    )
    assert with_it.push <= 6.0 and with_it.share("approach_speed") > 0.05
    assert without.push > 12.0


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "tilt_deg", "rho"), [(1.0, 0.71, 0.355), (0.1, 0.71, 0.370), (0.03, 0.71, 0.414)])
def test_prices_are_worth_what_the_settings_say(factor: float, tilt_deg: float, rho: float) -> None:
    """A guide leaves the picture at 0.384: at a thirtieth of the price. The level rows hold the tilt by themselves."""
    shipped = LimitSettings()
    cheap = config(limits={"tilt_slack_weight": factor * shipped.tilt_slack_weight})
    pitched = fly(cheap, Reference(standoff=0.1, lines=line_references(2)), 1.5, lines=2, prepare=turning(1, 0.25))
    assert pitched.tilt_deg == pytest.approx(tilt_deg, abs=0.02)
    cheap = config(limits={"view_slack_weight": factor * shipped.view_slack_weight})
    out = Reference(standoff=0.1, lines=(LineReference(rho=0.6, theta=0.5 * math.pi, role=HORIZONTAL),))
    assert fly(cheap, out, 4.0, lines=1).rho == pytest.approx(rho, abs=0.003)


def test_far_from_their_bounds_barriers_change_nothing() -> None:
    """Press and hold two lines: wherever no barrier binds, the program without them has the same solution."""
    reference = Reference(push_force=5.0, contact=True, lines=line_references(2))
    controller = HybridController()
    vehicle, silent, data = SmallVehicle(controller.config, distance=0.03), 0, controller.engine.data
    for tick in range(1500):
        command = controller.step(vehicle.measure(2), reference)
        if all(limit.name.startswith("thrust") for limit in command.active_limits):
            silent += 1
            if tick % 10 == 0:
                lower, upper = data.lower.copy(), data.upper.copy()
                lower[6:], upper[6:] = -1e6, 1e6
                free = controller.engine.exact.solve(data.p, data.q, data.a, lower, upper)
                assert free is not None
                np.testing.assert_allclose(command.thrusts, free[0][:6], atol=5e-3)
        vehicle.fly(command.thrusts)
    assert silent >= 0.95 * 1500


def test_hard_barriers_that_conflict_are_named() -> None:
    """A vehicle that tumbles faster than its rotors can stop: those who ask for the impossible are named."""
    hard = replace(ControllerConfig(), limits=LimitSettings(hard_barriers=True))
    controller, vehicle = HybridController(hard), SmallVehicle(hard)
    controller.step(vehicle.measure(0), Reference())
    vehicle.omega[:] = 0.0, 3.0, 0.0
    vehicle.tick += 1
    command = controller.step(vehicle.measure(0), Reference())
    said = " ".join(command.rejected)
    assert "no solution" in said and "tilt_pitch" in said and "thrust_" in said
    assert np.isfinite(command.thrusts).all()
    assert command.outcome.value == "analytic_fallback"
