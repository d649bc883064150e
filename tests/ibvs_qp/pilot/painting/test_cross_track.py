"""Place of the tip across the strokes: the filter against simulated strokes with the noises that it assumes."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.pilot.painting import cross_filter, cross_track
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.cross_track import LOOK_S, CrossTrack
from ibvs_qp.pilot.painting.pattern_lines import PatternLine

CONFIG = PaintingConfig(stroke_m=0.6)
MARGIN, HALF, PITCH = CONFIG.edge_margin_m, 0.5 * CONFIG.brush_width_m, CONFIG.pitch_m
RUNS, WITHIN = 30, 0.95


def parallel(track: int, place: float, side: int, kind: str, middle_u: float = 0.0, length: float = 6.0) -> PatternLine:
    """A line along the strokes, beside the tip."""
    line = TrackedLine(track_id=track, role="horizontal", slot=0, angle=0.5 * math.pi, deviation=0.0, seen_ns=0)
    line.weight, line.kind = 1.0, kind
    return PatternLine(line, True, place, 0.0, side, 1.0, length, (middle_u, place))


class Strokes:
    """A tip that paints strokes beside a board's edge, with an odometer and edges as noisy as the filter assumes."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.cross = CrossTrack(CONFIG)
        self.u, self.v, self.delta = 0.0, MARGIN, cross_filter.TIP_STD * self.rng.standard_normal()
        self.drift = cross_filter.DRIFT_STD * self.rng.standard_normal()
        self.turn = cross_filter.TURN_STD * self.rng.standard_normal()
        self.wander = cross_filter.WANDER_STD * self.rng.standard_normal()  # of odometer and picture
        self.strokes: list[dict[int, float]] = []
        board = self.seen(1, 0.0, 1, "board", cross_filter.BOARD_STD)
        self.cross.start(board)
        self.ratios: list[float] = []

    def seen(self, track: int, v: float, side: int, kind: str, std: float, middle: float = 0.0, length: float = 6.0):
        """An edge at v as the picture shows it."""
        turned = self.wander - self.cross.picture_turn
        place = v - self.v - self.delta + std * self.rng.standard_normal()
        line = parallel(track, place, side, kind, middle, length)
        line.middle, line.lean = (middle, place + turned * middle), turned
        return line

    def move(self, du: float, dv: float, dt: float = LOOK_S) -> None:
        variance = cross_filter.ODOMETER_PER_M * math.hypot(du, dv) + cross_filter.ODOMETER_AT_REST * dt
        kept = math.exp(-dt / cross_filter.WANDER_TIME_S)
        self.wander *= kept
        self.wander += math.sqrt(1.0 - kept**2) * cross_filter.WANDER_STD * self.rng.standard_normal()
        measured = dv + self.drift * dt + (self.turn + self.wander - self.cross.filter.turn) * du
        measured += math.sqrt(variance) * self.rng.standard_normal()
        self.u, self.v = self.u + du, self.v + dv
        self.cross.predict(du, measured, dt)

    def lines(self, ahead: float, laying: bool) -> list[PatternLine]:
        independent = math.sqrt(cross_track.INDEPENDENT_S / LOOK_S)
        noise = cross_track.EDGE_STD * independent
        found = []
        if len(self.strokes) < 3:
            still = math.sqrt(cross_track.BOARD_INDEPENDENT_S / LOOK_S)
            found.append(self.seen(1, 0.0, 1, "board", cross_filter.BOARD_STD * still))
        complete = self.strokes[:-1] if laying else self.strokes
        for stroke, direction, sides in ((complete, ahead, (1,)), (self.strokes if laying else [], -ahead, (1, -1))):
            if not stroke:
                continue
            reach = [u for u in stroke[-1] if 0.05 < direction * (0.01 * u - self.u) < 0.22]
            if len(reach) < 8:
                continue
            middle, v = 0.01 * np.mean(reach) - self.u, np.mean([stroke[-1][u] for u in reach])
            for side in sides:
                track = 100 * side + len(complete) + (direction != ahead)
                found.append(self.seen(track, v + side * HALF, side, "paint", noise, middle, 0.01 * len(reach)))
        return found

    def paint(self, count: int) -> list[float]:
        """Errors of v at every look of every stroke [m]."""
        errors = []
        for stroke in range(1, count + 1):
            ahead = 1.0 if stroke % 2 else -1.0
            self.cross.begin_stroke()
            self.strokes.append({})
            for _ in range(round(CONFIG.stroke_m / 0.01)):
                self.strokes[-1][round(self.u / 0.01)] = self.v
                self.cross.lay(self.u)
                self.move(0.01 * ahead, 0.05 * (MARGIN + (stroke - 1) * PITCH - self.cross.v))
                self.cross.look(self.lines(ahead, True), self.u, ahead)
                errors.append(self.error())
                self.ratios.append(self.error() / self.expected())
            self.cross.end_stroke()
            for _ in range(15):
                self.move(0.0, PITCH / 15)
                self.cross.look(self.lines(-ahead, False), self.u, -ahead)
        return errors

    def error(self) -> float:
        return self.cross.v - self.v

    def expected(self) -> float:
        return math.sqrt(self.cross.filter.p[0, 0])


