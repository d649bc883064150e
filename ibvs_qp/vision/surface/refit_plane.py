"""The surface refitted around a plane: two rounds of least squares on one grid, each within a gate."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.kernels.plane import choose_samples, fit_plane, residual_squares
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.robust import MAD_TO_SIGMA, median
from ibvs_qp.vision.surface.estimate import PlaneEstimate, connected_samples, plane_covariance, surface_problem

#: Samples used to judge the spread of residuals; more cost time and change nothing.
_JUDGED = 400
_NO_LABELS = np.empty(0, np.uint8)


class PlaneRefit:
    """Refits on one grid.

    Args:
        config: Settings.
        grid: Where the samples lie.
        design: Columns x, y, 1 of the samples, normalised, (rows * columns, 3).
        least: Fewest samples of a surface.
        block: Side of the blocks over which residuals are averaged to measure their correlation [samples].
        paint_gates: Gate of what looks like paint in either round, share of the board's.
    """

    def __init__(
        self,
        config: PlaneConfig,
        grid: CoarseGrid,
        design: np.ndarray,
        *,
        least: int,
        block: int,
        paint_gates: tuple[float, float],
    ) -> None:
        self._config, self._grid, self._design = config, grid, np.ascontiguousarray(design)
        self._least, self._block, self._paint_gates = least, block, paint_gates

    def refit(
        self,
        inverse: np.ndarray,
        labels: np.ndarray | None,
        start: np.ndarray,
        down: np.ndarray | None,
        *,
        sigma: float | None = None,
        seed: tuple[int, int] | None = None,
    ) -> PlaneEstimate | str:
        """Refit the surface.

        Args:
            inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
            labels: Colour labels of the samples, uint8 (rows, columns), or None.
            start: (a, b, c) to start from, (3,).
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            sigma: Spread of the residuals that sets the last gate, share of depth; None measures it in each round.
            seed: The surface is the part around this sample; None takes the largest.

        Returns:
            The surface, or the reason why there is none.
        """
        config, grid, searched = self._config, self._grid, sigma is None
        flat = np.ascontiguousarray(inverse, float).reshape(-1)
        colors = _NO_LABELS if labels is None else np.ascontiguousarray(labels).reshape(-1)
        usable = (flat > 0.0) & grid.free.reshape(-1)
        seen = int(np.count_nonzero(usable))
        if seen < self._least:
            return "too few valid depth samples"
        plane, gate, spread = np.array(start, float), config.coarse_gate, sigma or 0.0
        normal_matrix_inverse, component, count = np.empty((3, 3)), grid.free, 0
        for last in (False, True):
            relative, near = choose_samples(
                self._design, flat, usable, colors, plane, searched, gate, self._paint_gates[last], self._least
            )
            if last and not searched:  # before the last gate, which would make the spread look smaller
                spread = MAD_TO_SIGMA * median(np.abs(relative[component.reshape(-1)]))
            component = near.reshape(grid.shape)
            if last or searched:
                component = connected_samples(component, grid, seed)
            count = int(np.count_nonzero(component))
            if count < self._least:
                noise = depth_noise(flat.reshape(grid.shape))
                if noise > config.sound_scatter and np.count_nonzero(near) >= self._least:
                    return f"depth scatters by {100.0 * noise:.1f} % from sample to sample: no surface holds together"
                return "too few samples on the surface"
            solved, plane, normal_matrix_inverse = fit_plane(self._design, flat, component.reshape(-1))
            if not solved:
                return "samples on the surface lie on one line"
            if searched:
                judged = relative[component.reshape(-1)][:: max(1, count // _JUDGED)]
                spread = MAD_TO_SIGMA * median(np.abs(judged - median(judged)))
            wanted = config.fine_gate_sigmas * (spread if sigma is None else sigma)
            gate = min(max(wanted, config.fine_gate_low), config.fine_gate_high)
        problem = surface_problem(plane, down, config)
        if problem is not None:
            return problem
        squares = residual_squares(self._design, flat, component, plane, self._block)
        length = math.hypot(*plane.tolist())
        return PlaneEstimate(
            inverse_depth=plane,
            covariance=plane_covariance(plane, normal_matrix_inverse, squares, count, config.common_mode_m),
            normal=plane * (-1.0 / length),
            distance_m=1.0 / length,
            inlier_share=count / seen,
            residual_sigma=spread,
            component=component,
        )


def depth_noise(inverse: np.ndarray) -> float:
    r"""Noise of single depth samples by their second differences along rows, which are zero on every plane.

    .. math:: \sigma = \frac{1.4826}{\sqrt 6} \operatorname{median} \frac{|w_{k-1} - 2 w_k + w_{k+1}|}{w_k}

    Args:
        inverse: 1/Z of the samples w [1/m], 0 where absent, (rows, columns).

    Returns:
        Standard deviation as a share of depth [-]; 0 where no three samples lie side by side.
    """
    left, middle, right = inverse[:, :-2], inverse[:, 1:-1], inverse[:, 2:]
    there = (left > 0.0) & (middle > 0.0) & (right > 0.0)
    bends = np.abs(left - 2.0 * middle + right)[there] / middle[there]
    return MAD_TO_SIGMA / math.sqrt(6.0) * median(bends) if bends.size else 0.0
