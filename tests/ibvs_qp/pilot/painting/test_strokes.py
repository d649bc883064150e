"""Strokes and the steps between them: ends, edges that are hidden or misleading, lost contact, targets, retouches."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from painted_wall import END, FAR, GUIDE, NEAR, OUTER, PLACE, PaintedWall, Piece, assert_painted, flown, short, wall

from ibvs_qp.pilot.painting import stroke
from ibvs_qp.pilot.painting.standstill import STOP_DISTANCE

# ------------------------------------------------------------------------------------------------------------- ends


def test_hidden_ends_do_not_lengthen_a_stroke() -> None:
    world = flown("paint", 2, rows=3, stroke_m=1.0)
    world.hidden = {NEAR, END}
    world.finish()
    assert -PLACE < world.reached[0] and world.reached[1] < world.config.stroke_m + PLACE


@pytest.mark.parametrize("shift", [-0.03, 0.03])
def test_strokes_end_at_the_edge_and_not_by_the_odometer(shift: float) -> None:
    """The board is shorter or longer than the job says: stroke 1 keeps its margin, and its length is not claimed."""
    world = wall(rows=2, stroke_m=1.0, length=1.1 + shift)
    assert "1000 mm were asked" in world.finish()
    assert world.ends[0][1] == pytest.approx(1.0 + shift, abs=PLACE)
    noticed = [reason for _, event, reason in world.painter.log if event == "edge"]
    assert noticed and f"{shift * 1e3:+.0f} mm from where the job expects it" in noticed[0]


def test_no_stroke_runs_off_a_board_that_is_shorter_than_the_job() -> None:
    world = wall(rows=2, stroke_m=1.0, length=1.0)
    world.fly(100.0)
    assert world.reached[0] > -PLACE


def test_only_an_edge_with_the_surface_on_our_side_ends_a_stroke() -> None:
    """A joint, paint and the begin of another board stand where the stroke should end; its own edge a little behind."""
    end = 0.56
    decoys = [(60, 0.015, 1, "board"), (61, 0.02, 1, ""), (62, 0.01, -1, "paint")]
    extra = [Piece.upright(identity, end - before, side, kind) for identity, before, side, kind in decoys]
    world = wall(rows=1, length=end + 0.05, extra=extra)
    assert_painted(world)
    assert world.ends[0][1] == pytest.approx(end - world.config.edge_margin_m, abs=PLACE)


def test_a_board_s_edge_on_the_way_ends_no_stroke() -> None:
    """The edges of a board that lies behind: in view half a metre before the end of either stroke."""
    world = wall(rows=2, stroke_m=1.2, extra=[Piece.upright(70, 0.6, -1), Piece.upright(71, 0.62, 1)])
    assert_painted(world)
    assert [u for _, u, _ in world.ends] == pytest.approx([1.2, 0.0], abs=PLACE)


def test_a_stroke_does_not_end_beyond_its_end() -> None:
    """An overshoot that stands still for a moment."""
    world = flown("paint", rows=2, stroke_m=1.0)
    while world.tip[0] < world.config.stroke_m - STOP_DISTANCE:
        world.step()
    world.jolt(0.01)
    world.stuck = True
    world.fly(0.3)
    assert world.painter.phase == "paint"


@pytest.mark.parametrize("shift", [0.012, -0.012, -0.002])
def test_a_tip_that_is_moved_at_the_end_of_a_stroke_returns_to_it(shift: float) -> None:
    """A gust moves it over the end, or stiction holds it short of it; velocity alone would leave it there."""
    world = flown("paint", rows=2, stroke_m=1.0)
    while world.tip[0] < world.config.stroke_m - STOP_DISTANCE:
        world.step()
    world.jolt(world.config.stroke_m + shift - world.tip[0])
    world.fly(10.0, until="climb")
    assert world.ends[0][1] == pytest.approx(world.config.stroke_m, abs=world.config.stop_error_m)


@pytest.mark.parametrize("shift", [0.008, -0.008])
def test_a_stroke_that_begins_beside_its_beginning_ends_where_its_length_is_right(shift: float) -> None:
    """The step to stroke 2 takes the tip back; friction that holds it beside costs half of the error in length."""
    world = flown("climb", seconds=0.5, rows=2, stroke_m=1.0)
    while world.painter.phase == "climb":
        if world.painter._stroke.place - world.tip[1] < 0.01:
            world.jolt(world.config.stroke_m + shift - world.tip[0])
        world.step()
    assert world.tip[0] == pytest.approx(1.0 + shift, abs=2e-3)
    world.fly(60.0, until="retreat")
    assert world.ends[1][1] == pytest.approx(0.5 * shift, abs=2e-3)
    assert not world.painter._uncertain


def test_a_step_takes_the_tip_back_to_where_strokes_begin() -> None:
    world = flown("climb", rows=2, stroke_m=1.0)
    world.jolt(0.01)
    world.fly(60.0, until="paint")
    assert world.tip[0] == pytest.approx(1.0, abs=2e-3)


# -------------------------------------------------------------------------------------------------- edges of strokes


def test_the_far_edge_of_the_board_leads_where_it_is_all_that_is_seen() -> None:
    world = flown("paint", 4, rows=4, stroke_m=0.6, height=0.36)
    world.hidden = {GUIDE, *range(OUTER, OUTER + 5)}
    world.fly(1.0)
    assert world.guide == FAR
    assert world.finish() == ""  # its place was learnt beside the other edges
    assert world.ends[-1][2] == pytest.approx(world.config.edge_margin_m + 3.0 * world.config.pitch_m, abs=PLACE)


def test_stroke_two_follows_the_fresh_edge_and_not_its_own() -> None:
    world, followed = flown("paint", 2, 1.0, rows=2), set()
    while world.painter.phase == "paint":
        world.step()
        followed.add(world.guide)
    assert OUTER + 2 in world.lines() and OUTER + 2 not in followed and OUTER + 1 in followed
    assert abs(world.place_errors()[1]) < PLACE


@pytest.mark.parametrize(("rise", "lift"), [(0.05, 0.0), (0.0, 0.025), (None, None)])
def test_a_fresh_edge_that_leans_is_displaced_or_lost_does_not_lead(rise: float | None, lift: float | None) -> None:
    """It leans by 7 deg over the stroke."""
    world = flown("paint", 2, rows=2, stroke_m=0.8)
    world.hidden, edge = {OUTER + 1}, 0.05 + world.config.pitch_m - 0.032
    if rise is not None and lift is not None:
        world.extra = [Piece(OUTER + 30, (0.0, edge + lift + 2.0 * rise), (0.8, edge + lift), 1, "paint")]
    world.fly(1.0)
    assert world.guide == GUIDE
    assert_painted(world)


def test_a_line_that_is_found_again_under_another_name_leads_on() -> None:
    world = flown("paint", seconds=2.0, rows=2)
    world.board[0].identity, world.board[2].identity = 33, 34
    world.fly(1.0)
    assert world.guide == 33
    assert any(event == "guide" and "track 33" in reason for _, event, reason in world.painter.log)
    assert_painted(world)
    assert world.ends[0][1] == pytest.approx(world.config.stroke_m, abs=PLACE)


def test_the_own_edge_leads_where_no_other_one_is_in_view() -> None:
    world = flown("paint", 2, rows=2, stroke_m=1.0)
    world.hidden = {GUIDE, OUTER + 1, FAR}
    world.fly(5.0)
    assert world.painter.phase == "paint" and world.guide == OUTER + 2
    world.wave = lambda _stroke, u: 0.01 if u < 0.5 else 0.0  # as a jolt that the odometer measures
    world.fly(5.0)
    # Where an edge behind the arm would show.
    place = world.config.edge_margin_m + world.config.pitch_m + stroke.MOST_ASIDE * world.config.overlap_m
    assert abs(world.tip[1] - place) < 0.5 * PLACE


@pytest.mark.parametrize("overlap_m", [0.008, 0.004, 0.0])
def test_the_search_aside_takes_a_part_of_the_overlap(overlap_m: float) -> None:
    world = flown("paint", 2, rows=2, stroke_m=1.0, overlap_m=overlap_m)
    world.hidden = {GUIDE, OUTER + 1, FAR}
    world.fly(5.0)
    aside = world.tip[1] - world.config.edge_margin_m - world.config.pitch_m
    assert aside == pytest.approx(stroke.MOST_ASIDE * overlap_m, abs=1e-3)


def test_an_edge_that_hides_behind_the_arm_where_the_tip_errs_inwards_is_found_again() -> None:
    """Columns upwards: 32 mm beside the tip it shows, 31 mm beside it the arm covers it, and the odometer drifts."""
    world = flown("paint", 2, 2.0, rows=2, stroke_m=1.5)
    world.drift = world.to_wall(0.0, 2.0e-3)
    place, lowest = world.config.edge_margin_m + world.config.pitch_m, math.inf
    while world.painter.phase == "paint" and world.time < 100.0:
        world.hidden = {GUIDE, FAR} | ({OUTER + 1} if world.tip[1] < place - 1e-3 else set())
        world.step()
        lowest = min(lowest, world.tip[1] - place)
    world.hidden = set()
    assert lowest > -0.004, "it runs 13 mm inwards without a look"
    assert world.finish() == ""


@pytest.mark.parametrize("jump", [(0.0, -0.048), (0.08, 0.0)])
def test_a_jump_of_the_odometer_is_doubted(jump: tuple[float, float]) -> None:
    """After a hole in the data the velocity at its end moves the odometer; the edges show where the tip is."""
    world = flown("paint", seconds=2.0, rows=1, stroke_m=1.0)
    world.odometer += world.to_wall(*jump)
    world.fly(3.0)
    assert abs(world.painter._tip.cross.v - world.tip[1]) < PLACE
    assert_painted(world)


# ------------------------------------------------------------------------------------------------------------ search


def edge_lost(overlap_m: float = 0.008) -> PaintedWall:
    """In climb 5, so slow that the odometer alone is not good enough, nothing shows any more where the strokes are."""
    world = flown("climb", 5, rows=6, climb_speed_m_s=0.005, timeout_s=40.0, overlap_m=overlap_m)
    world.hidden = {OUTER + 4, FAR, GUIDE}
    return world


def test_a_hidden_fresh_edge_is_searched_and_the_job_fails_by_name() -> None:
    world = edge_lost()
    commands = world.fly(200.0)
    assert "search" in world.phases() and len(world.begins) == 4
    assert world.finish() == "stroke 5: the edge of stroke 4 was not found"
    assert any(not c.contact and c.standoff == world.config.search_standoff_m for c in commands)


@pytest.mark.slow
@pytest.mark.parametrize("overlap", [0.0, 0.008])
def test_no_stroke_begins_while_its_place_is_uncertain(overlap: float) -> None:
    """The fresh edge comes back ten seconds after the climb: until then the vehicle waits or searches."""
    world = edge_lost(overlap)
    config = world.config
    certain = max(0.5 * config.overlap_m, config.least_certainty_m) / 3.0
    while world.painter.phase == "climb":
        world.step()
    assert world.painter.phase == "search" and world.painter._tip.cross.deviation > certain
    world.fly(5.0)
    assert world.painter.phase == "search"
    world.hidden = set()
    assert world.finish() == "" or overlap == 0.0
    assert world.phases().count("search") == 1 and len(world.ends) == 6
    assert any(phase == "approach" and "edge for stroke 5 found" in reason for _, phase, reason in world.painter.log)
    assert max(deviation for _, deviation in world.begins) < 1.1 * certain  # the touch takes two seconds


def test_a_tip_that_friction_holds_beside_its_place_searches_and_begins_anew() -> None:
    world = flown("climb", seconds=0.5, rows=2)
    world.stuck = True
    world.fly(10.0, until="search")
    assert re.fullmatch(r"row 2: \+\d+ mm from its place of 5 mm", world.painter.log[-1][2])
    world.stuck = False
    assert_painted(world)


def test_on_the_way_to_the_wall_and_there_no_edge_is_followed_that_the_view_at_the_wall_loses() -> None:
    """Back from a search for row 4 the board's edge is still in view, 0.27 m away; its barrier would hold the tip."""
    world = flown("climb", 4, 0.5, rows=4)
    world.stuck = True
    world.fly(10.0, until="search")
    world.stuck, world.hidden = False, {OUTER + 3, OUTER + 2, OUTER + 1, FAR}
    world.fly(20.0, until="approach")
    commands = world.fly(40.0, until="paint")
    level = [offset for c in commands for line, offset in c.guides if line.role == world.pattern.guide_role]
    assert world.painter.phase == "paint" and max(map(abs, level), default=0.0) < world.config.guide_reach_m


