"""Every task and limit has unit, default and reason; their page is current and describes the program."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from controller_scenes import CEILING, FLOOR, measured, pack, random_tick
from law_only import evaluate_law

import ibvs_qp.limits
import ibvs_qp.tasks
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController, default_limits, default_tasks
from ibvs_qp.limits import Limit
from ibvs_qp.model.model import Model
from ibvs_qp.tasks import Task
from sim.report.catalogue import Setting, catalogue, settings_of_rows

PAGE = Path(__file__).parents[3] / "docs" / "tasks_and_limits.md"
CONFIG = ControllerConfig()
TASKS = {type(task): task for task in default_tasks(CONFIG)}
LIMITS = {type(limit): limit for limit in default_limits(CONFIG)}
#: Unit of a weight or price by the unit of its row: the cost has none.
PER_SQUARE = {"1/s^2": "s^4", "rad/s^2": "s^4/rad^2", "N": "1/N^2", "m/s^2": "s^4/m^2"}


def shipped(base: type) -> set[type]:
    """Subclasses that the package defines."""
    return {kind for kind in base.__subclasses__() if kind.__module__.startswith("ibvs_qp.")}


def changed(place: str, factor: float) -> ControllerConfig:
    """The default configuration with one number multiplied; a switch is turned off."""
    value = Setting.of(CONFIG, place).value
    new: Any = False if isinstance(value, bool) else value * factor
    *path, name = place.split(".")
    if not path:
        return dataclasses.replace(CONFIG, **{name: new})
    return dataclasses.replace(CONFIG, **{path[0]: dataclasses.replace(getattr(CONFIG, path[0]), **{name: new})})


def packed(config: ControllerConfig) -> HybridController:
    """A tick that every row has a say in: half of lambda, and two lines that are half believed."""
    controller = HybridController(config)
    measurement, reference = random_tick(np.random.default_rng(3), 2)
    lines = tuple(dataclasses.replace(line, weight=0.5) for line in measurement.lines)
    pack(controller, dataclasses.replace(measurement, lines=lines), reference, share=0.5, window=(FLOOR, CEILING))
    return controller


def rows_of(part: Task | Limit) -> list[str]:
    """Names of the rows of a class in the program: all slots of a line."""
    model = Model(CONFIG)
    parts = [*default_tasks(CONFIG), *default_limits(CONFIG)]
    return [row.name for other in parts if type(other) is type(part) for row in other.rows(model)]


def test_the_page_is_what_the_program_is() -> None:
    assert PAGE.read_text(encoding="utf-8") == catalogue(), f"python -m sim.report.catalogue > docs/{PAGE.name}"


def test_every_class_is_in_the_program_and_on_the_page() -> None:
    for base, parts, package in ((Task, TASKS, ibvs_qp.tasks), (Limit, LIMITS, ibvs_qp.limits)):
        assert shipped(base) == set(parts)
        assert {kind.__name__ for kind in parts} | {base.__name__} == set(package.__all__) - {
            "PaperLineTask"
        }  # the "paper" profile
    page = PAGE.read_text(encoding="utf-8")
    for part in [*TASKS.values(), *LIMITS.values()]:
        assert f"`{type(part).__name__}`" in page
        assert all(f"`{name}`" in page for name in rows_of(part))


@pytest.mark.parametrize("kind", TASKS)
def test_every_weight_has_the_unit_of_its_row_and_a_reason(kind: type[Task]) -> None:
    rows = TASKS[kind].rows(Model(CONFIG))
    for row, place in zip(rows, settings_of_rows(TASKS[kind], rows), strict=True):
        weight = Setting.of(CONFIG, place)
        assert weight.unit == PER_SQUARE[row.unit], row.name
        assert weight.why


@pytest.mark.parametrize("kind", LIMITS)
def test_every_price_and_bound_has_a_unit_and_a_reason(kind: type[Limit]) -> None:
    limit = LIMITS[kind]
    assert limit.bound_settings and limit.switch_setting
    for place in limit.bound_settings:
        assert Setting.of(CONFIG, place).why, place
    model = Model(CONFIG)
    for row in limit.rows(model):
        assert (row.slack_weight is None) == (limit.slack_weight_setting is None)
        if limit.slack_weight_setting is not None:
            price = Setting.of(CONFIG, limit.slack_weight_setting)
            assert price.unit == PER_SQUARE[row.unit] and price.why
            assert row.slack_weight is getattr(model.limits, limit.slack_weight_setting.removeprefix("limits."))


def weights(controller: HybridController) -> dict[str, float]:
    data = controller.engine.data
    _, _, values = controller.problem.report(data.point, np.zeros(6))
    return {row.name: float(value) for row, value in zip(controller.problem.task_rows, values, strict=True)}


def test_a_weight_weighs_the_rows_that_the_page_gives_it_and_no_other() -> None:
    before, belongs = weights(packed(CONFIG)), {}
    for kind, task in TASKS.items():
        for slot in [other for other in default_tasks(CONFIG) if type(other) is kind]:
            rows = slot.rows(Model(CONFIG))
            for row, place in zip(rows, settings_of_rows(task, rows), strict=True):
                belongs.setdefault(place, set()).add(row.name)
    for place, names in belongs.items():
        after = weights(packed(changed(place, 2.0)))
        for name, weight in before.items():
            assert after[name] == pytest.approx(weight * (2.0 if name in names else 1.0)), f"{place}: {name}"
    assert all(before[name] > 0.0 for name in before if not name.startswith("line_2")), "a row that no test sees"


@pytest.mark.slow
def test_a_price_and_a_switch_are_those_of_their_rows() -> None:
    full = packed(CONFIG)
    for limit in LIMITS.values():
        names = rows_of(limit)
        assert limit.switch_setting is not None
        off = packed(changed(limit.switch_setting, 0.0))
        if limit.slack_weight_setting is None:  # thrusts stay rows of the program, with wide bounds
            assert (off.engine.data.upper[:6] >= 1e4).all() and (full.engine.data.upper[:6] < 60.0).all()
            continue
        assert set(full.problem.row_names) - set(off.problem.row_names) == set(names)
        doubled = packed(changed(limit.slack_weight_setting, 2.0))
        ratio = doubled.engine.data.hessian().diagonal()[6:] / full.engine.data.hessian().diagonal()[6:]
        for slack, value in zip(full.problem.variable_names[6:], ratio, strict=True):
            assert value == pytest.approx(2.0 if slack.removeprefix("slack_") in names else 1.0)


@pytest.mark.slow
def test_a_bound_moves_the_rows_that_the_page_gives_it_and_no_other() -> None:
    @functools.cache
    def bounds(config: ControllerConfig, tick: int) -> np.ndarray:
        """Bounds of all rows, in free air (tick 0) or pressing."""
        controller = HybridController(config)
        for k in range(1 + tick):
            measurement, wanted = random_tick(np.random.default_rng(3), 2, k)
            controller.setpoints.update(measured(k, lines=measurement.lines), wanted)
            if tick:
                inputs = controller.setpoints.step.inputs
                inputs["contact.touching"][0], inputs["contact.rate"][0] = 1.0, -0.02  # closing in
                inputs["contact.rate_noise"][0] = 0.0  # the quiet zone is the setting
                evaluate_law(controller.setpoints, controller.problem.values)
                controller.setpoints.note(np.full(6, 11.3), 0.0)
        return np.concatenate((controller.engine.data.lower, controller.engine.data.upper))

    names = np.array(packed(CONFIG).problem.row_names * 2)
    for limit in LIMITS.values():
        for place in limit.bound_settings:
            moved = set()
            for tick in (0, 3):
                was, now = bounds(CONFIG, tick), bounds(changed(place, 0.9), tick)
                moved |= set(names[~np.isclose(was, now, rtol=1e-9, atol=1e-9)])
            assert moved and moved <= set(rows_of(limit)), place
