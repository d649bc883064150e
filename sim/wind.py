"""Wind: a mean airspeed that drags on the vehicle, and gusts as a random force."""

from __future__ import annotations

import math

import numpy as np

from sim.scene import WindScene

#: Correlation time of the gusts [s], Dryden-like (design, section 5).
GUST_TIME_CONSTANT_S = 1.0


class Wind:
    r"""Drag in a mean wind plus a first-order Gauss-Markov gust force per world axis.

    The gust is :math:`g_{k+1} = a g_k + \sigma \sqrt{1 - a^2}\, n_k`, a = exp(-dt / tau); it starts in its
    stationary distribution. Attribute ``mean`` (world NED [m/s]) may be changed at any time.

    Args:
        scene: Mean wind [m/s] (NED) and gust force [N rms per axis].
        linear_drag: Force per airspeed [N s/m].
        tick_s: Time between calls of `force` [s].
        generator: Source of the gusts; drawn from even without gusts, so that its stream never shifts.
    """

    def __init__(self, scene: WindScene, linear_drag: float, tick_s: float, generator: np.random.Generator) -> None:
        self.mean = np.array(scene.mean_m_s)
        self._drag = linear_drag
        self._rms = scene.gust_n_rms
        self._decay = math.exp(-tick_s / GUST_TIME_CONSTANT_S)
        self._kick = self._rms * math.sqrt(1.0 - self._decay**2)
        self._generator = generator
        self.gust = self._rms * generator.standard_normal(3)

    def force(self, velocity: np.ndarray) -> np.ndarray:
        """Advance the gusts by one tick and return the force of the air, world NED [N], (3,).

        Args:
            velocity: Velocity of the centre of mass, world NED [m/s], (3,).
        """
        self.gust = self._decay * self.gust + self._kick * self._generator.standard_normal(3)
        return self.gust + self._drag * (self.mean - velocity)