# ------------------------------------------------------------------------------------------------------ lost contact


def test_lost_contact_pauses_the_stroke_and_it_goes_on_afterwards() -> None:
    world = flown("paint", seconds=2.0, rows=2)
    world.contact_allowed = False
    world.fly(2.0)
    held = world.tip.copy()
    commands = world.fly(1.0)
    assert all(command.contact and abs(command.velocity[0]) < 1e-9 for command in commands)
    assert abs(world.tip - held).max() < 1e-3
    world.contact_allowed = True
    world.fly(0.4)
    assert abs(world.tip[0] - held[0]) < 1e-3  # not before the push is back
    assert re.fullmatch(r"the strokes were without contact for 3\.\d s of \d+\.\d s", world.finish())
    events = [event for _, event, _ in world.painter.log if event.startswith("contact")]
    assert events == ["contact lost", "contact back"]
    assert world.ends[0][1] == pytest.approx(world.config.stroke_m, abs=PLACE)


@pytest.mark.parametrize("before_m", [0.032, 0.01])
def test_contact_lost_before_the_end_of_a_stroke_is_waited_for(before_m: float) -> None:
    """The edge at the end leads there, but not a tip in the air."""
    world = flown("paint", 2, rows=3, stroke_m=1.0)
    while world.tip[0] > before_m:
        world.step()
    world.contact_allowed = False
    world.fly(3.0)
    assert world.painter.phase == "paint" and world.painter.row == 2
    world.contact_allowed = True
    assert world.finish() or world.paint[1].u[~np.isnan(world.paint[1].v)].min() < 0.01


