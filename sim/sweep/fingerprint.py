"""Hashes that decide whether two runs are the same: configuration, seed, and source code of the flight."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import allocation
import ibvs_qp
import sim
from ibvs_qp.config.settings import to_dict
from sim.flight.own_class import source_of
from sim.sweep.design import Block, Run

#: Folders of `sim` that only describe or draw results: a change there needs no new flight.
_AFTER_THE_FLIGHT = ("figures", "commands", "experiments", "fault_matrix", "notebook", "report", "tune")
#: Options that do not make a flight another one.
_NOT_HASHED = ("seed", "journal")
#: Suffixes of source files.
_SOURCES = (".py", ".c", ".h")
#: Hexadecimal digits of a hash: 64 bit.
_LENGTH = 16


def digest(content: Any) -> str:
    """Short hash of a JSON value."""
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def configuration_hash(run: Run) -> str:
    """Hash of scene, configuration, options, job and faults; all seeds of a cell in one scene have the same one."""
    plan = run.plan
    options = {key: value for key, value in dataclasses.asdict(plan.options).items() if key not in _NOT_HASHED}
    return digest(
        {
            "scene": to_dict(plan.scene),
            "config": to_dict(plan.config),
            "options": options,
            "job": repr(plan.job),
            "own": own_sources((plan.options.controller, getattr(plan.job, "name", ""), *plan.options.rows)),
            "faults": [repr(fault) for fault in plan.faults],
        }
    )


def own_sources(names: Sequence[str]) -> list[str]:
    """Source code of classes of the user's, ``module:Class`` or ``file.py:Class``; empty names are left out."""
    return [source_of(name) for name in names if name]


@functools.cache
def code_hash() -> str:
    """Hash of all source code that takes part in a flight."""
    source = hashlib.sha256()
    for package in (allocation, ibvs_qp, sim):
        root = Path(next(iter(package.__path__)))
        for file in sorted(file for suffix in _SOURCES for file in root.rglob(f"*{suffix}")):
            relative = file.relative_to(root)
            if package is sim and relative.parts[0] in _AFTER_THE_FLIGHT:
                continue
            source.update(str(relative).encode() + b"\0" + file.read_bytes())
    return source.hexdigest()[:_LENGTH]


def listed_block(runs: Sequence[Run]) -> Block:
    """A block of explicitly listed runs."""
    rows = [
        (run.experiment, run.variant, run.params, configuration_hash(run), run.seed, run.measure.__qualname__, kept)
        for run in runs
        for kept in ((run.keep, run.trace),)
    ]
    return Block(
        name=digest({"rows": rows, "code": code_hash()}),
        count=len(runs),
        expected_s=sum(run.expected_s for run in runs),
        make=functools.partial(tuple, runs),
    )
