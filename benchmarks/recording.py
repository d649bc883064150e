"""Time that a recorder adds to a tick: a step of the controller alone and recorded; prints one line of JSON.

Run as ``python benchmarks/recording.py --ticks 4000``. Both get the measurements and references of one recorded flight,
tick by tick in turn, at 250 Hz as in flight, so that the thread of the log has the pauses that it has there and the
computer's load is the same for both. ``recording_us`` is the median difference of a pair by the wall clock,
``recording_cpu_us`` by the processor time of the loop's thread, which other processes do not disturb.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np

from ibvs_qp.controller import HybridController
from ibvs_qp.interfaces.log import Recorder, read_log, replay
from ibvs_qp.pilot import Pilot
from ibvs_qp.pilot.runner import run
from ibvs_qp.supervision.assured import Assured
from sim.experiments.scenes import near_wall
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.worlds import in_world

#: Ticks that warm caches up and are not measured.
WARM_UP = 200


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=4000, help="ticks of the flight (default 4000: 16 s)")
    ticks = parser.parse_args().ticks
    options = FlightOptions(features="geometric", video=False)
    scene = in_world(near_wall(), "datasheet")
    config = pilot_config(scene, options)
    flown, world = Pilot(config), World(scene, options, config)
    frames, steps = [], []
    for _ in range(ticks):
        frames.append(world.sense())
        world.act(flown.step(frames[-1]).thrusts)
        steps.append((flown.measurement, flown.reference))
    figures: dict[str, float | bool] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, make, inputs in (
            ("controller", lambda: HybridController(config.controller), steps),
            ("assured", lambda: Assured(HybridController(config.controller)), steps),
            ("pilot", lambda: Pilot(config), [(frame,) for frame in frames]),
        ):
            file = Path(folder) / f"{name}.mcap"
            figures |= {f"{name}_{key}": value for key, value in measured(make, inputs, file).items()}
    print(json.dumps(figures | {"ticks": ticks}))


def measured(make, inputs, file: Path) -> dict[str, float | bool]:
    """Figures of one kind: medians [us], and whether its log replays to the bit."""
    alone, times, cpu = make(), np.zeros((len(inputs), 2)), np.zeros((len(inputs), 2))
    with Recorder(file, make()) as recorder:
        count = iter(range(len(inputs)))

        def tick(_: int) -> bool:
            index = next(count)
            both = (alone.step, recorder.step)
            for place in (0, 1) if index % 2 else (1, 0):  # neither is always first, on a warmer cache
                begin, cpu_begin = time.perf_counter(), time.thread_time()
                both[place](*inputs[index])
                cpu[index, place], times[index, place] = time.thread_time() - cpu_begin, time.perf_counter() - begin
            return index + 1 < len(inputs)

        run(tick, 250.0)
        dropped = recorder.dropped
    us = 1e6 * times[WARM_UP:]
    result = replay(read_log(file))
    return {
        "alone_us": round(float(np.median(us[:, 0])), 1),
        "recorded_us": round(float(np.median(us[:, 1])), 1),
        "recording_us": round(float(np.median(us[:, 1] - us[:, 0])), 1),
        "recording_cpu_us": round(1e6 * float(np.median(cpu[WARM_UP:, 1] - cpu[WARM_UP:, 0])), 1),
        "alone_p99_us": round(float(np.percentile(us[:, 0], 99)), 1),
        "recorded_p99_us": round(float(np.percentile(us[:, 1], 99)), 1),
        "dropped": dropped,
        "same_to_the_bit": result.same and result.ticks == len(inputs),
    }


if __name__ == "__main__":
    main()
