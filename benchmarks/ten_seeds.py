"""Both laws over the default scene and seeds 0..9 on rendered pictures; prints a table in Markdown.

Run as ``python benchmarks/ten_seeds.py --jobs 2``, with ``--camera gl`` drawn by OpenGL; a flight takes 10 s and more.
"""

from __future__ import annotations

import argparse
from typing import Any

import joblib
import numpy as np

from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import Scene

#: Figure, words, factor to the reported unit, unit, and bound of the QP law.
FIGURES = (
    ("stroke_m", "shortest stroke", 1.0, "m", ">= 1.2"),
    ("path_rms_straight_m", "path error, straights, rms", 1e3, "mm", "<= 5"),
    ("path_rms_corner_m", "path error, corners, rms", 1e3, "mm", "<= 15"),
    ("force_rms_straight_n", "push error, straights, rms", 1.0, "N", "<= 0.35"),
    ("force_peak_n", "push, peak of the flight", 1.0, "N", "<= 7.5"),
    ("contact_share", "contact while painting", 100.0, "%", ">= 99"),
    ("tilt_rms_deg", "tilt, rms", 1.0, "deg", "<= 1"),
    ("tilt_peak_deg", "tilt, peak", 1.0, "deg", "<= 3"),
    ("yaw_peak_deg", "yaw, peak", 1.0, "deg", "<= 3"),
    ("coverage", "coverage", 100.0, "%", ">= 97"),
    ("settle_s", "push settled after touch", 1.0, "s", ""),
)
SEEDS = range(10)
LAWS = ("qp", "paper")


def flight(law: str, seed: int, camera: str) -> dict[str, Any]:
    trace = fly(Scene(), FlightOptions(law=law, seed=seed, camera=camera, video=False, machine_code=True))
    figures = compute_metrics(trace)
    ticks = sum(figures["outcomes"].values())
    return {"law": law, "completed": trace.completed, "solved": figures["outcomes"]["solved"] / ticks, **figures}


def table(flights: list[dict[str, Any]]) -> str:
    rows = [
        "| figure | QP: median (least to most) | analytic: median (least to most) | bound of the QP |",
        "|---|---|---|---|",
    ]
    by_law = {law: [each for each in flights if each["law"] == law] for law in LAWS}
    done = [f"{sum(each['completed'] for each in by_law[law])} of {len(by_law[law])}" for law in LAWS]
    rows.append(f"| completed | {done[0]} | {done[1]} | all |")
    for name, words, factor, unit, bound in FIGURES:
        cells = []
        for law in LAWS:
            values = factor * np.array([each[name] for each in by_law[law]], float)
            cells.append(f"{np.median(values):.2f} ({values.min():.2f} to {values.max():.2f}) {unit}")
        rows.append(f"| {words} | {cells[0]} | {cells[1]} | {bound} {unit if bound else ''} |")
    solved = 100.0 * min(each["solved"] for each in by_law["qp"])
    rows.append(f"| ticks with outcome solved, least | {solved:.2f} % | | >= 99.9 % |")
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2, help="processes side by side")
    parser.add_argument("--camera", choices=("plane", "gl"), default="plane", help="camera back end")
    options = parser.parse_args()
    jobs = [joblib.delayed(flight)(law, seed, options.camera) for seed in SEEDS for law in LAWS]
    flights = joblib.Parallel(n_jobs=options.jobs)(jobs)
    print(table(list(flights)))


if __name__ == "__main__":
    main()
