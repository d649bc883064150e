"""Predictive rival: a linear model with rotor lag over 0.3 s, solved anew at every tick."""

from __future__ import annotations

import numpy as np

from ibvs_qp.analytic import PaperController, analytic_thrusts
from ibvs_qp.command import ActiveLimit, Command, Outcome
from ibvs_qp.config import ControllerConfig, SolverSettings
from ibvs_qp.controller import default_tasks
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import clipped_command, contact_mode, reach_margin, reach_note
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.symbolic.function import BoundFunction
from sim.rivals.condensed import CondensedProgram
from sim.rivals.horizon import MpcSettings
from sim.rivals.prediction import Prediction
from sim.rivals.solver import BackedSolver

#: OSQP for the horizon. While pressing 35 N the first command differs from the exact one by at most 0.28 N with a
#: tolerance of 1e-4 and by 0.005 N with 1e-6, which takes 130 iterations in the median instead of 50.
SOLVER = SolverSettings(tolerance=1e-5, max_iterations=2000, check_interval=10, adaptive_rho_interval=50)
#: A first command this close to a bound of its window counts as limited [N].
AT_BOUND = 1e-3


class MpcController(PaperController):
    """Model-predictive control with the inputs, estimates, references and thrust limits of the shipped law.

    Attributes:
        program: The condensed program.
        values: Its P (upper triangle), q, l, u of the last tick.

    Args:
        config: Configuration of the controller; weights and limits of the one-tick program have no effect.
        settings: Grid and weights of the horizon.
    """

    def __init__(self, config: ControllerConfig | None = None, settings: MpcSettings | None = None) -> None:
        self.settings = settings or MpcSettings()
        super().__init__(config)

    def _make_setpoints(self) -> Setpoints:
        """The shipped set-points, with the prediction's values added."""
        config, model = self.config, Model(self.config)
        rows = [row for task in default_tasks(config) for row in task.rows(model)]
        # Without the filter of its row: that starts at a command which serves the lines, too.
        forces = {row.name: row.target for row in rows} | {"standoff": model.signals.outputs["standoff_command"]}
        prediction = Prediction(model, self.settings, forces)
        setpoints = Setpoints(model, prediction.values())
        values, inputs, step = setpoints.step.extra, setpoints.step.inputs, config.vehicle.thrust_rate_n_s
        patterns = prediction.generator.sparsity(), prediction.rows.sparsity()
        program = CondensedProgram(*patterns, prediction.states, self.settings, config.tick_s, step)
        function = program.function  # its matrix products are faster in CasADi than in the C code it writes
        arguments = [
            *values,
            inputs["thrust_last"],
            setpoints.lower,
            setpoints.upper,
            inputs["thrust_low"],
            inputs["thrust_high"],
        ]
        self.values = [np.zeros(function.numel_out(index)) for index in range(function.n_out())]
        self._condense = BoundFunction(function, arguments, self.values)
        self.program = program
        self._solver = BackedSolver(program.p_pattern, program.a_pattern, SOLVER)
        return setpoints

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._solver.solver.reset()

    def _command(self, measurement: Measurement, reference: Reference, rejected: tuple[str, ...]) -> Command:
        setpoints, solver = self.setpoints, self._solver
        rejected += reach_note(setpoints, reference)
        self._condense()
        p, q, lower, upper = self.values
        found = solver.solve(p, q, self.program.a, lower, upper)
        if found is None:
            free = analytic_thrusts(setpoints)
            return clipped_command(setpoints, measurement, reference, free, Outcome.ANALYTIC_FALLBACK, rejected)
        thrusts = np.clip(found[0][: len(setpoints.lower)], setpoints.lower, setpoints.upper)
        limits = self._limits(thrusts, found[1])
        unallocated = setpoints.effectiveness @ (self._unlimited() - thrusts) if limits else np.zeros(6)
        setpoints.note(thrusts, float(np.abs(unallocated).max()))
        return Command(
            stamp_ns=int(measurement.stamp_ns),
            thrusts=thrusts,
            wrench=setpoints.effectiveness @ thrusts,
            outcome=solver.outcome,
            mode=contact_mode(setpoints, reference),
            rejected=rejected,
            active_limits=limits,
            unallocated_wrench=unallocated,
            reach_margin=reach_margin(setpoints),
            iterations=solver.iterations,
            solve_time_s=solver.seconds,
        )

    def _limits(self, thrusts: np.ndarray, multipliers: np.ndarray) -> tuple[ActiveLimit, ...]:
        """Rotors whose first command is at a bound of its window; prices are of the scaled cost."""
        low, high = self.setpoints.lower + AT_BOUND, self.setpoints.upper - AT_BOUND
        names = self.config.vehicle.geometry.names
        return tuple(
            ActiveLimit(
                name=f"thrust_{names[i]}",
                side="upper" if thrusts[i] > high[i] else "lower",
                price=abs(float(multipliers[i])),
                slack=0.0,
                unit="N",
            )
            for i in np.flatnonzero((thrusts < low) | (thrusts > high))
        )

    def _unlimited(self) -> np.ndarray:
        """First command of the same horizon without limits [N], (n,)."""
        p, q, *_ = self.values
        triangle = self.program.p_pattern.copy()
        triangle.data = p.copy()
        full = triangle.toarray()
        return np.linalg.solve(full + np.triu(full, 1).T, -q)[: len(self.setpoints.lower)]
