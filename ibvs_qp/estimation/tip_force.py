"""Force across the tool from both halves of a force/torque sensor: its moments measure a force at a known tip too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.line_noise import WhiteNoise

#: The moments of a shorter lever carry no information about a force [m].
LEAST_LEVER = 0.05


class TipForce:
    r"""Inverse-variance mean of two measurements of the force across the tool, y and z.

    A force f at the tip, r from the sensor, gives :math:`M_z = r_x f_y - r_y f_x` and
    :math:`M_y = r_z f_x - r_x f_z`. So the moments measure the force as well; their variance is that of successive
    samples plus :math:`(s f_x / r_x)^2`, where s is how far from the tip the contact may press. The moments about the
    sensor and the force along the tool stay as measured.
    """

    def __init__(self, vehicle: VehicleParams, config: EstimationConfig) -> None:
        self._lever = np.subtract(vehicle.tip_position_m, vehicle.force_torque_position_m).tolist()
        self._spread, self._floor = config.contact_spread_m, config.force_std_n**2
        self.reset()

    def reset(self) -> None:
        """Forget the noise."""
        self._noise = [WhiteNoise() for _ in range(4)]

    def across(self, force: Sequence[float], moment: Sequence[float]) -> tuple[float, float]:
        """Mean force across, y and z [N], of a tared force [N] and its moment about the sensor [N m], (3,) each."""
        (ahead, right, below), (fx, fy, fz), (_, my, mz) = self._lever, force, moment
        if ahead < LEAST_LEVER:
            return fy, fz
        off_tip = (self._spread * fx / ahead) ** 2
        return (
            self._mean(0, fy, (mz + right * fx) / ahead, off_tip),
            self._mean(2, fz, (below * fx - my) / ahead, off_tip),
        )

    def _mean(self, channel: int, direct: float, from_moment: float, off_tip: float) -> float:
        """Mean of a force sample and the one from the moment, whose variance is larger by ``off_tip`` [N^2]."""
        variance = self._variance(channel, direct)
        gain = variance / (variance + self._variance(channel + 1, from_moment) + off_tip)
        return direct + gain * (from_moment - direct)

    def _variance(self, channel: int, sample: float) -> float:
        """Variance of one sample of a channel [N^2], estimated from successive samples."""
        noise = self._noise[channel]
        noise.learn(sample - noise.residual, self._floor)
        noise.residual = sample
        return noise.total(self._floor)
