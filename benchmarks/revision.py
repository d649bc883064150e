"""Processor time of a tick against another revision; prints one line of JSON.

Run as ``python benchmarks/revision.py 1262c78 --rounds 5``. The working tree and the revision fly the same scene in
turn, each with its own simulator and preset, in a process of its own: the law alone (`HybridController.step`) and the
whole tick (`Pilot.step`, geometric features). Times are medians over the ticks of a round; the ratio is the median over
the rounds.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import statistics
import subprocess  # nosec B404
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Ticks that warm caches up and are not measured.
WARM_UP = 500
#: Flies ticks and prints the median processor times of tick and law [us]; runs in either revision.
ROUND = f"""
import statistics, sys, time
from ibvs_qp.controller import HybridController
from ibvs_qp.pilot import Pilot
from sim.experiments.scenes import near_wall
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.worlds import in_world

options = FlightOptions(features="geometric", video=False, compiled=True)
scene = in_world(near_wall(), "datasheet")
config = pilot_config(scene, options)
pilot, world, law = Pilot(config), World(scene, options, config), HybridController(config.controller)
ticks, laws = [], []
for _ in range(int(sys.argv[1])):
    frame = world.sense()
    begin = time.thread_time()
    command = pilot.step(frame)
    flown = time.thread_time()
    law.step(pilot.measurement, pilot.reference, pilot.contact.state)
    ticks.append(flown - begin)
    laws.append(time.thread_time() - flown)
    world.act(command.thrusts)
print(*(1e6 * statistics.median(times[{WARM_UP}:]) for times in (ticks, laws)))
"""


def measured(tree: Path, ticks: int) -> tuple[float, float]:
    """Tick and law in a tree [us]."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", ROUND, str(ticks)]
    done = subprocess.run(  # nosec B603
        command, cwd=tree, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{tree}: {done.stderr}")
    tick, law = (float(value) for value in done.stdout.split()[-2:])
    return tick, law


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("revision", help="of this repository")
    parser.add_argument("--rounds", type=int, default=5, help="flights of each revision")
    parser.add_argument("--ticks", type=int, default=4000, help="ticks of a flight (4000: 16 s)")
    given = parser.parse_args()
    if given.rounds < 1 or given.ticks <= WARM_UP:
        parser.error(f"--rounds must be at least 1, --ticks above {WARM_UP}")
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder)
        archive = ["git", "archive", "--format=tar", given.revision]
        packed = subprocess.run(archive, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout  # nosec B603
        with tarfile.open(fileobj=io.BytesIO(packed)) as tar:
            tar.extractall(folder, filter="data")
        pairs = [[measured(tree, given.ticks) for tree in (ROOT, other)] for _ in range(given.rounds)]
    found = {}
    for index, name in enumerate(("tick", "law")):
        here, there = ([pair[side][index] for pair in pairs] for side in (0, 1))
        ratio = statistics.median(one / two for one, two in zip(here, there, strict=True))
        found |= {
            f"{name}_us": round(statistics.median(here)),
            f"{name}_us_{given.revision}": round(statistics.median(there)),
        }
        found[f"{name}_ratio"] = round(ratio, 3)
    print(json.dumps({**found, "rounds": given.rounds}))


if __name__ == "__main__":
    main()
