"""Age and liveliness of the inputs."""

from __future__ import annotations

import math
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
        imu, wrench, first = settings.imu_age_s, settings.wrench_age_s, settings.first_picture_s
        # Oldest sample, and latest first one after the first tick [ns]; of a camera only where there is one.
        self._limits = tuple(
            (fault, round(1e9 * oldest), math.inf if latest is None else round(1e9 * latest), camera)
            for fault, oldest, latest, camera in (
                (Fault.IMU_STALE, imu, imu, False),
                (Fault.WRENCH_STALE, wrench, wrench, False),
                (Fault.PLANE_STALE, settings.plane_age_s, first, True),
                (Fault.IMAGE_STALE, settings.image_age_s, first, True),
                (Fault.LINES_STALE, settings.lines_age_s, None, True),
            )
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
        self._first_ns = self._imu_ns = self._wrench_ns = -1

    def update(self, tick: Tick) -> None:
        """Add the faults of the inputs of a tick."""
        faults, now = tick.faults, tick.stamp_ns
        if self._first_ns < 0:
            self._first_ns = now
        stamps = tick.imu_ns, tick.wrench_ns, tick.plane_ns, tick.image_ns, tick.lines_ns
        for (fault, oldest, latest, camera), stamp in zip(self._limits, stamps, strict=True):
            if now - stamp <= oldest:  # nearly always
                continue
            if stamp >= 0:
                faults[fault] = f"{1e-6 * (now - stamp):.0f} ms old, limit {1e-6 * oldest:.0f} ms"
            elif now - self._first_ns > latest and (tick.has_camera or not camera):
                faults[fault] = "none yet"
        if tick.plane_doubt and Fault.PLANE_STALE in faults and Fault.IMAGE_STALE not in faults:
            faults[Fault.PLANE_STALE] += f"; {tick.plane_doubt}"
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
