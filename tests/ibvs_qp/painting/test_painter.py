"""Painting strategy on a synthetic wall: every phase change, its time-out, and the choice of guides among decoys."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from ibvs_qp.estimation.wall_motion import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.painting.command import PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.painter import Painter

TICK = 0.02
#: What the camera sees around the tip [m].
VIEW_X, VIEW_UP, VIEW_DOWN = 0.26, 0.11, 0.27
HALF_BRUSH, MARGIN = 0.04, 0.05


@dataclass
class Edge:
    """One line on the wall in board coordinates (right, down) from the start of row 1."""

    identity: int
    role: str
    place: float
    side: int
    kind: str = "board"
    span: tuple[float, float] = (-9.0, 9.0)
    weight: float = 1.0
    lean: float = 0.0


@dataclass
class World:
    """A tip that follows its commands: velocity, guides (first order), stand-off, push."""

    config: PaintingConfig
    tip: np.ndarray = field(default_factory=lambda: np.zeros(2))
    distance: float = 0.3
    time: float = 0.0
    contact_since: float = math.nan
    hidden: set[int] = field(default_factory=set)
    extra: list[Edge] = field(default_factory=list)
    contact_allowed: bool = True
    tared_after: float = 0.5
    blind_wall: bool = False
    stuck: bool = False
    lowest_guide: float = math.inf  # offset at which a horizontal guide holds the vehicle back [m]

    def __post_init__(self) -> None:
        left = -self.config.stroke_m - MARGIN
        self.painter = Painter(self.config)
        self.edges = [
            Edge(1, HORIZONTAL, MARGIN, -1),
            Edge(2, VERTICAL, MARGIN, -1),
            Edge(3, VERTICAL, left, 1),
            Edge(4, HORIZONTAL, -0.9, 1),
        ]
        self.velocity = np.zeros(2)
        self.command: PaintingCommand | None = None
        self.ends: list[tuple[int, float, float]] = []
        self.extent = [0.0, 0.0]
        self.drift = 0.0

    @property
    def guide(self) -> int:
        """Track of the line that leads across the strokes, -1 without one."""
        guides = [] if self.command is None else self.command.guides
        return next((line.track_id for line, _ in guides if line.role == HORIZONTAL), -1)

    @property
    def in_contact(self) -> bool:
        return not math.isnan(self.contact_since)

    def seen(self) -> dict[int, TrackedLine]:
        found = {}
        for edge in self.edges + self.extra:
            axis = 1 if edge.role == HORIZONTAL else 0
            offset = edge.place - self.tip[axis]
            if axis:
                offset = (offset - math.tan(edge.lean) * self.tip[0]) * math.cos(edge.lean)
            inside = -VIEW_UP < offset < VIEW_DOWN if axis else abs(offset) < VIEW_X
            along = self.tip[0]
            inside &= axis == 0 or (along - VIEW_X < edge.span[1] and along + VIEW_X > edge.span[0])
            if inside and edge.identity not in self.hidden:
                found[edge.identity] = TrackedLine(
                    track_id=edge.identity,
                    role=edge.role,
                    slot=0,
                    angle=(0.5 * math.pi if axis else 0.0) + edge.lean,
                    deviation=1e-3,
                    seen_ns=0,
                    frames=9,
                    offset=offset,
                    weight=edge.weight,
                    surface_side=edge.side,
                    kind=edge.kind,
                )
        return found

    def step(self) -> PaintingCommand:
        self.time += TICK
        touching = 0.0 if math.isnan(self.contact_since) else self.time - self.contact_since
        push = 5.0 * min(1.0, touching)
        seen = PainterInput(
            time_s=self.time,
            lines=self.seen(),
            odometer=self.tip.copy(),
            velocity=self.velocity.copy(),
            distance=self.distance,
            wall_known=not self.blind_wall,
            in_contact=self.in_contact,
            time_since_touch=touching,
            push=push,
            push_reference=5.0,
            tared=self.time > self.tared_after,
        )
        before, row = self.painter.phase, self.painter.row
        command = self.painter.step(seen)
        if before == "paint" and self.painter.phase != "paint":
            self.ends.append((row, *self.tip.tolist()))
            self._leave_paint(row)
        self._move(command)
        if self.painter.phase == "climb":
            self.drift = max(self.drift, abs(self.tip[0] - self.ends[-1][1]))
        self.command = command
        return command

    def _move(self, command: PaintingCommand) -> None:
        velocity = np.array(command.velocity, float)
        for line, offset in command.guides:
            axis = 1 if line.role == HORIZONTAL else 0
            velocity[axis] += 4.0 * (line.offset - offset)
            if axis == 1 and line.offset > self.lowest_guide:
                velocity[axis] = max(velocity[axis], 0.0)
        self.velocity = np.zeros(2) if self.stuck else np.clip(velocity, -0.15, 0.15)
        self.tip = self.tip + TICK * self.velocity
        if self.painter.phase == "paint":
            self.extent = [min(self.extent[0], self.tip[0]), max(self.extent[1], self.tip[0])]
        target = -0.0025 if command.contact else command.standoff
        self.distance += np.clip(target - self.distance, -0.05 * TICK, 0.15 * TICK)
        touching = self.distance < 0.0 and self.contact_allowed
        if touching and not self.in_contact:
            self.contact_since = self.time
        elif not touching:
            self.contact_since = math.nan

    def _leave_paint(self, row: int) -> None:
        """Fresh paint behind the brush: its upper edge, and its lower one, which row 1 has on the board's margin."""
        upper = Edge(100 + row, HORIZONTAL, self.tip[1] - HALF_BRUSH, -1, "paint", (self.extent[0], self.extent[1]))
        self.edges.append(upper)
        self.extent = [self.tip[0], self.tip[0]]

    def fly(self, seconds: float, until: str = "") -> list[PaintingCommand]:
        commands = []
        for _ in range(round(seconds / TICK)):
            commands.append(self.step())
            if self.painter.finished or (until and self.painter.phase == until):
                break
        return commands

    def phases(self) -> list[str]:
        names = {"start", "approach", "align", "press", "paint", "climb", "retreat", "done"}
        return [phase for _, phase, _ in self.painter.log if phase in names]


