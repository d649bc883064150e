"""Fly several laws over one scene, in a process each when there are cores for it; the results are the same."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import multiprocessing
import os
import resource
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from ibvs_qp.config.errors import IbvsQpError
from sim.flight.closed_loop import FlightOptions, fly
from sim.flight.trace import Trace
from sim.flight.video import pack_pictures
from sim.world.scene import Scene

#: Called with law, simulated time [s], phase and real-time factor.
LawProgress = Callable[[str, float, str, float], None]
#: Reason of a trace that Ctrl-C ended.
INTERRUPTED = "interrupted"
_SIGINT = {signal.SIGINT}


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A trace and the peak memory of the processes that flew it beside this one [bytes]."""

    trace: Trace
    process_memory_bytes: int = 0


def own_peak_memory() -> int:
    """Peak resident memory of this process [bytes]; the kernel counts in bytes or in KiB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def fly_laws(
    scene: Scene, options: FlightOptions, laws: Iterable[str], progress: LawProgress, workers: int | None = None
) -> dict[str, Flight]:
    """Fly the same scene and seed under every law.

    Args:
        scene: The scene.
        options: How to fly it; its law is replaced.
        laws: Laws to fly.
        progress: Told about every law's progress.
        workers: Processes at a time; None takes one per law if there are cores for all, else one.

    Returns:
        One flight per law; after Ctrl-C the partial ones, without those that never began.
    """
    jobs = {law: dataclasses.replace(options, law=law) for law in laws}
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if (workers or cores) >= len(jobs) > 1:
        return _fly_apart(scene, jobs, progress)
    flights: dict[str, Flight] = {}
    for law, job in jobs.items():
        trace = fly(scene, job, functools.partial(progress, law))
        flights[law] = Flight(trace=pack_pictures(trace))
        _tell_end(law, trace, progress)
        if trace.reason == INTERRUPTED:
            break
    return flights


def _tell_end(law: str, trace: Trace, progress: LawProgress) -> None:
    duration = float(trace.t[-1]) if len(trace.t) else 0.0
    phase = INTERRUPTED if trace.reason == INTERRUPTED else "done"
    progress(law, duration, phase, duration / trace.wall_time_s if trace.wall_time_s > 0 else 0.0)


def _fly_apart(scene: Scene, jobs: dict[str, FlightOptions], progress: LawProgress) -> dict[str, Flight]:
    """One process per law. Ctrl-C reaches this process alone, which passes it on once and collects what was flown."""
    pipes: dict[Connection, str] = {}
    processes: list[BaseProcess] = []
    flights: dict[str, Flight] = {}
    try:
        with _interrupt_passed_on(processes):
            _start(scene, jobs, pipes, processes)
            while pipes:
                for pipe in wait(list(pipes)):
                    _receive(pipe, pipes, flights, progress)  # type: ignore[arg-type]
    finally:
        for process in processes:
            if pipes:
                process.terminate()
            process.join()
    return {law: flights[law] for law in jobs if law in flights}


def _start(
    scene: Scene, jobs: dict[str, FlightOptions], pipes: dict[Connection, str], processes: list[BaseProcess]
) -> None:
    """Start a process per job; Ctrl-C is blocked so that it cannot hit their imports."""
    context = multiprocessing.get_context("spawn")
    resource_tracker.ensure_running()  # its own start lets Ctrl-C through again
    signal.pthread_sigmask(signal.SIG_BLOCK, _SIGINT)
    try:
        for law, job in jobs.items():
            here, there = context.Pipe(duplex=False)
            process = context.Process(target=_child, args=(scene, job, there), daemon=True)
            process.start()
            there.close()
            pipes[here] = law
            processes.append(process)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGINT)


@contextlib.contextmanager
def _interrupt_passed_on(processes: list[BaseProcess]) -> Iterator[None]:
    """Let the first Ctrl-C end the children's flights; an exception here could tear a message in two."""
    previous = signal.getsignal(signal.SIGINT)

    def pass_on(*_: Any) -> None:
        signal.signal(signal.SIGINT, previous)
        for process in processes:
            if process.is_alive() and process.pid:
                os.kill(process.pid, signal.SIGINT)

    if threading.current_thread() is not threading.main_thread():
        yield  # signals belong to the main thread
        return
    signal.signal(signal.SIGINT, pass_on)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def _receive(pipe: Connection, pipes: dict[Connection, str], flights: dict[str, Flight], progress: LawProgress) -> None:
    law = pipes[pipe]
    try:
        kind, content = pipe.recv()
    except EOFError:
        raise RuntimeError(f"the process flying law {law} died without a word; was it out of memory?") from None
    if kind == "progress":
        progress(law, *content)
        return
    del pipes[pipe]
    if kind == "done":
        flights[law] = content
        _tell_end(law, content.trace, progress)
    elif kind == "refused":
        raise content
    elif kind == "failed":
        raise RuntimeError(f"law {law} failed in its process:\n{content}")


def _child(scene: Scene, options: FlightOptions, pipe: Connection) -> None:
    def tell(*news: Any) -> None:
        pipe.send(("progress", news))

    os.setpgrp()  # the terminal's Ctrl-C goes to the parent, which decides
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a parent started in the background ignores it
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGINT)
        trace = pack_pictures(fly(scene, options, tell))
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGINT)
        answer = ("done", Flight(trace=trace, process_memory_bytes=own_peak_memory()))
    except KeyboardInterrupt:
        answer = ("interrupted", None)
    except IbvsQpError as error:
        answer = ("refused", error)
    except Exception:
        answer = ("failed", traceback.format_exc())
    pipe.send(answer)
    pipe.close()
