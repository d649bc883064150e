"""Touch and loss of contact, and the ramp that starts at a touch."""

from __future__ import annotations

from ibvs_qp.config import ControllerConfig


class TouchDetector:
    """State machine of two states, free and in contact.

    - Free to contact: `touch_samples` force samples in a row exceed the threshold while the tip is nearer to the wall
      than `contact_distance_m`.
    - Contact to free: the push stays below `loss_force_n` for `loss_time_s`, or the tip is farther away than
      `contact_distance_m`.

    Attributes:
        in_contact: The state.

    Args:
        config: Its `contact` settings and the switch `touch_ramp`.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._settings, self._ramps = config.contact, config.touch_ramp
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first sample."""
        self.in_contact = False
        self._samples = 0  # in a row above the threshold
        self._touch_ns = self._loss_ns = -1
        self._weak_ns = -1  # since when the push is below the loss force
        self._ramp_start_s = 0.0  # where the ramp of this contact starts; while free, where the last one stopped

    def threshold(self, push_noise: float) -> float:
        """Filtered push that counts as touch [N], given its standard deviation in free flight [N]."""
        return max(self._settings.touch_force_n, self._settings.touch_sigmas * push_noise)

    def add_sample(self, push: float, push_noise: float) -> None:
        """Count one filtered force sample [N] towards a touch."""
        self._samples = self._samples + 1 if push > self.threshold(push_noise) else 0

    @property
    def pressed(self) -> bool:
        """Whether enough force samples in a row exceeded the threshold."""
        return self._samples >= self._settings.touch_samples

    def update(self, stamp_ns: int, push: float, distance: float) -> bool:
        """Decide on touch and loss at one tick by filtered push [N] and distance of the tip [m]; True at a touch."""
        if not self.in_contact:
            settings = self._settings
            touches = self.pressed and distance < settings.contact_distance_m
            if touches:
                self._touch(stamp_ns)
            return touches
        if self._lost(stamp_ns, push, distance):
            self._ramp_start_s += self.time_since_touch(stamp_ns)
            self._loss_ns, self.in_contact, self._samples = stamp_ns, False, 0
        return False

    def time_since_touch(self, stamp_ns: int) -> float:
        """Time in contact [s], 0 while free."""
        return (stamp_ns - self._touch_ns) * 1e-9 if self.in_contact else 0.0

    def ramp(self, stamp_ns: int) -> float:
        """0 at touch to 1 after `ramp_s`, and 0 while free; always 1 without `touch_ramp`.

        After a loss of less than `bounce_time_s` it resumes where it stopped.
        """
        if not self._ramps:
            return 1.0
        if not self.in_contact:
            return 0.0
        return min((self._ramp_start_s + self.time_since_touch(stamp_ns)) / self._settings.ramp_s, 1.0)

    def _touch(self, stamp_ns: int) -> None:
        estimation = self._settings.estimation
        bounced = self._loss_ns >= 0 and (stamp_ns - self._loss_ns) * 1e-9 < estimation.bounce_time_s
        latest = estimation.bounce_ramp * self._settings.ramp_s if bounced else 0.0
        self._ramp_start_s = min(self._ramp_start_s, latest)
        self.in_contact, self._touch_ns, self._weak_ns = True, stamp_ns, -1

    def _lost(self, stamp_ns: int, push: float, distance: float) -> bool:
        if push >= self._settings.loss_force_n:
            self._weak_ns = -1
        elif self._weak_ns < 0:
            self._weak_ns = stamp_ns
        weak = self._weak_ns >= 0 and (stamp_ns - self._weak_ns) * 1e-9 >= self._settings.loss_time_s
        return weak or distance > self._settings.contact_distance_m
