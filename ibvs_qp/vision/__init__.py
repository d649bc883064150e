"""RGB-D pictures to plane, lines and velocity."""

from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.interaction import endpoint_line_row, line_interaction_matrix
from ibvs_qp.vision.percept import LineHint, Percept, TrackState
from ibvs_qp.vision.perception import Perception
from ibvs_qp.vision.plane import PlaneEstimate

__all__ = [
    "LineHint",
    "Percept",
    "Perception",
    "PlaneEstimate",
    "TrackState",
    "VisionConfig",
    "endpoint_line_row",
    "line_interaction_matrix",
]