def short(**changes: object) -> PaintingConfig:
    return PaintingConfig(**({"stroke_m": 0.6} | changes))  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------- the whole job


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5])
def test_rows_alternate_and_end_at_their_nominal_places(rows: int) -> None:
    world = World(short(rows=rows))
    world.fly(200.0)
    assert world.painter.finished and not world.painter.failed, world.painter.reason
    expected = ["approach", "align", "press"]
    for row in range(1, rows + 1):
        expected += ["paint"] + (["climb"] if row < rows else [])
    assert world.phases() == [*expected, "retreat", "done"]
    assert [row for row, _, _ in world.ends] == list(range(1, rows + 1))
    assert world.drift < 0.006  # a climb goes straight up, beside whichever edge its row ended at
    for row, right, down in world.ends:
        assert right == pytest.approx(-world.config.stroke_m if row % 2 else 0.0, abs=0.006)
        assert down == pytest.approx(-(row - 1) * world.config.pitch_m, abs=0.004)


def test_each_phase_change_is_logged_with_time_and_reason() -> None:
    world = World(short())
    world.fly(100.0)
    times = [time for time, _, _ in world.painter.log]
    assert times == sorted(times)
    reasons = {phase: reason for _, phase, reason in world.painter.log}
    assert "guide" in reasons["approach"] and "stand-off" in reasons["align"] and "aligned" in reasons["press"]
    assert "climbed" in reasons["paint"] and "ended" in reasons["climb"] and "all rows" in reasons["done"]


def test_travel_goes_left_then_up_then_right() -> None:
    world = World(short(rows=2))
    seen: dict[tuple[str, int], list[np.ndarray]] = {}
    for _ in range(5000):
        command = world.step()
        seen.setdefault((world.painter.phase, world.painter.row), []).append(command.velocity)
        if world.painter.finished:
            break
    assert min(v[0] for v in seen[("paint", 1)]) == pytest.approx(-world.config.speed_m_s)
    assert max(v[0] for v in seen[("paint", 2)]) == pytest.approx(world.config.speed_m_s)
    assert min(v[1] for v in seen[("climb", 2)]) == pytest.approx(-world.config.climb_speed_m_s)
    assert max(abs(v[0]) for v in seen[("climb", 2)]) < 0.031  # held by the edge or the odometer


