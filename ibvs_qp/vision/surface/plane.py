"""The working surface as a plane in inverse depth, 1/Z = a x + b y + c, fitted robustly through a seed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, OTHER
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.surface.estimate import PlaneEstimate
from ibvs_qp.vision.surface.hypotheses import judged_planes
from ibvs_qp.vision.surface.refit_plane import PlaneRefit
from ibvs_qp.vision.surface.seeds import seed_values

#: Side of the blocks over which residuals are averaged to measure their correlation [samples].
_BLOCK = 8
#: Gate of what looks like paint in either round, share of the board's: a wall that looks like paint must not get in, so
#: what looks like it counts in the last round only, and has to fit twice as well.
_PAINT_GATES = (0.0, 0.5)


class LabelsOfSeeds(Protocol):
    """Colour labels for the seed of an index: a list, or something that makes them when they are looked at."""

    def __getitem__(self, index: int, /) -> np.ndarray:
        """Labels of the samples, uint8 (rows, columns)."""
        ...


class PlaneFitter:
    """Finds the surface through a seed and follows it from frame to frame."""

    def __init__(self, config: PlaneConfig) -> None:
        """Take the settings and start its own random generator."""
        self._config = config
        self._grid: CoarseGrid | None = None
        self._refit: PlaneRefit | None = None
        self.reset()

    def reset(self) -> None:
        """Start again as new: same pictures, same bits."""
        self._random = np.random.default_rng(np.random.SeedSequence(self._config.random_seed))

    def search(
        self,
        grid: CoarseGrid,
        inverse: np.ndarray,
        seeds: list[tuple[int, int]],
        down: np.ndarray | None,
        prefer: LabelsOfSeeds | None,
    ) -> PlaneEstimate | str:
        """Find the surface without a prediction.

        Args:
            grid: Where the samples lie.
            inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
            seeds: Cells on which the surface may lie; the nearest valid one is taken: a brush meets it first. At the
                same depth the first one counts: a row begins at its right end, so its left is surely on the surface.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            prefer: Colour labels of the samples for each seed, uint8 (rows, columns) each, or None.

        Returns:
            The surface, or the reason why there is none.
        """
        values = seed_values(grid, inverse, seeds, self._config.seed_radius)
        order = sorted((index for index, value in enumerate(values) if value > 0), key=lambda index: -values[index])
        reason = "no valid depth around the seed"
        for index, wanted in self._attempts(order, values, seeds, prefer):
            start = self._hypothesis(grid, inverse, seeds[index], values[index], down, wanted)
            if start is None:
                reason = "no plane through the seed stands upright and faces the camera"
                continue
            result = self._refine(grid, inverse, start, seeds[index], down, wanted)
            if isinstance(result, PlaneEstimate):
                return result
            reason = result
        return reason

    def _attempts(
        self, order: list[int], values: list[float], seeds: list[tuple[int, int]], prefer: LabelsOfSeeds | None
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """Seeds to try with labels of their colour or without, the likeliest first.

        A seed on an edge may have a colour that nearly nothing else has. Without colour its plane would tilt through
        the surface and a wall behind it, so seeds at the same depth with a colour of their own come before it.
        """
        if prefer is None or not order:
            yield from ((index, None) for index in order)
            return
        flush = [index for index in order if values[index] > (1.0 - self._config.coarse_gate) * values[order[0]]]
        if len(order) > 1:
            order = self._first_of_flush(order, flush, seeds, prefer)
            flush = [index for index in order if index in flush]
        tried = set()
        for index in flush:
            if int(np.count_nonzero(prefer[index] == BOARD)) >= self._config.min_samples:
                tried.add(index)
                yield index, prefer[index]
        for index in order:
            if index not in tried:
                yield index, prefer[index]
            yield index, None

    @staticmethod
    def _first_of_flush(
        order: list[int], flush: list[int], seeds: list[tuple[int, int]], prefer: LabelsOfSeeds
    ) -> list[int]:
        """The order of seeds, with the first listed one in front where the nearest one differs from it by colour only.

        A board that is flush with its wall cannot be told from it by depth.
        """
        first = min(flush)
        if first == order[0]:
            return order
        labels = prefer[first]
        if labels[seeds[first]] == OTHER or labels[seeds[order[0]]] != OTHER:
            return order
        return [first, *(index for index in order if index != first)]

    def track(
        self,
        grid: CoarseGrid,
        inverse: np.ndarray,
        predicted: np.ndarray,
        down: np.ndarray | None,
        prefer: np.ndarray | None,
        seed: tuple[int, int] | None = None,
    ) -> PlaneEstimate | str:
        """Follow the surface from predicted (a, b, c), without random search; it is the part around a seed if given."""
        return self._refine(grid, inverse, predicted, seed, down, prefer)

    def _hypothesis(
        self,
        grid: CoarseGrid,
        inverse: np.ndarray,
        seed: tuple[int, int],
        value: float,
        down: np.ndarray | None,
        prefer: np.ndarray | None,
    ) -> np.ndarray | None:
        """Best of many planes through the seed and two random samples near it."""
        tried = judged_planes(self._config, grid, inverse, seed, value, prefer, self._random)
        if tried is None:
            return None
        planes, score = tried
        score = score * self._upright(planes, down)
        best = int(np.argmax(score))
        return planes[best] if score[best] > 0 else None

    def _upright(self, planes: np.ndarray, down: np.ndarray | None) -> np.ndarray:
        """Whether planes (n, 3) face the camera and, if gravity is known, stand upright."""
        length = np.linalg.norm(planes, axis=1)
        good = planes[:, 2] > math.cos(math.radians(self._config.max_oblique_deg)) * length
        if down is not None:
            good &= np.abs(planes @ down) < math.sin(math.radians(self._config.max_lean_deg)) * length
        return good

    def _refine(
        self,
        grid: CoarseGrid,
        inverse: np.ndarray,
        start: np.ndarray,
        seed: tuple[int, int] | None,
        down: np.ndarray | None,
        prefer: np.ndarray | None,
    ) -> PlaneEstimate | str:
        """Two rounds of least squares within gates that the residuals set, around a start."""
        if self._refit is None or grid is not self._grid:
            self._grid, least = grid, self._config.min_samples
            self._refit = PlaneRefit(
                self._config, grid, grid.design, least=least, block=_BLOCK, paint_gates=_PAINT_GATES
            )
        return self._refit.refit(inverse, prefer, start, down, seed=seed)