def test_the_error_of_v_is_as_large_as_the_filter_says() -> None:
    """Thirty flights of three strokes: the normalised error stays within three in at least 95 % of the looks."""
    ratios = np.array([_ratios(seed) for seed in range(RUNS)])
    share = float(np.mean(np.abs(ratios) < 3.0))
    rms = float(np.sqrt(np.mean(ratios**2)))
    print(f"within three standard deviations {share:.3f}, rms {rms:.2f}, n = {ratios.size}")
    assert share >= WITHIN
    assert 0.3 < rms < 1.5  # and the filter does not claim much less than it has


def _ratios(seed: int) -> list[float]:
    flight = Strokes(seed)
    flight.paint(3)
    return flight.ratios


@pytest.mark.slow
def test_a_chain_of_strokes_stays_straight(monkeypatch) -> None:
    """The error of v changes little along stroke ten, although odometer and picture turn by 5 mrad rms.

    By 2.6 mrad where only the odometer turns.
    """
    monkeypatch.setattr(sys.modules[__name__], "CONFIG", PaintingConfig(stroke_m=2.0))
    last = [np.split(np.array(Strokes(seed).paint(10)), 10)[-1] for seed in range(12)]
    turned = [np.polyfit(0.01 * np.arange(errors.size), errors, 1)[0] for errors in last]
    rms = float(np.sqrt(np.mean(np.square(turned))))
    print(f"turned by {1e3 * rms:.2f} mrad rms, n = {len(turned)}")
    assert rms < 2.3e-3


@pytest.mark.parametrize("own", [False, True])
def test_rows_of_h_are_the_derivatives_of_the_places_in_the_picture(own: bool, monkeypatch) -> None:
    """Expected less seen places of every edge, against changes of each state; the direction turns what is seen."""
    cross, seen = _after_stroke_one(), []
    lines = [fresh(), parallel(1, -MARGIN - PITCH, 1, "board")]
    if own:
        cross.begin_stroke()
        for k in range(20):
            cross.lay(0.3 + 0.01 * k)
        lines.append(parallel(102, HALF, 1, "paint", 0.1, 0.16))

    def expected(state: int, by: float) -> list[float]:
        seen.clear()
        turned = by if state in (cross_filter.TURN, cross_filter.WANDER) else 0.0
        cross.filter.x[state] += by
        cross.look([replace(line, middle=(u, v - turned * u)) for line in lines for u, v in (line.middle,)], 0.3, -1.0)
        cross.filter.x[state] -= by
        return [level - float(x[0] + x[1]) - place for x, place, _, level in seen]

    def note(edges: list, _noise: float, _gate: float) -> None:
        seen.extend((cross.filter.x.copy(), *edge[1:4]) for edge in edges)

    monkeypatch.setattr(cross, "_correct", note)
    monkeypatch.setattr(cross.filter, "take_error", lambda _nodes: None)
    expected(0, 0.0)
    rows = np.array([row for _, _, row, _ in seen])
    assert len(rows) >= 2 + own
    slopes = [(np.array(expected(k, 1e-4)) - expected(k, -1e-4)) / 2e-4 for k in range(cross_filter.STATES)]
    np.testing.assert_allclose(rows, np.transpose(slopes), atol=1e-9)