@pytest.mark.parametrize("rows", [2, 3, 4])
def test_without_side_edges_rows_end_by_the_odometer(rows: int) -> None:
    world = World(short(rows=rows), hidden={2, 3})
    world.fly(300.0)
    assert world.painter.finished and not world.painter.failed
    for row, right, _ in world.ends:  # row 1 searches a little longer for its edge; the others follow it
        assert right == pytest.approx(world.ends[0][1] if row % 2 else 0.0, abs=0.01)


# ---------------------------------------------------------------------------------------------- phases and time-outs


def test_start_waits_for_guide_wall_and_tare() -> None:
    for world in (World(short(), hidden={1}), World(short(), blind_wall=True), World(short(), tared_after=99.0)):
        commands = world.fly(5.0)
        assert world.painter.phase == "start"
        assert not any(command.contact for command in commands)
    fading = World(short())
    fading.edges[0].weight = 0.5
    fading.fly(5.0)
    assert fading.painter.phase == "start"


def test_align_needs_stillness_and_place() -> None:
    world = World(short())
    world.fly(20.0, until="align")
    world.edges[0].place += 0.004  # the guide is off by more than allowed, and the tip does not follow
    world.stuck = True
    world.fly(2.0)
    assert world.painter.phase == "align"
    world.stuck = False
    world.fly(5.0, until="press")
    assert world.painter.phase == "press"


def test_tolerances_of_the_alignment_open_with_time() -> None:
    world = World(short())
    world.fly(20.0, until="align")
    world.edges[0].place += 0.006  # twice the tolerance: reached after sqrt(2) times the patience
    world.stuck = True
    world.fly(2.5)
    assert world.painter.phase == "align"
    world.fly(1.0)
    assert world.painter.phase == "press"


def test_press_waits_for_the_push() -> None:
    world = World(short())
    world.fly(30.0, until="press")
    world.contact_allowed = False
    world.fly(8.0)
    assert world.painter.phase == "press"
    world.contact_allowed = True
    world.fly(1.0)
    assert world.painter.phase == "press"  # contact is not enough, the push must have risen
    world.fly(5.0, until="paint")
    assert world.painter.phase == "paint" and world.painter.row == 1


@pytest.mark.parametrize(
    ("phase", "break_it"),
    [
        ("start", lambda world: world.hidden.add(1)),
        ("approach", lambda world: setattr(world, "distance", 50.0)),
        ("align", lambda world: (world.edges[0].__setattr__("place", 0.08), setattr(world, "stuck", True))),
        ("press", lambda world: setattr(world, "contact_allowed", False)),
        ("climb", lambda world: setattr(world, "contact_allowed", False)),
    ],
)
def test_every_phase_times_out_into_a_retreat_with_the_reason(phase: str, break_it: Callable[[World], object]) -> None:
    world = World(short(timeout_s=8.0))
    world.fly(60.0, until=phase)
    assert world.painter.phase == phase
    break_it(world)
    world.fly(9.0, until="retreat")
    assert "retreat" in world.phases() and world.painter.failed
    assert world.painter.reason == f"time-out after 8 s in {phase}"
    world.distance = min(world.distance, 1.0)
    commands = world.fly(9.0)
    assert world.painter.finished and world.painter.failed and not any(command.contact for command in commands)


def test_a_row_that_never_ends_times_out_and_a_retreat_too() -> None:
    world = World(short(timeout_s=5.0))
    world.fly(60.0, until="paint")
    world.stuck = True
    world.fly(40.0, until="retreat")
    assert world.painter.phase == "retreat" and world.painter.reason == "time-out in row 1"
    world.distance = -0.002
    for _ in range(400):
        world.distance = -0.002  # held by something
        world.step()
    assert world.painter.finished and world.painter.reason == "time-out in row 1"


