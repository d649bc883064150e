"""The whole paint job on a synthetic wall: every stroke at its place, from every corner, whatever the picture shows."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from painted_wall import END, END_PART, FAR, GUIDE, NEAR, PLACE, TICK, PaintedWall, short, wall

from ibvs_qp.pilot.painting.pattern import CORNERS, PATTERNS, stroke_count
from ibvs_qp.pilot.painting.stroke import LEAST_OVERLAP

ALL_PATTERNS = list(itertools.product(PATTERNS, CORNERS))
#: Largest error of the place of the tip in the picture [m].
TIP_ERROR = 4e-3


def paint(world: PaintedWall) -> PaintedWall:
    """Fly a job to its end, which is a success."""
    world.fly(60.0 + 12.0 * world.height / world.config.pitch_m)
    assert world.painter.finished and not world.painter.failed, world.painter.reason
    return world


def assert_at_their_places(world: PaintedWall, *, after: int = 0, until: int | None = None) -> None:
    """Every stroke after that one and until that one has the place, and all the length, that the job asks for."""
    assert np.abs(world.place_errors()[after:until]).max() < PLACE, world.place_errors()
    for stroke, u, _ in world.ends:
        assert u == pytest.approx(world.config.stroke_m if stroke % 2 else 0.0, abs=PLACE)


def amplitude(world: PaintedWall, stroke: int, wave_m: float) -> float:
    """Amplitude of the waves of a stroke [m], from a whole number of them."""
    path = world.paint[stroke - 1]
    part = (path.u > END_PART) & (path.u < END_PART + 4.0 * wave_m)
    v, phase = path.v[part], 2j * math.pi * path.u[part] / wave_m
    return 2.0 * abs(np.mean((v - v.mean()) * np.exp(phase)))


# ------------------------------------------------------------------------------------------------ place of strokes


@pytest.mark.parametrize(
    ("kind", "start", "delta"),
    [(*pair, 0.0) for pair in ALL_PATTERNS]
    + [("rows", "top-right", TIP_ERROR), ("columns", "bottom-left", -TIP_ERROR)],  # all others with twenty strokes
)
def test_five_strokes_end_at_their_places(kind: str, start: str, delta: float) -> None:
    """Also where the picture shows the tip beside its place: the own paint tells, from stroke 2 on at the latest."""
    world = paint(wall(rows=5, stroke_m=0.4, pattern=kind, start=start, delta=delta))
    assert [stroke for stroke, _, _ in world.ends] == [1, 2, 3, 4, 5]
    assert_at_their_places(world, after=0 if delta == 0.0 else 1)
    assert abs(world.painter._tip.cross.tip_error - delta) < 0.5 * TIP_ERROR


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "start"), ALL_PATTERNS)
def test_eight_strokes_end_at_their_places(kind: str, start: str) -> None:
    """The board's edge has left the picture by then: the error must not grow from stroke to stroke."""
    sign = 1.0 if start.startswith("top") else -1.0
    world = paint(wall(rows=8, stroke_m=0.4, pattern=kind, start=start, delta=sign * TIP_ERROR, noise=1e-3))
    assert_at_their_places(world, after=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "start", "delta"),
    [(*pair, delta) for pair in ALL_PATTERNS for delta in (TIP_ERROR, -TIP_ERROR)],
)
def test_twenty_strokes_end_at_their_places(kind: str, start: str, delta: float) -> None:
    world = paint(wall(rows=20, stroke_m=0.8, pattern=kind, start=start, delta=delta))
    assert len(world.ends) == 20
    assert_at_their_places(world, after=1)


@pytest.mark.parametrize("slope_deg", [-8.0, 8.0])
@pytest.mark.parametrize(
    ("kind", "start"), [("rows", "bottom-right"), ("rows", "top-left"), ("columns", "bottom-left")]
)
def test_strokes_follow_a_sloped_board(kind: str, start: str, slope_deg: float) -> None:
    slope = math.radians(slope_deg)
    world = wall(rows=4, stroke_m=0.4, pattern=kind, start=start, slope=slope, delta=TIP_ERROR, noise=1e-3)
    paint(world)
    assert world.painter._tip.cross.filter.turn == pytest.approx(slope, abs=math.radians(0.2))
    assert_at_their_places(world, after=1)


@pytest.mark.parametrize(("kind", "start"), [("rows", "top-right"), ("columns", "bottom-right")])
def test_strokes_are_at_their_places_where_no_line_has_ends(kind: str, start: str) -> None:
    world = paint(wall(rows=4, stroke_m=0.4, pattern=kind, start=start, ends_seen=False, delta=-TIP_ERROR, noise=1e-3))
    assert_at_their_places(world, after=1)


