"""Which noise costs what: growth exponents, shares of the scatter, and how much a filter must have averaged."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import polars as pl

from sim.notebook.noise.table import DEPTH_M, FORCE, VS, Figure, cell_values, grid_of


@dataclass(frozen=True, kw_only=True)
class Effects:
    r"""What the two noises do to one figure under one law.

    Fitted over completed flights, :math:`\log y = a + b \log \sigma_{vs} + c \log \sigma_f + \text{rest}`.

    Attributes:
        flights: Completed flights.
        vs_exponent: b; 0: no effect, 1: proportional.
        force_exponent: c.
        vs_share: Share of the scatter of log y that sigma_vs alone explains.
        force_share: Likewise sigma_f.
        rest_share: What neither, nor both together cell by cell, explain: the seeds.
    """

    flights: int
    vs_exponent: float
    force_exponent: float
    vs_share: float
    force_share: float
    rest_share: float


def effects(table: pl.DataFrame, law: str, figure: Figure) -> Effects:
    """Effects of both noises on a positive figure; NaN where too few flights ended as planned."""
    flown = table.filter((pl.col("law") == law) & pl.col("completed") & (pl.col(figure.column) > 0.0))
    y, vs, force = (np.log(flown[name].to_numpy()) for name in (figure.column, VS, FORCE))
    enough = len(y) > 3 and np.ptp(vs) > 0.0 and np.ptp(force) > 0.0 and np.ptp(y) > 0.0
    if not enough:
        return Effects(
            flights=len(y),
            **dict.fromkeys(("vs_exponent", "force_exponent", "vs_share", "force_share", "rest_share"), math.nan),
        )
    slope = np.linalg.lstsq(np.column_stack((np.ones(len(y)), vs, force)), y, rcond=None)[0]
    return Effects(
        flights=len(y),
        vs_exponent=float(slope[1]),
        force_exponent=float(slope[2]),
        vs_share=_explained(y, vs),
        force_share=_explained(y, force),
        rest_share=1.0 - _explained(y, np.round(vs, 9) + 1j * np.round(force, 9)),
    )


def _explained(y: np.ndarray, group: np.ndarray) -> float:
    """Share of the scatter of y about its mean that the means of its groups explain."""
    _, index = np.unique(group, return_inverse=True)
    means = np.bincount(index, y) / np.bincount(index)
    return float(((means[index] - y.mean()) ** 2).sum() / ((y - y.mean()) ** 2).sum())


def averaged_samples(
    table: pl.DataFrame, law: str, path: Figure, push: Figure
) -> tuple[dict[float, float], dict[float, float]]:
    r"""How many samples of noise must have been averaged behind an error: :math:`N = (\sigma / \text{rms})^2`.

    Each noise is looked at where the other one disturbs least, by the median of the completed flights.

    Returns:
        Pictures behind the path error per sigma_vs, and force samples behind the push error per sigma_f; NaN without
        flights.
    """
    sigmas, forces = grid_of(table)

    def count(noise: float, values: np.ndarray) -> float:
        return (noise / float(np.median(values))) ** 2 if len(values) else math.nan

    pictures = {vs: count(vs * DEPTH_M, cell_values(table, law, vs, forces[0], path) / path.scale) for vs in sigmas}
    samples = {force: count(force, cell_values(table, law, sigmas[0], force, push) / push.scale) for force in forces}
    return pictures, samples
