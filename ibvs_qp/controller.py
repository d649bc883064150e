"""HybridController: one quadratic program per tick for lines, push, level flight, yaw and six tilted rotors.

A tick validates its inputs, evaluates the set-points of the tasks (one compiled function that also fills the program),
solves the program with OSQP and reports the results of tasks and limits. The equations are in `ibvs_qp.tasks` and
`ibvs_qp.limits`, one file each; the program is assembled in `ibvs_qp.qp.problem`.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ibvs_qp.analytic import allocate_in_box, analytic_thrusts
from ibvs_qp.checked_law import CheckedLaw
from ibvs_qp.command import Command, Outcome
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.frames import ordered_product
from ibvs_qp.limits import ApproachLimit, Limit, PushCeiling, ThrustLimit, TiltLimit, ViewLimit, YawLimit
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.inputs import equations
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import (
    clipped_command,
    contact_mode,
    reach_margin,
    reach_note,
)
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.qp.accept import QpEngine
from ibvs_qp.qp.explain import active_limits, task_reports
from ibvs_qp.qp.infeasible import program_faults
from ibvs_qp.qp.problem import Program, ProgramData, QpProblem
from ibvs_qp.qp.solver import AcceptedSolution
from ibvs_qp.tasks import (
    EffortTask,
    HeightTask,
    LevelTask,
    LineTask,
    MarginTask,
    PaperLineTask,
    PushTask,
    SmoothnessTask,
    StandoffTask,
    Task,
    VelocityTask,
    YawTask,
)


def default_tasks(config: ControllerConfig) -> list[Task]:
    """The tasks of the program, in the order of their rows."""
    paper = config.line_profile == "paper"
    lines: list[Task] = [(PaperLineTask if paper else LineTask)(index) for index in range(config.line_slots)]
    along: list[Task] = [PushTask(), StandoffTask()]
    height: list[Task] = [] if paper else [HeightTask()]
    thrusts: list[Task] = [MarginTask(), EffortTask(), SmoothnessTask()]
    return [*lines, *along, LevelTask(), YawTask(), VelocityTask(), *height, *thrusts]


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
    return [ThrustLimit(), *(limit for enabled, limit in barriers if config.barriers and enabled)]


def qp_problem(
    config: ControllerConfig,
    tasks: Sequence[Task] = (),
    limits: Sequence[Limit] = (),
    kind: type[QpProblem] = QpProblem,
) -> QpProblem:
    """The program of a configuration: the shipped tasks and limits and further ones.

    Without further ones the equations are built once for all configurations that share them (`equations`).
    """
    if tasks or limits:
        return kind(Model(config), [*default_tasks(config), *tasks], [*default_limits(config), *limits])
    problem = copy.copy(_shipped_problem(kind, equations(config)))
    problem.model = problem.model.of(config)
    return problem


@functools.lru_cache(maxsize=8)
def _shipped_problem(kind: type[QpProblem], config: ControllerConfig) -> QpProblem:
    return kind(Model(config), default_tasks(config), default_limits(config))


class HybridController(CheckedLaw):
    """The drop-in controller: measurement and reference in, rotor thrusts and their explanation out.

    Attributes:
        problem_kind: Assembly of the rows.
        engine_kind: Their solution; a subclass may solve the same rows differently.

    Args:
        config: All settings; the default is for the Tarot T960.
        tasks: Tasks in addition to the shipped ones (docs/extending.md).
        limits: Further limits.

    Raises:
        ConfigError: When a row is not affine in the thrusts, two rows share a name, or the configuration is refused.
    """

    CONSTANTS = ("problem",)
    problem_kind: ClassVar[type[QpProblem]] = QpProblem
    engine_kind: ClassVar[type[QpEngine]] = QpEngine

    def __init__(
        self, config: ControllerConfig | None = None, *, tasks: Sequence[Task] = (), limits: Sequence[Limit] = ()
    ) -> None:
        super().__init__(config or ControllerConfig())
        self.problem = qp_problem(self.config, tasks, limits, self.problem_kind)
        self.setpoints = Setpoints(self.problem.model, self.problem.values)
        self.engine = self.engine_kind(self.problem, self.config.solver, ProgramData(self.problem, self.setpoints.step))
        self.reset()

    def reset(self) -> None:
        """Restore the state after construction, bit-identical."""
        super().reset()
        self.engine.reset()
        self._recovery = 0

    def program(self, measurement: Measurement | None = None, reference: Reference | None = None) -> Program:
        """The program of the last step, or of the next one with other inputs; no state changes.

        Args:
            measurement: Of the next step; None for the program of the last one.
            reference: Of the next step; None for `Reference()`.

        Raises:
            ConfigError: When the measurement is refused.
        """
        if measurement is None:
            return self.engine.data.program()
        gates = self.gate, self.references
        self.gate, self.references = copy.deepcopy(gates)
        try:
            with self.setpoints.without_trace():
                inputs = self.check(measurement, reference or Reference(), None)
                if inputs.measurement is None:
                    raise ConfigError(f"the measurement is refused: {'; '.join(inputs.rejected)}")
                self.setpoints.update(inputs.measurement, inputs.reference)
                return self.engine.data.program()
        finally:
            self.gate, self.references = gates

    def adjust(self, values: Mapping[str, Any]) -> None:
        """See `CheckedLaw.adjust`; a limit without rows in this program cannot be switched on."""
        for name, value in values.items():
            if value and str(name).endswith("_barrier") and name not in self.problem.switches:
                raise ConfigError(f"{name} = {value!r} is refused: the program has no rows of this limit")
        super().adjust(values)

    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        solution = self.engine.solve()
        if solution is None:
            self._recovery, rejected = self.config.solver.recovery_ticks, rejected + self._causes()
        elif self._recovery > 0:
            self._recovery, rejected = self._recovery - 1, (*rejected, "program: solved again, not yet for long")
        if solution is None or self._recovery > 0:
            free, outcome = analytic_thrusts(self.setpoints), Outcome.ANALYTIC_FALLBACK
            return clipped_command(self.setpoints, measurement, reference, free, outcome, rejected, allocate_in_box)
        if not self.config.thrust_rows:
            return clipped_command(self.setpoints, measurement, reference, solution.thrusts, solution.outcome, rejected)
        return self._explained(measurement, reference, solution, rejected)

    def _explained(
        self, measurement: Measurement, reference: Reference, solution: AcceptedSolution, rejected: tuple[str, ...]
    ) -> Command:
        thrusts, setpoints, data = solution.thrusts, self.setpoints, self.engine.data
        unallocated, limits, largest = np.zeros(6), (), 0.0
        if solution.limited:
            limits = active_limits(self.problem, solution.x, solution.y)
        if solution.limited or data.beyond_limits:
            unallocated = ordered_product(setpoints.effectiveness, data.free - thrusts)
            largest = max(map(abs, unallocated.tolist()))
        own = setpoints.note(thrusts, largest)
        return Command(
            stamp_ns=int(measurement.stamp_ns),
            thrusts=thrusts,
            wrench=setpoints.effectiveness.dot(thrusts),
            outcome=solution.outcome,
            mode=contact_mode(setpoints, reference),
            rejected=rejected + reach_note(setpoints, reference),
            tasks=task_reports(self.problem, data, own),
            active_limits=limits,
            unallocated_wrench=unallocated,
            reach_margin=reach_margin(setpoints),
            iterations=solution.iterations,
            solve_time_s=solution.seconds,
        )

    def _causes(self) -> tuple[str, ...]:
        """Reasons why no solver found a solution."""
        if self.engine.conflict:
            return (f"limits: no solution keeps all of {', '.join(self.engine.conflict)}",)
        faults = program_faults(self.problem, self.engine.data)
        return faults or ("program: no solver found a solution",)
