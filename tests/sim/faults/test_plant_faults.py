"""Faults in flight: their time, their effect on the plant, and the limits reported to the pilot."""

from __future__ import annotations

import dataclasses
import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from plants import at_rest

from sim.evaluate.measures import loss_figures
from sim.experiments.scenes import near_wall
from sim.faults.air import SidePush, WindStep
from sim.faults.rotors import Derate, RotorStuck, ThrustLoss
from sim.faults.schedule import FaultSchedule
from sim.faults.solver import SolverInfeasible, SolverSilent
from sim.faults.wall import BoardMoved, EdgeBroken, OtherWall
from sim.flight.closed_loop import fly, make_pilot
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.flight.trace import LANDED
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.errors import WorldErrors, world_errors
from sim.world.painted_edges import BIN_M
from sim.world.plant import Plant
from sim.world.scene import Scene, SurfaceScene

OPTIONS = FlightOptions(features="geometric", video=False)


def world_and_pilot():
    scene = near_wall()
    config = pilot_config(scene, OPTIONS)
    return World(scene, OPTIONS, config), make_pilot(scene, OPTIONS, config, PressJob())


def test_a_fault_strikes_once_when_its_time_has_come():
    world, pilot = world_and_pilot()
    schedule = FaultSchedule((Derate(after="start", delay_s=0.1, rotor="mid_right", share=0.5),))
    struck = []
    for tick in range(50):
        if schedule.tick(world, pilot):
            struck.append(tick)
        world.act(pilot.step(world.sense()).thrusts)
    assert struck == [25]
    low, high = world.plant.thrust_limits
    assert high == pytest.approx([26.28, *[52.56] * 5]) and low == pytest.approx(1.2)
    assert pilot.measurement is not None and pilot.measurement.thrust_max is not None
    assert pilot.measurement.thrust_max == pytest.approx(high)


def test_an_untold_fault_changes_the_plant_alone():
    world, pilot = world_and_pilot()
    Derate(rotor="mid_left", share=0.3, reported=False).strike(world, pilot)
    assert pilot.thrust_limits is None
    assert world.plant.thrust_limits[1][1] == pytest.approx(0.3 * 52.56)


def test_a_stopped_rotor_gives_nothing_and_the_wall_is_given_up():
    world, pilot = world_and_pilot()
    Derate(rotor="rear_left", share=0.0).strike(world, pilot)
    assert pilot.step(world.sense()).mode == "free" and pilot.painter.phase == "retreat"
    for _ in range(200):
        world.plant.step(np.full(6, 11.0))
    assert world.plant.thrusts_actual[5] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("rotor", ["front_left", pytest.param("mid_right", marks=pytest.mark.slow)])
def test_a_vehicle_that_loses_a_rotor_while_pressing_leaves_the_wall_and_comes_down(rotor):
    """The issue's figures; front_left leaves a force of 8 N towards the wall unless the vehicle tilts."""
    fault = Derate(delay_s=1.0, rotor=rotor, share=0.0)
    trace = fly(near_wall(), OPTIONS, job=PressJob(hold_s=8.0, descend_s=5.0), faults=(fault,))
    figures = loss_figures(trace)
    # Touch, ramp, loss of the rotor and the phases since: no thrust ever steps farther than the rate limit.
    assert np.abs(np.diff(trace.thrusts[1:], axis=0)).max() <= 500.0 * 0.004 + 1e-6
    assert trace.claimed, trace.reason
    assert (figures["survived_s"] >= 4.99 or trace.reason == LANDED) and figures["detached"] == 1.0
    assert figures["tilt_peak_deg"] <= 25.0 and 0.0 < figures["descent_peak_m_s"] <= 1.5


def test_wind_pushes_from_the_step_on():
    world, pilot = world_and_pilot()
    text = WindStep(mean_m_s=(0.0, 8.0, 0.0)).strike(world, pilot)
    for _ in range(25):
        world.act(pilot.step(world.sense()).thrusts)
    # 0.9 N per m/s of airspeed on 6 kg: 1.2 m/s^2 for 0.1 s, less what the pilot does against it.
    assert 0.06 < world.plant.velocity[1] < 0.13
    assert "wind steps" in text


