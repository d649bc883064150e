"""Settings of the survey: pictures of any camera, without gravity, gyro or a vehicle in view."""

from __future__ import annotations

from dataclasses import dataclass, field

from ibvs_qp.config.settings import setting, validate
from ibvs_qp.vision.config import LineConfig, PlaneConfig, TrackConfig


def _any_surface() -> PlaneConfig:
    """A hand-held camera may look at a surface that leans and stands oblique."""
    return PlaneConfig(max_lean_deg=90.0, max_oblique_deg=80.0)


@dataclass(frozen=True, kw_only=True)
class SurveyConfig:
    """All settings of the survey."""

    band_cells: int = setting(
        4, "half width of the band around the surface's end in which its edges are sought (32 px)", low=1, high=20
    )
    fitted: int = setting(16, "lines around the surface that are fitted to a fraction of a pixel", low=4, high=200)
    detect_period: int = setting(5, "frames between detections while a sequence is followed", low=1, high=1000)
    guide_score_min: float = setting(0.30, "weakest line that is offered as a guide", low=0.0, high=1.0)
    role_deg: float = setting(
        40.0, "a line this near to level or upright may be a guide of that direction", unit="deg", low=5.0, high=45.0
    )
    plane: PlaneConfig = field(default_factory=_any_surface)
    line: LineConfig = field(default_factory=LineConfig)
    track: TrackConfig = field(default_factory=TrackConfig)

    def __post_init__(self) -> None:
        """Validate every field."""
        validate(self)
