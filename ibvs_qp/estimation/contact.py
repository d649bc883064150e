"""Distance to the wall, its inertial rate, touch and loss: the part that decides whether contact works.

Differentiated depth is 60-100 ms late and takes the damping out of the contact; the rate here comes from the
accelerometer and is only corrected by depth (design section 4.2).
"""

from __future__ import annotations

import math
import struct

import numpy as np

from ibvs_qp.analysis.contact_loop import ACCELERATION_FILTER, ACCELERATION_NOISE, HELD_SPEED_STD
from ibvs_qp.config import LONGEST_TICK, ControllerConfig
from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.stamps import HISTORY
from ibvs_qp.estimation.stiffness import StiffnessEstimator
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import Measurement

#: Drift of the accelerometer bias that gravity leaks through the attitude bias [m/s^3/sqrt(Hz)].
BIAS_NOISE = 2e-3
#: Deviation of the distance of one fitted plane [m]: common mode of the depth camera.
DISTANCE_STD = 1.2e-3
#: This long after the touch the wall holds the tip [s]. Its speed says more than depth then, whose noise [m] the
#: impedance damping would turn into push.
HELD_AFTER, HELD_DISTANCE_STD = 0.3, 5e-3
#: Share of a frame's normal innovation that is believed; the normal averages over about six frames.
NORMAL_GAIN = 0.15
#: A plane this far from the expected distance is a leap [m], believed after so many frames in a row.
LEAP, LEAP_FRAMES = 0.05, 5
#: A loss no longer than this is a bounce [s], after which the ramp goes on where it stopped, if no later than this
#: share of it: 16 % of the push; the whole of it at once would throw the brush at the wall.
SHORT_LOSS, RESUMED = 0.5, 0.4
#: Free-flight noise of the push is averaged over this time [s].
NOISE_TIME = 1.0

_three = struct.Struct("3d")
_put_three, _ROW_BYTES = _three.pack_into, _three.size


