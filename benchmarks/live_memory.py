"""Memory of a session of ``ibvs-qp live``: rows and snapshots of the last minute of both laws, and growth after it.

Example: python benchmarks/live_memory.py --minutes 10
"""

from __future__ import annotations

import argparse
import time

import psutil

from sim.flight.jobs import PressJob
from sim.live.rows import KEPT_S
from sim.live.session import Session, ghost_flight
from sim.live.session_file import Start

#: Bounds [MB]: of what a minute keeps, and of growth after it (fragments of the heap).
REWIND_MB, GROWTH_MB = 200.0, 20.0
#: Flight before the first figure [s]: caches are filled, and few snapshots are kept.
BEGIN_S = 8.0


def main() -> int:
    """Fly without a clock, and print the memory every minute; exit code 1 beyond a bound."""
    parser = argparse.ArgumentParser(description="Memory of a session of ibvs-qp live")
    parser.add_argument("--minutes", type=float, default=10.0, help="of flight")
    parser.add_argument("--features", default="geometric")
    given = parser.parse_args()
    start = Start(press=PressJob(hold_s=60.0 * given.minutes), features=given.features)
    session = Session(start, ghost_flight(start))
    tick_s, process = session.qp.loop.pilot.config.controller.tick_s, psutil.Process()

    def memory_mb(until_s: float) -> float:
        while session.going and session.ticks * tick_s < until_s:
            session.step()
        used = 1e-6 * process.memory_full_info().uss
        print(f"{session.ticks * tick_s:6.0f} s: {used:.0f} MB, processor {time.process_time():.0f} s", flush=True)
        return used

    begin = memory_mb(BEGIN_S)
    full = last = memory_mb(2.0 * KEPT_S)
    for minute in range(3, int(given.minutes) + 1):
        last = memory_mb(60.0 * minute)
    print(f"a minute of both laws: {full - begin:.0f} MB (at most {REWIND_MB:.0f})")
    print(f"growth from 2 to {given.minutes:g} min: {last - full:.0f} MB (at most {GROWTH_MB:.0f})")
    return int(full - begin > REWIND_MB or last - full > GROWTH_MB)


if __name__ == "__main__":
    raise SystemExit(main())
