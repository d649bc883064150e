"""Standstill of the tip: before a touch, at the end of a stroke, and at an obstacle."""

from __future__ import annotations

import math

from ibvs_qp.pilot.painting.command import PainterInput
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.speed import approached

#: Remaining distance at which the commanded speed becomes zero [m]; speed at a stop over `align_speed_m_s` [-].
STOP_DISTANCE, STOP_SPEED_RATIO = 0.002, 2.0
#: Averaging time of the speed of the tip [s]; part of the commanded speed below which it is held [-]; slowest command
#: that counts, over the speed of the job [-].
HELD_AVERAGE_S, HELD_RATIO, LEAST_COMMAND = 0.1, 0.2, 0.5
#: A tip is held after so long [s]: after 0.4 s one at a rivet has freed itself before its push has fallen. One that has
#: not slid yet is held after so long [s]: friction alone holds it for 0.3 s at the beginning of a stroke.
HELD_PATIENCE_S, START_PATIENCE_S = 0.25, 0.6
#: Push against an obstacle over that of the job [-], at least [N], and its rate [1/s]; the rest before the tip goes on
#: [s], until drive and push have fallen, and the way over the obstacle [m]: of a rivet, and as much again.
EASED_PUSH, LEAST_PUSH_N, EASE_1_S, EASED_REST_S, EASED_WAY_M = 0.35, 1.0, 2.0, 0.8, 0.05


class StrokeEnd:
    """A stroke ends near its goal and still, or once it was waited for too long."""

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._stopped = config, math.inf

    def is_reached(self, inputs: PainterInput, remaining: float) -> bool:
        """Whether the stroke ends with that distance left [m]."""
        config = self._config
        if remaining > STOP_DISTANCE:
            return False
        self._stopped = min(self._stopped, inputs.time_s)
        waited = inputs.time_s - self._stopped
        still = math.hypot(*inputs.velocity[:2]) < STOP_SPEED_RATIO * config.align_speed_m_s
        near = abs(remaining) < config.stop_error_m
        return (waited > config.stop_time_s and still and near) or waited > config.stop_timeout_s


class Alignment:
    """The tip is aligned once error and speed, averaged over the sway of hover, stay within their tolerances.

    Gusts and noisy pictures may prevent any standstill, so the tolerances open with time.

    Attributes:
        error, speed: Averaged, the larger error [m] and the speed [m/s]; infinite without a guide.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._config, self._since = config, math.inf
        self._average: list[float] = []
        self.error = self.speed = math.inf

    def is_reached(self, inputs: PainterInput, errors: tuple[float, float], began: float, dt: float) -> bool:
        """Whether the tip is aligned, by errors of its place across and along the strokes [m]; begun at a time [s]."""
        now = [*errors, *inputs.velocity[:2]]
        if all(map(math.isfinite, now)):
            ratio, last = 1.0 - math.exp(-dt / self._config.align_average_s), self._average or now
            self._average = [old + ratio * (new - old) for old, new in zip(last, now, strict=True)]
            high, aside, right, down = self._average
            self.error, self.speed = max(abs(high), abs(aside)), math.hypot(right, down)
        else:
            self._average, self.error, self.speed = [], math.inf, math.inf
        most_error, most_speed = self._limits(inputs.time_s - began)
        aligned = self.error < most_error and self.speed < most_speed
        self._since = min(self._since, inputs.time_s) if aligned else math.inf
        return inputs.time_s - self._since >= self._config.align_time_s

    def state(self, waited: float) -> str:
        """Error and speed with their limits, in words, after that time [s]."""
        if math.isinf(self.error):
            return "no guide in view"
        (error, speed), limits = (self.error * 1e3, self.speed * 1e3), [1e3 * limit for limit in self._limits(waited)]
        return f"line error {error:.1f} mm, limit {limits[0]:g} mm; speed {speed:.0f} mm/s, limit {limits[1]:g} mm/s"

    def _limits(self, waited: float) -> tuple[float, float]:
        """Of error [m] and speed [m/s] after that time [s]."""
        config = self._config
        opening = min(max(1.0, (waited / config.align_patience_s) ** 2), config.align_opening_max)
        return opening * config.align_error_m, opening * config.align_speed_m_s


class HeldTip:
    r"""Eases the push of a tip that an obstacle holds: the tip rests, and passes it with a part of the push.

    The force along the wall that takes a tip over a flank of angle a is :math:`f \tan(a + \arctan \mu)`, twice the
    push f at 28 deg and friction 0.7. While the tip is held, drive along the wall and push hold each other: less push
    alone frees no tip, and one that frees itself under full drive is thrown along the wall.

    Attributes:
        push: Over the push of the job [-].
        rests: Whether the tip waits for drive and push to fall.
        config: Push and speed of the job.

    Args:
        config: Push and speed of the job.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self.config, self.push = config, 1.0
        self.release()

    def release(self) -> None:
        """The tip no longer moves along the stroke; its push rises to that of the job."""
        self.rests = self._slid = False
        self._speed = self._held_s = self._eased_s = 0.0
        self._way = math.inf  # since the tip was held [m]

    def watch(self, commanded: float, moved: float, dt: float) -> None:
        """Speed that is commanded along the stroke [m/s], and the move of the tip in its direction [m]."""
        if dt <= 0.0:
            return
        self._speed += (1.0 - math.exp(-dt / HELD_AVERAGE_S)) * (moved / dt - self._speed)
        slow = self._speed < HELD_RATIO * commanded and commanded > LEAST_COMMAND * self.config.speed_m_s
        self._held_s = self._held_s + dt if slow else 0.0
        self._eased_s, self._way = self._eased_s + dt, self._way + max(moved, 0.0)
        self._slid = self._slid or (commanded > 0.0 and self._speed > LEAST_COMMAND * commanded)
        if self._held_s > (HELD_PATIENCE_S if self._slid else START_PATIENCE_S) and not self.rests:
            self._eased_s = self._way = 0.0
        self.rests = self._way < EASED_WAY_M and self._eased_s < EASED_REST_S

    def ease(self, dt: float) -> None:
        """Move the push by one tick [s]: down while the tip passes an obstacle, up otherwise."""
        least = min(1.0, max(EASED_PUSH, LEAST_PUSH_N / self.config.push_n))
        self.push = approached(self.push, least if self._way < EASED_WAY_M else 1.0, EASE_1_S * dt)