def _after_stroke_one(delta: float = 0.0) -> CrossTrack:
    """Stroke 1 is painted by an odometer without drift, the tip has climbed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cross_filter, "WANDER_STD", 0.0)
        cross = CrossTrack(CONFIG)
        cross.start(parallel(1, -MARGIN - delta, 1, "board"))
        for steady in (cross_filter.DRIFT, cross_filter.TURN):
            cross.filter.p[steady, steady] = 0.0
        cross.begin_stroke()
        for k in range(60):
            cross.lay(0.01 * k)
            cross.unled = 0.0  # as with the board's edge in view
            cross.predict(0.01, 0.0, 0.1)
        cross.end_stroke()
        cross.predict(0.0, PITCH, 1.5)
    return cross


def _lay(cross: CrossTrack, bins: int = 60) -> Iterator[tuple[int, float]]:
    """Begin stroke 2 and lay it bin by bin, by the odometer; what the caller does follows the move: bin and its u."""
    cross.begin_stroke()
    for k in range(bins):
        cross.lay(0.6 - 0.01 * k)
        cross.predict(-0.01, 0.0, 0.1)
        yield k, 0.6 - 0.01 * k


def _look(cross: CrossTrack, *lines: PatternLine, u: float = 0.3, times: int = 20, ahead: float = -1.0) -> CrossTrack:
    for _ in range(times):
        cross.look(lines, u, ahead)
    return cross


def fresh(error: float = 0.0, track: int = 101, side: int = 1, kind: str = "paint", middle: float = -0.14):
    """The last stroke's outer edge beside a tip that has climbed one pitch and is that far too high [m]."""
    return parallel(track, HALF - PITCH - error, side, kind, middle, 0.16)


def test_the_fresh_edge_corrects_v_where_the_tip_s_place_in_the_picture_is_known(monkeypatch) -> None:
    monkeypatch.setattr(cross_filter, "TIP_STD", 1e-5)
    cross = _after_stroke_one()
    before = cross.deviation
    _look(cross, fresh(0.004), times=60)
    above_last = cross.v - cross.last_stroke(0.29, 0.31) + MARGIN
    assert above_last == pytest.approx(MARGIN + PITCH + 0.004, abs=1e-3)  # against the last stroke's map
    assert cross.deviation < 0.9 * before and list(cross.guides) == [101]


def test_a_displaced_fresh_edge_tells_the_tip_s_place_in_the_picture_where_that_is_unknown() -> None:
    """The board's edge showed v + delta, the odometer knows the climb: an edge that is off says that delta is."""
    cross = _look(_after_stroke_one(delta=0.004), fresh(0.004), times=60)
    assert cross.tip_error == pytest.approx(0.004, abs=1e-3)
    assert cross.v == pytest.approx(MARGIN + PITCH, abs=2e-3)


@pytest.mark.parametrize(
    "decoy",
    [
        lambda: fresh(0.030),  # farther than the gate
        lambda: fresh(side=-1),  # the bare side is the other one
        lambda: fresh(kind="board"),
        lambda: fresh(middle=0.14),  # the paint lies on the other side of the tip
    ],
)
def test_another_edge_corrects_nothing(decoy: Callable[[], PatternLine]) -> None:
    cross = _after_stroke_one()
    v, deviation = cross.v, cross.deviation
    _look(cross, decoy())
    assert cross.v == v and cross.deviation == deviation
    assert 101 not in cross.guides or decoy().kind == "board"


@pytest.mark.parametrize(("length", "counts"), [(0.025, True), (0.01, False)])
def test_the_short_piece_below_the_brush_counts(length: float, counts: bool) -> None:
    cross = _after_stroke_one()
    _look(cross, parallel(101, HALF - PITCH, 1, "paint", -0.055, length), times=1)
    assert (list(cross.guides) == [101]) is counts


def test_a_place_that_is_seen_twice_is_better_known_than_once() -> None:
    once, twice = _look(_after_stroke_one(), fresh(), times=1), _look(_after_stroke_one(), fresh(), times=2)
    assert twice.deviation < once.deviation < _after_stroke_one().deviation