def test_contact_that_is_lost_in_a_climb_pauses_it() -> None:
    world = flown("climb", seconds=0.5, rows=2)
    world.contact_allowed = False
    world.fly(1.0)
    held = world.tip.copy()
    world.fly(2.0)
    assert abs(world.tip - held).max() < 1e-3
    world.contact_allowed = True
    assert_painted(world)


# ----------------------------------------------------------------------------------------------------------- targets


def swung(first_u: float, length: float, swing: float, rows: int) -> list[np.ndarray]:
    """v of the strokes [m] where stroke 1 swings over a length and the others follow."""

    def wave(row: int, u: float) -> float:
        return swing * max(math.sin(math.pi * (u - first_u) / length), 0.0) if row == 1 else 0.0

    world = wall(rows=rows, stroke_m=1.5, wave=wave, stuck_across=True)
    world.fly(60.0, until="climb", stroke=2)
    world.stuck_across = False
    assert world.finish() == ""
    return [paint.v for paint in world.paint]


def test_a_stroke_bends_where_the_one_before_falls_short_and_leaves_no_gap() -> None:
    """Stroke 1 swings to 12 mm below its place over half a metre: more than the overlap of 8 mm."""
    first, second, third = swung(0.5, 0.5, -0.012, rows=3)
    assert np.nanmin(first) < 0.04, "it does swing"
    width = short().brush_width_m
    seams = first + width - second, second + width - third
    assert min(np.nanmin(seam[33:177]) for seam in seams) > 0.0, "without the last 2 cm"


