"""Jobs that cannot be flown are refused before the flight, and jobs just inside every limit are not."""

import dataclasses
import math
import re
from dataclasses import replace
from typing import Any

import pytest

from ibvs_qp.config.errors import ConfigError
from sim.flight.jobs import PaintJob, PressJob
from sim.flight.options import FlightOptions, pilot_config, unsupervised
from sim.flight.preflight import PLACE_TOLERANCE_M, check_job, job_problems, oldest_s
from sim.world.plant import Plant
from sim.world.plant_scene import PlantScene
from sim.world.scene import (
    BoardScene,
    CameraScene,
    ForceTorqueScene,
    ImuScene,
    PaintScene,
    Scene,
    StartScene,
    SurfaceScene,
    WallScene,
    WindScene,
)
from sim.world.worlds import in_world

WALL = Scene().wall
BIG = BoardScene(width_m=4.0, height_m=1.5)


def problems(scene: Scene, features: str = "geometric", world: str = "datasheet") -> list[str]:
    scene = in_world(scene, world)
    return job_problems(scene, pilot_config(scene, FlightOptions(features=features)), features)


def test_a_period_that_takes_the_margin_of_a_loop_is_refused() -> None:
    def found(tick_s: float) -> list[str]:
        config = pilot_config(Scene(), FlightOptions(features="geometric"))
        return job_problems(Scene(), replace(config, controller=replace(config.controller, tick_s=tick_s)), "geometric")

    assert found(0.008) == []
    assert found(0.010) == [
        "controller.tick_s = 0.01 s is refused: allowed is at most 0.008 s: "
        "the largest sensitivity of a loop is 2.11, allowed is 2"
    ]


def paint(board: BoardScene | None = None, **keys: Any) -> Scene:
    return Scene(board=board or BoardScene(), paint=PaintScene(**keys))


def camera(**keys: Any) -> Scene:
    return Scene(camera=CameraScene(**keys))


def force(**keys: Any) -> Scene:
    return Scene(force_torque=ForceTorqueScene(**keys))


