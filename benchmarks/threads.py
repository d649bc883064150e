"""Rate of steps of two controllers in two threads over that of one controller alone; the median of several rounds.

Run as ``python benchmarks/threads.py`` on an otherwise idle computer. The solves of a process take turns, because OSQP
replaces the handler of SIGINT meanwhile (`ibvs_qp/qp/solvers/osqp.py`); two threads must not be slower than 0.9.
"""

from __future__ import annotations

import argparse
import dataclasses
import threading
import time

import numpy as np

from ibvs_qp import HybridController, Measurement, Reference

TICK_NS = 4_000_000
STEPS = 3000


def run(controller: HybridController) -> None:
    """Hover before a wall for `STEPS` ticks."""
    controller.reset()
    measurement = Measurement(
        stamp_ns=0,
        wrench_stamp_ns=0,
        attitude=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_velocity=np.zeros(3),
        specific_force=np.array([0.0, 0.0, -9.81]),
        contact_wrench=np.zeros(6),
    )
    reference = Reference(standoff=0.2)
    for tick in range(1, STEPS):
        stamp = tick * TICK_NS
        controller.step(dataclasses.replace(measurement, stamp_ns=stamp, wrench_stamp_ns=stamp), reference)


def rate(controllers: list[HybridController]) -> float:
    """Steps per second of wall-clock time, in sum."""
    threads = [threading.Thread(target=run, args=(each,)) for each in controllers]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return STEPS * len(threads) / (time.perf_counter() - begin)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="rounds (default 7)")
    controllers = [HybridController(), HybridController()]
    run(controllers[0])
    ratios = [rate(controllers) / rate(controllers[:1]) for _ in range(parser.parse_args().rounds)]
    print(f"two threads over one: {np.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}), goal 0.9")


if __name__ == "__main__":
    main()
