"""Stiffness by the planes after a touch in calm air, with planes 80 ms late and 1.2 mm of noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from controller_scenes import TICK_NS, Wall, attitude
from estimators import ContactEstimator

from ibvs_qp.config import ControllerConfig

CONFIG = ControllerConfig()
ESTIMATION = CONFIG.contact.estimation
LEVEL, TICK, LATE_TICKS = attitude(), CONFIG.tick_s, 20
STIFF = 10_000.0
#: A loop that believes in less than this part of the true stiffness is unstable.
UNSTABLE = 1.0 / 3.0
#: Duration of the approach and of a contact [s].
APPROACH, CONTACT = 2.0, 4.5


class Touches:
    """Slow touches of a vehicle held by its pilot; keeps the estimated stiffness at every tick."""

    def __init__(self, seed: int = 0) -> None:
        self.estimator, self.rng, self.tick = ContactEstimator(CONFIG), np.random.default_rng(seed), 0
        self.bias = self.rng.normal(0.0, 0.003)  # of the depth camera: the same before and after a touch
        self.distances = [0.03] * (LATE_TICKS + 3)
        self.plane, self.plane_ns = Wall(LEVEL, 0.03).plane, -1
        self.values: list[float] = []

    def touch(
        self, stiffness: float, off: Callable[[float], float] = lambda t: 0.0, drift_n: float = 0.0, gap: float = 0.0
    ) -> tuple[float, bool]:
        """Approach with 20 mm/s, press with up to 5 N, and leave.

        Args:
            stiffness: Of the wall [N/m].
            off: Error of a plane captured some time after the touch [m].
            drift_n: Of the force sensor, which feels a touch that much too early [N].
            gap: Distance at which it does [m].
        """
        for step in range(round((APPROACH + CONTACT) / TICK)):
            t = step * TICK - APPROACH
            push = min(max(5.0 * t, 0.0), 5.0)
            self.distances.append(-push / stiffness if t >= 0.0 else min(-0.02 * t, 0.03))
            self._tick(push + drift_n * (t > -gap / 0.02), off, t)
        state = self.estimator.state
        return state.stiffness, state.stiffness_known

    def _tick(self, push: float, off: Callable[[float], float], t: float) -> None:
        if self.tick % 8 == 0:
            noise = self.rng.normal(0.0, ESTIMATION.distance_std_m)
            seen = self.distances[-1 - LATE_TICKS] + self.bias + noise + off(t - LATE_TICKS * TICK)
            self.plane, self.plane_ns = Wall(LEVEL, seen).plane, (self.tick + 1 - LATE_TICKS) * TICK_NS
        acceleration = -(self.distances[-1] - 2.0 * self.distances[-2] + self.distances[-3]) / TICK**2
        force = np.clip(acceleration, -5.0, 5.0) + self.rng.normal(0.0, 0.1)
        self.estimator.update(
            stamp_ns=(self.tick + 1) * TICK_NS,
            specific_force=(force, 0.0, -9.81),
            contact_wrench=np.array([-(push + self.rng.normal(0.0, 0.05)), 0.0, 0.0, 0.0, 0.0, 0.0]),
            wrench_stamp_ns=(self.tick // 3 * 3 + 1) * TICK_NS,
            plane=self.plane if self.plane_ns > 0 else None,
            plane_stamp_ns=self.plane_ns,
            press=t > -0.5,
        )
        self.values.append(self.estimator.state.stiffness)
        self.tick += 1


@pytest.mark.parametrize("stiffness", [1200.0, 1500.0, 3000.0])
def test_a_brush_is_known_after_a_touch(stiffness: float) -> None:
    found = [Touches(seed).touch(stiffness) for seed in range(5)]
    print(f"{stiffness:.0f} N/m: found {[round(value) for value, _ in found]}")
    assert np.median([value for value, _ in found]) < 2.0 * stiffness
    assert all(0.75 * stiffness < value for value, _ in found)
    assert stiffness > 1500.0 or all(known for _, known in found)


def test_a_stiff_wall_is_at_no_tick_taken_for_a_soft_one() -> None:
    for seed in range(6):
        touches = Touches(seed)
        touches.touch(STIFF)
        assert min(touches.values) > UNSTABLE * STIFF, seed


@pytest.mark.parametrize(
    ("begin_s", "nearer_m"),
    # 1 cm nearer within the first 0.1 s is what a brush shows.
    [(0.1, 0.03), (0.1, 0.08), (0.5, 0.01), (0.5, 0.03), (0.5, 0.08), (2.0, 0.01), (2.0, 0.03), (2.0, 0.08)],
)
def test_a_nearer_surface_in_view_is_no_penetration(begin_s: float, nearer_m: float) -> None:
    touches = Touches()
    touches.touch(STIFF, lambda t: -nearer_m * (t > begin_s))
    assert min(touches.values) > UNSTABLE * STIFF


@pytest.mark.parametrize("time_s", [0.35, 1.0, 2.5])
@pytest.mark.parametrize(("nearer_m", "duration_s"), [(0.015, 0.034), (0.045, 0.034), (0.045, 0.13)])
def test_a_few_wrong_planes_are_no_penetration(time_s: float, nearer_m: float, duration_s: float) -> None:
    touches = Touches()
    touches.touch(STIFF, lambda t: -nearer_m * (abs(t - time_s) < duration_s / 2.0))
    assert min(touches.values) > UNSTABLE * STIFF


def test_a_push_felt_before_the_wall_is_no_penetration() -> None:
    touches = Touches()
    touches.touch(STIFF, drift_n=0.6, gap=0.006)
    assert min(touches.values) > UNSTABLE * STIFF


def test_the_last_touch_counts() -> None:
    """Another part of the wall may be stiffer, and then a brush's stiffness would be unstable."""
    touches = Touches()
    for _ in range(4):
        assert touches.touch(1500.0)[0] < 4000.0
    assert touches.touch(STIFF)[0] > UNSTABLE * STIFF
    assert touches.touch(1500.0)[0] < 4000.0
