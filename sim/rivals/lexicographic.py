"""Strict priorities: the rows, limits, estimates and references of the shipped law, solved level by level."""

from __future__ import annotations

from ibvs_qp.controller import HybridController
from sim.rivals.cascade import CascadeEngine
from sim.rivals.priorities import PriorityProblem


class LexicographicController(HybridController):
    """`HybridController` without a trade between levels: the remainder of the cascade of `CascadeEngine`."""

    problem_kind = PriorityProblem
    engine_kind = CascadeEngine
