"""Noise sweep: nine combinations of feature and force noise, told to nobody."""

from __future__ import annotations

from sim.evaluate.measures import paint_figures
from sim.experiments.base import Choice, Criterion, Experiment, runs
from sim.experiments.figures.noise_sweep import draw_noise_sweep
from sim.experiments.paint import PATH_COLUMNS
from sim.experiments.scenes import short_job
from sim.sweep.design import Run

NAME = "noise-sweep"
#: Added to rho and theta of each line per frame, after vision; per sample and axis of the force/torque sensor [N].
SIGMA_VS, SIGMA_F = (0.02, 0.08, 0.12), (1.0, 2.0, 3.0)
FLIGHTS = 10
#: Strokes of a C that still has straights between its corners [m].
STROKE_M, QUICK_STROKE_M = 0.5, 0.3
#: What is held: force rms per sigma_f [N], path rms per sigma_vs [m].
FORCE_N, PATH_M = (0.20, 0.30, 0.40), (0.006, 0.015, 0.020)


def design(choice: Choice) -> list[Run]:
    """The full grid; quick takes its ends, where the paper's diagonal begins and ends."""
    grid = [(vs, force) for vs in SIGMA_VS for force in SIGMA_F]
    if choice.quick:
        grid = [(SIGMA_VS[0], SIGMA_F[0]), (SIGMA_VS[-1], SIGMA_F[-1])]
    flights = []
    for vs, force in grid:
        flights += runs(
            NAME,
            choice,
            scene=short_job(
                QUICK_STROKE_M if choice.quick else STROKE_M, features={"sigma_vs": vs}, force_torque={"sigma_n": force}
            ),
            measure=paint_figures,
            params={"sigma_vs": vs, "sigma_f_n": force},
            seeds=1 if choice.quick else FLIGHTS,
        )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="Noise sweep",
    about="The C with strokes of 0.5 m under noise added to every line after vision and to every force sample; nine "
    "cells, ten flights each; no filter is told the noise.",
    paper="sigma_vs 0.02, 0.08, 0.12 (said to equal 1, 4, 6 cm) with sigma_f 1, 2, 3 N: three combinations, ten "
    "flights each; box plots, 'within the sensor noise', no figure.",
    design=design,
    params={"sigma_vs": "sigma_vs", "sigma_f_n": "sigma_f [N]"},
    columns=PATH_COLUMNS,
    criteria=(
        Criterion(text="completed", metric="completed", bound=1.0, least=True, failed_too=True, every=True),
        *(
            Criterion(
                text=f"push error, rms, sigma_f {sigma:g} N",
                metric="force_rms_n",
                bound=bound,
                params={"sigma_f_n": sigma},
                unit="N",
            )
            for sigma, bound in zip(SIGMA_F, FORCE_N, strict=True)
        ),
        *(
            Criterion(
                text=f"path, rms, sigma_vs {sigma:g}",
                metric="path_rms_m",
                bound=bound,
                params={"sigma_vs": sigma},
                scale=1e3,
                unit="mm",
            )
            for sigma, bound in zip(SIGMA_VS, PATH_M, strict=True)
        ),
    ),
    draw=draw_noise_sweep,
)
