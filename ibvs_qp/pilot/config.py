"""Configuration of a flight, and its TOML file."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path

from ibvs_qp.config import ControllerConfig, EstimationConfig, SafetySettings
from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.derived import derive
from ibvs_qp.config.gain_scaling import LAWS
from ibvs_qp.config.settings import choice, dump_toml, load_toml, setting, validate
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.picture.settings import RgbdCameraSettings


@dataclass(frozen=True, kw_only=True)
class CameraConfig(RgbdCameraSettings):
    """Settings of the camera beside the colour intrinsics, which come with every picture."""

    latest_s: float = setting(0.30, "pictures older than this at delivery are refused", unit="s", low=0.01, high=2.0)
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
        """Validate; derive what follows from law and brush."""
        validate(self)
        if self.controller.gains_of != self.law:
            object.__setattr__(self, "controller", dataclasses.replace(self.controller, gains_of=self.law))
        vision = derive(self.vision, {"brush_width_m": self.painting.brush_width_m})
        object.__setattr__(self, "vision", vision)

    @classmethod
    def from_toml(cls, file: str | Path) -> PilotConfig:
        """Read a preset; one whose contact would ring is refused."""
        config = load_toml(cls, file)
        require_margin(config.controller, config.controller.brush, f"{file}: controller.")
        return config

    def to_toml(self, *, derived: bool = False) -> str:
        """Write the preset as TOML text; with ``derived`` also what follows from the rest, for a record."""
        return dump_toml(self, derived=derived)
