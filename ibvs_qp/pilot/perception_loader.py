"""The configured perception, loaded before the flight or during it: the first translation takes seconds."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.painting.pattern import Pattern
from ibvs_qp.validation.failure import raised

if TYPE_CHECKING:
    from ibvs_qp.vision.paper import PaperPerception
    from ibvs_qp.vision.perception import Perception

#: Pictures that call every stage once, and the time between them [ns].
_WARM_UP, _STEP_NS = 3, 33_333_333
#: Size of the stand-in for a camera's picture [px], its focal length [px] and distance [m].
_SIZE, _FOCAL, _DISTANCE = (480, 640), 600.0, 0.5


class PerceptionLoader:
    """Loads perception in a thread of its own; the result does not depend on the time.

    Attributes:
        perception: The perception, None until it is loaded.
        problem: Why loading failed, "" without a failure.
    """

    STATE = ()

    def __init__(self, config: PilotConfig) -> None:
        self._config = config
        self.perception: Perception | PaperPerception | None = None
        self.problem = ""
        self._thread: threading.Thread | None = None

    def reset(self) -> None:
        """As before the first picture; the loaded perception stays."""
        if self.perception is not None:
            self.perception.reset()

    def start(self, picture: RgbdFrame | None = None) -> threading.Thread:
        """Begin to load, unless it does already; `prepare` of the pilot describes the picture."""
        if self._thread is None or not self._thread.is_alive():
            self.problem = "perception is loading"
            self._thread = threading.Thread(target=self._load, args=(picture,), daemon=True)
            self._thread.start()
        return self._thread

    @np.errstate(all="ignore")  # as in a step
    def _load(self, picture: RgbdFrame | None) -> None:
        try:
            perception = self.perception or self._construct()
            picture = picture or _stand_in()
            for index in range(_WARM_UP):
                seen = RgbdFrame(
                    rgb=picture.rgb, depth=picture.depth, intrinsics=picture.intrinsics, stamp_ns=index * _STEP_NS
                )
                perception.process(seen)
            perception.reset()
            self.perception, self.problem = perception, ""
        except Exception as error:  # pictures are refused with this reason
            self.problem = raised("perception", error)

    def _construct(self) -> Perception | PaperPerception:
        vehicle, painting = self._config.controller.vehicle, self._config.painting
        inwards = Pattern(painting.pattern, painting.start).inwards
        if self._config.perception == "paper":
            from ibvs_qp.vision.paper import PaperPerception

            return PaperPerception(self._config.paper_vision, self._config.vision, vehicle, inwards)
        from ibvs_qp.vision.perception import Perception

        return Perception(self._config.vision, vehicle, inwards)


def _stand_in() -> RgbdFrame:
    """A bright surface with a level and an upright edge."""
    height, width = _SIZE
    rgb = np.full((height, width, 3), 60, np.uint8)
    rgb[: height // 2, : 3 * width // 4] = 200
    rgb += np.random.default_rng(0).integers(0, 8, rgb.shape, np.uint8)
    intrinsics = (_FOCAL, _FOCAL, 0.5 * width, 0.5 * height)
    return RgbdFrame(rgb=rgb, depth=np.full(_SIZE, _DISTANCE, np.float32), intrinsics=intrinsics, stamp_ns=0)
