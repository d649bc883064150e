"""Configuration of a flight, and its TOML file."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ibvs_qp.config import ControllerConfig, EstimationConfig, SafetySettings
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.gains import LAWS
from ibvs_qp.config.settings import choice, derive, dump_toml, load_toml, setting, validate
from ibvs_qp.frames import to_camera
from ibvs_qp.measurement import SensorFrame, channels
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.pattern import Pattern
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

#: Distance of a guide from the view barrier at which the barrier has little effect [m]; range of the result [m].
_BARRIER_ROOM_M, _LEAST_REACH_M, _MOST_REACH_M = 0.015, 0.02, 2.0

_IMAGE = channels(SensorFrame)["image"]


@dataclass(frozen=True, kw_only=True)
class CameraConfig(RgbdCameraSettings):
    """Settings of the camera except the colour intrinsics, which come with every picture."""

    latest_s: float = setting(
        _IMAGE.oldest_s, "pictures older than this at delivery are refused", unit="s", low=0.01, high=2.0
    )
    readout_s: float = setting(
        0.0,
        "rolling shutter of the colour picture: first to last row, the stamp is that of the row cy; 0 for a global one",
        unit="s",
        low=0.0,
        high=0.1,
    )


@dataclass(frozen=True, kw_only=True)
class PilotConfig:
    """Configuration of a flight."""

    controller: ControllerConfig = field(default_factory=ControllerConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    vision: VisionConfig = field(default_factory=VisionConfig)
    estimation: EstimationConfig = field(default_factory=EstimationConfig)
    painting: PaintingConfig = field(default_factory=PaintingConfig)
    safety: SafetySettings = field(default_factory=SafetySettings)
    perception: str = choice("own", "vision pipeline: the own one or the paper's", ("own", "paper"))
    paper_vision: PaperConfig = field(default_factory=PaperConfig)
    law: str = choice("qp", "control law", LAWS)

    def __post_init__(self) -> None:
        """Validate; derive settings from law and brush."""
        validate(self)
        if self.controller.gains_of != self.law:
            object.__setattr__(self, "controller", dataclasses.replace(self.controller, gains_of=self.law))
        self._require_room_for_trim()
        painting = derive(self.painting, {"guide_reach_m": _guide_reach(self.controller, self.painting)})
        object.__setattr__(self, "painting", painting)
        vision = derive(self.vision, {"brush_width_m": self.painting.brush_width_m})
        object.__setattr__(self, "vision", vision)

    def _require_room_for_trim(self) -> None:
        """The deliberate tilt plus the tilt barrier, in roll and pitch together, stay below the supervisor's bound."""
        limits, most = self.controller.limits, self.safety.tilt_deg
        if math.sqrt(2.0) * (limits.trim_deg + limits.tilt_deg) > most and limits.trim_deg > 0.0:
            room = math.floor(100.0 * max(most / math.sqrt(2.0) - limits.tilt_deg, 0.0)) / 100.0
            allowed = f"allowed is 0 to {room:g} deg with tilt_deg, for safety.tilt_deg = {most:g} deg"
            raise out_of_range("controller.limits.trim_deg", limits.trim_deg, "deg", allowed)

    @classmethod
    def from_toml(cls, file: str | Path) -> PilotConfig:
        """Read a preset; one whose contact would ring is refused."""
        config = load_toml(cls, file)
        require_margin(config.controller, config.controller.brush, f"{file}: controller.")
        return config

    def to_toml(self, *, derived: bool = False) -> str:
        """Write the preset as TOML text; with ``derived`` also the derived settings, for a record."""
        return dump_toml(self, derived=derived)


def _guide_reach(controller: ControllerConfig, painting: PaintingConfig) -> float:
    """Distance on the wall, in contact, from the tip to where the view barrier begins on the side of the guides [m]."""
    vehicle, limits = controller.vehicle, controller.limits
    (right, down), depth = Pattern(painting.pattern, painting.start).across, vehicle.contact_depth_m
    x, y, _ = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    if down:
        room = limits.view_down * depth - y if down < 0.0 else y - limits.view_up * depth
    else:
        room = limits.view_right * depth - x if right < 0.0 else x - limits.view_left * depth
    return round(min(max(room - _BARRIER_ROOM_M, _LEAST_REACH_M), _MOST_REACH_M), 6)
