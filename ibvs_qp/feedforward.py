"""Contact feed-forward: measured moments, and friction only along the commanded travel (design section 4.3).

Cancelling the whole measured wrench is wrong: a stuck tip returns our own push (an integrator), and friction across
the travel is damping that a delayed cancellation turns negative.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.config import ContactSettings

#: Commanded speed above which the tip is meant to slide [m/s].
SLIDING_COMMAND = 0.01


class ContactFeedforward:
    """Wrench that the contact will put on the vehicle, as far as it may be compensated."""

    def __init__(self, settings: ContactSettings, tip: np.ndarray) -> None:
        self._settings, self._tip = settings, tip
        self.reset()

    def reset(self) -> None:
        """Start from nothing."""
        self._moment = np.zeros(3)
        self._friction = np.zeros(3)

    def update(
        self,
        contact_wrench: np.ndarray,
        travel: np.ndarray,
        push: float,
        friction: float,
        in_contact: bool,
        dt: float,
        noise: float = 0.0,
    ) -> np.ndarray:
        """Wrench to expect [N, N m], (6,).

        Args:
            contact_wrench: Tared measured wrench on the vehicle.
            travel: Commanded velocity in the wall plane, in B [m/s].
            push: Filtered push [N].
            friction: Estimated Coulomb coefficient.
            in_contact: Whether the tip touches.
            dt: Time since the last tick [s].
            noise: Deviation of the filtered push [N]; a noisy sensor's moment is trusted less.
        """
        settings = self._settings
        share = 1.0 - math.exp(-2.0 * math.pi * settings.force_filter_hz * dt)
        measured = contact_wrench[3:] if in_contact else np.zeros(3)
        gain = settings.moment_gain / (1.0 + (noise / settings.moment_noise_n) ** 2)
        self._moment = self._moment + share * (gain * measured - self._moment)
        wanted = np.zeros(3)
        speed = math.sqrt(float(travel @ travel))
        if in_contact and speed > SLIDING_COMMAND:
            wanted = travel * (-settings.friction_gain * friction * max(push, 0.0) / speed)
        step = wanted - self._friction
        length = math.sqrt(float(step @ step))
        allowed = settings.friction_slew_n_s * dt if in_contact else math.inf
        self._friction = wanted if length <= allowed else self._friction + step * (allowed / length)
        return np.concatenate((self._friction, self._moment))