@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("columns", "top-left")])
def test_an_odometer_that_drifts_displaces_no_stroke(kind: str, start: str) -> None:
    config = short(rows=5, stroke_m=0.4, pattern=kind, start=start)
    world = PaintedWall(config, drift=(1.5e-3, -1e-3), noise=1e-3)
    paint(world)
    assert np.abs(world.place_errors()).max() < PLACE


@pytest.mark.parametrize("ends_seen", [True, False])
def test_stroke_two_does_not_copy_the_waves_of_stroke_one(ends_seen: bool) -> None:
    def wave(stroke: int, u: float) -> float:  # the guide takes half of it back
        return 5e-3 * math.sin(2.0 * math.pi * u / 0.25) if stroke == 1 else 0.0

    world = paint(wall(rows=2, stroke_m=1.2, wave=wave, ends_seen=ends_seen))
    first = amplitude(world, 1, 0.25)
    assert first > 2.5e-3
    assert amplitude(world, 2, 0.25) < 0.1 * first


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.25, 0.3, 0.316, 0.4])
@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("rows", "top-left"), ("columns", "top-right")])
def test_a_filling_job_ends_at_the_margin_of_the_far_edge(kind: str, start: str, height: float) -> None:
    world = paint(wall(rows="fill", stroke_m=0.4, pattern=kind, start=start, height=height))
    config = world.config
    assert len(world.ends) == stroke_count("fill", height, config.edge_margin_m, config.pitch_m)
    assert_at_their_places(world, until=-1)
    before, last = (world.paint[k].straight(config.stroke_m).mean() for k in (-2, -1))
    rest = height - config.edge_margin_m - last
    assert -PLACE < rest < 8e-3 + PLACE  # a narrower rest gets no stroke of its own
    assert rest < PLACE or last - before == pytest.approx(
        config.brush_width_m - LEAST_OVERLAP * config.overlap_m, abs=1e-3
    )


@pytest.mark.parametrize("drift", [1e-3, -1e-3])
def test_a_job_begun_beside_its_beginning_begins_at_the_margin(drift: float) -> None:
    world = paint(wall(rows=2, stroke_m=1.2, tip=np.array((0.2, 0.05)), drift=(drift, 0.0)))
    begin, end = world.reached
    assert begin == pytest.approx(0.0, abs=PLACE) and end == pytest.approx(1.2, abs=PLACE)
    assert world.painter._tip.along.deviation < 2e-3  # the job says where the edge beside the beginning lies


@pytest.mark.parametrize("at_margin", [True, False])
def test_a_board_longer_than_its_strokes_is_surveyed_unless_they_begin_at_the_margin(at_margin: bool) -> None:
    slack, config = 0.03, short(rows=2, stroke_m=1.0, begins_at_margin=at_margin)
    length = config.stroke_m + 2.0 * config.edge_margin_m + slack
    world = PaintedWall(config, length=length, tip=np.array((slack, 0.05)))
    world.fly(120.0)
    assert world.painter.finished and world.painter.failed == at_margin  # 3 cm too long are not claimed
    assert ("survey" in world.phases()) == (not at_margin)
    begin, end = world.reached
    assert end == pytest.approx(config.stroke_m + slack, abs=PLACE)
    assert begin == pytest.approx(0.0 if at_margin else slack, abs=PLACE)


def test_the_far_edge_in_view_changes_nothing_in_a_job_with_a_number_of_strokes() -> None:
    world = wall(rows=4, stroke_m=0.4, height=0.5)
    paint(world)
    assert FAR not in (line.track_id for line, _ in world.command.guides) and world.painter._tip.cross.far_edge < 0.51
    assert len(world.ends) == 4
    assert_at_their_places(world)


# ------------------------------------------------------------------------------------------------ course of the job


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_strokes_alternate_with_climbs(rows: int) -> None:
    world = paint(wall(rows=rows))
    expected = ["approach", "align", "press"]
    for stroke in range(1, rows + 1):
        expected += ["paint"] + (["climb"] if stroke < rows else [])
    assert world.phases() == [*expected, "retreat", "done"]


def test_each_phase_change_is_logged_with_time_and_reason() -> None:
    world = paint(wall(rows=2))
    times = [time for time, _, _ in world.painter.log]
    assert times == sorted(times)
    reasons = {phase: reason for _, phase, reason in world.painter.log}
    assert "guide" in reasons["approach"] and "stand-off" in reasons["align"] and "aligned" in reasons["press"]
    assert "climbed to 122 mm" in reasons["paint"] and "known to" in reasons["paint"]
    assert "row 1 ended at board edge" in reasons["climb"] and "all rows" in reasons["done"]


