"""Fly several laws over one scene, each in its own process where there are cores for it; the results are the same."""

from __future__ import annotations

import dataclasses
import functools
import resource
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import cv2
import joblib

from sim.flight.closed_loop import fly
from sim.flight.jobs import Job
from sim.flight.options import FlightOptions
from sim.flight.pictures import pack_pictures
from sim.flight.stop import handled_ctrl_c, live_with_parent
from sim.flight.trace import INTERRUPTED, Trace
from sim.world.scene import Scene

#: Called with law, simulated time [s], phase and real-time factor.
LawProgress = Callable[[str, float, str, float], None]


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A trace, and the peak memory of its process if it was not this one [bytes]."""

    trace: Trace
    process_memory_bytes: int = 0


def own_peak_memory() -> int:
    """Peak resident memory of this process [bytes]; the kernel counts in bytes or in KiB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def fly_laws(
    scene: Scene,
    options: FlightOptions,
    laws: Iterable[str],
    progress: LawProgress,
    workers: int | None = None,
    task: Job | None = None,
) -> dict[str, Flight]:
    """Fly the same scene and seed under every law.

    Args:
        scene: The scene.
        options: How to fly it; its law is replaced.
        laws: Laws to fly.
        progress: Called with the progress of every law.
        workers: Processes at a time; None takes one per law if there are cores for all, else one.
        task: Task at the wall; None paints.

    Returns:
        One flight per law; after Ctrl-C the partial ones, without those that never began.
    """
    jobs = {law: dataclasses.replace(options, law=law) for law in laws}
    if (workers or joblib.cpu_count()) >= len(jobs) > 1:
        return _fly_apart(scene, jobs, progress, task)
    flights: dict[str, Flight] = {}
    for law, job in jobs.items():
        trace = _fly_one(scene, job, functools.partial(progress, law), task)
        flights[law] = Flight(trace=trace)
        if trace.reason == INTERRUPTED:
            break
    return flights


def _fly_one(
    scene: Scene, options: FlightOptions, progress: Callable[[float, str, float], None], task: Job | None
) -> Trace:
    """Fly one law and report its end."""
    cv2.setNumThreads(1)  # more of them make no flight faster, and the laws share the cores as processes
    trace = pack_pictures(fly(scene, options, progress, job=task))
    duration = float(trace.t[-1]) if len(trace.t) else 0.0
    phase = INTERRUPTED if trace.reason == INTERRUPTED else "done"
    progress(duration, phase, duration / trace.wall_time_s if trace.wall_time_s > 0 else 0.0)
    return trace


def _fly_apart(
    scene: Scene, jobs: dict[str, FlightOptions], progress: LawProgress, task: Job | None
) -> dict[str, Flight]:
    """One process per law. The first Ctrl-C ends the flights and returns the partial traces; the second one raises.

    Raises:
        RuntimeError: When a process died.
    """
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with _Link(progress) as link:
        calls = [joblib.delayed(_fly_in_worker)(scene, job, task, link.updates, link.stop) for job in jobs.values()]
        try:
            with (
                joblib.parallel_config(backend="loky", inner_max_num_threads=1),
                handled_ctrl_c(signal.SIG_IGN),  # workers inherit it, so Ctrl-C cannot hit their imports
            ):
                parallel = joblib.Parallel(n_jobs=len(jobs), batch_size=1, return_as="generator")  # type: ignore[arg-type]
                results: Any = parallel(calls)
            with handled_ctrl_c(link.stop_flights):
                return dict(zip(jobs, results, strict=True))
        except BrokenProcessPool:
            if link.stopping:  # a stop of the whole group came before the worker could ignore it
                raise KeyboardInterrupt from None
            raise RuntimeError("the process of a flight died; was it out of memory?") from None
        finally:
            get_reusable_executor().shutdown(wait=False, kill_workers=True)


def _fly_in_worker(scene: Scene, options: FlightOptions, task: Job | None, updates: Any, stop: Any) -> Flight:
    live_with_parent()  # `stop` ends the flight

    def report(flown_s: float, phase: str, real_time_factor: float) -> None:
        updates.put((options.law, flown_s, phase, real_time_factor))
        if stop.is_set() and phase not in ("done", INTERRUPTED):
            raise KeyboardInterrupt

    return Flight(trace=_fly_one(scene, options, report, task), process_memory_bytes=own_peak_memory())


class _Link:
    """Progress from the workers and the event that stops them, held by a manager process."""

    def __init__(self, progress: LawProgress) -> None:
        from multiprocessing import get_context
        from multiprocessing.managers import SyncManager

        self._progress, self._manager = progress, SyncManager(ctx=get_context("spawn"))
        self.stopping = False

    def __enter__(self) -> _Link:
        with handled_ctrl_c(signal.SIG_IGN):
            self._manager.start(live_with_parent)
        self.updates, self.stop = self._manager.Queue(), self._manager.Event()
        self._reader = threading.Thread(target=self._pass_on, daemon=True)
        self._reader.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.updates.put(None)
        self._reader.join()
        self._manager.shutdown()

    def _pass_on(self) -> None:
        while (updates := self.updates.get()) is not None:
            self._progress(*updates)

    def stop_flights(self, *_: Any) -> None:
        """Signal handler: end the flights; the next Ctrl-C raises."""
        signal.signal(signal.SIGINT, signal.default_int_handler)
        self.stopping = True
        self.stop.set()