def run(world, pilot, ticks, faults):
    """Fly that many ticks with faults; commands in order."""
    schedule, commands = FaultSchedule(faults), []
    for _ in range(ticks):
        schedule.tick(world, pilot)
        frame = schedule.seen(world.sense())
        commands.append(pilot.step(frame) if frame is not None else commands[-1])
        world.act(commands[-1].thrusts)
    return commands


def test_a_stuck_rotor_keeps_its_thrust_and_follows_again_when_the_fault_ends():
    world, pilot = world_and_pilot()
    fault = RotorStuck(after="start", delay_s=0.0, duration_s=0.4, rotor="rear_right", thrust_n=15.0)
    run(world, pilot, 100, (fault,))
    assert world.plant.thrusts_actual[3] == pytest.approx(15.0, abs=0.05)
    assert pilot.thrust_limits is None
    run(world, pilot, 2, (dataclasses.replace(fault, duration_s=0.001),))
    assert np.array_equal(world.plant.thrust_limits, [[1.2] * 6, [52.56] * 6])


def test_a_loss_of_thrust_scales_what_is_commanded_until_it_ends():
    world, pilot = world_and_pilot()
    fault = ThrustLoss(rotor="mid_left", share=0.5)
    fault.strike(world, pilot)
    for _ in range(200):
        world.plant.step(np.full(6, 11.0))
    assert world.plant.thrusts_actual == pytest.approx([11.0, 5.5, 11.0, 11.0, 11.0, 11.0], abs=1e-3)
    fault.end(world, pilot)
    assert world.plant.gain == pytest.approx(1.0)


def test_a_gust_and_a_side_push_end():
    world, pilot = world_and_pilot()
    gust = WindStep(after="start", delay_s=0.0, duration_s=0.04, mean_m_s=(0.0, 8.0, 0.0))
    push = SidePush(after="start", delay_s=0.0, duration_s=0.04, force_n=(0.0, 10.0, 0.0))
    run(world, pilot, 11, (push,))
    # 10 N on 6 kg for 40 ms, less what the pilot does against it.
    assert 0.6 < world.plant.velocity[1] / (10.0 / 6.0 * 0.04) < 1.0
    assert world.plant.outer_force is None
    run(world, pilot, 5, (gust,))
    assert world.plant.wind.mean[1] == 8.0
    run(world, pilot, 11, (gust,))
    assert world.plant.wind.mean[1] == 0.0


def test_another_wall_changes_stiffness_and_friction_of_the_contact_and_back():
    world, pilot = world_and_pilot()
    model = world.plant.model
    stiff, rough = model.pair_solref[0, 0], model.pair_friction[0, 0]
    fault = OtherWall(stiffness_ratio=5.0, friction=1.2)
    fault.strike(world, pilot)
    assert model.pair_solref[0, 0] == pytest.approx(5.0 * stiff) and model.pair_friction[0, 0] == 1.2
    fault.end(world, pilot)
    assert model.pair_solref[0, 0] == pytest.approx(stiff) and model.pair_friction[0, 0] == rough


def test_a_wall_that_stiffens_under_the_tip_is_dented_less_and_pushes_as_before():
    pushes = {}
    for ratio in (1.0, 5.0):
        plant = at_rest(Plant(Scene()), np.array([-0.70 + 0.003, 0.7, -1.5]))
        OtherWall(stiffness_ratio=ratio).strike(SimpleNamespace(plant=plant), None)
        plant.step(plant.thrusts_actual)
        pushes[ratio] = plant.pushes[0]
    assert pushes[1.0] == pytest.approx(1500.0 * 0.003, rel=0.02)
    assert pushes[5.0] == pytest.approx(pushes[1.0], rel=0.05)


