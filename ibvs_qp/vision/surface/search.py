"""The surface through a seed without a prediction: random planes, scored by the agreeing samples, then refitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, OTHER
from ibvs_qp.vision.compilation import MAD_TO_SIGMA, kernel, median
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import DEPTH_RATIO, Cell, CoarseGrid, Seeds
from ibvs_qp.vision.surface.plane import PlaneEstimate, refit_plane

#: Samples by which planes are scored; more cost time and change nothing.
_VOTERS = 400
#: Radius that counts around the seed when planes are scored, normalised.
_NEAR = 0.25
#: Fraction of the coarse gate within which a sample votes for a plane.
_VOTE = 0.6
#: Smallest area that two arms of a plane span, normalised.
_SPAN = 1e-4
#: Distances from the seed up to which samples count while a plane grows, in sequence, normalised.
_RADII = (0.10, 0.14, 0.20, 0.28, 0.40, 0.60)
#: Fewer samples near the seed give no plane to grow.
_LEAST = 40

#: Colour labels of the samples for the seed of an index, uint8 (rows, columns).
LabelsOfSeeds = Callable[[int], np.ndarray]


class PlaneSearch:
    """Finds the surface through a seed; it has its own random generator."""

    def __init__(self, config: PlaneConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Start again as new: same pictures, same bits."""
        self._random = np.random.default_rng(np.random.SeedSequence(self._config.random_seed))

    def search_plane(
        self, grid: CoarseGrid, inverse: np.ndarray, seeds: list[Cell], down: np.ndarray | None, prefer: LabelsOfSeeds
    ) -> PlaneEstimate | str:
        """Find the surface without a prediction, or return the reason why it is missing.

        Args:
            grid: Where the samples lie.
            inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
            seeds: Cells on which the surface may lie; the nearest valid one is taken: a brush meets it first. At the
                same depth the first one counts: a row begins at its right end, so its left is on the surface.
            down: Gravity's direction in C, unit, (3,), or None if unknown.
            prefer: Colour labels of the samples for each seed.
        """
        values = seed_values(grid, inverse, seeds, self._config.seed_radius)
        order = sorted((index for index, value in enumerate(values) if value > 0), key=lambda index: -values[index])
        reason = "no valid depth around the seed"
        for index, labels in self._attempts(order, values, seeds, prefer):
            start = self._hypothesis(grid, inverse, seeds[index], values[index], down, labels)
            if start is None:
                reason = "no plane through the seed stands upright and faces the camera"
                continue
            result = refit_plane(grid, inverse, labels, start, down, self._config, seed=seeds[index])
            if isinstance(result, PlaneEstimate):
                return result
            reason = result
        return reason

    def _attempts(
        self, order: list[int], values: list[float], seeds: list[Cell], prefer: LabelsOfSeeds
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """Seeds to try with labels of their colour or without, the likeliest first.

        A seed on an edge may have a colour that nearly nothing else has. Without colour its plane would tilt through
        the surface and a wall behind it, so seeds at the same depth with a colour of their own come before it.
        """
        if not order:
            return
        flush = [index for index in order if values[index] > (1.0 - self._config.coarse_gate) * values[order[0]]]
        if len(order) > 1:
            order = self._first_of_flush(order, flush, seeds, prefer)
            flush = [index for index in order if index in flush]
        tried = set()
        for index in flush:
            if int(np.count_nonzero(prefer(index) == BOARD)) >= self._config.min_samples:
                tried.add(index)
                yield index, prefer(index)
        for index in order:
            if index not in tried:
                yield index, prefer(index)
            yield index, None

    @staticmethod
    def _first_of_flush(order: list[int], flush: list[int], seeds: list[Cell], prefer: LabelsOfSeeds) -> list[int]:
        """The order of seeds, with the first listed one in front where the nearest one differs from it by colour only.

        Depth cannot separate a board from a wall that is flush with it.
        """
        first = min(flush)
        if first == order[0]:
            return order
        labels = prefer(first)
        if labels[seeds[first]] == OTHER or labels[seeds[order[0]]] != OTHER:
            return order
        return [first, *(index for index in order if index != first)]

    def _hypothesis(
        self,
        grid: CoarseGrid,
        inverse: np.ndarray,
        seed: Cell,
        value: float,
        down: np.ndarray | None,
        prefer: np.ndarray | None,
    ) -> np.ndarray | None:
        """Best of many planes through the seed and two random samples near it, of the board's colour if enough are."""
        config, design = self._config, grid.design
        place = seed[0] * grid.shape[1] + seed[1]
        x, y = design[:, 0] - design[place, 0], design[:, 1] - design[place, 1]
        flat = np.ascontiguousarray(inverse, float).reshape(-1)
        usable = (flat > 0.0) & grid.free.reshape(-1) & (x * x + y * y < config.seed_reach**2)
        if prefer is not None:
            board = usable & (prefer.reshape(-1) == BOARD)
            usable = board if int(np.count_nonzero(board)) >= config.min_samples else usable
        near = np.flatnonzero(usable)
        if len(near) < config.min_samples:
            return None
        pairs = self._random.choice(near, (2, config.hypotheses))
        voters = np.ascontiguousarray(near[:: max(1, len(near) // _VOTERS)])
        planes, score = score_planes(
            design, flat, place, value, pairs, voters, _VOTE * config.coarse_gate, _NEAR, _SPAN
        )
        length = np.linalg.norm(planes, axis=1)
        upright = planes[:, 2] > math.cos(math.radians(config.max_oblique_deg)) * length
        if down is not None:
            upright &= np.abs(planes @ down) < math.sin(math.radians(config.max_lean_deg)) * length
        score = score * upright
        best = int(np.argmax(score))
        return planes[best] if score[best] > 0 else None


@kernel("Tuple((f8[:, ::1], f8[::1]))(f8[:, ::1], f8[::1], i8, f8, i8[:, ::1], i8[::1], f8, f8, f8)")
def score_planes(design, inverse, seed, value, pairs, voters, gate, width, span):
    """Planes through a seed of some value and pairs of samples, and the weight of the voters that agree with each.

    A voter counts less the farther it is from the seed, by 1/e at a width. Planes whose arms span less area are level.
    Returns (a, b, c) of the planes, (planes, 3), and the weights, (planes,).
    """
    count = pairs.shape[1]
    a, b, c, scores = np.empty(count), np.empty(count), np.empty(count), np.zeros(count)
    x0, y0 = design[seed, 0], design[seed, 1]
    for k in range(count):
        one, two = pairs[0, k], pairs[1, k]
        x1, y1, x2, y2 = design[one, 0] - x0, design[one, 1] - y0, design[two, 0] - x0, design[two, 1] - y0
        rise1, rise2, cross = inverse[one] - value, inverse[two] - value, x1 * y2 - y1 * x2
        safe = cross if abs(cross) > span else np.inf
        a[k], b[k] = (rise1 * y2 - rise2 * y1) / safe, (rise2 * x1 - rise1 * x2) / safe
        c[k] = value - a[k] * x0 - b[k] * y0
    for place in voters:
        u, v, d = design[place, 0], design[place, 1], inverse[place]
        x, y, near = u - x0, v - y0, gate * d
        weight = math.exp(-(x * x + y * y) / (width * width))
        for k in range(count):
            scores[k] += weight if abs(a[k] * u + b[k] * v + c[k] - d) < near else 0.0
    planes = np.empty((count, 3))
    for k in range(count):
        planes[k, 0], planes[k, 1], planes[k, 2] = a[k], b[k], c[k]
    return planes, scores


def grown_plane(
    grid: CoarseGrid, inverse: np.ndarray, seed: Cell, start: np.ndarray, config: PlaneConfig
) -> np.ndarray:
    """Least-squares plane of the samples around a seed, the gate known from those nearer to it.

    It starts from (a, b, c) of a plane through the seed, good near it, which is returned where too few samples agree.
    The samples are 1/Z [1/m], 0 where absent, (rows, columns).
    """
    flat, design = inverse.ravel(), grid.design
    origin = design[seed[0] * grid.shape[1] + seed[1], :2]
    distance = np.hypot(*(design[:, :2] - origin).T)
    plane, gate = start, config.coarse_gate
    for radius in _RADII:
        near = np.flatnonzero((flat > 0.0) & (distance < radius))
        if len(near) < _LEAST:
            continue
        relative = flat[near] / np.maximum(design[near] @ plane, 1e-3) - 1.0
        inlier = np.abs(relative) < gate
        if int(inlier.sum()) < _LEAST:
            return plane
        chosen = near[inlier]
        samples = design[chosen]
        normal_matrix = samples.T @ samples
        if np.linalg.cond(normal_matrix) > 1e10:
            return plane
        plane = np.linalg.solve(normal_matrix, samples.T @ flat[chosen])
        residual = flat[chosen] / np.maximum(samples @ plane, 1e-3) - 1.0
        sigma = MAD_TO_SIGMA * median(np.abs(residual))
        gate = min(max(config.fine_gate_sigmas * sigma, config.fine_gate_low), config.fine_gate_high)
    return plane


def facing(grid: CoarseGrid, inverse: np.ndarray, ladder: list[Seeds], radius: int) -> list[Cell]:
    """The seeds at which samples have the depth for which they were laid; without any, those of a contact."""
    if not ladder:
        return []
    cells, gate = [(cell, seeds.depth) for seeds in ladder for cell in seeds.cells], math.sqrt(DEPTH_RATIO)
    values = seed_values(grid, inverse, [cell for cell, _ in cells], radius)
    fitting = [cell for (cell, z), value in zip(cells, values, strict=True) if 1.0 / gate < value * z < gate]
    return list(dict.fromkeys(fitting)) or ladder[0].cells  # no cell twice, in order


def seed_values(grid: CoarseGrid, inverse: np.ndarray, seeds: list[Cell], radius: int) -> list[float]:
    """Upper median 1/Z around every seed [1/m], within a radius [cells]; 0 where too few samples have one."""
    if not seeds:
        return []
    windows, least = grid.windows(seeds, radius), 2 * radius + 1
    known = inverse.reshape(-1).take(windows)
    known[~grid.free.reshape(-1).take(windows) | ~(known > 0.0)] = np.inf
    known.sort(axis=1)
    counts = np.count_nonzero(known < np.inf, axis=1).tolist()
    return [float(row[count // 2]) if count >= least else 0.0 for row, count in zip(known, counts, strict=True)]


def depth_problem(depth: np.ndarray, grid: CoarseGrid, seed: Cell, config: PlaneConfig) -> str | None:
    """Why depth cannot give a surface at a seed: absent, or in wrong units; None if it is neither."""
    samples = grid.sample(depth)
    valid = samples[np.isfinite(samples) & (samples > 0.0)]
    if len(valid) == 0:
        return "the depth picture holds no valid reading"
    low, high = config.distance_min_m, config.distance_max_m
    typical = float(np.median(valid))
    if not low <= typical <= high and float(((valid > low) & (valid < high)).mean()) < 0.1:
        return (
            f"depth of {typical:.3g} m in the middle is out of the camera's range ({low:g} to {high:g} m): "
            "are the depth units per metre right?"
        )
    around = samples[grid.window(seed, config.seed_radius)]
    around = around[np.isfinite(around) & (around > 0.0)]
    if len(around) == 0:
        return "no valid depth around the seed"
    near = float(np.median(around))
    if not low <= near <= high:
        return f"depth of {near:.3g} m at the seed is out of range ({low:g} to {high:g} m)"
    return None