def test_a_stroke_bends_out_where_the_one_before_lies_far_out() -> None:
    """A wave of 12 mm outwards would leave 20 mm of overlap, and one of this stroke inwards more than is claimed."""
    first, second = swung(0.4, 0.7, 0.012, rows=2)
    overlap = first + short().brush_width_m - second
    assert np.nanmax(first) > 0.06, "it does swing"
    assert 0.0 < np.nanmin(overlap) and np.nanmax(overlap) < 2.0 * short().overlap_m + 0.002


def test_the_last_stroke_of_a_filling_job_overlaps_by_its_own_nominal_overlap() -> None:
    """The board ends 5 mm farther out than the third stroke's nominal place asks for: its nominal overlap is 3 mm."""
    third = 0.05 + 2.0 * 0.072 + 0.005
    last = flown("paint", 3, 2.0, rows="fill", height=0.05 + third).painter._stroke
    assert last.place == pytest.approx(third, abs=1e-3)
    assert last._reach_of_last() - last._touching_target(last.place, 1.5) == pytest.approx(1.5 * 0.003, abs=1e-3)


# --------------------------------------------------------------------------------------------------------- retouches


def gapped(row: int, first_u: float, last_u: float, **changes) -> PaintedWall:
    """A retouch begins: a gust carries a stroke 12 mm away from the last one, and nothing holds it there."""
    world = wall(wave=lambda stroke, u: 0.012 if stroke == row and first_u < u < last_u else 0.0, **changes)
    world.fly(90.0, until="paint", stroke=row)
    world.stuck_across = True
    world.fly(60.0, until="retouch")
    assert world.painter.row == row and world.painter.phase == "retouch"
    world.stuck_across = False
    return world


