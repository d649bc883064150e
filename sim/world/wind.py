"""Wind: a mean airspeed that drags on the vehicle, and gusts as a random force."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.world.errors import AirErrors
from sim.world.random_streams import Normals, stream
from sim.world.scene import WindScene

#: Correlation time of the gusts [s], Dryden-like (design, section 5).
GUST_TIME_CONSTANT_S = 1.0
#: Height at which the mean wind is stated [m], a usual board's, and lowest one of the law over height.
REFERENCE_M, LOWEST_M = 1.5, 0.1
#: Time from the beginning of a front to that of its end [s]; assumed.
FRONT_S = 5.0


class Wind:
    r"""Drag in a mean wind plus a first-order Gauss-Markov gust force per world axis.

    The gust is :math:`g_{k+1} = a g_k + \sigma \sqrt{1 - a^2}\, n_k`, a = exp(-dt / tau); it starts in its
    stationary distribution. Attribute ``mean`` (world [m/s]) is the present one; fronts depart from the steady wind,
    that of the scene and the seed until `step_to`. Every drawn quantity has a stream of its own.

    Args:
        scene: Mean wind [m/s] (NED) and gust force [N rms per axis].
        air: Further wind, drawn from the seed, and fronts.
        from_ned: Rotation from NED to the world, (3, 3).
        linear_drag: Force per airspeed [N s/m].
        tick_s: Time between calls of `force` [s].
        seed: Seed of the flight.
    """

    def __init__(
        self,
        scene: WindScene,
        air: AirErrors,
        from_ned: np.ndarray,
        linear_drag: float,
        tick_s: float,
        seed: int,
    ) -> None:
        self._air, self._from_ned = air, from_ned
        draw = stream(seed, "errors.air.wind")
        self._drawn = self._steady = _level(draw, air.wind_m_s * float(draw.uniform())) + scene.mean_m_s
        self.mean = from_ned @ self._steady
        self._fronts = stream(seed, "errors.air.fronts")
        self._front_s = float(self._fronts.exponential(air.front_every_s)) if air.front_m_s else math.inf
        self._passing, self._time_s = False, 0.0
        self._drag, self._tick_s = linear_drag, tick_s
        self._steps: list[np.ndarray] = []  # means of the ticks to come, the last first
        self._rms = math.hypot(scene.gust_n_rms, float(stream(seed, "errors.air.gusts").uniform(*air.gust_n)))
        self._decay = math.exp(-tick_s / GUST_TIME_CONSTANT_S)
        self._kick = self._rms * math.sqrt(1.0 - self._decay**2)
        self._normals = Normals(stream(seed, "wind"))
        self._gust = [self._rms * number for number in self._normals.take(3)]

    def _pass_front(self) -> None:
        """A front comes, or has passed."""
        air = self._air
        self._passing = not self._passing
        front = _level(self._fronts, air.front_m_s) if self._passing else 0.0
        self._change(self._steady + front, air.front_rise_s)
        wait = FRONT_S if self._passing else float(self._fronts.exponential(air.front_every_s))
        self._front_s = self._time_s + wait

    def step_to(self, steady_m_s: Sequence[float], rise_s: float) -> None:
        """Another steady wind [m/s] (NED), reached evenly within a time [s]; a front that passes is over."""
        self._steady = np.array(steady_m_s, float)
        self._change(self._steady, rise_s)

    def back(self, rise_s: float) -> None:
        """The steady wind of the scene and the seed again, within a time [s]."""
        self.step_to(self._drawn.tolist(), rise_s)

    def _change(self, mean_m_s: np.ndarray, rise_s: float) -> None:
        """Change the mean [m/s] (NED) evenly within a time [s]: a front that passes the vehicle."""
        ticks = max(round(rise_s / self._tick_s), 1)
        self._steps = list(np.linspace(self._from_ned @ mean_m_s, self.mean, ticks, endpoint=False))

    def force(self, velocity: Sequence[float], height_m: float = REFERENCE_M) -> tuple[float, float, float]:
        """Advance the gusts by one tick and return the force of the air, world [N].

        Args:
            velocity: Velocity of the centre of mass, world [m/s], (3,).
            height_m: Above the ground, for the shear.
        """
        self._time_s += self._tick_s
        if self._time_s >= self._front_s:
            self._pass_front()
        if self._steps:
            self.mean = self._steps.pop()
        mean = self.mean
        if self._air.shear:
            mean = mean * (max(height_m, LOWEST_M) / REFERENCE_M) ** self._air.shear
        mx, my, mz = mean.tolist()
        vx, vy, vz = velocity
        drag = self._drag
        if self._rms == 0.0:
            return drag * (mx - vx), drag * (my - vy), drag * (mz - vz)
        (a, b, c), (i, j, k), decay, kick = self._gust, self._normals.take(3), self._decay, self._kick
        self._gust = gx, gy, gz = decay * a + kick * i, decay * b + kick * j, decay * c + kick * k
        return gx + drag * (mx - vx), gy + drag * (my - vy), gz + drag * (mz - vz)


def _level(draw: np.random.Generator, speed: float) -> np.ndarray:
    """A wind of some speed in a random level direction, NED [m/s], (3,)."""
    angle = float(draw.uniform(-math.pi, math.pi))
    return speed * np.array((math.cos(angle), math.sin(angle), 0.0))