@pytest.mark.parametrize(("kind", "start"), ALL_PATTERNS)
def test_strokes_and_climbs_go_into_the_board_at_their_speed(kind: str, start: str) -> None:
    world = wall(rows=2, stroke_m=0.4, pattern=kind, start=start, hidden={NEAR, END})
    along, across = {}, {}
    while not world.painter.finished:
        command = world.step()
        u, v = world.pattern.to_pattern(*command.velocity)
        state = world.painter.phase, world.painter.row
        along.setdefault(state, []).append(u)
        across.setdefault(state, []).append(v)
        if state[0] == "paint":
            travel = world.pattern.to_pattern(*command.travel)
            assert travel == pytest.approx((world.config.speed_m_s * (1 if state[1] == 1 else -1), 0.0), abs=1e-12)
    speed, climb = world.config.speed_m_s, world.config.climb_speed_m_s
    assert max(along["paint", 1]) == pytest.approx(speed) and min(along["paint", 1]) > -1e-9
    assert min(along["paint", 2]) == pytest.approx(-speed) and max(along["paint", 2]) < 1e-9
    assert max(across["climb", 2]) == pytest.approx(climb, rel=0.05)
    assert max(map(abs, along["climb", 2])) <= world.config.hold_speed_m_s  # held by the odometer


def test_reset_starts_over_to_the_bit() -> None:
    world = paint(wall(rows=2, noise=1e-3))
    log, errors = list(world.painter.log), world.place_errors()
    world.painter.reset()
    again = paint(wall(rows=2, painter=world.painter, noise=1e-3))
    assert again.painter.log == log
    assert again.ends == world.ends
    np.testing.assert_array_equal(again.place_errors(), errors)


@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("rows", "top-left"), ("columns", "top-right")])
def test_the_expected_edge_is_the_outer_one_of_the_last_stroke_or_of_stroke_one_itself(kind: str, start: str) -> None:
    """Offset, bare side and direction along the strokes of that edge beside the brush."""
    world = wall(rows=3, stroke_m=0.4, pattern=kind, start=start)
    assert world.painter.expected_edge() is None
    for stroke in (1, 2):  # both towards -u: own edge of stroke 1 lies behind the brush, and stroke 2 returns
        world.fly(120.0, until="paint", stroke=stroke)
        world.fly(2.5)
        expected, seen = world.painter.expected_edge(), world.lines()[101]
        assert expected is not None
        assert expected.role == seen.role and expected.side == seen.surface_side
        assert expected.offset == pytest.approx(seen.offset, abs=1e-3)
        right, down = world.pattern.to_wall(-1.0, 0.0)
        assert expected.ahead == (right if kind == "rows" else down)


def test_the_guide_of_stroke_one_is_the_edge_at_which_the_pattern_starts() -> None:
    for kind, start in ALL_PATTERNS:
        world = wall(stroke_m=0.4, pattern=kind, start=start)
        world.fly(60.0, until="paint")
        world.step()
        assert world.guide == GUIDE


def test_a_tip_that_an_obstacle_holds_rests_and_passes_with_less_push() -> None:
    """A rivet at u = 0.5 holds the tip under more than half of the push, and lets a resting one pass below it."""
    world = wall(rows=1, stroke_m=1.0)
    world.fly(90.0, until="paint")
    push, speed = world.config.push_n, world.config.speed_m_s
    pushes, speeds, held_s = [], [], 0.0
    while world.painter.phase == "paint":
        command = world.step()
        world.stuck = 0.5 < world.tip[0] < 0.51 and command.push > 0.5 * push
        held_s += TICK * world.stuck
        pushes.append(command.push)
        speeds.append(float(np.hypot(*command.velocity)))
    assert held_s < 2.0, "it would time out"
    least = int(np.argmin(pushes))
    assert 0.3 * push < pushes[least] < 0.4 * push
    assert min(speeds[least : least + 200]) == 0.0, "at rest before it goes on"
    assert pushes[0] == pushes[-1] == push and max(speeds) == pytest.approx(speed)
    assert world.finish() == ""


def test_a_tip_that_slides_keeps_its_push() -> None:
    world = wall(rows=1, stroke_m=1.0)
    world.fly(90.0, until="paint")
    while world.painter.phase == "paint":
        assert world.step().push == world.config.push_n