@pytest.mark.parametrize(("pattern", "row"), [("rows", 2), ("rows", 3), ("columns", 2), ("columns", 3)])
def test_a_gap_is_painted_again_and_the_job_is_claimed(pattern: str, row: int) -> None:
    world = gapped(row, 0.5, 0.8, rows=3, stroke_m=1.5, pattern=pattern)
    config, reached = world.config, [float(world.tip[0])]
    while world.painter.phase == "retouch":
        world.step()
        reached.append(float(world.tip[0]))
    inside = 0.02  # the round brush covers the gap's ends
    back = 0.5 + inside - stroke.RETOUCH_BEFORE_M if row == 3 else 0.8 - inside + stroke.RETOUCH_BEFORE_M
    ends = sorted((back, reached[0]))
    assert [min(reached), max(reached)] == pytest.approx(ends, abs=0.02), "from before the gap to the end of the stroke"
    assert world.finish() == "" and world.phases().count("retouch") == 1
    last, mended = world.paint[row - 2].v, world.paint[row - 1]
    overlap = (last + config.brush_width_m - mended.inner)[(mended.u > 0.02) & (mended.u < 1.48)]
    assert overlap.min() > 0.0 and overlap.max() < 3.0 * config.overlap_m
    assert abs(np.delete(world.place_errors(), row - 1)).max() < PLACE