def test_own_edges_show_where_the_picture_shows_the_tip() -> None:
    """The board's edge cannot tell v from delta; the edges of the own paint lie at +- half a brush from the tip."""
    delta = 0.004
    cross = CrossTrack(CONFIG)
    board = parallel(1, -MARGIN - delta, 1, "board")  # the tip is at the margin
    cross.start(board)
    _look(cross, board, times=50)
    assert cross.v == pytest.approx(MARGIN + delta, abs=1e-4) and cross.tip_error == pytest.approx(0.0, abs=1e-4)
    cross.begin_stroke()
    for k in range(60):
        u = 0.01 * k
        cross.lay(u)
        cross.predict(0.01, 0.0, 0.1)
        own = [parallel(100 + side, side * HALF - delta, side, "paint", -0.14, 0.16) for side in (1, -1)]
        cross.look([board, *(own if u > 0.25 else [])], u, 1.0)
    assert cross.tip_error == pytest.approx(delta, abs=1e-3)
    assert cross.v == pytest.approx(MARGIN, abs=1e-3)


def test_an_older_stroke_helps_where_the_last_one_is_missing() -> None:
    cross = _after_stroke_one()
    cross.begin_stroke()
    for k in range(60):
        cross.predict(-0.01, 0.0, 0.1)
        cross.lay(0.6 - 0.01 * k)
    cross.end_stroke()
    cross.predict(0.0, PITCH, 1.5)
    before = cross.filter.p[0, 0]
    _look(cross, parallel(101, HALF - 2.0 * PITCH - 0.002, 1, "paint", 0.14, 0.16), ahead=1.0)
    assert cross.filter.p[0, 0] < before and list(cross.guides) == [101]


def test_the_board_s_edge_turns_the_strokes_and_no_more_than_a_board_may() -> None:
    for lean, expected in ((0.05, math.atan(0.05)), (0.6, cross_track.LARGEST_TURN)):
        cross = CrossTrack(CONFIG)
        edge = parallel(1, -MARGIN, 1, "board")
        edge.lean = lean
        cross.start(edge)
        assert cross.filter.turn == cross.picture_turn == pytest.approx(expected)


def test_the_direction_that_the_odometer_showed_outlasts_the_board_s_edge_in_the_picture() -> None:
    """The mount rolls the picture by 6 mrad: 1 m beside the edge shows the direction in the odometer's axes."""
    cross, roll = CrossTrack(CONFIG), 6e-3
    edge = parallel(1, -MARGIN, 1, "board")
    edge.lean = roll
    cross.start(edge)
    for k in range(200):
        du = 0.01 if k < 100 else -0.01
        cross.predict(du, -cross.filter.turn * du, 0.1)  # the odometer moves along the strokes exactly
        edge.lean = roll - math.tan(cross.picture_turn)
        _look(cross, edge, u=0.01 * min(k, 200 - k), times=1, ahead=1.0)
    assert abs(cross.filter.turn) < 1.5e-3
    assert cross.picture_turn == pytest.approx(roll, abs=1e-3)


@pytest.mark.parametrize("turned", [-0.01, 0.01])
def test_a_board_s_edge_across_the_strokes_shows_the_turn_of_the_picture(turned: float) -> None:
    """A picture that is turned from u to v by an angle shows an edge along v turned from v to -u by it."""
    cross = _after_stroke_one()
    cross.filter.p[cross_filter.WANDER, cross_filter.WANDER] = cross_filter.WANDER_STD**2
    before = cross.filter.p[cross_filter.WANDER, cross_filter.WANDER]
    for _ in range(100):
        across = parallel(7, 0.2, 1, "board")
        across.parallel, across.lean = False, -math.tan(turned - cross.picture_turn)
        ends_of_paint = replace(across, lean=0.3, track=replace(across.track, kind="paint"))
        cross.look([across, ends_of_paint], 0.3, 1.0)
    assert cross.picture_turn == pytest.approx(turned, abs=0.6 * abs(turned))
    assert cross.filter.p[cross_filter.WANDER, cross_filter.WANDER] < 0.5 * before


def test_a_step_back_forgets_nothing_that_was_learnt_of_the_stroke_that_is_laid() -> None:
    cross = _after_stroke_one()
    for _, u in _lay(cross, 40):
        _look(cross, fresh(0.003, middle=-0.14), u=u, times=1)
    laid = slice(cross_filter.OWN.start + 10, cross_filter.OWN.stop)  # 0.26 to 0.6 m
    learnt = cross.filter.x[laid].copy()
    cross.look([], 0.4, -1.0)
    np.testing.assert_array_equal(cross.filter.x[laid], learnt)
    assert np.all(learnt != 0.0)


