"""RGB-D pictures to plane, lines and velocity.

The names load on first use: a controller that is fed with lines needs the interaction matrix, but no OpenCV.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ibvs_qp.model.interaction_matrix import endpoint_line_row, line_interaction_matrix
    from ibvs_qp.vision.config import VisionConfig
    from ibvs_qp.vision.lines.line_state import LineHint, TrackState
    from ibvs_qp.vision.perception import Perception
    from ibvs_qp.vision.perception_result import PerceptionResult
    from ibvs_qp.vision.surface.plane import PlaneEstimate

_HOMES = {
    "ibvs_qp.vision.config": ("VisionConfig",),
    "ibvs_qp.model.interaction_matrix": ("endpoint_line_row", "line_interaction_matrix"),
    "ibvs_qp.vision.lines.line_state": ("LineHint", "TrackState"),
    "ibvs_qp.vision.perception_result": ("PerceptionResult",),
    "ibvs_qp.vision.perception": ("Perception",),
    "ibvs_qp.vision.surface.plane": ("PlaneEstimate",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
__all__ = [
    "LineHint",
    "Perception",
    "PerceptionResult",
    "PlaneEstimate",
    "TrackState",
    "VisionConfig",
    "endpoint_line_row",
    "line_interaction_matrix",
]


def __getattr__(name: str) -> Any:
    """Import a public name where it lives."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME_OF[name]), name)
