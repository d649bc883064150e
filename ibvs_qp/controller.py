"""HybridController: one quadratic program per tick for lines, push, level flight, yaw and six tilted rotors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.limits import ApproachLimit, Limit, PushCeiling, ThrustLimit, TiltLimit, ViewLimit, YawLimit
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import clipped_command, contact_mode, reach_margin, reach_note
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.qp.accept import AcceptedSolution, QpEngine
from ibvs_qp.qp.evaluator import ProgramData
from ibvs_qp.qp.explain import active_limits, task_reports
from ibvs_qp.qp.infeasible import program_faults
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.safety.hover import hold_thrusts
from ibvs_qp.tasks import (
    EffortTask,
    HeightTask,
    LevelTask,
    LineTask,
    PaperLineTask,
    PushTask,
    SmoothnessTask,
    StandoffTask,
    Task,
    VelocityTask,
    YawTask,
)
from ibvs_qp.validation.measurement import MeasurementGate, answered_stamp
from ibvs_qp.validation.reference import check_reference

#: Wrench given up by a tick that no limit touches; shared by all of them.
_NOTHING = np.zeros(6)
_NOTHING.flags.writeable = False


def default_tasks(config: ControllerConfig) -> list[Task]:
    """The tasks of the program, in the order of their rows."""
    paper = config.line_profile == "paper"
    lines: list[Task] = [(PaperLineTask if paper else LineTask)(index) for index in range(config.line_slots)]
    along: list[Task] = [PushTask(), StandoffTask()]
    height: list[Task] = [] if paper else [HeightTask()]
    return [*lines, *along, LevelTask(), YawTask(), VelocityTask(), *height, EffortTask(), SmoothnessTask()]


def default_limits(config: ControllerConfig) -> list[Limit]:
    """The limits of the program; thrust first, its rows are the thrusts themselves."""
    settings = config.limits
    barriers: list[tuple[bool, Limit]] = [
        (settings.tilt_barrier, TiltLimit()),
        (settings.yaw_barrier, YawLimit()),
        (settings.view_barrier, ViewLimit()),
        (settings.push_barrier, PushCeiling()),
        (settings.approach_barrier, ApproachLimit()),
    ]
    return [ThrustLimit(), *(limit for wanted, limit in barriers if config.barriers and wanted)]


def qp_problem(config: ControllerConfig, tasks: Sequence[Task] = (), limits: Sequence[Limit] = ()) -> QpProblem:
    """The program of a configuration: shipped tasks and limits and further ones, assembled."""
    return QpProblem(Model(config), [*default_tasks(config), *tasks], [*default_limits(config), *limits])


class HybridController:
    """The drop-in controller: measurement and reference in, rotor thrusts and their explanation out.

    Args:
        config: Everything it needs; the default flies the Tarot T960.
        tasks: Further tasks beside the shipped ones (docs/extending.md).
        limits: Further limits.

    Raises:
        ConfigError: When a row is not affine in the thrusts, two rows share a name, or the configuration is refused.
    """

    def __init__(
        self, config: ControllerConfig | None = None, *, tasks: Sequence[Task] = (), limits: Sequence[Limit] = ()
    ) -> None:
        self.config = config or ControllerConfig()
        self.problem = qp_problem(self.config, tasks, limits)
        self.setpoints = Setpoints(self.problem.model, self.problem.values)
        data = ProgramData(self.problem, self.setpoints.step)
        self.engine = QpEngine(self.problem, self.config.solver, data)
        self._gate = MeasurementGate(self.config.vehicle.geometry.count)
        self.reset()

    def reset(self) -> None:
        """As after construction, to the bit."""
        self.engine.reset()
        self.setpoints.reset()
        self._gate.reset()
        self._reference = Reference()

    def step(self, measurement: Measurement, reference: Reference, contact: ContactState | None = None) -> Command:
        """Thrusts for one tick; never raises, never leaves the limits.

        Args:
            measurement: State of the vehicle; fields that fail the checks are named in ``Command.rejected``.
            reference: Targets.
            contact: Wall and contact if the caller estimates them (`Pilot` does); None estimates them here from the
                measurement.

        Returns:
            The command with its explanation.
        """
        checked, rejected = self._gate.check(measurement)
        reference, refused = check_reference(reference, self._reference)
        self._reference = reference
        rejected += refused
        if len(reference.lines) > self.config.line_slots:
            rejected += (
                f"reference.lines: {len(reference.lines)} given, room for line_slots = {self.config.line_slots}",
            )
        if checked is None:
            return self._hold(measurement, rejected)
        if self._gate.restarted:
            self.setpoints.restart()
        self.setpoints.update(checked, reference, contact)
        solution = self.engine.solve()
        if solution is None:
            return self._fallback(checked, rejected)
        if not self.config.thrust_rows:
            mode = contact_mode(self.setpoints, self._reference)
            return clipped_command(
                self.setpoints, int(checked.stamp_ns), solution.thrusts, solution.outcome, mode, rejected
            )
        return self._finish(checked, solution, rejected)

    def _finish(self, measurement: Measurement, solution: AcceptedSolution, rejected: tuple[str, ...]) -> Command:
        thrusts, setpoints, data = solution.thrusts, self.setpoints, self.engine.data
        unallocated, given_up, limits = _NOTHING, 0.0, ()
        if solution.limited:
            unallocated = setpoints.effectiveness.dot(data.free - thrusts)
            given_up = max(map(abs, unallocated.tolist()))
            limits = active_limits(self.problem, solution.x, solution.y)
        tasks = task_reports(self.problem, data, thrusts)
        setpoints.note(thrusts, given_up)
        return Command(
            stamp_ns=int(measurement.stamp_ns),
            thrusts=thrusts,
            wrench=setpoints.effectiveness.dot(thrusts),
            outcome=solution.outcome,
            mode=contact_mode(setpoints, self._reference),
            rejected=rejected + reach_note(setpoints, self._reference),
            tasks=tasks,
            active_limits=limits,
            unallocated_wrench=unallocated,
            reach_margin=reach_margin(setpoints),
            iterations=solution.iterations,
            solve_time_s=solution.seconds,
        )

    def _fallback(self, measurement: Measurement, rejected: tuple[str, ...]) -> Command:
        """The analytic law answers when no solver did."""
        from ibvs_qp.analytic import analytic_thrusts

        free, outcome = analytic_thrusts(self.setpoints), Outcome.ANALYTIC_FALLBACK
        mode = contact_mode(self.setpoints, self._reference)
        if self.engine.conflict:
            rejected += (f"limits: no solution keeps all of {', '.join(self.engine.conflict)}",)
        else:
            faults = program_faults(self.problem, self.engine.data)
            rejected += faults or ("program: no solver found a solution",)
        if not np.isfinite(free).all():
            free, outcome, mode = hold_thrusts(self.config, measurement), Outcome.HOLD, "hold"
        return clipped_command(self.setpoints, int(measurement.stamp_ns), free, outcome, mode, rejected)

    def _hold(self, measurement: Measurement, rejected: tuple[str, ...]) -> Command:
        free = hold_thrusts(self.config, self._gate.inertial)
        self.setpoints.pause()
        return clipped_command(self.setpoints, answered_stamp(measurement), free, Outcome.HOLD, "hold", rejected)