def test_the_far_edge_is_remembered_and_leads_last() -> None:
    cross = _after_stroke_one()
    assert math.isnan(cross.far_edge)
    _look(cross, fresh(), parallel(4, 0.1, -1, "board"))
    assert cross.far_edge == pytest.approx(MARGIN + PITCH + 0.1, abs=1e-3)
    assert list(cross.guides) == [101, 4]


def test_the_far_edge_holds_a_stroke_whose_other_edges_are_hidden() -> None:
    """By the odometer alone a drift of 2 mm/s moves the tip by 8 mm in 4 s; the far edge shows it."""
    cross, true_v, far = _after_stroke_one(), MARGIN + PITCH, MARGIN + PITCH + 0.25
    cross.begin_stroke()
    _look(cross, fresh(), parallel(4, far - true_v, -1, "board"))
    for k in range(40):
        cross.lay(0.6 - 0.01 * k)
        cross.predict(-0.01, 0.002 * 0.1, 0.1)
        cross.look([parallel(4, far - true_v, -1, "board")], 0.6 - 0.01 * k, -1.0)
    assert abs(cross.v - true_v) < 2e-3
    assert cross.deviation < 3e-3
    assert cross.far_edge == pytest.approx(far, abs=2e-3)


def test_a_far_edge_elsewhere_is_another_one_and_moves_nothing() -> None:
    cross = _after_stroke_one()
    _look(cross, fresh(), parallel(4, 0.3, -1, "board"))
    v = cross.v
    cross.look([parallel(5, 0.2, -1, "board")], 0.0, 1.0)
    assert cross.v == v
    assert cross.far_edge == pytest.approx(v + 0.2, abs=1e-3)


def test_without_edges_the_uncertainty_grows_and_never_shrinks() -> None:
    cross, last = _after_stroke_one(), 0.0
    for _ in range(50):
        cross.predict(0.0, 0.001, 0.1)
        cross.look([], 0.0, 1.0)
        assert cross.deviation > last
        last = cross.deviation
    assert cross.guides == {}


