"""How far the price of a limit holds, against the exact solver with the bound moved."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import CEILING
from scipy import sparse
from small_vehicle import SmallVehicle

from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.qp.exact import ExactSolver
from ibvs_qp.qp.explain import BoundRange, TickReplay, bound_ranges

VARIABLES, ROWS = 6, 9
#: Beside the end of a range, as a fraction of it: the set of active limits is looked at on both sides.
BESIDE = 1e-3


class Patterns:
    """Sparsity for the solver."""

    def __init__(self, p: np.ndarray, a: np.ndarray) -> None:
        self.p_pattern, self.a_pattern = sparse.csc_matrix(p), sparse.csc_matrix(a)


class Program:
    """A dense program and its exact solution."""

    def __init__(self, hessian: np.ndarray, q: np.ndarray, rows: np.ndarray, bounds: np.ndarray) -> None:
        self.hessian, self.q, self.rows, self.bounds = hessian, q, rows, bounds
        self._solver = ExactSolver(Patterns(np.triu(np.ones_like(hessian)), np.ones_like(rows)))

    def solve(self, row: int = 0, side: int = 0, change: float = 0.0) -> tuple[float, np.ndarray, np.ndarray] | None:
        """Cost, solution and multipliers with one bound moved; None without a solution."""
        lower, upper = self.bounds.copy()
        (lower, upper)[side][row] += change
        p = np.concatenate([self.hessian[: j + 1, j] for j in range(len(self.q))])
        found = self._solver.solve(p, self.q, self.rows.T.ravel(), lower, upper)
        if found is None:
            return None
        x, y = found.x, found.y
        return float(0.5 * x @ self.hessian @ x + self.q @ x), x, y

    def ranges(self) -> tuple[np.ndarray, dict[int, BoundRange]]:
        found = self.solve()
        assert found is not None
        _, x, y = found
        return y, bound_ranges(self.hessian, self.rows, self.bounds[0], self.bounds[1], x, y)


def random_program(seed: int) -> Program:
    """A program whose unlimited solution lies outside of several bounds, with two soft rows."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(VARIABLES, VARIABLES))
    hessian = np.diag(np.concatenate((np.ones(VARIABLES), [30.0, 300.0])))
    hessian[:VARIABLES, :VARIABLES] = root @ root.T + 0.05 * np.eye(VARIABLES)
    rows = np.zeros((ROWS, VARIABLES + 2))
    rows[:, :VARIABLES] = np.vstack((np.eye(VARIABLES), random.normal(size=(ROWS - VARIABLES, VARIABLES))))
    rows[-2, -2] = rows[-1, -1] = -1.0
    bounds = np.vstack((-random.uniform(0.2, 1.0, ROWS), random.uniform(0.2, 1.0, ROWS)))
    return Program(hessian, np.concatenate((random.normal(scale=3.0, size=VARIABLES), [0.0, 0.0])), rows, bounds)


@pytest.mark.parametrize("seed", range(8))
def test_the_same_limits_are_active_up_to_the_end_and_others_beyond(seed: int) -> None:
    program = random_program(seed)
    y, ranges = program.ranges()
    assert set(ranges) == set(np.flatnonzero(y)) and ranges
    for row, found in ranges.items():
        side = int(y[row] > 0.0)
        for end in (found.lower, found.upper):
            if not np.isfinite(end):
                continue
            inside, beyond = (program.solve(row, side, (1.0 + sign * BESIDE) * end) for sign in (-1.0, 1.0))
            assert inside is not None and (np.sign(inside[2]) == np.sign(y)).all()
            assert beyond is None or (np.sign(beyond[2]) != np.sign(y)).any()


@pytest.mark.parametrize("seed", range(8))
def test_the_cost_falls_by_what_is_stated_and_by_less_than_the_price_promises(seed: int) -> None:
    program = random_program(seed)
    y, ranges = program.ranges()
    at_first = program.solve()
    assert at_first is not None
    for row, found in ranges.items():
        side = int(y[row] > 0.0)
        change = found.upper if side else found.lower
        moved = program.solve(row, side, change)
        assert moved is not None
        assert found.fall == pytest.approx(at_first[0] - moved[0], rel=1e-6, abs=1e-9)
        assert 0.5 * abs(y[row] * change) <= found.fall * (1.0 + 1e-9) < abs(y[row] * change) * (1.0 + 1e-9)
        released = (1.0 + BESIDE) * change
        beyond = program.solve(row, side, released)
        assert beyond is not None and (beyond[2][found.end] == 0.0) == (y[found.end] != 0.0)


def test_rows_that_depend_on_each_other_have_no_range() -> None:
    one = np.ones(2)
    assert bound_ranges(np.eye(2), np.ones((2, 2)), -one, one, 0.5 * one, 2.0 * one) == {}


def test_a_weak_rotor_of_a_tick_is_released_where_the_explanation_says() -> None:
    """The bound of the recorded tick is moved in the program; the explanation is that of `ibvs-qp explain`."""
    controller, limit = HybridController(), np.full(6, CEILING)
    limit[3] = 9.0  # below hover: this rotor is missed
    vehicle = SmallVehicle(controller.config)
    for _ in range(20):
        command = controller.step(vehicle.measure(thrust_max=limit), Reference(standoff=0.1))
        vehicle.fly(command.thrusts)
    data, exact = controller.engine.data, controller.engine.exact
    found = TickReplay(controller.problem).explain(data.point)
    assert found is not None
    place = [each.name for each in found.active_limits].index(controller.problem.row_names[3])
    price, span = found.active_limits[place].price, found.limit_ranges[place]
    costs = []
    for change in (0.0, span.change_high, 1.01 * span.change_high):
        moved = data.upper.copy()
        moved[3] += change
        solution = exact.solve(data.p, data.q, data.a, data.lower, moved)
        assert solution is not None
        costs.append(0.5 * solution[0] @ data.hessian() @ solution[0] + data.q @ solution[0])
    assert span.until == "released" or span.until.startswith(tuple(controller.problem.row_names))
    assert span.cost_fall == pytest.approx(costs[0] - costs[1], rel=1e-4)
    assert span.cost_fall < 0.75 * price * span.change_high, "the price alone promises too much"
    if span.until == "released":
        assert solution[1][3] == 0.0 and costs[1] == pytest.approx(costs[2], abs=1e-9)
