"""Wind: a mean airspeed that drags on the vehicle, and gusts as a random force."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.world.random_streams import Normals
from sim.world.scene import WindScene

#: Correlation time of the gusts [s], Dryden-like (design, section 5).
GUST_TIME_CONSTANT_S = 1.0


class Wind:
    r"""Drag in a mean wind plus a first-order Gauss-Markov gust force per world axis.

    The gust is :math:`g_{k+1} = a g_k + \sigma \sqrt{1 - a^2}\, n_k`, a = exp(-dt / tau); it starts in its
    stationary distribution. Attribute ``mean`` (world [m/s]) may be changed at any time, or by `change`.

    Args:
        scene: Mean wind [m/s] (NED) and gust force [N rms per axis].
        from_ned: Rotation from NED to the world, (3, 3).
        linear_drag: Force per airspeed [N s/m].
        tick_s: Time between calls of `force` [s].
        generator: Source of the gusts.
    """

    def __init__(
        self,
        scene: WindScene,
        from_ned: np.ndarray,
        linear_drag: float,
        tick_s: float,
        generator: np.random.Generator,
    ) -> None:
        self._from_ned, self.mean = from_ned, from_ned @ scene.mean_m_s
        self._drag, self._tick_s = linear_drag, tick_s
        self._steps: list[np.ndarray] = []  # means of the ticks to come, the last first
        self._rms = scene.gust_n_rms
        self._decay = math.exp(-tick_s / GUST_TIME_CONSTANT_S)
        self._kick = self._rms * math.sqrt(1.0 - self._decay**2)
        self._normals = Normals(generator)
        self._gust = [self._rms * number for number in self._normals.take(3)]

    def change(self, mean_m_s: Sequence[float], rise_s: float) -> None:
        """Change the mean [m/s] (NED) evenly within a time [s]: a front that passes the vehicle."""
        ticks = max(round(rise_s / self._tick_s), 1)
        self._steps = list(np.linspace(self._from_ned @ mean_m_s, self.mean, ticks, endpoint=False))

    def force(self, velocity: Sequence[float]) -> tuple[float, float, float]:
        """Advance the gusts by one tick and return the force of the air, world [N].

        Args:
            velocity: Velocity of the centre of mass, world [m/s], (3,).
        """
        if self._steps:
            self.mean = self._steps.pop()
        mx, my, mz = self.mean.tolist()
        vx, vy, vz = velocity
        drag = self._drag
        if self._rms == 0.0:
            return drag * (mx - vx), drag * (my - vy), drag * (mz - vz)
        (a, b, c), (i, j, k), decay, kick = self._gust, self._normals.take(3), self._decay, self._kick
        self._gust = gx, gy, gz = decay * a + kick * i, decay * b + kick * j, decay * c + kick * k
        return gx + drag * (mx - vx), gy + drag * (my - vy), gz + drag * (mz - vz)
