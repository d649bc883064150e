"""Page of all tasks and limits: rows, units, weights, slack weights, bounds, switches and their reasons.

``python -m sim.report.catalogue`` prints docs/tasks_and_limits.md from the classes and the settings that they name.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import default_limits, default_tasks, qp_problem
from ibvs_qp.limits import Limit
from ibvs_qp.model.rows import LimitRow, TaskRow
from ibvs_qp.tasks import Task
from sim.evaluate.table import markdown

_HEAD = """\
# Tasks and limits of the program

Written by `python -m sim.report.catalogue` from the classes and their settings; a test compares the page with them.
[model](how_it_works/model.md) explains how they work together, [your own](extending.md) how to add one. Rows are those
of the shipped vehicle. Settings are named as in a preset's TOML, below `[controller]` in a pilot's preset.
"""

_TASKS = """
## Tasks

A row costs `weight * (achieved - target)^2 / 2`, so a weight is per squared unit of its row and the cost has no unit.
The table lists full weights. At a tick, lambda and 1 - lambda blend push and stand-off; the weight of a line falls
as its variance rises and is zero without the line; the velocity rows lose weight in directions that a line fixes;
while friction holds the tip, `velocity_right` has the weight of `height` (`ibvs_qp/tasks/velocity.py`).

"""

_LIMITS = """
## Limits

A soft row costs `slack weight * slack^2 / 2`. `limits.hard_barriers = true` makes all rows hard, `barriers = false`
removes all soft rows.

"""

_BOUNDS = "\n## Bounds\n\n"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Setting:
    """A field of the configuration with its documentation.

    Attributes:
        place: Dotted name as in TOML.
        value: Its value.
        unit, doc, why: Its unit, its meaning, and the reason for its default.
    """

    place: str
    value: Any
    unit: str
    doc: str
    why: str

    @classmethod
    def of(cls, config: ControllerConfig, place: str) -> Setting:
        """The field at a dotted name; AttributeError or KeyError if it does not exist."""
        owner: Any = config
        *path, name = place.split(".")
        for part in path:
            owner = getattr(owner, part)
        meta: Mapping[str, Any] = {field.name: field.metadata for field in dataclasses.fields(owner)}[name]
        return cls(place=place, value=getattr(owner, name), unit=meta["unit"], doc=meta["doc"], why=meta.get("why", ""))

    @property
    def amount(self) -> str:
        """Value with its unit."""
        value = str(self.value).lower() if isinstance(self.value, bool) else f"{self.value:g}"
        return f"{value} {_superscript(self.unit.replace('1/', 'per '))}".rstrip()


def settings_of_rows(part: Task, rows: Sequence[TaskRow]) -> list[str]:
    """Name of the weight of every row of a task: a common one, or one per row."""
    names = part.weight_settings
    return [names[0]] * len(rows) if len(names) == 1 else list(names)


def catalogue(config: ControllerConfig | None = None) -> str:
    """The page in Markdown.

    Args:
        config: Configuration of the program; None for the default.
    """
    config = config or ControllerConfig()
    model = qp_problem(config).model
    tasks, limits = default_tasks(config), default_limits(config)
    weighed = [line for task in tasks for line in _weighed(task, task.rows(model), config)]
    parts = [_HEAD, _TASKS, _table(("class", "purpose", "rows", "weight", "reason"), _joined(weighed))]
    limited = [_limited(limit, limit.rows(model), config) for limit in limits]
    parts += [_LIMITS, _table(("class", "purpose", "rows", "slack weight", "reason", "switch"), _joined(limited))]
    bounds = [_bound(limit, Setting.of(config, place)) for limit in limits for place in limit.bound_settings]
    parts += [_BOUNDS, _table(("class", "setting", "value", "meaning", "reason"), bounds)]
    return "".join(parts)


def _weighed(task: Task, rows: Sequence[TaskRow], config: ControllerConfig) -> list[list[str]]:
    lines: dict[str, list[TaskRow]] = {} if rows else {place: [] for place in task.weight_settings}
    for row, place in zip(rows, settings_of_rows(task, rows), strict=True):
        lines.setdefault(place, []).append(row)
    found = []
    for place, weighed in lines.items():
        weight = Setting.of(config, place)
        found.append([_name(task), _summary(task), _rows(weighed), f"`{place}` {weight.amount}", weight.why])
    return found


def _limited(limit: Limit, rows: Sequence[LimitRow], config: ControllerConfig) -> list[str]:
    slack_weight, why = "hard", "physical limits of the rotors; their intersection is never empty"
    if limit.slack_weight_setting is not None:
        setting = Setting.of(config, limit.slack_weight_setting)
        slack_weight, why = f"`{setting.place}` {setting.amount}", setting.why
    switch = f"`{limit.switch_setting}`" if limit.switch_setting else ""
    return [_name(limit), _summary(limit), _rows(rows), slack_weight, why, switch]


def _bound(limit: Limit, setting: Setting) -> list[str]:
    return [_name(limit), f"`{setting.place}`", setting.amount, setting.doc, setting.why]


def _joined(lines: Iterable[list[str]]) -> list[list[str]]:
    """Merge lines of the page that differ in their rows only (one class per image line)."""
    found: dict[tuple[str, ...], list[str]] = {}
    for line in lines:
        key = tuple(line[:2] + line[3:])
        if key in found:
            found[key][2] = _merge(found[key][2], line[2])
        else:
            found[key] = line
    return list(found.values())


def _merge(first: str, second: str) -> str:
    names, unit = first.rsplit(" [", 1)
    return f"{names}, {second.rsplit(' [', 1)[0]} [{unit}"


def _rows(rows: Sequence[TaskRow] | Sequence[LimitRow]) -> str:
    if not rows:
        return "none with six rotors"
    names = ", ".join(f"`{row.name}`" for row in rows)
    return f"{names} [{_superscript(rows[0].unit)}]"


def _name(part: Task | Limit) -> str:
    return f"`{type(part).__name__}`"


def _summary(part: Task | Limit) -> str:
    summary = (inspect.getdoc(type(part)) or "").split("\n")[0]
    return re.sub(r":math:`([^`]+)`", r"$\1$", summary)


def _superscript(unit: str) -> str:
    return unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴")


def _table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    return markdown(head, ([cell.replace("|", "\\|") for cell in line] for line in lines))


if __name__ == "__main__":
    print(catalogue(), end="")
