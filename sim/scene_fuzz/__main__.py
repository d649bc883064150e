"""``python -m sim.scene_fuzz --draws 150 --first-seed 1000``: fly drawn scenes and count their outcomes.

Prints every draw that is not complete, then figure, goal and n; exits 1 when a scene had an outcome that none may have.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from sim.flight.options import FlightOptions
from sim.scene_fuzz.judge import BAD, COMPLETE, OUTCOMES, judge
from sim.world.worlds import DEFAULT_WORLD, world_names

#: Longest time of the strokes of a drawn scene [s]; ten times that of the default one would take a day for 150 draws.
LONGEST_S = 150.0


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.scene_fuzz", description=__doc__)
    parser.add_argument("--draws", type=int, default=150, help="number of scenes")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first; the next ones follow")
    parser.add_argument("--law", choices=("qp", "paper"), default="qp")
    parser.add_argument("--features", choices=("geometric", "rendered"), default="geometric")
    parser.add_argument("--world", choices=world_names(), default=DEFAULT_WORLD)
    parser.add_argument("--longest", type=float, default=LONGEST_S, help="longest time of a scene's strokes [s]")
    given = parser.parse_args()
    options = FlightOptions(law=given.law, features=given.features, video=False, compiled=True)
    counts: Counter[str] = Counter()
    for seed in range(given.first_seed, given.first_seed + given.draws):
        judged = judge(seed, options, given.world, given.longest)
        counts[judged.outcome] += 1
        if judged.outcome != COMPLETE:
            print(judged, flush=True)
    flown = f"n = {given.draws} scenes, {given.law}, {given.features}, {given.world}, from seed {given.first_seed}"
    print(f"\n{'figure':<24} {'count':>5}  goal   {flown}")
    for outcome in OUTCOMES:
        print(f"{outcome:<24} {counts[outcome]:>5}  {'0' if outcome in BAD else '-':<6}")
    return int(any(counts[outcome] for outcome in BAD))


if __name__ == "__main__":
    sys.exit(main())
