"""A line on the wall, as it is followed from picture to picture."""

from __future__ import annotations

from dataclasses import dataclass, field

from ibvs_qp.estimation.kalman import GATE
from ibvs_qp.estimation.line_noise import SteadyValue, WhiteNoise

#: So many offsets in a row that agree with each other, not with the prediction, are another line.
REFUSED = 3


@dataclass(slots=True)
class TrackedLine:
    """One line on the wall, in metres from the tip's wall point.

    Attributes:
        offset: Signed distance from the tip to the line along its normal [m]; normals point down (horizontal lines)
            or right (vertical lines), so > 0 is below or right of the tip.
        angle: Angle of the normal in (right, down) [rad]; pi/2 for a level line.
        deviation: Of the filtered offset [m], from the noise that the pictures show.
        weight: How much it counts now; fresh_weight: how much while pictures show it.
        rates: Offset per unit of the tip's motion (right, down).
        noise: Of the measured offset [m^2]; tilt: filter of the angle.
        refused: Offsets beyond the gate in a row that agree with each other.
    """

    track_id: int
    role: str
    slot: int
    angle: float
    deviation: float
    seen_ns: int
    news_ns: int = 0
    frames: int = 1
    offset: float = 0.0
    weight: float = 0.0
    fresh_weight: float = 0.0
    surface_side: int = 0
    kind: str = ""
    theta_variance: float = 1e-4
    rates: tuple[float, float] = (0.0, 0.0)
    noise: WhiteNoise = field(default_factory=WhiteNoise)
    tilt: SteadyValue = field(default_factory=SteadyValue)
    refused: int = 0

    def is_another(self, difference: float, variance: float) -> bool:
        """Whether a refused offset makes this another line: three in a row that agree with each other.

        Noise that has just begun lies now here, now there; it is refused until it is known, and no more than that.

        Args:
            difference: Between the residuals of this picture and the last [m].
            variance: Of one offset [m^2].
        """
        agrees = difference * difference < 2.0 * GATE * GATE * variance
        self.refused = self.refused + 1 if agrees else 1
        return self.refused >= REFUSED
