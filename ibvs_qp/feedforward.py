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
        self._moment = [0.0, 0.0, 0.0]
        self._friction = [0.0, 0.0, 0.0]

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
        gain = settings.moment_gain / (1.0 + (noise / settings.moment_noise_n) ** 2) if in_contact else 0.0
        measured = contact_wrench.tolist()[3:]
        self._moment = [old + share * (gain * new - old) for old, new in zip(self._moment, measured, strict=True)]
        way = travel.tolist()
        speed = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        size = -settings.friction_gain * friction * max(push, 0.0) / speed if speed > SLIDING_COMMAND else 0.0
        wanted = [size * entry if in_contact else 0.0 for entry in way]
        step = [new - old for new, old in zip(wanted, self._friction, strict=True)]
        length = math.sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2])
        allowed = settings.friction_slew_n_s * dt if in_contact else math.inf
        if length > allowed:
            wanted = [old + entry * (allowed / length) for old, entry in zip(self._friction, step, strict=True)]
        self._friction = wanted
        return np.array(wanted + self._moment)