@pytest.mark.parametrize("row", [2, 3])
@pytest.mark.parametrize(("slide", "claimed"), [(0.003, True), (0.016, False)])
def test_a_slide_before_the_beginning_by_a_retouch_is_length(row: int, slide: float, claimed: bool) -> None:
    """The gap is at the beginning; where the tip turns there, friction lets it slide on before it stops."""
    gap, begin = ((0.8, 1.0), 1.0) if row == 2 else ((0.0, 0.2), 0.0)
    world = gapped(row, *gap, rows=row, stroke_m=1.0)
    while abs(world.tip[0] - begin) > stroke.TURN_BEFORE_M + 0.002:
        world.step()
    world.jolt((begin - 0.5) * 2.0 * (stroke.TURN_BEFORE_M + slide))
    assert re.fullmatch("" if claimed else rf"row {row} is painted over 101\d mm, 1000 mm were asked", world.finish())


@pytest.mark.parametrize(("inwards", "moves"), [(0.004, 0.0), (0.01, 0.006)])
def test_a_retouch_leaves_the_outer_edge_unless_the_first_pass_is_too_deep(inwards: float, moves: float) -> None:
    """After a gap the first pass lies inwards; where it overlaps by 18 mm, waves of a second one would exceed 24 mm."""
    swing = {True: 0.012, False: -inwards}
    world = wall(rows=2, stroke_m=1.5, stuck_across=True)
    world.wave = lambda row, u: swing[u > 0.9] if row == 2 and u < 1.2 else 0.0
    world.fly(100.0, until="retouch")
    first = world.paint[1].v.copy()
    world.stuck_across = False
    world.fly(60.0, until="retreat")
    moved = (world.paint[1].v - first)[(world.paint[1].u > 0.1) & (world.paint[1].u < 0.8)]
    assert "retouch" in world.phases() and moved == pytest.approx(moves, abs=1e-3 if moves == 0.0 else 1.5e-3)


def test_a_retouch_keeps_off_the_outer_edge() -> None:
    """An edge that the tip paints anew moves with it and shows no error of its place."""
    world, inside = gapped(2, 0.5, 0.6, rows=2, stroke_m=1.5), []
    world.fly(3.0)
    while world.painter.phase == "retouch":
        world.step()
        inside.append(world.painter._stroke.place - world.painter._tip.cross.v)
    assert np.mean(inside) > 0.0015 and np.median(inside) > 0.0015


@pytest.mark.parametrize(("overlap", "retouches"), [(0.008, stroke.MOST_RETOUCHES), (0.0, 0)])
def test_a_stroke_is_painted_again_twice_at_most_and_never_without_overlap(overlap: float, retouches: int) -> None:
    world = wall(rows=2, stroke_m=1.0, overlap_m=overlap, stuck_across=True)
    world.wave = lambda row, u: -0.02 if row == 1 and 0.3 < u < 0.6 else 0.0
    assert "may leave a gap" in world.finish() and world.phases().count("retouch") == retouches


def test_a_retouch_that_gets_nowhere_ends_the_job_with_what_is_left() -> None:
    world = gapped(2, 0.3, 0.6, rows=2, stroke_m=1.0)
    world.fly(2.0)
    world.stuck = True
    world.fly(200.0, until="retreat")
    world.stuck, stopped = False, float(world.tip[0])
    assert re.fullmatch(r"time-out in the retouch of row 2: \d+ mm are left after \d+ s", world.finish())
    assert world.tip[0] == pytest.approx(stopped, abs=PLACE), "it leaves where it stands"


def test_what_the_end_of_a_stroke_shows_moves_its_map() -> None:
    """The odometer is 16 mm short at the end of a stroke of 1.5 m, and 8 mm at a dip in its middle."""
    world = wall(rows=2, stroke_m=1.5, stuck_across=True)
    world.wave = lambda row, u: -0.006 if row == 1 and 0.7 < u < 0.8 else 0.0
    world.fly(30.0, until="paint", stroke=1)
    world.drift = world.to_wall(-1e-3, 0.0)
    world.fly(60.0, until="climb", stroke=2)
    u, v = world.painter._tip.cross.strokes.complete[0].places()
    dip = u[v < 0.047]
    assert 0.5 * (dip.min() + dip.max()) == pytest.approx(0.75, abs=4e-3)