class ContactEstimator:
    """Wall normal, tip distance and rate, push, contact state and lambda; one instance per controller.

    Attributes:
        direction: Unit vector into the wall, in B, as plain numbers; known: whether the wall was ever seen.
        distance: Tip to wall [m]; rate: its rate [m/s]; acceleration: the rate's own, filtered [m/s^2].
        depth: Camera to wall along the normal [m].
        push: Filtered push [N]; push_raw: of the last sample; push_noise: deviation of push in free flight [N].
        across_noise: Deviation of the filtered moments in free flight, as a force across the tip [N].
        in_contact: Whether the tip touches; touch_ns: since when.
        ramp: 0 at touch to 1 after the ramp time; 0 while free.
        contact_weight: Lambda (paper, corrected), 0 far away to 1.
        stiffness: Of brush and wall.
    """

    def __init__(self, config: ControllerConfig) -> None:
        """Prepare for the geometry and settings of a controller."""
        self._config = config
        vehicle = config.vehicle
        self._tip = np.array(vehicle.tip_position_m)
        self._tip_list = self._tip.tolist()
        self._tip_from_camera = (self._tip - np.array(vehicle.camera_position_m)).tolist()
        chain = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
        noise = np.array([1e-10, ACCELERATION_NOISE**2, BIAS_NOISE**2])
        self._filter = DelayedKalman(chain, noise, np.array([0.05, 0.05, 0.1]), config.tick_s)
        self.reset()

    def reset(self) -> None:
        """Forget everything, as before the first measurement."""
        self._filter.reset()
        self._normal_history = np.zeros((HISTORY, 3))
        self._normal_memory = self._normal_history.data
        self._state: tuple[float, ...] | None = None  # of the filter as last asked; None once it was corrected
        self._share_of = (math.nan, 0.0)  # share of a new acceleration in a tick of that length [s]
        self._ticks = 0
        self._plane_stamp = self._wrench_stamp = self._stamp = -1
        self.direction = (1.0, 0.0, 0.0)
        self.known, self._leaps = False, 0
        self.distance, self.rate, self.acceleration, self._lever_speed = math.inf, 0.0, 0.0, 0.0
        self.depth = math.inf
        self.push = self.push_raw = 0.0
        self._push_mean, self._push_variance = 0.0, 0.02
        self._moment, self._moment_variance = (0.0, 0.0, 0.0), 0.0
        self._note_noise()
        self.in_contact, self.touch_ns, self._touch_count, self._doubt_ns = False, -1, 0, -1
        self._ramped, self._lost_ns = 0.0, -1
        self.stiffness = StiffnessEstimator()
        self._update_weight()

    def update(self, measurement: Measurement, down: tuple[float, float, float]) -> None:
        """Take in one measurement; ``down`` is the unit gravity direction in B."""
        stamp = measurement.stamp_ns
        dt = self._config.tick_s
        if self._stamp >= 0:
            dt = (stamp - self._stamp) * 1e-9
            dt = LONGEST_TICK if dt > LONGEST_TICK else dt if dt > 0.0 else 0.0
        self._stamp = stamp
        self._predict(measurement, down, dt)
        if measurement.plane is not None and measurement.plane_stamp_ns > self._plane_stamp:
            self._correct_plane(measurement.plane, measurement.plane_stamp_ns)
        if self.known:
            state = self._state
            if state is None:  # corrected meanwhile
                state = self._state = tuple(self._filter.state.tolist())
            self.distance, speed, _ = state
            self.rate = -speed - self._lever_speed
            (nx, ny, nz), (cx, cy, cz) = self.direction, self._tip_from_camera
            self.depth = self.distance + nx * cx + ny * cy + nz * cz
        if measurement.wrench_stamp_ns > self._wrench_stamp:
            self._update_push(measurement)
        self._update_contact(stamp)
        self._update_weight()

    @property
    def normal(self) -> np.ndarray:
        """Unit vector into the wall, in B, (3,)."""
        return np.array(self.direction)

    def _predict(self, measurement: Measurement, down: tuple[float, float, float], dt: float) -> None:
        """Turn the normal with the gyro and integrate the accelerometer along it."""
        # Plain numbers: this runs every tick, and arrays of three cost ten times their arithmetic.
        wx, wy, wz = measurement.angular_velocity.tolist()
        nx, ny, nz = self.direction
        nx, ny, nz = nx + dt * (ny * wz - nz * wy), ny + dt * (nz * wx - nx * wz), nz + dt * (nx * wy - ny * wx)
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        self.direction = nx, ny, nz = nx / length, ny / length, nz / length
        self._ticks += 1
        _put_three(self._normal_memory, self._ticks % HISTORY * _ROW_BYTES, nx, ny, nz)
        # The tip moves with the body's turn as well; the chain integrates only the centre of mass.
        tx, ty, tz = self._tip_list
        lever = nx * (wy * tz - wz * ty) + ny * (wz * tx - wx * tz) + nz * (wx * ty - wy * tx)
        self._lever_speed = lever
        acceleration = 0.0
        if measurement.specific_force is not None:
            fx, fy, fz = measurement.specific_force.tolist()
            gx, gy, gz = down
            acceleration = nx * (fx + GRAVITY * gx) + ny * (fy + GRAVITY * gy) + nz * (fz + GRAVITY * gz)
        distance, speed, bias = self._state or self._filter.state.tolist()
        if dt != self._share_of[0]:
            self._share_of = dt, 1.0 - math.exp(-dt / ACCELERATION_FILTER)
        self.acceleration += self._share_of[1] * (bias - acceleration - self.acceleration)
        self._state = state = distance - dt * (speed + lever), speed + dt * (acceleration - bias), bias
        self._filter.remember(measurement.stamp_ns, state, dt)

    def _correct_plane(self, plane: tuple[float, float, float, float], stamp: int) -> None:
        a, b, c, d = plane
        x, y, z = -c / d, -a / d, -b / d  # from camera to body axes
        length = math.sqrt(x * x + y * y + z * z)
        tip_x, tip_y, tip_z = self._tip_from_camera
        distance = (1.0 - x * tip_x - y * tip_y - z * tip_z) / length
        x, y, z = x / length, y / length, z / length
        self._plane_stamp, self._state = stamp, None
        if not self.known:
            self.direction = x, y, z
            self._normal_history[:] = x, y, z
            self._filter.set_entry(0, distance, 0.01)
            self.known = True
            return
        if not self._believe(stamp, distance):
            return
        age = self._filter.ticks.age(stamp) or 0
        history, start, end = self._normal_history, (self._ticks - age) % HISTORY, self._ticks % HISTORY + 1
        past_x, past_y, past_z = history[start].tolist()
        dx, dy, dz = NORMAL_GAIN * (x - past_x), NORMAL_GAIN * (y - past_y), NORMAL_GAIN * (z - past_z)
        for part in (slice(start, end),) if start < end else (slice(start, None), slice(0, end)):
            history[part] += (dx, dy, dz)
        nx, ny, nz = self.direction
        nx, ny, nz = nx + dx, ny + dy, nz + dz
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        self.direction = nx / length, ny / length, nz / length

    def _believe(self, stamp: int, distance: float) -> bool:
        """Correct with a measured distance: a jump is believed slowly, a leap only when the next frames repeat it."""
        held = self.in_contact and (stamp - self.touch_ns) * 1e-9 > HELD_AFTER
        if self._filter.correct_entry(stamp, 0, distance, (HELD_DISTANCE_STD if held else DISTANCE_STD) ** 2):
            if held:
                self._filter.correct_entry(stamp, 1, -self._lever_speed, HELD_SPEED_STD**2)
            self._leaps = 0
            return True
        past = self._filter.at(stamp)
        if past is None:
            return False
        if abs(distance - past[0]) < LEAP:
            self._leaps = 0
            return self._filter.correct_entry(stamp, 0, distance, 0.02**2, gate=1e3)
        self._leaps += 1
        if self._leaps < LEAP_FRAMES:
            return False
        self._leaps = 0
        self._filter.set_entry(0, distance, 0.01)
        return True

    def _update_push(self, measurement: Measurement) -> None:
        """Filter a new force sample."""
        settings = self._config.contact
        dt = 0.01 if self._wrench_stamp < 0 else min((measurement.wrench_stamp_ns - self._wrench_stamp) * 1e-9, 0.1)
        self._wrench_stamp = measurement.wrench_stamp_ns
        (fx, fy, fz, mx, my, mz), (nx, ny, nz) = measurement.contact_wrench.tolist(), self.direction
        self.push_raw = -(fx * nx + fy * ny + fz * nz)
        gain = 1.0 - math.exp(-2.0 * math.pi * settings.force_filter_hz * dt)
        self.push += gain * (self.push_raw - self.push)
        x, y, z = self._moment
        self._moment = x, y, z = x + gain * (mx - x), y + gain * (my - y), z + gain * (mz - z)
        if not self.in_contact and self.distance > 2.0 * settings.contact_distance_m:
            share = min(1.0, dt / NOISE_TIME)
            self._push_mean += share * (self.push - self._push_mean)
            self._push_variance += share * ((self.push - self._push_mean) ** 2 - self._push_variance)
            self._moment_variance += share * (0.5 * (x * x + y * y + z * z) - self._moment_variance)
            self._note_noise()
        self._touch_count = self._touch_count + 1 if self.push > self.touch_threshold else 0
        if self.in_contact:
            self.stiffness.add(self.push, -self.distance, dt)

    @property
    def speed(self) -> float:
        """Speed of the centre of mass into the wall [m/s], whatever the tip does by turning."""
        return -self.rate - self._lever_speed

    def _note_noise(self) -> None:
        self.push_noise = math.sqrt(self._push_variance)
        self.across_noise = math.sqrt(self._moment_variance) / self._tip_list[0]

    @property
    def touch_threshold(self) -> float:
        """Filtered push that counts as touch [N]."""
        settings = self._config.contact
        return max(settings.touch_force_n, settings.touch_sigmas * self.push_noise)

    def _update_contact(self, stamp: int) -> None:
        settings = self._config.contact
        if not self.in_contact:
            if self._touch_count >= settings.touch_samples and self.distance < settings.contact_distance_m:
                self.in_contact, self.touch_ns, self._doubt_ns = True, stamp, -1
                short = self._lost_ns >= 0 and (stamp - self._lost_ns) * 1e-9 < SHORT_LOSS
                self._ramped = min(self._ramped, RESUMED * self._config.contact.ramp_s) if short else 0.0
                self.stiffness.start()
            return
        self._doubt_ns = (
            -1 if self.push >= settings.loss_force_n else (self._doubt_ns if self._doubt_ns >= 0 else stamp)
        )
        doubted = self._doubt_ns >= 0 and (stamp - self._doubt_ns) * 1e-9 >= settings.loss_time_s
        if doubted or self.distance > settings.contact_distance_m:
            self._ramped, self._lost_ns = self._ramped + self.time_since_touch, stamp
            self.in_contact, self.touch_ns, self._touch_count = False, -1, 0

    @property
    def time_since_touch(self) -> float:
        """Seconds since touch, 0 while free."""
        return (self._stamp - self.touch_ns) * 1e-9 if self.in_contact else 0.0

    def _update_weight(self) -> None:
        r"""Ramp and lambda, :math:`\tfrac12(1+\cos(\pi (d-d_{min})/(d_{max}-d_{min})))` times the ramp (corrected).

        The ramp goes from 0 at touch to 1 and is 0 while free; after a short loss it goes on where it stopped.
        """
        settings = self._config.contact
        if not self._config.touch_ramp:
            self.ramp = 1.0
        elif self.in_contact:
            ramp = (self._ramped + self.time_since_touch) / settings.ramp_s
            self.ramp = ramp if ramp < 1.0 else 1.0
        else:
            self.ramp = 0.0
        share = (self.depth - settings.depth_min_m) / (settings.depth_max_m - settings.depth_min_m)
        if share >= 1.0:
            self.contact_weight = 0.0
        else:
            self.contact_weight = self.ramp * (1.0 if share <= 0.0 else 0.5 * (1.0 + math.cos(math.pi * share)))
