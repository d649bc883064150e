"""Gusts and wind steps: painting in Dryden-like gusts, and a hold in a wind that begins at once."""

from __future__ import annotations

from sim.evaluate.measures import paint_figures, press_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.curves import Panel, curves
from sim.experiments.scenes import near_wall, short_job
from sim.flight.faults import WindStep
from sim.flight.jobs import PressJob
from sim.sweep.design import Run

NAME = "gust"
GUST_N, QUICK_GUST_N = (1.0, 2.0, 3.0), (2.0,)
STROKE_M, QUICK_STROKE_M = 0.5, 0.3
#: Wind steps [m/s] along the wall and onto it, this long after the touch, in a hold this long [s].
WIND_M_S, QUICK_WIND_M_S = (3.0, 5.0, 8.0), (5.0,)
STEP_AFTER_S, HOLD_S = 4.0, 13.0
#: Unit vectors, north (into the wall), east (along it), down.
DIRECTIONS = {"along the wall": (0.0, 1.0, 0.0), "off the wall": (-1.0, 0.0, 0.0)}


def design(choice: Choice) -> list[Run]:
    """Painting in gusts, then holds with wind steps."""
    flights = []
    for gust in QUICK_GUST_N if choice.quick else GUST_N:
        flights += runs(
            NAME,
            choice,
            scene=short_job(QUICK_STROKE_M if choice.quick else STROKE_M, wind={"gust_n_rms": gust}),
            measure=paint_figures,
            params={"kind": "gust", "wind": gust, "direction": "every axis"},
            seeds=1 if choice.quick else 5,
        )
    for words, axis in list(DIRECTIONS.items())[: 1 if choice.quick else 2]:
        for speed in QUICK_WIND_M_S if choice.quick else WIND_M_S:
            north, east, down = (speed * entry for entry in axis)
            flights += runs(
                NAME,
                choice,
                scene=near_wall(),
                job=PressJob(hold_s=HOLD_S),
                measure=press_figures,
                params={"kind": "step", "wind": speed, "direction": words},
                seeds=1 if choice.quick else 2,
                faults=(WindStep(delay_s=STEP_AFTER_S, mean_m_s=(north, east, down)),),
            )
    return flights


def _gust(rms: float) -> dict[str, float | str]:
    return {"kind": "gust", "wind": rms}


EXPERIMENT = Experiment(
    name=NAME,
    title="Gusts and wind",
    about="The C with strokes of 0.5 m in gusts of 1, 2, 3 N rms per axis (correlation time 1 s); and holds of 5 N in "
    "which a wind of 3, 5, 8 m/s (2.7, 4.5, 7.2 N) begins at once. Recovery: push within 0.5 N and tip within 5 mm "
    "for good.",
    paper="Not reported.",
    design=design,
    params={"kind": "flights", "wind": "gust or wind (N rms, m/s)", "direction": "direction"},
    columns=(
        Column(metric="path_rms_m", label="path, rms", unit="mm", scale=1e3),
        Column(metric="force_rms_n", label="push error, rms", unit="N", digits=3),
        Column(metric="contact_share", label="contact", unit="%", scale=100.0, digits=1, better=1),
        Column(metric="tilt_peak_deg", label="tilt, peak", unit="deg"),
        Column(metric="yaw_peak_deg", label="yaw, peak", unit="deg"),
        Column(metric="recovery_s", label="recovered after", unit="s"),
        Column(metric="fault_force_peak_n", label="push error after the step, peak", unit="N"),
        Column(metric="fault_path_peak_m", label="tip after the step, peak", unit="mm", scale=1e3, digits=1),
    ),
    criteria=(
        Criterion(
            text="gust 1 N: path, rms", metric="path_rms_m", bound=0.015, params=_gust(1.0), scale=1e3, unit="mm"
        ),
        Criterion(text="gust 1 N: push error, rms", metric="force_rms_n", bound=0.6, params=_gust(1.0), unit="N"),
        Criterion(
            text="gust 2 N: path, rms", metric="path_rms_m", bound=0.025, params=_gust(2.0), scale=1e3, unit="mm"
        ),
        Criterion(text="gust 2 N: push error, rms", metric="force_rms_n", bound=1.1, params=_gust(2.0), unit="N"),
        Criterion(
            text="gust 3 N: completed (keeps the vehicle)",
            metric="completed",
            bound=1.0,
            least=True,
            failed_too=True,
            params=_gust(3.0),
            every=True,
        ),
        Criterion(
            text="gust 3 N: contact (keeps the wall)",
            metric="contact_share",
            bound=0.995,
            least=True,
            failed_too=True,
            params=_gust(3.0),
            scale=100.0,
            unit="%",
            every=True,
        ),
        Criterion(
            text="wind step: completed",
            metric="completed",
            bound=1.0,
            least=True,
            failed_too=True,
            params={"kind": "step"},
            every=True,
        ),
    ),
    draw=curves(
        "gust",
        "Path and push in gusts, and after wind steps along the wall",
        "wind",
        "gust [N rms]",
        (
            Panel(metric="path_rms_m", label="path error, rms [mm]", scale=1e3, where={"kind": "gust"}),
            Panel(metric="force_rms_n", label="push error, rms [N]", where={"kind": "gust"}),
            Panel(
                metric="fault_path_peak_m",
                label="tip after the step, peak [mm]",
                scale=1e3,
                where={"kind": "step", "direction": "along the wall"},
                xlabel="wind step [m/s]",
            ),
        ),
    ),
)
