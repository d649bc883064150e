"""Flights with faults in vision: guide hidden, glare, broken edge, paint without edge."""

from __future__ import annotations

import dataclasses
import itertools
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import to_camera
from ibvs_qp.pilot.painting.pattern import CORNERS, PATTERNS, Pattern
from sim.experiments.scenes import near_wall
from sim.faults.fault import Fault
from sim.faults.features import FeatureFault
from sim.faults.picture import PictureCovered
from sim.faults.scenario import Scenario, scenario
from sim.world.random_streams import stream
from sim.world.scene import PaintScene, Scene

#: Rows of faults.
ROWS_FILE = Path(__file__).with_name("vision_faults.toml")
#: Strokes of these jobs and their length [m]: a guide of the board, two of paint, in 35 s.
STROKES, STROKE_M = 3, 0.8
#: Flights of every row under each law, and all flights from pictures under each law.
FLIGHTS, RENDERED_FLIGHTS = 9, 10


def faulty_jobs(seed: int, features: str) -> Iterator[tuple[str, int, Scene, tuple[Fault, ...]]]:
    """Row, seed of the flight, scene and faults of every flight: patterns and corners in turn, moments drawn.

    Args:
        seed: Of the design.
        features: "geometric" or "rendered"; faults of lines fly with the former only.
    """
    rows = [scenario(row) for row in tomllib.loads(ROWS_FILE.read_text(encoding="utf-8"))["row"]]
    places = list(itertools.product(PATTERNS, CORNERS))
    if features == "geometric":
        flown = [row for row in rows for _ in range(FLIGHTS)]
    else:
        seen = [row for row in rows if not any(isinstance(fault, FeatureFault) for fault in row.faults)]
        flown = [seen[number % len(seen)] for number in range(RENDERED_FLIGHTS)]
    for number, row in enumerate(flown):
        pattern, start = places[number % len(places)]
        moment = float(stream(seed + number, "moment of a fault in vision").random())
        yield row.name, seed + number, _scene(pattern, start), _struck(row, moment, Pattern(pattern, start))


def _scene(pattern: str, start: str) -> Scene:
    size = STROKE_M + 2.0 * PaintScene().edge_margin_m
    paint = {"pattern": pattern, "start": start, "rows": STROKES, "stroke_m": STROKE_M}
    return near_wall(board={"width_m": size, "height_m": size}, paint=paint)


def _struck(row: Scenario, moment: float, pattern: Pattern) -> tuple[Fault, ...]:
    """The faults of a row at a moment 0..1 of the strokes but one, at their places in the picture of a pattern."""
    delay_s = moment * (STROKES - 1) * STROKE_M / PaintScene().speed_m_s
    faults = (dataclasses.replace(fault, delay_s=delay_s) for fault in row.faults)
    return tuple(_placed(fault, pattern) if isinstance(fault, PictureCovered) else fault for fault in faults)


def _placed(fault: PictureCovered, pattern: Pattern) -> PictureCovered:
    """The fault with its place and half axes in the picture, from those along and across the strokes."""
    vehicle = VehicleParams()
    tip = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    right, down = np.add(tip[:2] / tip[2], pattern.to_wall(fault.right, fault.down)).tolist()
    half_width, half_height = np.abs(pattern.to_wall(fault.half_width, fault.half_height)).tolist()
    return dataclasses.replace(fault, right=right, down=down, half_width=half_width, half_height=half_height)
