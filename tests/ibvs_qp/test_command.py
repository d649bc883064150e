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
