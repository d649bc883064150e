"""Rotors to body wrench and back: geometry, effectiveness, allocation within limits, attainable wrench sets."""

from allocation.effectiveness import control_effectiveness
from allocation.geometry import TAROT_T960, Rotor, RotorGeometry
from allocation.least_squares import DEFAULT_ROW_WEIGHTS, allocate_least_squares
from allocation.level_reach import level_polygon, level_reach, worst_level_reach
from allocation.pseudo_inverse import allocate_pseudo_inverse
from allocation.wrench_set import Reach, WrenchSet

__all__ = [
    "DEFAULT_ROW_WEIGHTS",
    "TAROT_T960",
    "Reach",
    "Rotor",
    "RotorGeometry",
    "WrenchSet",
    "allocate_least_squares",
    "allocate_pseudo_inverse",
    "control_effectiveness",
    "level_polygon",
    "level_reach",
    "worst_level_reach",
]
