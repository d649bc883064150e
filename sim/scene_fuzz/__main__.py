"""``python -m sim.scene_fuzz --draws 150 --first-seed 1000``: fly drawn scenes and count their outcomes.

``--scenes PATH`` flies the scenes of a folder, or one file, instead: none may fail, and none may push harder than 2.5
times the reference. With ``--may-fail`` they may fail, but not crash, break or be claimed falsely.
``sim/scene_fuzz/hard`` has scenes that once crashed or shook. Prints every scene that is not complete, then figure,
goal and n; exits 1 when a goal is missed.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import cast

from joblib import Parallel, delayed

from sim.flight.options import FlightOptions
from sim.scene_fuzz.check import BAD, COMPLETE, FAILED, OUTCOMES, Checked, check_draw, check_file
from sim.world.worlds import DEFAULT_WORLD, world_names

#: Longest time of the strokes of a drawn scene [s]; ten times that of the default one would take a day for 150 draws.
LONGEST_S = 150.0
#: Hardest push over the reference in the scenes of a folder.
HARDEST_PUSH = 2.5


def main() -> int:
    """Fly, print, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.scene_fuzz", description=__doc__)
    parser.add_argument("--draws", type=int, default=150, help="number of scenes")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first; the next ones follow")
    parser.add_argument(
        "--scenes", type=Path, help="scene (TOML), or folder of scenes, to fly instead of draws, each with --seeds"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="seeds of the scenes of a folder")
    parser.add_argument("--may-fail", action="store_true", help="scenes of a folder may fail with a true reason")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--law", choices=("qp", "paper"), default="qp")
    parser.add_argument("--features", choices=("geometric", "rendered"), default="geometric")
    parser.add_argument("--world", choices=world_names(), default=DEFAULT_WORLD)
    parser.add_argument("--longest", type=float, default=LONGEST_S, help="longest time of a scene's strokes [s]")
    given = parser.parse_args()
    options = FlightOptions(law=given.law, features=given.features, video=False, compiled=True)
    if given.scenes is not None:
        files = [given.scenes] if given.scenes.is_file() else sorted(given.scenes.glob("*.toml"))
        if not files:
            parser.error(f"--scenes: no scene (*.toml) in {given.scenes}")
        calls = [delayed(check_file)(file, options, given.world, seed) for file in files for seed in given.seeds]
        bad, source = BAD if given.may_fail else (*BAD, FAILED), str(given.scenes)
    else:
        seeds = range(given.first_seed, given.first_seed + given.draws)
        calls = [delayed(check_draw)(seed, options, given.world, given.longest) for seed in seeds]
        bad, source = BAD, f"draws from seed {given.first_seed}"
    counts: Counter[str] = Counter()
    hardest = 0.0
    for each in cast("Iterator[Checked]", Parallel(n_jobs=given.jobs, return_as="generator")(calls)):
        counts[each.outcome] += 1
        hardest = max(hardest, each.push if math.isfinite(each.push) else 0.0)
        if each.outcome != COMPLETE or each.push > HARDEST_PUSH:
            print(each, flush=True)
    flown = f"n = {counts.total()} flights, {given.law}, {given.features}, {given.world}, {source}"
    print(f"\n{'figure':<32} {'value':>5}  goal   {flown}")
    for outcome in OUTCOMES:
        print(f"{outcome:<32} {counts[outcome]:>5}  {'0' if outcome in bad else '-':<6}")
    print(f"{'hardest push over reference':<32} {hardest:>5.2f}  {HARDEST_PUSH if given.scenes else '-'}")
    too_hard = given.scenes is not None and hardest > HARDEST_PUSH
    return int(too_hard or not counts or any(counts[outcome] for outcome in bad))


if __name__ == "__main__":
    sys.exit(main())
