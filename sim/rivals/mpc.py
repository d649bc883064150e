"""Predictive rival: a linear model with rotor lag over 0.3 s, solved anew at every tick."""

from __future__ import annotations

import casadi as ca
import numpy as np
from scipy import sparse

from ibvs_qp.analytic import PaperController, analytic_thrusts
from ibvs_qp.command import ActiveLimit, Command, Outcome
from ibvs_qp.config import ControllerConfig, SolverSettings
from ibvs_qp.controller import default_tasks
from ibvs_qp.measurement import Measurement, Reference
from ibvs_qp.model.model import Model
from ibvs_qp.model.reporting import clipped_command, contact_mode, reach_margin, reach_note
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.symbolic.function import BoundFunction
from sim.rivals.prediction import MpcSettings, Prediction
from sim.rivals.solver import BackedSolver

#: Terms of the exponential's series: for a rotor lag of 0.05 s and a coarse step of 0.03 s the rest is below 1e-6.
TERMS = 8


def transition(generator: ca.MX, step_s: float) -> ca.MX:
    """Exponential of generator times step, by Horner's scheme."""
    identity = ca.DM.eye(generator.shape[0])
    result = ca.MX(identity)
    for term in range(TERMS, 0, -1):
        result = identity + (step_s / term) * ca.mtimes(generator, result)
    return result


class CondensedProgram:
    """Prediction matrices, cost and rows of a horizon as one CasADi function.

    The function maps the values of `sim.rivals.prediction.Prediction`, the last command and the thrust window of this
    tick, and the box, to P (upper triangle), q, l, u. A holds the commands and their changes and never changes.

    Attributes:
        function: The function.
        generator, rows: Sparsity of the model and of the rows of its errors.
        p_pattern, a_pattern: Sparsity.
        a: Non-zeros of A.
    """

    def __init__(
        self,
        generator: ca.Sparsity,
        rows: ca.Sparsity,
        states: int,
        settings: MpcSettings,
        tick_s: float,
        rate: float,
    ) -> None:
        errors, joint = rows.shape
        self._states, self._rotors, self._settings = states, joint - states, settings
        self.generator, self.rows, rotors = generator, rows, self._rotors
        self._steps, moves = settings.steps(tick_s), len(settings.blocks)
        values = [ca.MX.sym("generator", generator.nnz()), ca.MX.sym("rows", rows.nnz()), ca.MX.sym("start", states)]
        offsets, weights, last = (
            ca.MX.sym("offsets", 3 * errors),
            ca.MX.sym("weights", errors),
            ca.MX.sym("last", rotors),
        )
        window = [ca.MX.sym(name, rotors) for name in ("low", "high", "floor", "ceiling")]
        free, forced = self.predict(
            ca.MX(generator, values[0]), values[2], ca.MX(rows, values[1]), ca.reshape(offsets, errors, 3)
        )
        scale = np.array(self._steps)
        scale[-1] *= settings.terminal
        weighting = ca.vertcat(*(float(duration) * weights for duration in scale))
        weighted = forced.T * ca.repmat(weighting.T, rotors * moves, 1)
        changes, first = self._changes()
        change = settings.thrust_change * settings.step_s
        hessian = ca.mtimes(weighted, forced) + change * ca.DM(changes.T @ changes)
        gradient = ca.mtimes(weighted, free) - change * ca.mtimes(ca.DM(changes.T @ first), last)
        norm = ca.mmax(ca.diag(hessian))
        lower, upper = self._bounds(last, window, rate)
        full = np.triu(np.ones((rotors * moves,) * 2))
        self.p_pattern = sparse.csc_matrix(full)
        matrix = np.vstack((np.eye(rotors * moves), changes[rotors:]))
        self.a_pattern = sparse.csc_matrix(matrix)
        self.a = self.a_pattern.data.copy()
        self.p_pattern.data[:] = self.a_pattern.data[:] = 1.0
        upper_triangle = ca.project(hessian / norm, ca.Sparsity.upper(rotors * moves)).nz[:]
        self.function = ca.Function(
            "horizon",
            [*values, offsets, weights, last, *window],
            [upper_triangle, gradient / norm, lower, upper],
        )

    def predict(self, generator: ca.MX, start: ca.MX, rows: ca.MX, offsets: ca.MX) -> tuple[ca.MX, ca.MX]:
        """Errors at the end of every step without commands, and their change per command.

        Returns:
            (steps * errors,) and (steps * errors, blocks * rotors).
        """
        states, rotors, blocks = self._states, self._rotors, self._settings.blocks
        of_state, of_command = rows[:, :states], rows[:, states:]
        exponentials = {step: transition(generator, step) for step in set(self._steps)}
        owner = np.repeat(np.arange(len(blocks)), blocks)
        state, effects, time = start, [ca.MX.zeros(states, rotors) for _ in blocks], 0.0
        free, forced = [], []
        for step, block in zip(self._steps, owner.tolist(), strict=True):
            whole = exponentials[step]
            over = whole[:states, :states]
            state = ca.mtimes(over, state) + whole[:states, -1]
            for index in range(block + 1):
                effects[index] = ca.mtimes(over, effects[index])
            effects[block] = effects[block] + whole[:states, states:-1]
            time += step
            free.append(ca.mtimes(of_state, state) + ca.mtimes(offsets, ca.DM([1.0, time, 0.5 * time**2])))
            parts = [ca.mtimes(of_state, effect) for effect in effects]
            parts[block] = parts[block] + of_command
            forced.append(ca.horzcat(*parts))
        return ca.vertcat(*free), ca.vertcat(*forced)

    def _changes(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the changes from command to command, and the entries of the last command in them."""
        moves, rotors = len(self._settings.blocks), self._rotors
        return (
            np.kron(np.eye(moves) - np.eye(moves, k=-1), np.eye(rotors)),
            np.kron(np.eye(moves)[:, :1], np.eye(rotors)),
        )

    def _bounds(self, last: ca.MX, window: list[ca.MX], rate: float) -> tuple[ca.MX, ca.MX]:
        """Bounds of the commands, the first within this tick's window, and of their changes at the rate limit."""
        low, high, floor, ceiling = window
        later = len(self._settings.blocks) - 1
        room = [
            rate * count * self._settings.step_s for count in self._settings.blocks[1:] for _ in range(self._rotors)
        ]
        return (
            ca.vertcat(low, ca.repmat(floor, later, 1), -ca.DM(room)),
            ca.vertcat(high, ca.repmat(ceiling, later, 1), ca.DM(room)),
        )


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
