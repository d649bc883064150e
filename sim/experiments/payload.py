"""Payload and calibration: what the pilot believes of mass, inertia, balance and camera is wrong."""

from __future__ import annotations

from typing import Any

from sim.evaluate.measures import paint_figures
from sim.experiments.base import Choice, Criterion, Experiment, runs
from sim.experiments.figures.bars import draw_payload
from sim.experiments.paint import PATH_COLUMNS
from sim.experiments.scenes import short_job
from sim.sweep.design import Run

NAME = "payload"
STROKE_M = 0.4
#: What is wrong, one thing at a time: scene sections by the words of the table.
ERRORS: dict[str, dict[str, dict[str, Any]]] = {
    "nothing": {},
    "mass 5 kg": {"vehicle": {"mass_kg": 5.0}},
    "mass 7.5 kg": {"vehicle": {"mass_kg": 7.5}},
    "inertia -25 %": {"vehicle": {"inertia_kg_m2": (0.165, 0.225, 0.36)}},
    "inertia +25 %": {"vehicle": {"inertia_kg_m2": (0.275, 0.375, 0.60)}},
    "centre of mass 3 cm forward": {"vehicle": {"com_offset_m": (0.03, 0.0, 0.0)}},
    "centre of mass 3 cm right": {"vehicle": {"com_offset_m": (0.0, 0.03, 0.0)}},
    "centre of mass 3 cm down": {"vehicle": {"com_offset_m": (0.0, 0.0, 0.03)}},
    "camera pitched by 1 deg": {"camera": {"mount_error_deg": (0.0, 1.0, 0.0)}},
    "camera yawed by 1 deg": {"camera": {"mount_error_deg": (0.0, 0.0, 1.0)}},
    "camera rolled by 1 deg": {"camera": {"mount_error_deg": (1.0, 0.0, 0.0)}},
    "camera 1 cm low": {"camera": {"mount_error_m": (0.0, 0.0, 0.01)}},
    "focal length -3 %": {"camera": {"focal_error": -0.03}},
    "focal length +3 %": {"camera": {"focal_error": 0.03}},
}
QUICK = ("mass 7.5 kg", "camera pitched by 1 deg")
#: Errors that only pictures can have.
_PICTURES = "focal"


def design(choice: Choice) -> list[Run]:
    """One error at a time."""
    names = [name for name in ERRORS if choice.features == "rendered" or not name.startswith(_PICTURES)]
    flights = []
    for name in QUICK if choice.quick else names:
        flights += runs(
            NAME,
            choice,
            scene=short_job(STROKE_M, rows=1, **ERRORS[name]),
            measure=paint_figures,
            params={"error": name},
            seeds=1 if choice.quick else 2,
        )
    return flights


EXPERIMENT = Experiment(
    name=NAME,
    title="Wrong beliefs: payload and calibration",
    about="One row of 0.4 m with one wrong belief at a time: mass, inertia, centre of mass, mount of the camera, focal "
    "length. The pilot is told none of it.",
    paper="Not reported.",
    design=design,
    params={"error": "what is wrong"},
    columns=PATH_COLUMNS,
    criteria=(Criterion(text="completed", metric="completed", bound=1.0, least=True, failed_too=True, every=True),),
    draw=draw_payload,
)