def test_a_place_is_as_uncertain_as_the_last_edge_wanders_from_where_it_is_expected() -> None:
    """By 3 mm for a second and back; noise of the same size from look to look does not count."""
    misfits, place = [], []
    for jolt, looks in ((0.0, 1), (3e-3, 1), (3e-3, 10)):
        cross = _after_stroke_one()
        for k, u in _lay(cross, 40):
            _look(cross, fresh(jolt if k // looks % 2 else -jolt), u=u - 0.01, times=1)
        misfits.append(cross.misfit)
        place.append(cross.stroke_place(0.25, 0.6)[1])
    assert max(misfits[:2]) < 0.5e-3 and 1e-3 < misfits[2] < 3e-3
    assert place[0] == pytest.approx(place[1]) and place[2] > 1.3 * place[0]


def test_the_wander_of_the_odometer_s_axes_is_followed_and_fades() -> None:
    """They turn by 1 deg after stroke 1: its edge shows a third of that within 4 s, 2.5 standard deviations."""
    cross, wander = _after_stroke_one(), math.radians(1.0)
    cross.begin_stroke()

    def move() -> None:
        turned = wander - cross.filter.turn  # the odometer in the axes of the strokes, as the filter has them
        cross.predict(-0.01 * math.cos(turned), -0.01 * math.sin(turned), 0.1)

    for k in range(40):
        cross.lay(0.6 - 0.01 * k)
        move()
        _look(cross, fresh(), u=0.6 - 0.01 * (k + 1), times=1)
    assert 0.25 * wander < cross.filter.turn < wander
    before, learnt = cross.v, cross.filter.turn
    for _ in range(20):
        move()
    assert abs(cross.v - before) < 0.8 * 0.2 * wander
    cross.predict(0.0, 0.0, 30.0)
    assert abs(cross.filter.turn) < 0.5 * learnt


def test_the_drift_of_the_odometer_makes_v_uncertain_in_one_direction() -> None:
    """Its variance in v grows with the square of time, and v and drift are correlated."""
    cross, seconds = CrossTrack(CONFIG), 20.0
    cross.start(parallel(1, -MARGIN, 1, "board"))
    before = cross.filter.p[0, 0]
    for _ in range(200):
        cross.predict(0.0, 0.0, 0.1)
    variance = cross_filter.DRIFT_STD**2
    assert cross.filter.p[0, cross_filter.DRIFT] == pytest.approx(-seconds * variance, rel=0.1)
    rest = cross_filter.ODOMETER_AT_REST * seconds
    assert cross.filter.p[0, 0] - before == pytest.approx(seconds**2 * variance + rest, rel=0.1)
    np.testing.assert_allclose(cross.filter.p, cross.filter.p.T, atol=1e-18)


def test_a_map_that_begins_has_the_error_of_v() -> None:
    cross = _after_stroke_one()
    cross.begin_stroke()
    own = cross_filter.OWN.start
    np.testing.assert_array_equal(cross.filter.p[own], cross.filter.p[0])
    assert cross.filter.p[own, own] == cross.filter.p[0, 0] > 0.0


def _least(cross: CrossTrack, first_u: float, last_u: float) -> float:
    _, overlap, known, _ = cross.overlap(first_u, last_u)
    return float((overlap - known).min())


def test_the_overlap_is_that_of_the_maps_and_their_errors() -> None:
    cross = CrossTrack(CONFIG)
    cross.begin_stroke()
    assert cross.overlap(0.0, 0.6)[0].size == 0
    cross = _after_stroke_one()
    cross.begin_stroke()
    for k in range(60):
        cross.lay(0.6 - 0.01 * k)
        cross.predict(-0.01, 0.002 if k == 30 else 0.0, 0.1)
        cross.look([], 0.6 - 0.01 * k, -1.0)
    nominal, step = 2.0 * HALF - PITCH, 0.002
    u, overlap, known, _ = cross.overlap(0.0, 0.25)
    assert u.min() > 0.0 and u.max() < 0.25 and overlap == pytest.approx(nominal - step, abs=1e-4)
    assert _least(cross, 0.35, 0.6) > _least(cross, 0.0, 0.25)
    assert known.max() == pytest.approx(cross.deviation, rel=0.1)  # the tip is at the end, where least is known
    place, known = cross.stroke_place(0.0, 0.25)
    assert place == pytest.approx(MARGIN + PITCH + step, abs=1e-4) and known > 0.0


def test_paint_laid_again_farther_in_adds_to_the_overlap_and_not_to_the_map() -> None:
    cross = _after_stroke_one()
    for _ in _lay(cross):
        cross.unled = 0.0  # as with the last stroke's edge in view
    before, map_before = cross.overlap(0.0, 0.6), cross.strokes.passes[0][0].places()[1]
    cross.predict(0.0, -0.004, 0.1)
    for way in (range(30), reversed(range(30))):  # the way back lies where the first pass does: it takes nothing away
        cross.begin_again()
        for k in way:
            cross.lay(0.01 * k)
        cross.predict(0.0, 0.004, 0.1)
    u, overlap, _, largest = cross.overlap(0.0, 0.6)
    np.testing.assert_array_equal(cross.strokes.passes[0][0].places()[1], map_before)
    first = np.isin(u, before[0])  # where the first pass lies, too
    assert np.isin(before[0], u).all() and first.sum() < u.size
    u, overlap, largest = u[first], overlap[first], largest[first]
    again = u < 0.29
    assert np.all((overlap - before[1])[~again] == 0.0)
    gained = (overlap - before[1])[again]
    assert np.all((0.0 < gained) & (gained < 0.004)), "less the deviation of v"
    np.testing.assert_allclose((largest - before[3])[again], 0.004, atol=1e-6)
    assert cross.stroke_place(0.1, 0.2)[0] == pytest.approx(MARGIN + PITCH, abs=1e-4)
    cross.end_stroke()
    cross.begin_stroke()
    cross.lay(0.3)
    assert cross.overlap(0.2, 0.4)[1] == pytest.approx(2.0 * HALF - 0.004, abs=1e-6), "the first pass is the map"


@pytest.mark.parametrize("middle", [-0.14, 0.14])
def test_on_its_own_paint_the_edge_is_where_the_last_pass_left_it(middle: float) -> None:
    cross, outwards = _after_stroke_one(), 0.004
    cross.begin_stroke()
    for k in range(60):
        cross.lay(0.6 - 0.01 * k)
    cross.predict(0.0, outwards, 0.1)
    cross.begin_again()
    for k in range(60):
        cross.lay(0.01 * k)
    cross.predict(0.0, -outwards, 0.1)
    cross.begin_again()
    v = cross.v
    cross.look([parallel(102, HALF + outwards, 1, "paint", middle, 0.16)], 0.3, 1.0, again=True)
    assert cross.v == pytest.approx(v, abs=1e-6) and list(cross.guides) == [102]


def test_a_stroke_that_ends_elsewhere_than_the_odometer_says_moves_its_waves() -> None:
    """A dip of stroke 2 towards stroke 1 lies 2 cm nearer to its end than it seemed."""
    cross = _after_stroke_one()
    cross.begin_stroke()
    for k in range(60):
        u, dip = 0.595 - 0.01 * k, 0.006 if 25 <= k < 31 else 0.0
        cross.predict(-0.01, -dip, 0.1)
        cross.lay(u)
        cross.predict(0.0, dip, 0.1)
    u, overlap, *_ = cross.overlap(0.0, 0.6)
    assert u[overlap > overlap.min() + 0.005].mean() == pytest.approx(0.32, abs=0.006)
    cross.strokes.end_pass(np.array([0.6, 0.0]), np.array([0.58, -0.02]))
    u, overlap, *_ = cross.overlap(0.0, 0.6)
    assert u[overlap > overlap.min() + 0.005].mean() == pytest.approx(0.30, abs=0.006)


@pytest.mark.parametrize("middle", [-0.14, 0.14])
def test_on_its_own_paint_the_tip_goes_by_the_edge_on_either_side(middle: float) -> None:
    """Ahead of the way out (-u) it seems to lie 1 mm farther out, by beta, and that is no error of v."""
    cross = _after_stroke_one()
    cross.begin_stroke()
    for k in range(60):
        cross.lay(0.6 - 0.01 * k)
        cross.look([], 0.6 - 0.01 * k, -1.0)
    cross.filter.x[cross_filter.AHEAD] = beta = 1e-3
    seems = beta if middle < 0.0 else 0.0
    own, v = parallel(102, HALF + seems, 1, "paint", middle, 0.16), cross.v
    cross.look([own], 0.3, 1.0, again=True)
    assert cross.v == pytest.approx(v, abs=1e-9) and list(cross.guides) == [102]
    cross.look([parallel(102, HALF + seems - 2e-3, 1, "paint", middle, 0.16)], 0.3, 1.0, again=True)
    assert cross.tip_error > 5e-4, "the edge seems nearer than the map says: the picture shows the tip farther out"
    inner = parallel(104, -HALF - 4e-3, -1, "paint", middle, 0.16)
    cross.look([fresh(track=103, middle=0.14), inner], 0.3, 1.0, again=True)
    assert not cross.guides, "the last stroke's edge lies under the paint, and the inner one is that of the brush"


@pytest.mark.parametrize(
    ("near", "far", "share"), [(-0.2, 0.2, 0.5), (-0.2, -0.1, 1.0), (0.1, 0.2, 0.0), (-0.3, 0.1, 0.75)]
)
def test_beta_counts_by_the_part_of_the_own_edge_that_lies_ahead_on_the_way_out(near, far, share) -> None:
    cross = _after_stroke_one()
    cross.begin_stroke()
    cross.look([], 0.3, -1.0)
    assert cross._share_ahead(near, far) == pytest.approx(share)
    cross.look([], 0.3, 1.0)
    assert cross._share_ahead(near, far) == pytest.approx(1.0 - share)


@pytest.mark.parametrize("line", ["fresh", "board", "far"])
def test_the_way_without_an_edge_ends_at_one_that_corrects(line: str) -> None:
    seen = {
        "fresh": fresh(),
        "board": parallel(1, -MARGIN - PITCH, 1, "board"),
        "far": parallel(3, 0.3, -1, "board"),
    }[line]
    cross = _after_stroke_one()
    for k, u in _lay(cross, 40):
        if k >= 20:
            cross.look([seen], u, -1.0)
    assert cross.unled == 0.0
    assert cross.longest_unled == pytest.approx(0.21 if line == "far" else 0.2)  # the first look only learns its place
