"""Place of the tip along the strokes, from the odometer and the board's edges across them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.pilot.painting import along_track
from ibvs_qp.pilot.painting.along_track import DRIFT_PER_M, EDGE_STD, SCALE_STD, AlongTrack
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.pattern_lines import PatternLine

CONFIG = PaintingConfig(stroke_m=1.0)
MARGIN = CONFIG.edge_margin_m
END_U = CONFIG.stroke_m + MARGIN


def upright(track: int, place: float, side: int, kind: str = "board", weight: float = 1.0) -> PatternLine:
    """A line across the strokes, beside the tip."""
    line = TrackedLine(track_id=track, role="vertical", slot=0, angle=0.0, deviation=1e-3, seen_ns=0)
    line.weight, line.kind = weight, kind
    return PatternLine(line, False, place, 0.0, side, 1.0, 0.4, (place, 0.0))


def at_the_margin() -> AlongTrack:
    along = AlongTrack(CONFIG)
    assert along.find_mark([upright(2, -MARGIN, 1)])
    return along


def test_the_odometer_moves_u_and_its_variance_grows_with_the_way() -> None:
    along = at_the_margin()
    before = along.deviation
    for _ in range(100):
        along.predict(0.01)
    assert along.u == pytest.approx(1.0)
    assert along.deviation**2 - before**2 == pytest.approx(DRIFT_PER_M)
    along.predict(-1.0)
    assert along.u == pytest.approx(0.0) and along.deviation**2 - before**2 == pytest.approx(2.0 * DRIFT_PER_M)


def test_the_beginning_is_at_the_margin_from_the_edge_beside_it() -> None:
    along = AlongTrack(CONFIG)
    assert not along.known
    assert along.find_mark([upright(2, -0.07, 1)])  # the tip is 2 cm too far
    assert along.known and along.u == pytest.approx(0.02)


def test_the_end_gives_u_wherever_it_is() -> None:
    along = AlongTrack(CONFIG)
    assert not along.find_end([upright(2, -0.1, 1), upright(5, 0.1, -1, "paint"), upright(6, 0.1, -1, weight=0.5)])
    assert along.find_end([upright(4, 0.4, -1), upright(3, 0.2, -1)])
    assert along.u == pytest.approx(END_U - 0.2) and along.end == 3
    assert along.deviation == pytest.approx(math.hypot(EDGE_STD, 0.2 * SCALE_STD))


@pytest.mark.parametrize("error", [-0.01, 0.01])
def test_the_end_corrects_what_the_odometer_has_lost(error: float) -> None:
    along = at_the_margin()
    for _ in range(90):
        along.predict(0.01)
    for _ in range(20):
        assert along.look([upright(3, END_U - 0.9 - error, -1)]) == ""
    assert along.u == pytest.approx(0.9 + error, abs=1e-3) and along.deviation < 1e-3 and along.end_seen


def test_what_an_edge_shows_at_the_end_belongs_to_the_way_before() -> None:
    along, error = at_the_margin(), 0.02
    along.begin_stroke()
    for _ in range(90):
        along.predict(0.01)
        along.look([])
    for _ in range(20):
        along.look([upright(3, END_U - 0.9 - error, -1)])
    for _ in range(10):
        along.predict(0.01)
        along.look([upright(3, END_U - along.u, -1)])
    before, after = (places[len(places) // 2 :] for places in along.smoothed())
    known = along.u - 1.0
    assert known == pytest.approx(error, abs=1e-3)
    assert after[0] - before[0] == pytest.approx(0.0, abs=3e-3), "the edge beside the beginning was in view"
    assert after[45] - before[45] == pytest.approx(0.55 * known, rel=0.05), "half, and a part of the beginning's"
    assert after[89] - before[89] == pytest.approx(known, rel=0.05)
    assert after[-1] == before[-1] == along.u
    along.begin_pass()
    assert set(np.ravel(along.smoothed())) == {along.u}


@pytest.mark.parametrize("scale", [0.98, 1.02])
@pytest.mark.parametrize("seen_from", [0.0, 0.6])
def test_places_that_an_edge_has_corrected_stay(scale: float, seen_from: float) -> None:
    along, true, truth = at_the_margin(), 0.0, [0.0]
    along.begin_stroke()
    for _ in range(100):
        true += 0.01
        along.predict(0.01 * scale)
        along.look([upright(3, END_U - true, -1)] if true > seen_from else [])
        truth.append(true)
    before, after = along.smoothed()
    error = np.abs(after[: len(truth)] - truth)
    assert error.max() < max(0.4 * 0.02 * seen_from, 2e-3) < np.abs(before[: len(truth)] - truth).max()
    assert error[truth.index(true)] < 1e-3


def test_another_origin_moves_the_whole_pass_and_a_jump_only_what_follows() -> None:
    moved = at_the_margin()
    moved.begin_stroke()
    for _ in range(90):
        moved.predict(0.01)
        moved.look([])
    for _ in range(3):
        moved.look([upright(3, END_U + 0.1 - 0.9, -1)])
    before, after = moved.smoothed()
    assert after[0] - before[0] == pytest.approx(moved.u - 0.9, rel=0.02)
    jumped = at_the_margin()
    jumped.begin_stroke()
    for tick in range(90):
        jumped.predict(0.01)
        if tick == 60:
            jumped._add_variance(0.03**2)
        jumped.look([])
    for _ in range(20):
        jumped.look([upright(3, END_U - 0.9 - 0.02, -1)])
    before, after = jumped.smoothed()
    looks = len(before) // 2
    shift = (after - before)[looks:]
    assert abs(shift[50]) < 3e-3 and shift[70] == pytest.approx(jumped.u - 0.9, abs=3e-3)


@pytest.mark.parametrize("shift", [-0.1, 0.1])
def test_a_board_of_another_length_moves_the_origin_and_is_noticed(shift: float) -> None:
    along = at_the_margin()
    for _ in range(90):
        along.predict(0.01)
    noticed = [along.look([upright(3, END_U + shift - 0.9, -1)]) for _ in range(3)]
    assert noticed == [f"the board's edge lies {shift * 1e3:+.0f} mm from where the job expects it", "", ""]
    assert along.u == pytest.approx(0.9 - shift, abs=1e-3)


@pytest.mark.parametrize(
    "decoy",
    [
        upright(7, END_U - 0.9, 1),  # the surface on its other side
        upright(7, END_U - 0.9, -1, "paint"),
        upright(7, END_U - 0.9, -1, weight=0.5),
        upright(7, END_U - 0.9 - 0.3, -1),  # beyond the gate of a first end
    ],
)
def test_another_edge_ends_nothing(decoy: PatternLine) -> None:
    along = at_the_margin()
    along.predict(0.9)
    along.look([decoy])
    assert along.end == -1 and not along.end_seen and along.u == pytest.approx(0.9)


def test_an_end_that_was_recognised_has_a_narrow_gate_and_may_be_dim() -> None:
    along = at_the_margin()
    along.predict(0.9)
    along.look([upright(3, END_U - 0.9, -1)])
    along.look([upright(3, END_U - 0.9, -1, weight=0.1)])
    assert along.end == 3
    along.look([upright(3, END_U - 0.9 + 0.1, -1, kind="")])
    along.look([upright(3, END_U - 0.9 + 0.1, -1, weight=0.5)])
    along.look([upright(3, END_U - 0.9 + 0.3, -1)])
    assert along.end == -1 and along.u == pytest.approx(0.9, abs=1e-3)


@pytest.mark.parametrize("error", [-0.08, 0.08])
@pytest.mark.parametrize("back", [False, True])
def test_a_certain_edge_of_the_board_shows_that_the_odometer_has_erred(error: float, back: bool) -> None:
    """Farther from its expected place than its gate: a fault of the velocity for seconds moves u, not the board."""
    along = at_the_margin()
    along.begin_stroke()
    along.predict(0.9)
    along.look([upright(3, END_U - 0.9, -1)])
    if back:
        along.begin_stroke()
    along.predict(-0.9 if back else 0.0)
    true = (0.0 if back else 0.9) + error
    noticed = [along.look([upright(2, -MARGIN - true, 1) if back else upright(3, END_U - true, -1)]) for _ in range(9)]
    assert noticed[0] == f"the tip is {error * 1e3:+.0f} mm from where the odometer has it" and not any(noticed[1:])
    assert along.u == pytest.approx(true, abs=1e-3) and along.stroke_length == pytest.approx(
        0.9 + (-error if back else error), abs=5e-3
    )
    assert along._near_u == pytest.approx(-MARGIN, abs=1e-3) and (along.near == 2) == back
    assert along.slip == pytest.approx(abs(error))
    along.begin_stroke()
    assert along.slip == 0.0


@pytest.mark.parametrize("slip", [0.05, 0.1])
def test_an_error_of_the_odometer_before_the_first_sight_of_the_end_leaves_no_contradiction(slip: float) -> None:
    """It looks like a board of another length, until the edge beside the beginning comes back: n was wrong, not u."""
    along = at_the_margin()
    along.begin_stroke()
    along.predict(0.9)
    assert along.look([upright(3, END_U - 0.9 - slip, -1)]).startswith("the board's edge lies")
    along.begin_stroke()
    along.predict(-0.9)
    noticed = [along.look([upright(2, -MARGIN - slip, 1)]) for _ in range(9)]
    assert not any(noticed) and along.u == pytest.approx(slip, abs=2e-3) and along.slip == 0.0
    assert along._near_u == pytest.approx(-MARGIN, abs=2e-3) and along.begin == pytest.approx(0.0, abs=2e-3)


def test_a_far_edge_that_is_seen_badly_moves_nothing() -> None:
    along = at_the_margin()
    along.predict(0.9)
    along.look([upright(3, END_U - 0.9, -1)])
    far = upright(3, END_U - 0.8, -1)
    far.track.deviation = 2.0 * CONFIG.gates.start_deviation_m
    along.look([far])
    assert along.end == -1 and along.u == pytest.approx(0.9, abs=1e-3)


@pytest.mark.parametrize(("weight", "error"), [(0.5, 0.02), (1.0, 0.01)])
def test_an_edge_that_leaves_the_picture_does_not_move_the_beginning(weight: float, error: float) -> None:
    """Fading, or seen far aside, where the scale of the picture counts."""
    along = at_the_margin()
    along.look([upright(2, -MARGIN, 1)])
    along.predict(0.22)
    along.look([upright(2, -MARGIN - 0.22 + error, 1, weight=weight)])
    along.predict(-0.22)
    along.look([upright(2, -MARGIN, 1)])
    assert along.u == pytest.approx(0.0, abs=2e-3) and along._near_u == pytest.approx(-MARGIN, abs=2e-3)


def test_the_edge_beside_the_beginning_that_comes_into_view_later_is_as_uncertain_as_u() -> None:
    along = AlongTrack(CONFIG)
    along.find_end([upright(3, 0.2, -1)])
    along.predict(-0.8)
    for _ in range(2):
        along.look([upright(2, -MARGIN - along.u + 0.1, 1)])
        assert np.linalg.eigvalsh(along._p).min() >= -1e-18


def test_back_at_the_beginning_the_edge_beside_it_corrects() -> None:
    along = at_the_margin()
    along.look([upright(2, -MARGIN, 1)])
    for du in (1.0, -1.0):
        along.predict(du)
    for _ in range(20):
        along.look([upright(2, -MARGIN - 0.008, 1)])
    assert along.near == 2 and along.u == pytest.approx(0.008, abs=1.5e-3)
    along.look([])
    assert along.near == along.end == -1


def test_the_error_of_u_is_as_large_as_the_filter_says() -> None:
    """Thirty flights there and back with edges and an odometer as noisy as the filter assumes."""
    ratios = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        place = 0.0
        along = AlongTrack(CONFIG)
        along.find_mark([upright(2, -MARGIN + EDGE_STD * rng.standard_normal(), 1)])
        for du in [0.01] * 100 + [-0.01] * 100:
            place += du
            along.predict(du + math.sqrt(DRIFT_PER_M * abs(du)) * rng.standard_normal())
            lines = [(3, END_U - place, -1), (2, -MARGIN - place, 1)]
            along.look([upright(k, p + EDGE_STD * rng.standard_normal(), s) for k, p, s in lines if abs(p) < 0.26])
            ratios.append((along.u - place) / along.deviation)
    share, rms = np.mean(np.abs(ratios) < 3.0), np.sqrt(np.mean(np.square(ratios)))
    print(f"within three standard deviations {share:.3f}, rms {rms:.2f}")
    assert share >= 0.95 and 0.3 < rms < 1.5


def test_rows_of_h_are_the_derivatives_of_the_places_of_both_ends() -> None:
    base, rows = np.array((0.3, -0.05)), []
    for state in range(2):
        step = 1e-6 * np.eye(2)[state]
        places = [(END_U - u, near - u) for u, near in (base + step, base - step)]
        rows.append((np.array(places[0]) - np.array(places[1])) / 2e-6)
    np.testing.assert_allclose(np.transpose(rows), (along_track._END, along_track._NEAR), atol=1e-6)
