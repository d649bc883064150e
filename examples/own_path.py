"""A path of your own: an L, a row to the left along the board's lower edge, then a column up along its left edge.

Fly it: ``ibvs-qp paint --strategy examples/own_path.py:OwnPath``. Edges in view lead, otherwise the odometer.
"""

import numpy as np

from ibvs_qp import PainterInput, PaintingCommand, Strategy

COLUMN_M, GATE_M = 0.25, 0.15  # length of the column; largest distance of an edge from its expected place
STEP_M, GAIN, HOLD = 0.02, 0.8, 0.05  # largest step of an edge's target; odometer to speed [1/s], at most [m/s]
BRAKE, CREEP = 0.12, 0.005  # acceleration along a leg [m/s^2]; its least speed [m/s]


class OwnPath(Strategy):
    """Begins in front of the lower right corner. Vectors are (right, down) [m], as those of the odometer."""

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        margin, width = self.config.edge_margin_m, self.config.stroke_m + 2.0 * self.config.edge_margin_m
        self.goals = np.array([(width - margin, -margin), (margin, -margin), (margin, -margin - COLUMN_M)])
        self.legs = [(leg[0], leg[1]) for leg in np.diff(self.goals, axis=0)]  # vectors, for the simulator's truth
        self.edges = ((0, "vertical", -1, width), (0, "vertical", 1, 0.0), (1, "horizontal", -1, 0.0))
        self.corner = np.full(2, np.nan)  # the board's lower left corner by the odometer

    def step(self, inputs: PainterInput) -> PaintingCommand:
        """Targets of one tick, from lines, odometer, wall and contact."""
        job, place, lines = self.config, np.array(inputs.odometer), {}
        self.corner = np.where(np.isnan(self.corner), place - self.goals[0], self.corner)
        for axis, role, side, at in self.edges:
            for line in inputs.lines.values():
                corner = place[axis] + line.offset - at
                board = (line.role, line.surface_side) == (role, side) and line.kind != "paint" and line.weight > 0.5
                if board and abs(corner - self.corner[axis]) < GATE_M:
                    self.corner[axis], lines[axis] = corner, line
        error, leg = self.corner + self.goals[self.row] - place, self.row - 1  # the leg's axis is its number
        reached = self.phase == "paint" and abs(error[leg]) < job.stop_error_m
        if self.phase == "start" and inputs.wall_known and inputs.tared and 1 in lines:
            self.enter(inputs, "approach", "lower edge in view")
        elif self.phase == "approach" and abs(inputs.distance - job.standoff_m) < 0.01:
            if np.abs(error).max() < job.align_error_m and np.linalg.norm(inputs.velocity) < job.align_speed_m_s:
                self.enter(inputs, "press", f"{1e3 * np.linalg.norm(error):.1f} mm from the beginning")
        elif reached and self.row == 2:
            return self.leave(inputs, "L painted")
        elif reached or (self.phase == "press" and inputs.time_since_touch > job.press_time_s):
            self.row += 1
            self.enter(inputs, "paint", f"leg {self.row}")
        velocity = np.clip(GAIN * error, -HOLD, HOLD) * [axis not in lines for axis in (0, 1)]
        guides = [(line, line.offset - np.clip(error[axis], -STEP_M, STEP_M)) for axis, line in lines.items()]
        if self.phase == "paint" and not reached:  # along the leg by speed, across it by the edge
            guides = [guide for guide in guides if guide[0] is not lines.get(leg)]
            ramps = BRAKE * (inputs.time_s - self.entered), np.sqrt(2.0 * BRAKE * abs(error[leg]))
            velocity[leg] = np.sign(error[leg]) * min(job.speed_m_s, CREEP + min(ramps))
        contact, standoff = self.phase in ("press", "paint"), job.retreat_m if self.phase == "start" else job.standoff_m
        return PaintingCommand(contact, standoff, velocity, guides if self.phase != "start" else [], job.push_n)
