"""Age and liveliness of the inputs."""

from __future__ import annotations

from typing import Any

from ibvs_qp.config import SafetySettings
from ibvs_qp.safety.policy import Fault
from ibvs_qp.safety.tick import Tick

#: Samples in a row, each different from the one before, that show a sensor with noise: half a second of force, and of
#: pictures. A simulator without noise may repeat values; its sensors are not monitored.
LIVELY_SAMPLES, LIVELY_PICTURES = 50, 15


class SampleMonitor:
    """Finds inputs that stopped, by their stamps, and inputs that repeat although their stamps go on."""

    def __init__(self, settings: SafetySettings) -> None:
        self._limits = (  # age [ns], and whether the input must be there from the start
            (Fault.IMU_STALE, round(1e9 * settings.imu_age_s), True),
            (Fault.WRENCH_STALE, round(1e9 * settings.wrench_age_s), True),
            (Fault.PLANE_STALE, round(1e9 * settings.plane_age_s), False),
            (Fault.IMAGE_STALE, round(1e9 * settings.image_age_s), False),
            (Fault.LINES_STALE, round(1e9 * settings.lines_age_s), False),
        )
        self._imu = FrozenInput(settings.frozen_imu_samples, LIVELY_SAMPLES)
        self._wrench = FrozenInput(settings.frozen_samples, LIVELY_SAMPLES)
        self._picture = FrozenInput(settings.frozen_pictures, LIVELY_PICTURES)
        self._frozen = (
            (Fault.IMU_FROZEN, self._imu),
            (Fault.WRENCH_FROZEN, self._wrench),
            (Fault.IMAGE_FROZEN, self._picture),
        )
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        for part in (self._imu, self._wrench, self._picture):
            part.reset()
        self._imu_ns = self._wrench_ns = -1

    def update(self, tick: Tick) -> None:
        """Add the faults of the inputs of a tick."""
        faults, now = tick.faults, tick.stamp_ns
        stamps = tick.imu_ns, tick.wrench_ns, tick.plane_ns, tick.image_ns, tick.lines_ns
        for (fault, limit, must), stamp in zip(self._limits, stamps, strict=True):
            if now - stamp > limit and (must or stamp >= 0):
                age_ms, limit_ms = 1e-6 * (now - stamp), 1e-6 * limit
                faults[fault] = f"{age_ms:.0f} ms old, limit {limit_ms:.0f} ms" if stamp >= 0 else "none yet"
        if tick.imu_ns != self._imu_ns:
            self._imu_ns = tick.imu_ns
            self._imu.add(tick.inertial)
        if tick.wrench_ns != self._wrench_ns:
            self._wrench_ns = tick.wrench_ns
            self._wrench.add(tick.wrench)
        if self._imu.equal or self._wrench.equal or self._picture.equal:
            for fault, monitor in self._frozen:
                if monitor.frozen:
                    faults[fault] = f"{monitor.equal + 1} equal samples in a row"

    def add_picture(self, picture: object) -> bool:
        """Count a new picture, anything that differs from picture to picture; whether it differs from the last one."""
        self._picture.add(picture)
        return not self._picture.repeats


class FrozenInput:
    """Detects a sensor that repeats a value although it has noise.

    Attributes:
        equal: Samples in a row that repeat the one before.

    Args:
        samples: Repetitions in a row that count as frozen.
        lively: Different samples in a row that show noise.
    """

    def __init__(self, samples: int, lively: int) -> None:
        self._limit, self._least = samples, lively
        self.reset()

    def reset(self) -> None:
        """As before the first sample."""
        self._last: Any = None
        self._lively = False
        self._different = self.equal = 0

    def add(self, sample: Any) -> None:
        """Count a new sample, of any type with a comparison."""
        if sample == self._last:
            self.equal, self._different = self.equal + 1, 0
            return
        self.equal, self._last = 0, sample
        self._different += 1
        self._lively = self._lively or self._different >= self._least

    @property
    def repeats(self) -> bool:
        """Whether the last sample repeats the one before."""
        return self._lively and self.equal > 0

    @property
    def frozen(self) -> bool:
        """Whether it repeats."""
        return self._lively and self.equal >= self._limit
