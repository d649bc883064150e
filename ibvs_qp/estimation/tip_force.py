"""Force across the tool from both halves of a force/torque sensor: a push at a known tip shows in the moments too."""

from __future__ import annotations

import numpy as np

from ibvs_qp.estimation.config import EstimationConfig
from ibvs_qp.estimation.line_noise import WhiteNoise
from ibvs_qp.vehicle import VehicleParams


class TipForce:
    r"""Weighs the two ways of measuring the force across the tool, y and z, by the noise that each shows.

    A force f at the tip, a lever l ahead of the sensor, gives the moments :math:`M_z = l f_y,\; M_y = -l f_z`.
    So besides the sensor's force, with deviation :math:`\sigma_F`, there is M / l, with

    .. math:: \sigma^2 = (\sigma_M^2 + (s f_x)^2) / l^2,

    where s is how far from the tip the contact may press. :math:`\sigma_F` and :math:`\sigma_M` are learned from
    successive samples. The moments themselves and the force along the tool are left as they are.
    """

    def __init__(self, vehicle: VehicleParams, config: EstimationConfig) -> None:
        self._lever = vehicle.tip_position_m[0] - vehicle.force_torque_position_m[0]
        self._spread, self._floor = config.contact_spread_m, config.force_std_n**2
        self.reset()

    def reset(self) -> None:
        """Forget the noise."""
        self._noise = [WhiteNoise() for _ in range(4)]

    def fuse(self, wrench: np.ndarray) -> np.ndarray:
        """Tared wrench at the sensor with the better force across [N, N m], (6,).

        Args:
            wrench: Contact wrench about the sensor, FRD axes, (6,); not changed.
        """
        along, right, down, _, pitch, yaw = wrench.tolist()
        samples = right, yaw / self._lever, down, -pitch / self._lever
        variances = []
        for noise, sample in zip(self._noise, samples, strict=True):
            noise.learn(noise.difference(sample), self._floor)
            noise.keep(sample)
            variances.append(noise.total(self._floor))
        astray = (self._spread * along / self._lever) ** 2
        better = wrench.copy()
        for axis, (direct, moment) in enumerate(((0, 1), (2, 3)), start=1):
            of_force, of_moment = variances[direct], variances[moment] + astray
            better[axis] = (of_moment * samples[direct] + of_force * samples[moment]) / (of_force + of_moment)
        return better