# ------------------------------------------------------------------------------------------------------- the guides


def test_topmost_and_nearest_decoys_are_not_taken_for_the_bottom_edge() -> None:
    """Above it a joint with the surface below, a picture edge, paint; nearer than the true edge by far."""
    decoys = [
        Edge(50, HORIZONTAL, -0.08, -1, ""),  # topmost, a joint of unknown kind
        Edge(51, HORIZONTAL, 0.02, 1),  # just in place, but its surface lies below: the upper edge of another board
        Edge(52, HORIZONTAL, 0.022, -1, "paint"),  # old paint
        Edge(53, HORIZONTAL, 0.20, -1),
    ]
    world = World(short(), extra=decoys, tip=np.array([0.0, -0.03]))  # starts 3 cm high
    world.fly(10.0, until="approach")
    assert world.guide == 1
    world.fly(100.0)
    assert world.painter.finished and not world.painter.failed
    assert world.ends[0][2] == pytest.approx(0.0, abs=0.004)


def test_the_right_edge_in_view_at_the_start_does_not_end_row_one() -> None:
    world = World(short())
    world.fly(60.0, until="paint")
    assert 2 in world.seen()
    world.fly(1.0)
    assert world.painter.phase == "paint" and world.painter._stroke_end._identity == -1


def test_only_an_edge_with_the_surface_on_our_side_ends_a_row() -> None:
    """A joint and the right edge of another board stand where the row should end; its own edge a little behind."""
    end = -short().stroke_m
    decoys = [Edge(60, VERTICAL, end - MARGIN + 0.015, -1), Edge(61, VERTICAL, end - MARGIN + 0.02, 0, "")]
    decoys.append(Edge(62, VERTICAL, end - MARGIN + 0.01, 1, "paint"))
    world = World(short(rows=1), extra=decoys)
    world.fly(100.0)
    assert world.painter.finished and not world.painter.failed
    assert world.ends[0][1] == pytest.approx(end, abs=0.004)


def test_row_two_follows_the_fresh_edge_and_not_its_own_upper_edge() -> None:
    world = World(short())
    world.fly(100.0, until="climb")
    own = Edge(70, HORIZONTAL, 0.0, -1, "paint")
    world.extra.append(own)
    for _ in range(5000):
        own.place = world.tip[1] - HALF_BRUSH  # grows with the row, topmost in the picture
        world.step()
        if world.painter.phase == "paint":
            assert world.guide == 101
        if world.painter.finished:
            break
    assert not world.painter.failed
    assert world.ends[1][2] == pytest.approx(-world.config.pitch_m, abs=0.004)


def test_the_fresh_edge_is_found_where_the_old_guide_holds_the_vehicle_back() -> None:
    """The old guide at the border of the picture: 25 mm are missing to the row, more than the gate of 18 mm."""
    world = World(short(rows=2), lowest_guide=MARGIN + short().pitch_m - 0.025)
    world.fly(200.0)
    assert world.painter.finished and not world.painter.failed
    assert any(phase == "paint" and "fresh edge found" in reason for _, phase, reason in world.painter.log)
    assert world.ends[1][2] == pytest.approx(-world.config.pitch_m, abs=0.004)


def test_without_fresh_edge_the_old_guide_stays() -> None:
    world = World(short(rows=2), hidden={101})
    world.fly(200.0)
    assert world.painter.finished and not world.painter.failed
    assert any(phase == "paint" and "the old guide stays" in reason for _, phase, reason in world.painter.log)
    assert world.ends[1][2] == pytest.approx(-world.config.pitch_m, abs=0.004)


