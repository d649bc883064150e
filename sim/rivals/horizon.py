"""Settings of the predictive law: time grid and weights; each weight is the inverse square of an acceptable error."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class MpcSettings:
    """Grid and weights of the predictive law.

    The weights were set by hand on tuning scenes, 20 settings; the cost of thrust changes such that the rms thrust rate
    stays near that of the shipped law. Heavier weights of `normal` make a push beyond reach oscillate.
    """

    step_s: float = setting(
        0.025, "coarse step of the prediction, after one control period", unit="s", low=0.02, high=0.03
    )
    blocks: tuple[int, ...] = (1, 1, 2, 3, 5)  # steps of constant thrust command; the first step is one control period
    line: float = setting(4e4, "line error", low=0.0, high=1e8)
    line_rate: float = setting(650.0, "line error rate", unit="s^2", low=0.0, high=1e8)
    height: float = setting(4.0, "ratio of level lines and vertical motion to the others", low=0.0, high=1e4)
    velocity: float = setting(400.0, "velocity of free directions", unit="s^2/m^2", low=0.0, high=1e8)
    normal: float = setting(0.1, "net force along n against that of the shipped law", unit="1/N^2", low=0.0, high=1e6)
    tilt: float = setting(5e4, "roll and pitch", unit="1/rad^2", low=0.0, high=1e8)
    tilt_rate: float = setting(500.0, "their rates", unit="s^2/rad^2", low=0.0, high=1e8)
    yaw: float = setting(2.5e4, "yaw", unit="1/rad^2", low=0.0, high=1e8)
    yaw_rate: float = setting(500.0, "its rate", unit="s^2/rad^2", low=0.0, high=1e8)
    terminal: float = setting(3.0, "weight of the last step over that of the others", low=1.0, high=1e3)
    thrust_change: float = setting(4.0, "change from one thrust command to the next", unit="1/N^2", low=1e-6, high=1e3)

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)

    def steps(self, tick_s: float) -> tuple[float, ...]:
        """Durations of the steps [s]: one control period, then coarse ones."""
        return (tick_s, *[self.step_s] * (sum(self.blocks) - 1))
