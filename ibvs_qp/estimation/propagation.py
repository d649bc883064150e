"""How the covariance of an integrator chain grows, as one compiled function that knows where the chain is empty."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np


@functools.lru_cache(maxsize=8)
def propagation(size: int, pattern: bytes) -> ca.Function:
    r"""Function of (chain, covariance, noise, time) yielding the covariance after that time.

    With :math:`\Phi = I + t G + \tfrac12 t^2 G^2` it is :math:`\Phi P \Phi^T + t\,Q`, its lower half a copy of the
    upper one.

    Args:
        size: n; chain G and covariance P are (n, n) row by row, the diagonal of the noise Q is (n,) [unit^2/s], and
            time is in seconds.
        pattern: Where the chain may have entries, (n, n) bool row by row.
    """
    chain, covariance = ca.SX.sym("chain", size * size), ca.SX.sym("covariance", size * size)
    noise, time = ca.SX.sym("noise", size), ca.SX.sym("time")
    known = ca.SX(size, size)
    for row, column in np.argwhere(np.frombuffer(pattern, bool).reshape(size, size)).tolist():
        known[row, column] = chain[row * size + column]
    step = ca.SX.eye(size) + time * known + (0.5 * time * time) * ca.mtimes(known, known)
    moved = ca.mtimes(ca.mtimes(step, ca.reshape(covariance, size, size)), step.T) + ca.diag(time * noise)
    return ca.Function("propagation", [chain, covariance, noise, time], [ca.densify(ca.triu2symm(ca.triu(moved)))])
