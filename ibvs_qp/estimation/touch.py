"""Touch and loss of contact, and the ramp that starts at a touch."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.config import ControllerConfig
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import Signals

#: Time since an event that has not happened [s].
NEVER_S = 1e6


def touch_threshold(config: ControllerConfig, push_noise: ca.SX | float) -> ca.SX | float:
    """Filtered push that counts as touch [N], given its standard deviation in free flight [N]."""
    least, noise = config.contact.touch_force_n, config.contact.touch_sigmas * push_noise
    return max(least, noise) if isinstance(noise, float) else ca.fmax(least, noise)


class TouchDetector:
    """State machine of two states, free and in contact.

    - Free to contact: `touch_samples` force samples in a row exceed the threshold while the tip is nearer to the wall
      than `contact_distance_m`.
    - Contact to free: the push stays below `loss_force_n` for `loss_time_s`, or the tip is farther away than
      `contact_distance_m`.

    Attributes:
        in_contact: The state; before `update` that of the last tick.
        time: Time in contact [s], 0 while free.
        pressed: After `add_sample`, whether enough force samples in a row exceeded the threshold.

    Args:
        signals: Registry.
        config: Its `contact` settings and the switch `touch_ramp`.
        dt: Bounded time since the last tick [s]: a stamp far ahead must not end the ramp.
    """

    def __init__(self, signals: Signals, config: ControllerConfig, dt: ca.SX) -> None:
        self._signals, self._config, self._settings = signals, config, config.contact
        state = signals.state
        self.in_contact, self._samples = state("touch.in_contact"), state("touch.samples")
        self.time = self.in_contact * (state("touch.time") + dt)
        self._since_loss = state("touch.since_loss", start=NEVER_S) + dt
        self._weak_for = state("touch.weak_for") + dt
        self._weak = state("touch.weak")
        self._ramp_start = state("touch.ramp_start")  # where the ramp of this contact starts, or the last one stopped

    def add_sample(self, new: ca.SX, push: ca.SX, push_noise: ca.SX) -> None:
        """Count a filtered force sample [N] towards a touch, if it is new."""
        above = push > touch_threshold(self._config, push_noise)
        self._samples = where(new, where(above, self._samples + 1.0, 0.0), self._samples)
        self.pressed = self._samples >= self._settings.touch_samples

    def update(self, push: ca.SX, distance: ca.SX) -> None:
        """Decide on touch and loss by filtered push [N] and distance of the tip [m]."""
        settings, estimation = self._settings, self._settings.estimation
        touches = both(no(self.in_contact), self.pressed, distance < settings.contact_distance_m)
        bounced = self._since_loss < estimation.bounce_time_s
        latest = where(bounced, estimation.bounce_ramp * settings.ramp_s, 0.0)

        weak = both(self.in_contact, push < settings.loss_force_n)
        weak_for = where(self._weak, self._weak_for, 0.0)
        lost = both(
            self.in_contact,
            either(both(weak, weak_for >= settings.loss_time_s), distance > settings.contact_distance_m),
        )
        start = where(touches, ca.fmin(self._ramp_start, latest), self._ramp_start + where(lost, self.time, 0.0))
        self.in_contact = where(lost, 0.0, either(self.in_contact, touches))
        self.time = where(either(touches, lost), 0.0, self.time)
        for name, value in {
            "in_contact": self.in_contact,
            "samples": where(lost, 0.0, self._samples),
            "time": self.time,
            "since_loss": where(lost, 0.0, ca.fmin(self._since_loss, NEVER_S)),
            "weak": weak,
            "weak_for": weak_for,
            "ramp_start": start,
        }.items():
            self._signals.remember(f"touch.{name}", value)
        self._ramp_start = start

    @property
    def ramp(self) -> ca.SX:
        """0 at touch to 1 after `ramp_s`, and 0 while free; always 1 without `touch_ramp`.

        After a loss of less than `bounce_time_s` it resumes where it stopped.
        """
        if not self._config.touch_ramp:
            return ca.SX(1.0)
        return self.in_contact * ca.fmin((self._ramp_start + self.time) / self._settings.ramp_s, 1.0)
