"""Rotors to body wrench and back: geometry, effectiveness, allocation within limits, attainable wrenches."""

from allocation.allocators import (
    DEFAULT_ROW_WEIGHTS,
    FULLY_ACTUATED_ORDER,
    allocate_least_squares,
    allocate_pseudo_inverse,
    allocate_px4,
    allocate_sequential,
)
from allocation.geometry import TAROT_T960, Rotor, RotorGeometry, control_effectiveness
from allocation.hover import hover_wrench, least_hover_tilt, level_polygon, worst_level_reach
from allocation.reach import (
    PushReach,
    push_direction,
    push_reach,
    tilted_push_reach,
    worst_push_reach,
    worst_tilted_push_reach,
)
from allocation.wrench_facets import WrenchFacets

__all__ = [
    "DEFAULT_ROW_WEIGHTS",
    "FULLY_ACTUATED_ORDER",
    "TAROT_T960",
    "PushReach",
    "Rotor",
    "RotorGeometry",
    "WrenchFacets",
    "allocate_least_squares",
    "allocate_pseudo_inverse",
    "allocate_px4",
    "allocate_sequential",
    "control_effectiveness",
    "hover_wrench",
    "least_hover_tilt",
    "level_polygon",
    "push_direction",
    "push_reach",
    "tilted_push_reach",
    "worst_level_reach",
    "worst_push_reach",
    "worst_tilted_push_reach",
]
