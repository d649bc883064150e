"""A command is a plain value: it can be copied, compared and pickled."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
from controller_scenes import line_references, measured

from ibvs_qp import HybridController, Reference


def test_a_command_survives_replace_and_pickle() -> None:
    command = HybridController().step(measured(0), Reference(lines=line_references(2)))
    names = [task.name for task in command.tasks]
    copy = pickle.loads(pickle.dumps(command))
    assert command.iterations > 0 and "roll" in names
    assert copy.tasks == command.tasks == tuple(command.tasks) and len(copy.tasks) == len(names)
    assert copy.active_limits == command.active_limits and copy.outcome is command.outcome
    np.testing.assert_array_equal(copy.wrench, command.wrench)
    later = replace(command, stamp_ns=7, rejected=("velocity: NaN",))
    assert later.stamp_ns == 7 and later.tasks is command.tasks and replace(command) == command
    assert replace(command, tasks=()).tasks == ()


def test_the_reports_of_a_command_stay_those_of_its_tick() -> None:
    controller, twin = HybridController(), HybridController()
    commands = [one.step(measured(0), Reference(lines=line_references(2))) for one in (controller, twin)]
    at_once = tuple(commands[1].tasks)
    controller.step(measured(1, angular_velocity=np.array([0.3, 0.2, 0.1])), Reference(standoff=0.1))
    assert tuple(commands[0].tasks) == at_once, "evaluated when they are read"
