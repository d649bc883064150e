"""Wall and brush of a preset."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class BrushSettings:
    """Contact of a preset: wall and brush in series, and the age of the measured force."""

    stiffness_min_n_m: float = setting(1000.0, "softest wall and brush", unit="N/m", low=50.0, high=1e5)
    stiffness_max_n_m: float = setting(
        3500.0, "stiffest wall and brush; 30 N s/m damp 4 kN/m by a tenth", unit="N/m", low=50.0, high=1e5
    )
    damping_n_s_m: float = setting(30.0, "damping of wall and brush", unit="N s/m", low=0.0, high=1e4)
    force_delay_s: float = setting(
        0.009, "mean age of the force in use: latency 4 ms and half a period of 100 Hz", unit="s", low=0.0, high=0.5
    )

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
        if self.stiffness_min_n_m > self.stiffness_max_n_m:
            allowed = f"at most stiffness_max_n_m = {self.stiffness_max_n_m:g} N/m"
            raise out_of_range("stiffness_min_n_m", self.stiffness_min_n_m, "N/m", allowed)