BRUSH = {"brush_width_m": 0.25, "rows": 3, "stroke_m": 1.2, "edge_margin_m": 0.1}
LIMITS = {
    "strokes longer than the board": (
        paint(stroke_m=1.301),
        paint(stroke_m=1.3),
        ["paint.stroke_m", "board.width_m"],
    ),
    "columns longer than the board": (
        paint(pattern="columns", stroke_m=0.501),
        paint(pattern="columns", stroke_m=0.5),
        ["paint.stroke_m", "board.height_m"],
    ),
    "strokes above the board": (
        paint(BoardScene(height_m=0.2), rows=3),
        paint(BoardScene(height_m=0.203), rows=3),
        ["paint.rows", "allowed is at most 2", "board.height_m"],
    ),
    "columns beside the board": (
        paint(BoardScene(width_m=0.2), pattern="columns", stroke_m=0.4, rows=3),
        paint(BoardScene(width_m=0.203), pattern="columns", stroke_m=0.4, rows=3),
        ["paint.rows", "board.width_m"],
    ),
    "a margin above the board": (
        paint(BoardScene(height_m=0.2), edge_margin_m=0.193, stroke_m=1.0, rows=1),
        paint(BoardScene(height_m=0.2), edge_margin_m=0.192, stroke_m=1.0, rows=1),
        ["paint.edge_margin_m", "board.height_m"],
    ),
    "an overlap as wide as the brush": (paint(overlap_m=0.08), paint(overlap_m=0.072), ["paint.overlap_m", "brush"]),
    "an overlap that leaves gaps": (
        paint(overlap_m=0.0079),
        paint(overlap_m=0.008),
        ["paint.overlap_m", "allowed is [0.008, 0.072] m", "paint.brush_width_m = 0.08 m"],
    ),
    "a brush thinner than the overlap": (
        paint(brush_width_m=0.05, overlap_m=0.06),
        paint(brush_width_m=0.05, overlap_m=0.06, rows=1),
        ["paint.overlap_m", "paint.brush_width_m = 0.05 m"],
    ),
    "an edge beside the picture": (
        paint(BIG, edge_margin_m=0.241, stroke_m=1.0),
        paint(BIG, edge_margin_m=0.238, stroke_m=1.0),
        ["paint.edge_margin_m", "camera.vertical_fov_deg"],
    ),
    "an edge above the picture": (
        paint(BIG, edge_margin_m=0.097, stroke_m=1.0, start="top-left"),
        paint(BIG, edge_margin_m=0.094, stroke_m=1.0, start="top-left"),
        ["paint.edge_margin_m"],
    ),
    "the end of a column above the picture": (
        paint(BIG, edge_margin_m=0.097, stroke_m=1.0, pattern="columns"),
        paint(BIG, edge_margin_m=0.094, stroke_m=1.0, pattern="columns"),
        ["paint.edge_margin_m"],
    ),
    "a brush that hides its guide": (
        dataclasses.replace(paint(BIG, overlap_m=0.1, **BRUSH), camera=CameraScene(vertical_fov_deg=20.0)),
        dataclasses.replace(paint(BIG, overlap_m=0.01, **BRUSH), camera=CameraScene(vertical_fov_deg=20.0)),
        ["paint.brush_width_m", "view ahead of the brush"],
    ),
    "strokes longer than the supervisor's time": (
        paint(BoardScene(width_m=10.0), stroke_m=4.6, speed_m_s=0.01),
        paint(BoardScene(width_m=10.0), stroke_m=4.4, speed_m_s=0.01),
        ["paint.speed_m_s", "safety.mission_s"],
    ),
    "columns higher than the supervisor's bound": (
        paint(BoardScene(height_m=3.0), pattern="columns", stroke_m=2.52),
        paint(BoardScene(height_m=3.0), pattern="columns", stroke_m=2.49),
        ["paint.stroke_m", "safety.height_m"],
    ),
    "a start at the ground": (
        Scene(board=BoardScene(bottom_m=0.5), start=StartScene(down_m=0.375)),
        Scene(board=BoardScene(bottom_m=0.5), start=StartScene(down_m=0.365)),
        ["start.down_m", "board.bottom_m"],
    ),
    "an IMU slower than the loop": (
        Scene(imu=ImuScene(rate_hz=249.0)),
        Scene(imu=ImuScene(rate_hz=250.0)),
        ["imu.rate_hz = 249.0 Hz", "at least 250 Hz"],
    ),
    "accelerometer noise": (
        Scene(imu=ImuScene(accel_density=0.077)),
        Scene(imu=ImuScene(accel_density=0.075)),
        ["imu.accel_density = 0.077 m/s^2/sqrt(Hz)", "at most 0.0759", "imu.rate_hz = 250 Hz"],
    ),
    "gyro noise": (
        Scene(imu=ImuScene(gyro_density=0.0077)),
        Scene(imu=ImuScene(gyro_density=0.0075)),
        ["imu.gyro_density = 0.0077 rad/s/sqrt(Hz)", "at most 0.00759"],
    ),
    "attitude noise": (
        Scene(imu=ImuScene(attitude_noise_deg=0.51)),
        Scene(imu=ImuScene(attitude_noise_deg=0.5)),
        ["imu.attitude_noise_deg = 0.51 deg", "at most 0.5 deg"],
    ),
    "wind that no level vehicle holds": (
        Scene(wind=WindScene(mean_m_s=(-9.6, 9.6, 0.0))),
        Scene(wind=WindScene(mean_m_s=(-9.5, 9.5, 0.0))),
        ["wind.mean_m_s", "level speed of at most 13.5 m/s"],
    ),
    "gusts that no level vehicle holds": (
        Scene(wind=WindScene(gust_n_rms=6.2)),
        Scene(wind=WindScene(gust_n_rms=6.0)),
        ["wind.gust_n_rms", "at most 6.1 N"],
    ),
    "motors that lag much longer than the vehicle's": (
        Scene(plant=PlantScene(motor_lag_up_s=0.12, motor_lag_down_s=0.12)),
        Scene(plant=PlantScene(motor_lag_up_s=0.045, motor_lag_down_s=0.18)),
        ["plant.motor_lag_up_s = 0.12 s", "at most 0.115 s"],
    ),
    # Both sides of these were flown: the passing one to the end, the other until the supervisor ended the flight.
    "old pictures": (
        camera(latency_s=0.16),
        camera(latency_s=0.15),
        ["camera.latency_s", "safety.image_age_s = 0.2 s"],
    ),
    "rare pictures": (camera(rate_hz=7.0), camera(rate_hz=8.0), ["camera.rate_hz = 7 Hz"]),
    "old force samples": (force(latency_s=0.025), force(latency_s=0.02), ["force_torque.latency_s", "wrench_age_s"]),
    "rare force samples": (force(rate_hz=30.0), force(rate_hz=40.0), ["force_torque.rate_hz = 30 Hz"]),
}


@pytest.mark.parametrize("name", LIMITS)
def test_a_job_beyond_a_limit_is_refused_by_name_and_one_inside_is_not(name):
    refused, flown, words = LIMITS[name]
    assert problems(flown) == []
    (text,) = problems(refused)
    assert "\n" not in text and "is refused: allowed is" in text
    for word in words:
        assert word in text


@pytest.mark.parametrize(("one", "other"), [("paint", "board"), ("wall", "board"), ("wall", "paint")])
def test_colours_that_vision_cannot_separate_are_refused_where_there_are_pictures(one, other):
    gate = pilot_config(Scene(), FlightOptions()).vision.line.color_gate
    for apart, refused in ((gate - 2.0, True), (gate + 2.0, False)):
        step = round(apart / math.sqrt(2.0))
        red, green, blue = getattr(Scene(), other).color
        color = (abs(red - step), green, abs(blue - step))
        scene = dataclasses.replace(Scene(), **{one: dataclasses.replace(getattr(Scene(), one), color=color)})
        assert [f"{one}.color" in text for text in problems(scene, "rendered")] == [True] * refused
        assert problems(scene, "geometric") == []


