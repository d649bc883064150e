from ibvs_qp.model.interaction_matrix import endpoint_line_row as endpoint_line_row
from ibvs_qp.model.interaction_matrix import line_interaction_matrix as line_interaction_matrix
from ibvs_qp.vision.config import VisionConfig as VisionConfig
from ibvs_qp.vision.lines.tracks import LineHint as LineHint
from ibvs_qp.vision.lines.tracks import TrackState as TrackState
from ibvs_qp.vision.perception import Perception as Perception
from ibvs_qp.vision.perception import PerceptionResult as PerceptionResult
from ibvs_qp.vision.surface.plane import PlaneEstimate as PlaneEstimate
