"""Where the tip is in the pattern, where it should be, and the command that leads it there.

Everything is in pattern coordinates (u along the strokes, v across; `ibvs_qp.painting.pattern`). Where the tip is:
`cross_track` and `along_track`; lines that lead there: `carrier`.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.measurement import HORIZONTAL
from ibvs_qp.painting.along_track import SIGMAS, AlongTrack
from ibvs_qp.painting.carrier import Carrier
from ibvs_qp.painting.command import ZERO, ExpectedEdge, PainterInput, PaintingCommand
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.cross_track import LOOK_S, CrossTrack
from ibvs_qp.painting.pattern import FILL, FILL_REST_M, Pattern
from ibvs_qp.painting.pattern_lines import PatternLine, pattern_lines
from ibvs_qp.painting.phase_machine import PhaseMachine
from ibvs_qp.painting.speed import approached, clipped

#: The end of a stroke moves by at most this much so that its length is right [m]: less than half a length's tolerance.
MOST_END_SHIFT_M = 0.004
#: A stroke that begins farther from its place shows that the board is not as long as the job says [m].
MOST_BEGIN_ERROR_M = 0.015
#: An odometer that moves by more at once was corrected after a hole in the data, by the velocity at its end [m/s, m].
MOST_SPEED_M_S, JUMP_M = 1.0, 0.005


class Navigation(PhaseMachine):
    """Both coordinates of the tip by odometer and lines, and their references; a subclass is the phases."""

    _SLIDES = True  # whether a stroke follows the press

    def __init__(self, config: PaintingConfig) -> None:
        self.pattern = Pattern(config.pattern, config.start)
        super().__init__(config)

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._cross, self._along = CrossTrack(self.config), AlongTrack(self.config)
        self._across_line, self._along_line = Carrier(), Carrier()
        self._lines: list[PatternLine] = []
        self._odometer: tuple[float, float] | None = None
        self._looked = -math.inf
        self._u_reference = self._v_reference = 0.0  # where the tip should be now [m]
        self._v_target = self.config.edge_margin_m  # where the stroke in progress belongs [m]
        self._behind = 0.0  # paint of the stroke before its beginning, by a gust or a retouch [m]

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Advance by one tick."""
        dt = 0.0 if math.isnan(self._last_time) else inputs.time_s - self._last_time
        self._navigate(inputs, dt)
        return super().step(inputs)

    def _navigate(self, inputs: PainterInput, dt: float) -> None:
        """Move both coordinates by the odometer and correct them with the lines in view."""
        cross, along = self._cross, self._along
        odometer = float(inputs.odometer[0]), float(inputs.odometer[1])
        before, self._odometer = self._odometer or odometer, odometer
        du, dv = self._turned(*self.pattern.to_pattern(odometer[0] - before[0], odometer[1] - before[1]), -cross.turn)
        cross.predict(du, dv, dt)
        along.predict(du)
        if math.hypot(du, dv) > MOST_SPEED_M_S * dt + JUMP_M:
            cross.doubt(dv)
            along.doubt(du)
        self._lines = lines = pattern_lines(inputs.lines.values(), self.pattern, cross.picture_turn)
        again = self.phase == "retouch"
        if self.phase == "paint" and inputs.in_contact:
            cross.lay(along.u)
        if again and inputs.in_contact:
            cross.lay_again(along.u)
        if inputs.time_s - self._looked >= LOOK_S and self.phase != "start":
            self._looked = inputs.time_s
            cross.look(lines, along.u, self._view_direction(), again)
            if along.known and (noticed := along.look(lines)):
                self.log.append((inputs.time_s, "edge", noticed))
        if self._across_line.update(lines, self._guides()) and self.phase != "start":
            line = self._across_line.line
            assert line is not None
            text = f"track {line.track.track_id} at {line.track.offset * 1e3:+.1f} mm"
            self.log.append((inputs.time_s, "guide", text))
        self._along_line.update(lines, self._upright_tracks())

    def _upright_tracks(self) -> tuple[int, ...]:
        """Tracks of the edge beside the place to which the tip moves; another one may leave the picture on the way."""
        if self.phase == "survey":
            return ()
        goal = self._stroke_goal() if self.phase in ("paint", "retouch") else self._stroke_begin()
        return (self._along.end,) if goal > 0.5 * self.config.stroke_m else (self._along.near,)

    def _guides(self) -> tuple[int, ...]:
        """Tracks of the edges along the strokes, best first; on the way to the wall and there, those that stay in view.

        Another one would hold the vehicle back: the view barrier keeps it in the picture.
        """
        cross, reach = self._cross, self.config.guide_reach_m
        if self.phase not in ("approach", "align", "press", "paint", "retouch", "climb"):
            return tuple(cross.guides)
        return tuple([track for track, v in cross.guides.items() if abs(v - self._v_target) < reach])

    def _view_direction(self) -> float:
        """Direction of travel along u: the last stroke's edge is in view there, not under the brush."""
        return self.pattern.travel(max(self.row, 1))

    @staticmethod
    def _turned(u: float, v: float, angle: float) -> tuple[float, float]:
        c, s = math.cos(angle), math.sin(angle)
        return c * u - s * v, s * u + c * v

    # ------------------------------------------------------------------ places

    def _stroke_begin(self) -> float:
        """Where the stroke in progress, or the first one, begins, u [m]."""
        return self._along.begin if self.pattern.travel(max(self.row, 1)) > 0.0 else self.config.stroke_m

    def _stroke_goal(self) -> float:
        """Where the stroke in progress ends, u [m].

        Half the error of its beginning is made up for there, and the paint that a gust laid before it, together at most
        `MOST_END_SHIFT_M`.
        """
        goal = self.config.stroke_m if self.pattern.travel(self.row) > 0.0 else self._along.begin
        error = self._along.began - self._stroke_begin()
        if abs(error) > MOST_BEGIN_ERROR_M:
            return goal
        shift = 0.5 * error - self.pattern.travel(self.row) * self._behind
        return goal + clipped(shift, -MOST_END_SHIFT_M, MOST_END_SHIFT_M)

    def _place(self, stroke: int) -> float:
        """Nominal v of a stroke [m]; the last one of a filling job keeps the margin to the board's other edge."""
        config = self.config
        nominal = config.edge_margin_m + (stroke - 1) * config.pitch_m
        if config.rows == FILL and not math.isnan(self._cross.far_edge):
            last = self._cross.far_edge - config.edge_margin_m
            return last if last < nominal + FILL_REST_M else nominal
        return nominal

    def _is_certain(self) -> bool:
        """Whether three standard deviations of the place fit into half the overlap, or into `least_certainty_m`."""
        return SIGMAS * self._cross.deviation < self._certain_m

    @property
    def _certain_m(self) -> float:
        """Half the overlap, or what is certain at any overlap [m]; a stroke that errs by twice as much leaves a gap."""
        return max(0.5 * self.config.overlap_m, self.config.least_certainty_m)

    # ---------------------------------------------------------------- movement

    def _move_to(self, u: float, v: float, dt: float) -> tuple[float, float]:
        """Move both references towards a place off the wall; returns their speeds [m/s]."""
        config, last = self.config, (self._u_reference, self._v_reference)
        self._u_reference = approached(last[0], u, config.survey_speed_m_s * dt)
        self._climb_to(v, dt)
        if dt <= 0.0:
            return 0.0, 0.0
        return (self._u_reference - last[0]) / dt, (self._v_reference - last[1]) / dt

    def _climb_to(self, v: float, dt: float) -> None:
        self._v_reference = approached(self._v_reference, v, self.config.climb_speed_m_s * dt)

    def _slid(self, now: float, target: float, dt: float) -> float:
        return approached(now, target, self.config.guide_slide_m_s * dt)

    # ------------------------------------------------------------------- lines

    def expected_edge(self) -> ExpectedEdge | None:
        """The painted edge to look for: the last stroke's outer one, ahead; for stroke 1 its own, behind the brush.

        Without `vision.paint_color`, perception finds edges of paint only where they are expected, and only an edge of
        the stroke being laid shows where the picture has the tip.
        """
        first = self.row == 1 and self.phase == "paint"
        if not first and (self.row < 2 or self.phase not in ("climb", "paint", "search")):
            return None
        pattern, cross = self.pattern, self._cross
        ahead, across = pattern.along, pattern.across
        travel = -pattern.travel(1) if first else pattern.travel(self.row)
        outer = 0.5 * self.config.brush_width_m + (0.0 if first else self._place(self.row - 1) - cross.v)
        place = outer - cross.tip_error
        sign = across[1] if pattern.guide_role == HORIZONTAL else across[0]
        direction = ahead[0] if pattern.guide_role == HORIZONTAL else ahead[1]
        return ExpectedEdge(role=pattern.guide_role, offset=place * sign, side=int(sign), ahead=int(travel * direction))

    # ----------------------------------------------------------------- command

    def _command(
        self,
        inputs: PainterInput,
        *,
        contact: bool,
        standoff: float = 0.0,
        guided: bool = True,
        hold: bool = False,
        along: float = 0.0,
        climb: float = 0.0,
        edge: bool = False,
    ) -> PaintingCommand:
        """Command of the tick.

        ``along`` and ``climb`` are speeds along u and v [m/s]; ``hold`` holds u at its reference, ``edge`` leads the
        tip there by the edge at the end of the stroke. Without a line in view, the odometer holds.
        """
        config, guides, u, v = self.config, [], along, climb
        if guided:
            error = self._v_reference - self._cross.v
            if (line := self._across_line.line) is not None:
                guides.append((line.track, self._across_line.offset(error)))
            else:
                v += self._held(error)
        if hold or edge:
            error = self._u_reference - self._along.u
            if (line := self._along_line.line) is not None:
                guides.append((line.track, self._along_line.offset(error)))
            elif hold:
                u += self._held(error)
        u, v = self._turned(u, v, self._cross.turn)
        travel = ZERO
        if contact and self._SLIDES:
            way = config.speed_m_s * self._view_direction()
            travel = np.array(self.pattern.to_wall(way, 0.0))
        velocity = np.array(self.pattern.to_wall(u, v))
        return PaintingCommand(contact, standoff, velocity, guides, config.push_n, ZERO, travel)

    def _held(self, error: float) -> float:
        """Speed that holds a place by the odometer [m/s]."""
        return clipped(self.config.hold_gain * error, -self.config.hold_speed_m_s, self.config.hold_speed_m_s)
