"""Solvers called directly solve the same program as the exact one."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.controller import HybridController
from sim.bench.direct import direct_solvers
from sim.bench.ticks import by_flight, recorded_ticks

#: Largest distance of a thrust to the exact one [N]: the default tolerance of an interior or proximal method.
CLOSE_N = 0.05


@pytest.mark.parametrize("name", ["daqp", "quadprog", "proxqp"])
def test_thrusts_are_those_of_the_exact_solver(name: str) -> None:
    if name not in direct_solvers():
        pytest.skip(f"{name} is not installed: the extra solvers")
    prepare, controller = direct_solvers()[name], HybridController()
    data, compared = controller.engine.data, 0
    for index, (measurement, reference) in enumerate(by_flight(controller, recorded_ticks(1000, seed=0))):
        controller.step(measurement, reference)
        if index % 100:
            continue
        exact = controller.engine.exact.solve(data.p, data.q, data.a, data.lower, data.upper)
        assert exact is not None
        np.testing.assert_allclose(prepare(data)()[:6], exact[0][:6], atol=CLOSE_N)
        compared += 1
    assert compared == 10
