"""Rotors to body wrench and back: geometry, effectiveness, allocation within limits, attainable wrench sets."""

from allocation.effectiveness import control_effectiveness
from allocation.geometry import TAROT_T960, Rotor, RotorGeometry
from allocation.least_squares import DEFAULT_ROW_WEIGHTS, allocate_least_squares
from allocation.level_reach import level_polygon, level_reach, worst_level_reach
from allocation.pseudo_inverse import allocate_pseudo_inverse
from allocation.push_reach import (
    PushReach,
    PushReachTable,
    hover_wrench,
    push_direction,
    push_reach,
    worst_push_reach,
)
from allocation.sequential_desaturation import FULLY_ACTUATED_ORDER, allocate_px4, allocate_sequential
from allocation.wrench_facets import WrenchFacets
from allocation.wrench_set import Reach, WrenchSet

__all__ = [
    "DEFAULT_ROW_WEIGHTS",
    "FULLY_ACTUATED_ORDER",
    "TAROT_T960",
    "PushReach",
    "PushReachTable",
    "Reach",
    "Rotor",
    "RotorGeometry",
    "WrenchFacets",
    "WrenchSet",
    "allocate_least_squares",
    "allocate_pseudo_inverse",
    "allocate_px4",
    "allocate_sequential",
    "control_effectiveness",
    "hover_wrench",
    "level_polygon",
    "level_reach",
    "push_direction",
    "push_reach",
    "worst_level_reach",
    "worst_push_reach",
]
