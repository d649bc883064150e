"""The tree of all sweep parameters: scene, pilot and job, changed by dotted paths."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import from_dict, to_dict
from ibvs_qp.pilot import PilotConfig
from sim.flight.jobs import OwnJob, PaintJob, PressJob
from sim.world.scene import Scene

#: Sections of a setup, the first parts of a dotted path.
ROOTS = ("scene", "pilot", "job")


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Everything of a flight within reach of a dotted path, e.g. ``scene.wall.friction``."""

    scene: Scene = field(default_factory=Scene)  # the truth
    pilot: PilotConfig = field(default_factory=PilotConfig)  # perception, controller, strategy
    job: PaintJob | PressJob | OwnJob = field(default_factory=PaintJob)  # task at the wall


AnySetup = TypeVar("AnySetup", bound=Setup)


def changed(setup: AnySetup, values: Mapping[str, Any]) -> AnySetup:
    """The setup with other values, checked alone and together.

    Args:
        setup: Start values.
        values: New value by dotted path; a number as last part is the index of a list entry, from 0.

    Raises:
        ConfigError: With path, value, unit and allowed range.
    """
    trees: dict[str, dict[str, Any]] = {}
    for path, value in values.items():
        root, _, rest = path.partition(".")
        if root not in ROOTS or not rest:
            raise ConfigError(f"unknown parameter {path!r}; paths begin with scene., pilot. or job.")
        if root not in trees:
            trees[root] = copy.deepcopy(to_dict(getattr(setup, root)))
        if not trees[root] and root == "job":
            raise ConfigError(f"unknown parameter {path!r}: this job has no settings")
        _put(trees[root], rest.split("."), value, path)
    return dataclasses.replace(
        setup, **{root: from_dict(type(getattr(setup, root)), tree, root) for root, tree in trees.items()}
    )


def _put(tree: dict[str, Any], parts: list[str], value: Any, path: str) -> None:
    node: Any = tree
    for part in parts[:-1]:
        # `from_dict` later refuses an unknown section by name.
        node = node.setdefault(part, {}) if isinstance(node, dict) else None
    last = parts[-1]
    if isinstance(node, dict):
        if isinstance(node.get(last), dict):
            raise ConfigError(f"{path} is a section; give one of its keys: {', '.join(node[last])}")
        node[last] = value
    elif isinstance(node, list) and last.isdigit() and int(last) < len(node):
        node[int(last)] = value
    else:
        kind = f"a list of {len(node)}, entries 0 to {len(node) - 1}" if isinstance(node, list) else "a single value"
        raise ConfigError(f"unknown parameter {path!r}: {path.rsplit('.', 1)[0]} is {kind}")


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


def unit_of(path: str) -> str:
    """Unit of a dotted path; empty for a pure number or an unknown path."""
    node: Any = Setup(job=PressJob())
    unit = ""
    for part in path.split("."):
        fields = {each.name: each for each in dataclasses.fields(node)} if dataclasses.is_dataclass(node) else {}
        if part not in fields:
            break
        unit, node = fields[part].metadata.get("unit", ""), getattr(node, part)
    return unit
