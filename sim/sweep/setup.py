"""What a sweep may vary: scene, pilot and job as one tree, changed by dotted paths."""

from __future__ import annotations

import copy
import dataclasses
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict, to_dict
from ibvs_qp.pilot import PilotConfig
from sim.flight.closed_loop import FlightOptions, pilot_config
from sim.flight.jobs import PaintJob, PressJob
from sim.world.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Everything of a flight that a dotted path reaches, e.g. ``scene.wall.friction``.

    Attributes:
        scene: The truth.
        pilot: Perception, controller, strategy.
        job: What is done at the wall.
    """

    scene: Scene = field(default_factory=Scene)
    pilot: PilotConfig = field(default_factory=PilotConfig)
    job: PaintJob | PressJob = field(default_factory=PaintJob)


def changed(setup: Setup, values: Mapping[str, Any]) -> Setup:
    """The setup with other values, checked alone and together.

    Args:
        setup: Where to start.
        values: New value by dotted path; a last part that is a number counts entries of a list from 0.

    Raises:
        ConfigError: Naming path, value, unit and allowed range.
    """
    roots = {name: getattr(setup, name) for name in ("scene", "pilot", "job")}
    trees = {name: to_dict(root) for name, root in roots.items()}
    touched = set()
    for path, value in values.items():
        root, _, rest = path.partition(".")
        if root not in roots or not rest:
            raise ConfigError(f"unknown parameter {path!r}; paths begin with scene., pilot. or job.")
        if not trees[root] and root == "job":
            raise ConfigError(f"unknown parameter {path!r}: this job has no settings")
        if root not in touched:
            trees[root] = copy.deepcopy(trees[root])
            touched.add(root)
        _put(trees[root], rest.split("."), value, path)
    new = {name: from_dict(type(roots[name]), trees[name], name) for name in touched}
    return Setup(**{**roots, **new})


def value_at(setup: Setup, path: str) -> Any:
    """The present value of a dotted path.

    Raises:
        ConfigError: When there is no such path, or it is not a single value.
    """
    node: Any = setup
    for part in path.split("."):
        if isinstance(node, tuple) and part.isdigit() and int(part) < len(node):
            node = node[int(part)]
        elif dataclasses.is_dataclass(node) and part in {each.name for each in dataclasses.fields(node)}:
            node = getattr(node, part)
        else:
            changed(setup, {path: 0})  # refuses the path by name
            raise ConfigError(f"unknown parameter {path!r}")
    if dataclasses.is_dataclass(node):
        changed(setup, {path: 0})
    return node


def flown_by(setup: Setup, options: FlightOptions) -> PilotConfig:
    """The pilot as it flies: what the scene decides for it is filled in."""
    return pilot_config(setup.scene, options, setup.pilot)


def _put(tree: dict[str, Any], parts: list[str], value: Any, path: str) -> None:
    node: Any = tree
    for part in parts[:-1]:
        if isinstance(node, dict) and part not in node:
            node[part] = {}  # an unknown section: refused by name when the tree is read
        node = node[part] if isinstance(node, dict) else None
    last = parts[-1]
    if isinstance(node, dict):
        if isinstance(node.get(last), dict):
            raise ConfigError(f"{path} is a section; give one of its keys: {', '.join(node[last])}")
        node[last] = value
    elif isinstance(node, list) and last.isdigit() and int(last) < len(node):
        node[int(last)] = value
    else:
        held = f"a list of {len(node)}, entries 0 to {len(node) - 1}" if isinstance(node, list) else "a single value"
        raise ConfigError(f"unknown parameter {path!r}: {path.rsplit('.', 1)[0]} is {held}")


def unit_of(path: str) -> str:
    """Unit of a dotted path; empty where it has none or there is no such path."""
    kinds = {"scene": Scene, "pilot": PilotConfig, "job": PressJob}
    root, *parts = path.split(".")
    kind, unit = kinds.get(root), ""
    for part in parts:
        fields = {each.name: each for each in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else {}
        if part not in fields:
            break
        unit = fields[part].metadata.get("unit", "")
        kind = typing.get_type_hints(kind)[part]
    return unit
