"""Cost of the supervisor: a step of the controller alone and under `Assured`; prints one line of JSON.

Run as ``python benchmarks/supervision.py --ticks 4000``. Both get the measurements, references and contacts of one
recorded flight, tick by tick in turn, so that the computer's load is the same for both. ``inputs`` is what the checks
of a measurement cost, which both pay.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from typing import Any

from ibvs_qp.command import SafetyState
from ibvs_qp.controller import HybridController
from ibvs_qp.pilot import Pilot
from ibvs_qp.supervision.assured import Assured
from ibvs_qp.validation.measurement import MeasurementGate
from sim.experiments.scenes import near_wall
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.worlds import in_world

#: Ticks that warm caches up and are not measured.
WARM_UP = 200


def recorded(ticks: int) -> tuple[Any, list[tuple[Any, Any, Any]]]:
    """Controller configuration, and measurement, reference and contact of every tick of a flight."""
    options = FlightOptions(features="geometric", video=False)
    scene = in_world(near_wall(), "datasheet")
    config = pilot_config(scene, options)
    pilot, world, steps = Pilot(config), World(scene, options, config), []
    for _ in range(ticks):
        world.act(pilot.step(world.sense()).thrusts)
        steps.append((pilot.measurement, pilot.reference, pilot.contact.state))
    return config.controller, steps


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=4000, help="ticks of the flight (default 4000: 16 s)")
    config, steps = recorded(parser.parse_args().ticks)
    gate = MeasurementGate(config.vehicle.geometry.count, config.line_slots)
    alone, assured = HybridController(config), Assured(HybridController(config))
    times: dict[str, list[float]] = {"inputs": [], "alone": [], "assured": []}
    supervised = 0
    for measurement, reference, contact in steps:
        begin = time.perf_counter()
        gate.check(measurement)
        checked = time.perf_counter()
        alone.step(measurement, reference, contact)
        stepped = time.perf_counter()
        command = assured.step(measurement, reference, contact)
        end = time.perf_counter()
        for name, time_s in (("inputs", checked - begin), ("alone", stepped - checked), ("assured", end - stepped)):
            times[name].append(time_s)
        supervised += command.safety is not SafetyState.NOMINAL
    median_us = {name: 1e6 * statistics.median(values[WARM_UP:]) for name, values in times.items()}
    figures = {f"{name}_us": round(value, 1) for name, value in median_us.items()}
    extra = round(median_us["assured"] - median_us["alone"], 1)
    print(json.dumps(figures | {"supervision_us": extra, "ticks": len(steps), "not_nominal": supervised}))


if __name__ == "__main__":
    main()
