from ibvs_qp.vision.paper.config import PaperConfig as PaperConfig
from ibvs_qp.vision.paper.perception import PaperPerception as PaperPerception
from ibvs_qp.vision.paper.pipeline import PaperPipeline as PaperPipeline
from ibvs_qp.vision.paper.result import PaperDetection as PaperDetection
