"""Correction of a Kalman filter by one or two measured entries, written down once and compiled."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np


@functools.lru_cache(maxsize=8)
def correction(size: int, pattern: bytes) -> ca.Function:
    r"""Function of (chain, belief, entries, measured) yielding the belief after a correction.

    With k1, k2 the columns of the covariance P at the measured entries, W the inverse of the innovations' covariance
    and :math:`\delta` the innovations: :math:`[g_1\, g_2] = [k_1\, k_2] W`, :math:`P \leftarrow P - k_1 g_1^T -
    k_2 g_2^T`, symmetric to the bit, and the state moves by :math:`c = \delta_1 g_1 + \delta_2 g_2`.

    Args:
        size: n.
        pattern: Where the chain G may have entries, (n, n) bool row by row.

    The belief is P (n, n), the state (n,), and the sums of c, h G c and h^2 G^2 c over all corrections, (3, n). Entries
    are two rows of n numbers, a one where the measured entry is; a row of zeros measures nothing. Measured are
    (W11, W12, W22, innovation 1, innovation 2, tick h [s]).
    """
    chain, belief = ca.SX.sym("chain", size * size), ca.SX.sym("belief", size * (size + 4))
    entries, measured = ca.SX.sym("entries", 2 * size), ca.SX.sym("measured", 6)
    covariance, at = ca.reshape(belief[: size * size], size, size), size * size
    past, sums = belief[at : at + size], [belief[at + part * size : at + (part + 1) * size] for part in (1, 2, 3)]
    wa, wab, wb, da, db, tick = (measured[index] for index in range(6))
    first, second = ca.mtimes(covariance, entries[:size]), ca.mtimes(covariance, entries[size:])
    gain_a, gain_b = wa * first + wab * second, wab * first + wb * second
    known = ca.SX(size, size)
    for row, column in np.argwhere(np.frombuffer(pattern, bool).reshape(size, size)).tolist():
        known[row, column] = chain[row * size + column]
    moved = da * gain_a + db * gain_b
    once = tick * ca.mtimes(known, moved)
    twice = tick * ca.mtimes(known, once)
    left = covariance - (ca.mtimes(first, gain_a.T) + ca.mtimes(second, gain_b.T))
    left = ca.reshape(ca.densify(ca.triu2symm(ca.triu(left))), size * size, 1)
    grown = [ca.densify(total + part) for total, part in zip(sums, (moved, once, twice), strict=True)]
    return ca.Function("correction", [chain, belief, entries, measured], [ca.vertcat(left, past + moved, *grown)])
