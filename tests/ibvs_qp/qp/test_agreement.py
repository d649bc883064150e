"""OSQP against DAQP on drawn programs; recorded flights are in tests/replay."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import pack, random_tick
from solver_checks import LIMITED_N, check_active, exact

from ibvs_qp.controller import HybridController
from ibvs_qp.qp.solver import ACTIVE_MULTIPLIER


@pytest.mark.parametrize("window", [(2.0, 30.0), (8.0, 13.0)])
def test_osqp_solves_programs_that_have_nothing_in_common_with_the_last_like_daqp(window: tuple[float, float]) -> None:
    controller, rng, worst = HybridController(), np.random.default_rng(5), 0.0
    for tick in range(200):
        pack(controller, *random_tick(rng, tick % 3, tick=tick), last=rng.uniform(2.0, 20.0, 6), window=window)
        solution = controller.engine.solve()
        x, y = exact(controller)
        assert solution is not None and solution.iterations > 0
        worst = max(worst, float(np.abs(solution.thrusts - x[:6]).max()))
        names = {controller.problem.row_names[row] for row in np.flatnonzero(np.abs(solution.y) > ACTIVE_MULTIPLIER)}
        check_active(names, controller, y)
        assert solution.limited == bool(names)
    print(f"window {window}: {worst:.1e} N")
    assert worst < LIMITED_N
