"""HybridController: one quadratic program per tick for lines, push, level flight, yaw and six tilted rotors."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.command import ActiveLimit, Command, Outcome, TaskReport
from ibvs_qp.config import ControllerConfig
from ibvs_qp.gate import MeasurementGate, answered_stamp, check_reference
from ibvs_qp.hold import hold_thrusts
from ibvs_qp.limits import Limit, ThrustLimit, TiltLimit, YawLimit
from ibvs_qp.limits.thrust import thrust_window
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.qp.acceptance import AcceptedSolution, QpEngine
from ibvs_qp.qp.assembly import QpTemplate
from ibvs_qp.qp.model import SymbolicModel
from ibvs_qp.setpoints import Setpoints
from ibvs_qp.tasks import (
    EffortTask,
    LevelTask,
    LineTask,
    PushTask,
    SmoothnessTask,
    StandoffTask,
    Task,
    VelocityTask,
    YawTask,
)

#: A multiplier above this price counts as an active limit [cost per unit].
ACTIVE_PRICE = 1e-3


def default_tasks(config: ControllerConfig) -> list[Task]:
    """The tasks of the program, in the order of their rows."""
    lines: list[Task] = [LineTask(slot) for slot in range(config.line_slots)]
    return [*lines, PushTask(), StandoffTask(), LevelTask(), YawTask(), VelocityTask(), EffortTask(), SmoothnessTask()]


def default_limits(config: ControllerConfig) -> list[Limit]:
    """The limits of the program; thrust first, its rows are the thrusts themselves."""
    return [ThrustLimit(), *([TiltLimit(), YawLimit()] if config.barriers else [])]


class HybridController:
    """The drop-in controller: measurement and reference in, rotor thrusts and their explanation out."""

    def __init__(self, config: ControllerConfig | None = None) -> None:
        self.config = config or ControllerConfig()
        model = SymbolicModel(self.config)
        self.template = QpTemplate(model, default_tasks(self.config), default_limits(self.config))
        self.engine = QpEngine(self.template, self.config.solver)
        self.setpoints = Setpoints(self.config)
        vehicle = self.config.vehicle
        self._gate = MeasurementGate(vehicle.geometry.count)
        self._floor, self._ceiling = vehicle.thrust_min, vehicle.thrust_max
        self._step = vehicle.thrust_rate_n_s * self.config.tick_s
        self.reset()

    def reset(self) -> None:
        """As after construction, to the bit."""
        self.engine.reset()
        self.setpoints.reset()
        self._gate.reset()
        self._last: np.ndarray | None = None
        self._change = np.zeros(self.config.vehicle.geometry.count)
        self._reference = Reference()
        self._good: Measurement | None = None

    def step(self, measurement: Measurement, reference: Reference) -> Command:
        """Thrusts for one tick; never raises, never leaves the limits.

        Args:
            measurement: What is known now; fields that fail the checks are named in ``Command.rejected``.
            reference: What shall be done.

        Returns:
            The command with its explanation.
        """
        checked, rejected = self._gate.check(measurement)
        reference, refused = check_reference(reference, self._reference)
        self._reference = reference
        rejected += refused
        if checked is None:
            return self._hold(measurement, rejected)
        if self._gate.restarted:
            self.setpoints.reset()
        self._good = checked
        self.setpoints.update(checked, reference)
        last = self._last if self._last is not None else hold_thrusts(self.config, checked)
        step = self._step if self._last is not None else math.inf
        lower, upper = thrust_window(last, *self._limits(checked), step, self._floor, self._ceiling)
        self._pack(last, lower, upper)
        solution = self.engine.solve()
        if solution is None:
            return self._fallback(checked, last, lower, upper, rejected)
        return self._finish(checked, solution, rejected)

    def _limits(self, measurement: Measurement) -> tuple[np.ndarray, np.ndarray]:
        low = self._floor if measurement.thrust_min is None else np.maximum(measurement.thrust_min, self._floor)
        high = self._ceiling if measurement.thrust_max is None else np.minimum(measurement.thrust_max, self._ceiling)
        return low, np.maximum(high, low)

    def _pack(self, last: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
        values, terms, weights = self.engine.evaluator.parameters, self.setpoints, self.config.weights
        gains = self.config.gains
        values["bias_wrench"][:] = terms.bias_wrench
        values["normal"][:] = terms.normal
        values["axis_right"][:] = terms.right
        values["axis_down"][:] = terms.down
        values["last_thrust"][:] = last
        values["extrapolated_thrust"][:] = np.minimum(np.maximum(last + self._change, lower), upper)
        values["thrust_lower"][:] = lower
        values["thrust_upper"][:] = upper
        share = terms.contact_weight
        values["turn_share"][:] = 1.0 - share * (1.0 - gains.line_turn_share)
        values["push"][:] = terms.push_command, weights.push * share
        values["standoff"][:] = terms.standoff_command, weights.push * (1.0 - share)
        values["level"][:] = terms.angular[0], terms.angular[1], weights.level
        values["yaw"][:] = terms.angular[2], weights.yaw
        values["velocity_right"][:] = terms.velocity_command[0], weights.velocity * terms.free_right
        values["velocity_down"][:] = terms.velocity_command[1], weights.velocity * terms.free_down
        if self.config.barriers:
            rates = self._good.angular_velocity if self._good is not None else np.zeros(3)
            values["tilt_state"][:] = terms.roll, terms.pitch, rates[0], rates[1]
            values["yaw_state"][:] = terms.yaw, rates[2]
        values["plane"][:] = terms.plane[:3] if terms.contact.known else (0.0, 0.0, 1.0)
        for slot in range(self.config.line_slots):
            place = values[f"line_{slot}"]
            if slot >= len(terms.lines):
                place[6:] = 0.0
                continue
            line = terms.lines[slot]
            wanted = -(gains.line_kp * line.error + gains.line_kd * line.error_rate + gains.line_ki * line.integral)
            angle = -(gains.theta_kp * line.angle_error + gains.theta_kd * line.angle_rate)
            place[:] = (
                line.rho,
                line.theta,
                line.tip_x,
                line.tip_y,
                wanted,
                angle,
                weights.line * line.weight,
                weights.line_angle * line.weight,
            )

    def _finish(self, measurement: Measurement, solution: AcceptedSolution, rejected: tuple[str, ...]) -> Command:
        n = len(solution.thrusts)
        thrusts = solution.thrusts
        # What the box of each rotor cost: its multiplier moves the free optimum by P^-1 y.
        unallocated = self._unallocated(solution.y[:n])
        self._commit(thrusts, unallocated)
        stacked = self.engine.evaluator.stacked.copy()
        command = Command(
            stamp_ns=int(measurement.stamp_ns),
            thrusts=thrusts,
            wrench=self.setpoints.effectiveness @ thrusts,
            outcome=solution.outcome,
            mode=self._mode(),
            rejected=rejected,
            active_limits=self._active_limits(solution),
            unallocated_wrench=unallocated,
            reach_margin=self.setpoints.reach - max(self.setpoints.contact.push, 0.0),
            iterations=solution.iterations,
            solve_time_s=solution.seconds,
        )
        return command.explained_by(lambda: self._task_reports(stacked, thrusts))

    def _unallocated(self, multipliers: np.ndarray) -> np.ndarray:
        n, y = len(multipliers), multipliers
        if float(np.abs(y).max()) < ACTIVE_PRICE:
            return np.zeros(6)
        data = self.engine.evaluator
        hessian = self.template.p_pattern.copy()
        hessian.data = data.p.copy()
        block = hessian.toarray()[:n, :n]
        block = block + np.triu(block, 1).T
        return self.setpoints.effectiveness @ np.linalg.solve(block, y)

    def _task_reports(self, stacked: np.ndarray, thrusts: np.ndarray) -> tuple[TaskReport, ...]:
        achieved, asked, weights = self.engine.evaluator.report(stacked, thrusts)
        return tuple(
            TaskReport(
                name=row.name,
                unit=row.unit,
                weight=float(weights[i]),
                asked=float(asked[i]),
                achieved=float(achieved[i]),
                residual=float(achieved[i] - asked[i]),
            )
            for i, row in enumerate(self.template.task_rows)
            if weights[i] > 0.0
        )

    def _active_limits(self, solution: AcceptedSolution) -> tuple[ActiveLimit, ...]:
        active = []
        for i in np.flatnonzero(np.abs(solution.y) > ACTIVE_PRICE):
            slot = self.template.row_slack[i]
            active.append(
                ActiveLimit(
                    name=self.template.row_names[i],
                    side="upper" if solution.y[i] > 0 else "lower",
                    price=abs(float(solution.y[i])),
                    slack=abs(float(solution.x[slot])) if slot >= 0 else 0.0,
                    unit=self.template.row_units[i],
                )
            )
        return tuple(active)

    def _mode(self) -> str:
        if self.setpoints.contact.in_contact:
            return "contact"
        return "approach" if self._reference.contact else "free"

    def _commit(self, thrusts: np.ndarray, unallocated: np.ndarray) -> None:
        self._change = thrusts - self._last if self._last is not None else np.zeros(len(thrusts))
        self._last = thrusts
        self.setpoints.note(thrusts, unallocated)

    def _fallback(
        self,
        measurement: Measurement,
        last: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        rejected: tuple[str, ...],
    ) -> Command:
        """The analytic law answers when no solver did."""
        from ibvs_qp.analytic import analytic_thrusts

        free = analytic_thrusts(self.setpoints)
        good = bool(np.isfinite(free).all())
        thrusts = np.clip(free if good else hold_thrusts(self.config, measurement), lower, upper)
        outcome = Outcome.ANALYTIC_FALLBACK if good else Outcome.HOLD
        return self._plain(int(measurement.stamp_ns), thrusts, free if good else thrusts, outcome, rejected)

    def _hold(self, measurement: Measurement, rejected: tuple[str, ...]) -> Command:
        wanted = hold_thrusts(self.config, self._gate.inertial)
        lower, upper = (
            thrust_window(self._last, self._floor, self._ceiling, self._step, self._floor, self._ceiling)
            if self._last is not None
            else (self._floor, self._ceiling)
        )
        thrusts = np.clip(wanted, lower, upper)
        return self._plain(answered_stamp(measurement), thrusts, wanted, Outcome.HOLD, rejected)

    def _plain(
        self, stamp_ns: int, thrusts: np.ndarray, free: np.ndarray, outcome: Outcome, rejected: tuple[str, ...]
    ) -> Command:
        effectiveness = self.setpoints.effectiveness
        unallocated = effectiveness @ (free - thrusts)
        self._commit(thrusts, unallocated)
        return Command(
            stamp_ns=stamp_ns,
            thrusts=thrusts,
            wrench=effectiveness @ thrusts,
            outcome=outcome,
            mode="hold" if outcome is Outcome.HOLD else self._mode(),
            rejected=rejected,
            unallocated_wrench=unallocated,
            reach_margin=math.nan,
        )
