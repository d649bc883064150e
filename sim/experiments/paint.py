"""The complete demonstration: the C of two rows, thirty seeds, both laws, and the ablations."""

from __future__ import annotations

from sim.evaluate.measures import paint_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.paint import draw_paint
from sim.experiments.scenes import near_wall, short_job
from sim.experiments.variants import VARIANTS
from sim.sweep.design import Run

NAME = "paint"
SEEDS, ABLATION_SEEDS = 30, 4
ABLATIONS = (
    "printed",
    "shared-gains",
    "no-feedforward",
    "no-ramp",
    "no-barriers",
    "clipped",
    "paper-lines",
    "paper-vision",
)
#: Stroke of the quick flights [m].
QUICK_STROKE_M = 0.4

#: Figures of a painted path that several experiments show.
PATH_COLUMNS = (
    Column(metric="path_rms_straight_m", label="path, straights, rms", unit="mm", scale=1e3),
    Column(metric="path_rms_corner_m", label="path, corners, rms", unit="mm", scale=1e3),
    Column(metric="force_rms_straight_n", label="push error, straights, rms", unit="N", digits=3),
    Column(metric="force_rms_corner_n", label="push error, corners, rms", unit="N", digits=3),
    Column(metric="contact_share", label="contact", unit="%", scale=100.0, better=1),
    Column(metric="tilt_rms_deg", label="tilt, rms", unit="deg"),
    Column(metric="tilt_peak_deg", label="tilt, peak", unit="deg"),
    Column(metric="yaw_peak_deg", label="yaw, peak", unit="deg"),
)


def design(choice: Choice) -> list[Run]:
    """The main job, then the ablations on fewer seeds."""
    scene = short_job(QUICK_STROKE_M) if choice.quick else near_wall()
    params = {"stroke_m": scene.paint.stroke_m}
    count = 1 if choice.quick else SEEDS
    flights = runs(NAME, choice, scene=scene, measure=paint_figures, params=params, seeds=count)
    for variant in () if choice.quick else ABLATIONS:
        flights += runs(
            NAME,
            choice,
            scene=scene,
            measure=paint_figures,
            variant=variant,
            laws=VARIANTS[variant].laws,
            params=params,
            seeds=ABLATION_SEEDS,
            keep=False,
        )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="The complete demonstration: painting a C",
    about="Approach, touch, row 1 along the bottom edge to the left, climb, row 2 back along its own fresh edge, "
    "retreat. Ablations fly the first seeds.",
    paper="Plots only, no error figure. Published real flight of this class of vehicle: 29 mm of path and 0.7 N of "
    "force, rms.",
    design=design,
    params={"stroke_m": "stroke [m]"},
    columns=(*PATH_COLUMNS, Column(metric="limited_share", label="limited ticks", unit="%", scale=100.0, better=0)),
    criteria=(
        Criterion(text="path, straights, rms", metric="path_rms_straight_m", bound=0.003, scale=1e3, unit="mm"),
        Criterion(text="path, corners, rms", metric="path_rms_corner_m", bound=0.010, scale=1e3, unit="mm"),
        Criterion(text="push error, straights, rms", metric="force_rms_straight_n", bound=0.25, unit="N"),
        Criterion(text="push error, corners, rms", metric="force_rms_corner_n", bound=0.6, unit="N"),
        Criterion(text="tilt, rms", metric="tilt_rms_deg", bound=0.5, unit="deg"),
        Criterion(text="contact", metric="contact_share", bound=0.995, least=True, scale=100.0, unit="%"),
        Criterion(text="completed", metric="completed", bound=1.0, least=True, failed_too=True, every=True),
    ),
    draw=draw_paint,
)
