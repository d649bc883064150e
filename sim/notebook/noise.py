"""Notebook 06: the table of a noise sweep, its statistics, and flights of it flown again."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError
from sim.evaluate.figures import FIGURES as FIGURES_BY_NAME
from sim.evaluate.figures import MORE, Figure
from sim.experiments.design import Choice, design
from sim.experiments.spec import experiment
from sim.flight.closed_loop import fly
from sim.flight.trace import Trace, law_name
from sim.notebook.common import table
from sim.sweep.design import Run, code_hash, configuration_hash
from sim.sweep.figures.page import read_table
from sim.sweep.parts import PARAM
from sim.sweep.statistics import completed, needed, paired_differences, select, sign
from sim.world.worlds import DEFAULT_WORLD

#: Table that the notebook reads by default, and the spec of its flights for `ibvs-qp experiment`.
SAMPLE = Path(__file__).parents[2] / "notebooks" / "data" / "noise_sweep.parquet"
SPEC = SAMPLE.with_name("noise_sample.toml")
#: Columns of the two noises.
VS, FORCE = PARAM + "sigma_vs", PARAM + "sigma_f_n"
#: Camera distance in contact [m]: sigma_vs times this is the noise of a line on the wall.
DEPTH_M = 0.5
#: Figures of merit that the notebook offers.
FIGURES = tuple(
    FIGURES_BY_NAME[name]
    for name in (
        *("path_rms_m", "force_rms_n", "path_max_m", "tilt_rms_deg", "yaw_rms_deg", "velocity_rms_m_s", "coverage"),
        *("limited_share", "duration_s"),
    )
)
#: By the sign of analytic law minus QP law in a figure that should be small.
_VERDICTS = {1: "QP better", 0: "no significant difference", -1: "analytic law better"}


def sweep_or_sample(file: str) -> tuple[pl.DataFrame, str]:
    """The table of a noise sweep and "", or the sample and the error; the sample without a file name."""
    try:
        sweep, _ = read_table(Path(file) if file else SAMPLE)
        if missing := [name for name in (VS, FORCE) if name not in sweep.columns]:
            raise ConfigError(f"{file} is no noise sweep: it lacks {', '.join(missing)}")
    except ConfigError as error:
        return read_table(SAMPLE)[0], f"{error}. The page shows the sample."
    return sweep, ""


def success(sweep: pl.DataFrame) -> pl.DataFrame:
    """Number of flights and fraction completed per law and cell."""
    keys = ["law", VS, FORCE]
    return sweep.group_by(keys).agg(pl.len().alias("flights"), pl.col("completed").mean()).sort(keys)


def success_table(sweep: pl.DataFrame) -> str:
    """Completed flights of each cell and the reasons of the others, as markdown."""
    words = pl.format("{} of {}", (pl.col("completed") * pl.col("flights")).round().cast(int), "flights")
    cells = success(sweep).with_columns(words.alias("words"))
    wide = cells.pivot(FORCE, index=["law", VS], values="words").sort("law", VS, descending=[True, False])
    rows = [(law_name(law), f"{vs:g}", *(text or "–" for text in texts)) for law, vs, *texts in wide.rows()]
    reasons = sweep.filter(~pl.col("completed")).group_by("law", "reason").len().sort("len", "law", descending=True)
    failed = "; ".join(f"{count} × {law_name(law)}: {reason}" for law, reason, count in reasons.head(6).rows())
    header = ["law", "sigma_vs", *(f"sigma_f {float(force):g} N" for force in wide.columns[2:])]
    return table(header, rows) + f"\n\nNot completed: {failed or 'none'}."


def effects(sweep: pl.DataFrame, law: str, figure: Figure) -> dict[str, float]:
    r"""Effects of the two noises on a positive figure over the completed flights of a law.

    Fitted is :math:`\log y = a + b \log \sigma_{vs} + c \log \sigma_f + \text{rest}`.

    Returns:
        ``flights``; the exponents b ``vs`` and c ``force`` (0: no effect, 1: proportional); and the fractions of the
        scatter of log y that sigma_vs alone, sigma_f alone, and not even both explain: ``vs_part``, ``force_part`` and
        ``rest``. NaN with too few flights.
    """
    import pandas as pd
    from statsmodels.formula.api import ols

    flown = sweep.filter((pl.col("law") == law) & pl.col("completed") & (pl.col(figure.name) > 0.0))
    logs = flown.select(
        pl.col(figure.name).log().alias("y"), pl.col(VS).log().alias("vs"), pl.col(FORCE).log().alias("f")
    )
    if logs.height <= 3 or min(logs[name].n_unique() for name in logs.columns) == 1:
        return {"flights": logs.height, **dict.fromkeys(("vs", "force", "vs_part", "force_part", "rest"), math.nan)}
    data = pd.DataFrame(logs.to_dict(as_series=False))
    slopes = ols("y ~ vs + f", data).fit().params
    vs, force, both = (float(ols(f"y ~ {terms}", data).fit().rsquared) for terms in ("C(vs)", "C(f)", "C(vs) * C(f)"))
    parts = {"vs_part": vs, "force_part": force, "rest": 1.0 - both}
    return {"flights": logs.height, "vs": float(slopes["vs"]), "force": float(slopes["f"]), **parts}


def averaged_samples(sweep: pl.DataFrame, law: str) -> tuple[dict[float, float], dict[float, float]]:
    r"""Least number of averaged samples behind an error: :math:`N = (\sigma / \text{rms})^2`.

    For each noise at the smallest value of the other one, by the median of the completed flights.

    Returns:
        Pictures behind the path error per sigma_vs, and force samples behind the push error per sigma_f; NaN without
        flights.
    """
    sigmas, forces = (sorted(sweep[name].unique()) for name in (VS, FORCE))

    def count(noise: float, metric: str, vs: float, force: float) -> float:
        values = completed(select(sweep, law=law, sigma_vs=vs, sigma_f_n=force), metric)
        return (noise / float(np.median(values))) ** 2 if len(values) else math.nan

    pictures = {vs: count(vs * DEPTH_M, "path_rms_m", vs, forces[0]) for vs in sigmas}
    return pictures, {force: count(force, "force_rms_n", sigmas[0], force) for force in forces}


def differences_table(sweep: pl.DataFrame, figure: Figure) -> str:
    """Analytic law minus QP law, seed by seed: median with its exact interval per cell, as markdown."""
    rows = []
    for cell in paired_differences(sweep.filter(pl.col("completed")), [figure.name]):
        found = cell["differences"].get(figure.name)
        if found is None:
            continue
        low, middle, high = (figure.scale * found[name] for name in ("sure_low", "median", "sure_high"))
        enough, better = math.isfinite(low), -sign(found) if figure.better == MORE else sign(found)
        verdict = _VERDICTS[better] if enough else f"significant from {needed()} pairs on"
        sigmas = (f"{cell['params'][name]:g}" for name in ("sigma_vs", "sigma_f_n"))
        rows.append((*sigmas, cell["n"], f"{middle:+.2f}", f"{low:+.2f} to {high:+.2f}" if enough else "–", verdict))
    header = ["sigma_vs", "sigma_f [N]", "pairs", f"analytic − QP, {figure.label}", "95 % interval", "result"]
    return table(header, rows)


def row_name(row: dict[str, Any]) -> str:
    """Law, cell and seed of a row as text."""
    return f"{row['law']}, sigma_vs {row[VS]:g}, sigma_f {row[FORCE]:g} N, seed {row['seed']}"


def find_run(row: dict[str, Any]) -> Run:
    """The run of a row: the one with its configuration, otherwise the same cell of the first design that has it.

    Raises:
        LookupError: When no design has such a cell, law and seed.
    """
    key = (row["law"], row["seed"], row[VS], row[FORCE])
    alike = [
        run
        for name, world in ((str(SPEC), "ideal"), ("noise-sweep", "ideal"), ("noise-sweep", DEFAULT_WORLD))
        for run in design(experiment(name), Choice(features="geometric", world=world))
        if (run.law, run.seed, run.params["sigma_vs"], run.params["sigma_f_n"]) == key
    ]
    if not alike:
        raise LookupError(f"no flight {row_name(row)}")
    return next((run for run in alike if configuration_hash(run) == row.get("config_hash")), alike[0])


def fly_again(row: dict[str, Any]) -> tuple[Trace, dict[str, float], bool]:
    """Fly the run of a row; its trace and figures, and whether code and settings are those of the row."""
    run = find_run(row)
    plan = run.plan
    trace = fly(plan.scene, plan.options, config=plan.config, job=plan.job, faults=plan.faults)
    return trace, run.measure(trace), (configuration_hash(run), code_hash()) == (row["config_hash"], row["code_hash"])
