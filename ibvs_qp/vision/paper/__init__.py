"""The paper's vision pipeline, the named baseline beside the own perception."""

from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.paper.perception import PaperPerception
from ibvs_qp.vision.paper.pipeline import PaperPipeline
from ibvs_qp.vision.paper.result import PaperDetection

__all__ = ["PaperConfig", "PaperDetection", "PaperPerception", "PaperPipeline"]