@pytest.mark.parametrize("misleads", ["leans from the start", "leans in the row", "lost in the row"])
def test_where_the_fresh_edge_misleads_the_board_leads(misleads: str) -> None:
    """A stroke that gusts have bent is no straight edge: followed as one it led 100 mm away."""
    world, lean = World(short(rows=2)), math.radians(4.5)
    world.fly(100.0, until="climb")
    fresh = next(edge for edge in world.edges if edge.identity == 101)
    fresh.lean = lean if misleads == "leans from the start" else math.radians(2.0)
    world.fly(10.0, until="paint")
    world.fly(1.0)
    if misleads == "lost in the row":
        world.hidden.add(101)
    elif misleads == "leans in the row":
        assert world.guide == 101  # two degrees are none
        fresh.lean, fresh.place = lean, fresh.place - 0.015
    world.fly(1.0)
    assert world.guide == 1
    world.fly(100.0)
    assert world.painter.finished and not world.painter.failed
    assert world.ends[1][2] == pytest.approx(-world.config.pitch_m, abs=0.004)


def test_back_from_the_board_to_the_fresh_edge_the_row_stays() -> None:
    """With the board's offset as its target the fresh edge led 90 mm up."""
    world = World(short(rows=2))
    world.fly(100.0, until="climb")
    world.fly(10.0, until="paint")
    world.fly(0.5)
    for hidden, guide in (({101}, 1), ({1}, 101)):
        world.hidden = hidden
        world.fly(0.5)
        assert world.guide == guide
    world.fly(1.0)
    assert world.tip[1] == pytest.approx(-world.config.pitch_m, abs=0.004)


def test_a_sloped_row_does_not_lean() -> None:
    world = World(short(rows=2))
    for edge in world.edges:
        edge.lean = math.radians(8.0) if edge.role == HORIZONTAL else 0.0
    world.fly(100.0, until="climb")
    next(edge for edge in world.edges if edge.identity == 101).lean = math.radians(8.0)
    world.fly(10.0, until="paint")
    world.fly(1.0)
    assert world.guide == 101


def test_the_edge_of_a_climb_is_found_again_under_another_name() -> None:
    """The brush paints over the edge at which the row ended; it reappears as another track."""
    world = World(short(rows=2))
    world.fly(100.0, until="climb")
    stop = next(edge for edge in world.edges if edge.identity == 3)
    world.hidden.add(3)
    world.fly(0.3)
    assert not any(line.role == VERTICAL for line, _ in world.step().guides)
    stop.identity = 34
    assert [line.track_id for line, _ in world.step().guides if line.role == VERTICAL] == [34]
    world.fly(10.0, until="paint")
    assert not any(line.role == VERTICAL for line, _ in world.step().guides)


def test_a_guide_that_is_lost_is_found_again_under_another_name() -> None:
    world = World(short(rows=1))
    world.fly(60.0, until="paint")
    world.fly(2.0)
    world.edges[0].identity = 33
    world.fly(1.0)
    assert world.guide == 33
    assert any(phase == "guide" for _, phase, _ in world.painter.log)
    world.fly(100.0)
    assert not world.painter.failed


# ------------------------------------------------------------------------------------------------------ lost contact


def test_lost_contact_pauses_the_stroke_and_goes_on_afterwards() -> None:
    world = World(short(rows=2))
    world.fly(60.0, until="paint")
    world.fly(3.0)
    world.contact_allowed = False
    world.fly(2.0)
    held = world.tip.copy()
    commands = world.fly(1.0)
    assert all(command.contact and abs(command.velocity[0]) < 1e-9 for command in commands)
    assert np.linalg.norm(world.tip - held) < 1e-3
    world.contact_allowed = True
    world.fly(0.4)
    assert abs(world.tip[0] - held[0]) < 1e-3  # not before the push is back
    world.fly(200.0)
    events = [phase for _, phase, _ in world.painter.log if phase.startswith("contact")]
    assert events == ["contact lost", "contact back"]
    assert world.painter.finished and not world.painter.failed
    assert world.ends[0][1] == pytest.approx(-world.config.stroke_m, abs=0.006)


def test_reset_starts_over() -> None:
    world = World(short(rows=1))
    world.fly(100.0)
    world.painter.reset()
    again = World(short(rows=1))
    again.painter = world.painter
    again.fly(100.0)
    assert again.painter.finished and not again.painter.failed
    np.testing.assert_allclose(again.ends, world.ends)