def test_wide_gap_does_not_separate_equal_colours():
    """Flown with gaps of 0.05, 0.3 and 1.0 m: the board's edges are not found."""
    scene = Scene(board=BoardScene(gap_m=1.0), wall=WallScene(color=BoardScene().color))
    assert "wall.color" in problems(scene, "rendered")[0]


def test_start_with_a_propeller_at_the_wall_is_refused():
    believed = Scene(start=StartScene(distance_m=0.15, yaw_deg=20.0))
    assert problems(believed) == []
    config = pilot_config(believed, FlightOptions())
    vehicle = dataclasses.replace(config.controller.vehicle, tip_position_m=(0.50, 0.0, 0.0))
    short = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))
    (text,) = [text for text in job_problems(believed, short, "geometric") if text.startswith("start.")]
    assert "start.distance_m" in text and "start.yaw_deg = 20 deg" in text


@pytest.mark.parametrize("job", [None, PressJob()])
def test_a_start_with_a_propeller_in_the_far_side_of_a_tank_is_refused(job: PressJob | None) -> None:
    def found(distance_m: float) -> list[str]:
        tank = SurfaceScene(kind="cylinder", radius_m=1.5, side="concave")
        scene = Scene(surface=tank, start=StartScene(distance_m=distance_m))
        clearance = min(Plant(scene, seed=seed).propeller_clearance for seed in range(10))
        config = pilot_config(scene, FlightOptions(features="geometric"))
        problems = job_problems(scene, config, "geometric", job)
        assert not problems or clearance < 0.05
        return problems

    assert found(1.6) == []
    assert found(1.9) == [
        "start.distance_m = 1.9 m is refused: allowed is [0.15, 1.67] m: no propeller starts at the wall "
        "(start.yaw_deg = 0 deg)"
    ]


def test_several_problems_make_one_line():
    scene = Scene(paint=PaintScene(stroke_m=1.5), imu=ImuScene(rate_hz=100.0))
    config = pilot_config(scene, FlightOptions())
    with pytest.raises(ConfigError, match=r"imu\.rate_hz.*; paint\.stroke_m") as refused:
        check_job(scene, config)
    assert "\n" not in str(refused.value)


def test_a_press_needs_no_place_for_strokes_and_no_supervisor_no_young_samples():
    scene = Scene(paint=PaintScene(stroke_m=1.5))
    assert job_problems(scene, pilot_config(scene, FlightOptions()), job=PressJob()) == []
    late = camera(latency_s=0.25)
    assert job_problems(late, unsupervised(pilot_config(late, FlightOptions()))) == []
    later = in_world(camera(latency_s=0.3), "datasheet")
    (text,) = job_problems(later, unsupervised(pilot_config(later, FlightOptions())))
    assert "camera.latest_s" in text


def test_fill_always_ends_on_the_board():
    for height, strokes in ((0.1, 1), (0.33, 5), (0.6, 8), (1.5, 21)):
        scene = paint(BoardScene(height_m=height), rows="fill")
        assert problems(scene) == []
        assert PaintJob().expected_s(pilot_config(scene, FlightOptions()).painting, strokes) == pytest.approx(
            (strokes * 1.3 + (strokes - 1) * 0.072) / 0.1
        )
    assert PLACE_TOLERANCE_M < PaintScene().edge_margin_m


@pytest.mark.parametrize(("section", "rate"), [("camera", 30.0), ("camera", 11.0), ("force_torque", 100.0)])
def test_the_latency_that_a_refusal_allows_is_the_largest_one(section, rate):
    def scene(latency: float) -> Scene:
        part = dataclasses.replace(getattr(Scene(), section), rate_hz=rate, latency_s=latency)
        return dataclasses.replace(Scene(), **{section: part})

    (text,) = problems(scene(0.1 if section == "force_torque" else 0.3))
    allowed = float(re.search(r"at most ([\d.]+) s", text)[1])  # type: ignore[index]
    assert problems(scene(allowed)) == []
    assert len(problems(scene(allowed + 0.0005))) == 1


def test_age_of_a_sample_counts_its_period_in_ticks():
    # Samples at 0, 12, 20, 32, 40 ms; the first is delivered at 4 and in use until 12 ms.
    assert oldest_s(100.0, 0.004, 0.004) == pytest.approx(0.012)
    assert oldest_s(30.0, 0.060, 0.004) == pytest.approx(0.092)


@pytest.mark.parametrize(("stroke_m", "at_margin"), [(1.3, True), (1.296, True), (1.28, False)])
def test_strokes_shorter_than_the_board_begin_by_the_edge_at_their_end(stroke_m, at_margin):
    config = pilot_config(paint(stroke_m=stroke_m), FlightOptions())
    assert config.painting.begins_at_margin == at_margin
