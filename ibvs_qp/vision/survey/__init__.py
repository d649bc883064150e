"""Surface and guides in pictures of any RGB-D camera: no gravity, no gyro, no vehicle in view."""

from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import GUIDE_SIDES, DetectedLine, Detection
from ibvs_qp.vision.survey.pipeline import SurveyPipeline

__all__ = ["GUIDE_SIDES", "DetectedLine", "Detection", "SurveyConfig", "SurveyPipeline"]
