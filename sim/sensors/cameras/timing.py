"""Errors of delivery: pictures that come later than the camera's latency, and wrong stamps."""

from __future__ import annotations

from sim.world.errors import TimingErrors
from sim.world.random_streams import stream

_NS_PER_S = 1e9


class DeliveryErrors:
    """Delay and stamp of every picture; the content of a picture never changes.

    Args:
        errors: Sizes.
        seed: Seed of the flight.
    """

    def __init__(self, errors: TimingErrors, seed: int) -> None:
        self._errors, self._rng = errors, stream(seed, "errors.timing")
        self._last_ns = -1

    def delay_ns(self) -> int:
        """Delay of the next picture beyond the camera's latency [ns]."""
        return round(self._errors.jitter_s * self._rng.standard_exponential() * _NS_PER_S)

    def stamp_ns(self, captured_ns: int) -> int:
        """Stamp of a picture captured at ``captured_ns``; the clock begins with the flight and never runs back."""
        errors = self._errors
        off = errors.stamp_error_s + errors.stamp_jitter_s * self._rng.standard_normal()
        self._last_ns = max(captured_ns + round(off * _NS_PER_S), self._last_ns + 1)
        return self._last_ns


def delivery_errors(errors: TimingErrors, seed: int) -> DeliveryErrors | None:
    """Errors of a flight's deliveries, or None for a world without them."""
    return DeliveryErrors(errors, seed) if errors != TimingErrors() else None
