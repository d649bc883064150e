r"""Condensed program of a horizon: :math:`\min \tfrac12 U^T P U + q^T U` over the blocked thrust commands U."""

from __future__ import annotations

import casadi as ca
import numpy as np
from scipy import sparse

from sim.rivals.horizon import MpcSettings

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