@pytest.mark.parametrize("beside", [False, True])
def test_bristles_keep_another_wall_and_push_as_before(beside):
    scene, tip = Scene(errors=dataclasses.replace(WorldErrors(), brush=world_errors("field").brush)), (0.003, 0.7, -1.5)
    if beside:
        tip = (scene.board.gap_m + 0.003, -0.02, -1.5)
    pushes = {}
    for ratio in (1.0, 5.0):
        plant = at_rest(Plant(scene), np.array(tip) - Plant(scene).vehicle.tip_position_m)
        plant.step(plant.thrusts_actual)  # the tip comes before the wall's face
        at_rest(plant, np.array(tip) - plant.vehicle.tip_position_m)
        OtherWall(stiffness_ratio=ratio, friction=1.2).strike(SimpleNamespace(plant=plant), None)
        plant.step(plant.thrusts_actual)
        pushes[ratio] = plant.pushes[0]
        assert plant.model.pair_friction[0, 0] >= 1.2
    assert pushes[1.0] == pytest.approx(1500.0 * (1.0 + 3.0 * scene.errors.brush.progression_per_mm) * 0.003, rel=0.1)
    assert pushes[5.0] == pytest.approx(pushes[1.0], rel=0.1)


@pytest.mark.parametrize("settings", [SurfaceScene(kind="cylinder", radius_m=1.5), SurfaceScene(lean_deg=10.0)])
def test_a_push_is_level_and_a_board_moves_along_its_normal_on_every_wall(settings):
    scene = Scene(surface=settings)
    plant, pushed = Plant(scene), Plant(scene)
    before = plant.tip
    BoardMoved(away_m=0.1).strike(SimpleNamespace(plant=plant), None)
    assert plant.tip - before == pytest.approx([-0.1, 0.0, 0.0])
    SidePush(force_n=(30.0, 0.0, 0.0)).strike(SimpleNamespace(plant=pushed), None)
    plant = Plant(scene)
    for each in (plant, pushed):
        for _ in range(10):
            each.step(each.thrusts_actual)
    gained = BoardGeometry(scene).from_ned.T @ (pushed.rotation @ pushed.velocity - plant.rotation @ plant.velocity)
    assert gained[0] > 0.15 and abs(gained[2]) < 1e-3


def test_a_board_that_moves_away_is_farther_and_the_speed_stays():
    world, pilot = world_and_pilot()
    run(world, pilot, 50, ())
    tip, velocity = world.plant.tip, world.plant.velocity
    BoardMoved(away_m=0.1).strike(world, pilot)
    assert world.plant.tip - tip == pytest.approx([-0.1, 0.0, 0.0])
    assert np.array_equal(world.plant.velocity, velocity)
    before = pilot.contact.state.distance
    run(world, pilot, 50, ())
    assert pilot.contact.state.distance - before == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize("kind", [SolverSilent, SolverInfeasible])
def test_a_failing_solver_gives_the_analytic_law_as_long_as_the_fault_lasts(kind):
    world, pilot = world_and_pilot()
    back = 20 + pilot.config.controller.solver.recovery_ticks
    commands = run(world, pilot, back + 10, (kind(after="start", delay_s=0.04, duration_s=0.04),))
    found = [str(command.outcome) for command in commands]
    assert set(found[10 : back - 1]) == {"analytic_fallback"}
    assert set(found[:10]) == {"solved"} and set(found[back:]) <= {"solved", "exact_fallback"}


def test_paint_runs_over_the_edges_that_are_there_along_a_part_of_them():
    canvas = Canvas(Scene(), seed=0)
    geometry, paint = canvas.geometry, canvas.scene.paint
    first, last = geometry.stroke_ends
    path = [geometry.from_pattern(np.array((u, paint.edge_margin_m))) for u in np.arange(first, last, 0.01)]
    for before, after in itertools.pairwise(path):
        canvas.stroke(before, after)
    whole, painted = len(canvas.edges.exposed()[0]), canvas.coverage.sum()
    EdgeBroken(length_m=0.3).strike(SimpleNamespace(canvas=canvas), None)
    strokes, points = canvas.edges.exposed()
    assert (whole - len(strokes)) * BIN_M == pytest.approx(0.3, abs=2 * BIN_M)
    assert np.abs(points[:, 0] - 0.5 * (first + last)).min() >= 0.15 - BIN_M
    added = (canvas.coverage.sum() - painted) / canvas.pixels_per_m**2
    assert 0.3 * 0.001 < added < 0.4 * EdgeBroken().farthest_m
