"""Force across the tool from both halves of a force/torque sensor: a push at a known tip shows in the moments too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.config import EstimationConfig
from ibvs_qp.estimation.line_noise import WhiteNoise

#: Levers shorter than this tell nothing about a force [m].
LEAST_LEVER = 0.05


class TipForce:
    r"""Weighs the two ways of measuring the force across the tool, y and z, by the noise that each shows.

    A force f at the tip, r from the sensor, gives :math:`M_z = r_x f_y - r_y f_x` and
    :math:`M_y = r_z f_x - r_x f_z`. So besides the sensor's force there is the moment's, its variance that of
    successive samples and :math:`(s f_x / r_x)^2`, where s is how far from the tip the contact may press. The moments
    about the sensor and the force along the tool are left as they are.
    """

    def __init__(self, vehicle: VehicleParams, config: EstimationConfig) -> None:
        self._lever = np.subtract(vehicle.tip_position_m, vehicle.force_torque_position_m).tolist()
        self._spread, self._floor = config.contact_spread_m, config.force_std_n**2
        self.reset()

    def reset(self) -> None:
        """Forget the noise."""
        self._noise = [WhiteNoise() for _ in range(4)]

    def across(self, force: Sequence[float], moment: Sequence[float]) -> tuple[float, float]:
        """The better force across [N]: y and z of a tared wrench at the sensor.

        Args:
            force: Contact force [N], FRD axes, (3,).
            moment: Its moment about the sensor [N m], (3,).
        """
        (ahead, right, below), (fx, fy, fz), (_, my, mz) = self._lever, force, moment
        if ahead < LEAST_LEVER:
            return fy, fz
        samples = fy, fz, (mz + right * fx) / ahead, (below * fx - my) / ahead
        floor = self._floor
        variances = [noise.hear(sample, floor) for noise, sample in zip(self._noise, samples, strict=True)]
        astray = (self._spread * fx / ahead) ** 2
        better = []
        for axis in (0, 1):
            of_force, of_moment = variances[axis], variances[axis + 2] + astray
            share = of_force / (of_force + of_moment)
            better.append(samples[axis] + share * (samples[axis + 2] - samples[axis]))
        return better[0], better[1]
