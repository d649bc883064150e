"""From single messages to sensor frames: the last received samples are held; a picture is given once."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.interfaces.ros import pictures, samples
from ibvs_qp.interfaces.ros.messages import BadMessage, from_ros
from ibvs_qp.interfaces.ros.topics import MOTION, Topics
from ibvs_qp.measurement import RgbdFrame, SensorFrame, channels
from ibvs_qp.validation.clock import LEAD_NS

#: Gravity, and largest difference of the specific force from it that still shows the vertical [m/s^2].
GRAVITY, CALM = 9.81, 1.0
#: Longest gap between two samples that the gyro bridges [s].
LONGEST_GAP_S = 0.2


class AttitudeFilter:
    r"""Roll and pitch from the accelerometer below a bandwidth, from the gyro above it; yaw from the gyro, from 0 on.

    .. math:: q \leftarrow q \otimes \exp\bigl((\omega + \tfrac{1}{T} (-f/|f|) \times d)\, \Delta t\bigr)

    with the vertical d of the estimate in the body. While the specific force f differs from gravity by more than
    `CALM`, the gyro alone turns the attitude.

    Args:
        time_constant_s: T [s].
    """

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self._stamp_ns, self._attitude = -1, Rotation.identity()

    def update(self, stamp_ns: int, rate: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Attitude of B in I (w, x, y, z) after a sample.

        Args:
            stamp_ns: Its time [ns].
            rate: Angular velocity in B [rad/s], (3,).
            force: Specific force in B [m/s^2], (3,).

        Raises:
            BadMessage: When the filter must begin and the specific force shows no vertical.
        """
        dt, self._stamp_ns, begun = 1e-9 * (stamp_ns - self._stamp_ns), stamp_ns, self._stamp_ns >= 0
        size = float(np.linalg.norm(force))
        calm = abs(size - GRAVITY) <= CALM
        if not (begun and 0.0 < dt <= LONGEST_GAP_S):
            if not calm:
                self._stamp_ns = -1
                raise BadMessage("no vertical to begin the attitude from")
            x, y, z = force
            yaw = float(self._attitude.as_euler("ZYX")[0])
            angles = [yaw, math.atan2(x, math.hypot(y, z)), math.atan2(-y, -z)]
            self._attitude = Rotation.from_euler("ZYX", angles)
        else:
            turn = np.array(rate, float)
            if calm:
                down = self._attitude.inv().apply((0.0, 0.0, 1.0))
                turn += np.cross(-np.asarray(force) / size, down) / self._time_constant_s
            self._attitude = self._attitude * Rotation.from_rotvec(turn * dt)
        x, y, z, w = self._attitude.as_quat()
        return np.array((w, x, y, z))


#: Longest time by their stamps that colour and depth wait for their partner [ns]: aligned depth comes 30 to 70 ms late.
WAITING_NS = 250_000_000
#: Most pictures of a kind that wait: 90 Hz for that time, with a margin.
MOST_WAITING = 32
#: In a recording a stamp that goes back by more is of a clock that was set, and not of a late sample [ns].
CLOCK_SET_NS = 1_000_000_000
#: A stamp of the system's clock lies at most this far behind it [ns].
LATEST_NS = 1_000_000_000


class LatestSamples:
    """Collects messages in the order of their arrival.

    A frame has the last sample of every sensor with its own stamp; the pilot checks their age. Colour and depth are
    paired by the nearest stamps within ``pair_s``, however late one of them comes. A message that cannot be used, and a
    sample that is late or repeated, is left out and counted.

    Attributes:
        last: Last sample of each role.
        ignored: Messages left out, by role and reason.
        camera: Of the last camera info, None before it.
        pairs: Complete pictures so far.

    Args:
        topics: Axes of the force sensor, source of the attitude, and tolerance of the pairs.
        clock: Time that stamps are compared with [ns]; None compares nothing, as for a recording.
    """

    def __init__(self, topics: Topics, clock: Callable[[], int] | None = None) -> None:
        self._topics, self._clock = topics, clock
        self.last: dict[str, samples.Sample] = {}
        self.ignored = Counter[str]()
        self.camera: pictures.Camera | None = None
        self.pairs = 0
        self._waiting: dict[str, deque[tuple[int, Any]]] = {name: deque() for name in ("color", "depth")}
        self._picture: RgbdFrame | None = None
        self._paired_ns = -1
        self._filter = AttitudeFilter(topics.attitude_filter_s) if topics.attitude_filter_s > 0.0 else None

    @np.errstate(all="ignore")  # a host may have numpy raise for the NaN of a message
    def add(self, role: str, value: Any) -> bool:
        """Take a decoded message of a role of `ibvs_qp.interfaces.ros.topics.ACCEPTED`; False if it cannot be used."""
        try:
            if role in self._waiting:
                self._add_picture(role, value)
            elif role == "camera_info":
                self.camera = pictures.to_camera(value, self._topics.rectified)
            else:
                self._add_sample(role, value)
        except BadMessage as error:
            self.ignore(role, str(error))
            return False
        except Exception:  # a bag may define a type of this name without the fields
            self.ignore(role, "fields are not those of its type")
            return False
        return True

    def ignore(self, role: str, reason: str) -> None:
        """Count a message that is left out."""
        self.ignored[f"{role}: {reason}"] += 1

    def frame(self, stamp_ns: int) -> SensorFrame | None:
        """Frame of a tick, with a picture that no frame had; None until every sensor was received."""
        if missing := [role for role in MOTION if role not in self.last]:
            if "imu" not in missing:  # its message makes no frame
                self.ignore("imu", f"no {' and no '.join(missing)} yet")
            return None
        values: dict[str, Any] = {}
        for sample in self.last.values():
            values |= sample.values | {channels(SensorFrame)[name].stamp: sample.stamp_ns for name in sample.values}
        return SensorFrame(stamp_ns=stamp_ns, image=self.take_picture(), **values)

    def finish(self) -> None:
        """Count the pictures that still wait, for a partner or a frame, at the end of a recording."""
        if self.take_picture() is not None:
            self.ignore("color", "no frame came after it")
        for role, waiting in self._waiting.items():
            self._forget(role, len(waiting))

    def take_picture(self) -> RgbdFrame | None:
        """The last complete picture, once."""
        picture, self._picture = self._picture, None
        return picture

    def check_clock(self, stamp_ns: int) -> None:
        """Raise BadMessage for a stamp that is not of the clock, or too old."""
        if self._clock is not None and not -LEAD_NS <= self._clock() - stamp_ns <= LATEST_NS:
            raise BadMessage("stamp is not of this computer's clock, or too old")

    def _add_sample(self, role: str, value: Any) -> None:
        sample = samples.READERS[role](value, self._topics)
        self.check_clock(sample.stamp_ns)
        if (before := self.last.get(role)) is not None and self._late(sample.stamp_ns, before.stamp_ns):
            raise BadMessage("not newer than the one before")
        if role == "imu" and not self._topics.attitude:
            self.last["attitude"] = self._attitude(value, sample)
        self.last[role] = sample

    def _late(self, stamp_ns: int, before_ns: int) -> bool:
        """Whether a stamp is not newer than an earlier one, whose clock was not set back since."""
        if self._clock is not None:
            return stamp_ns <= before_ns <= self._clock() + LEAD_NS
        return 0 <= before_ns - stamp_ns < CLOCK_SET_NS

    def _attitude(self, value: Any, sample: samples.Sample) -> samples.Sample:
        """Attitude of an IMU's message, or of the filter where one is set."""
        if self._filter is None:
            return samples.attitude(value)
        values = sample.values["angular_velocity"], sample.values["specific_force"]
        return samples.Sample(sample.stamp_ns, {"attitude": self._filter.update(sample.stamp_ns, *values)})

    def _add_picture(self, role: str, value: Any) -> None:
        """Keep a picture, and complete the pair of the nearest stamps."""
        pixels = pictures.to_rgb(value) if role == "color" else pictures.to_depth(value)
        stamp = from_ros(value.header.stamp)
        self.check_clock(stamp)
        if self._late(stamp, self._paired_ns):
            raise BadMessage("not newer than the last pair")
        own, other = self._waiting[role], self._waiting[partner := "depth" if role == "color" else "color"]
        nearest = min(other, key=lambda each: abs(each[0] - stamp), default=None)
        if nearest is None or abs(nearest[0] - stamp) > round(self._topics.pair_s * 1e9):
            own.append((stamp, pixels))
            if len(own) > MOST_WAITING:
                own.popleft()
                self._forget(role, 1)
            self._drop(role, lambda waiting: stamp - waiting > WAITING_NS or waiting - stamp >= CLOCK_SET_NS)
            return
        self._drop(role, lambda waiting: waiting <= stamp)
        self._drop(partner, lambda waiting: waiting < nearest[0])
        other.remove(nearest)
        (color_ns, rgb), (_, depth) = ((stamp, pixels), nearest) if role == "color" else (nearest, (stamp, pixels))
        self._paired_ns = min(stamp, nearest[0])
        if (camera := self.camera) is None:
            raise BadMessage("no camera info yet")
        if self._topics.depth_registered and rgb.shape[:2] != depth.shape:
            raise BadMessage("colour and depth differ in size")
        if rgb.shape[:2] != camera.shape:  # binning and a region of interest change it as well, and with it the pixels
            raise BadMessage("size is not that of camera_info")
        if self._picture is not None:
            self.ignore("color", "a newer picture came before a frame")
        self._picture = RgbdFrame(rgb=rgb, depth=depth, intrinsics=camera.intrinsics, stamp_ns=color_ns)
        self.pairs += 1

    def _drop(self, role: str, old: Callable[[int], bool]) -> None:
        """Leave out waiting pictures by their stamps, and count them."""
        waiting = self._waiting[role]
        kept = [each for each in waiting if not old(each[0])]
        self._forget(role, len(waiting) - len(kept))
        waiting.clear()
        waiting.extend(kept)

    def _forget(self, role: str, count: int) -> None:
        if count:
            partner = "depth" if role == "color" else "colour"
            self.ignored[f"{role}: no {partner} within pair_s"] += count


#: Former name.
HeldSamples = LatestSamples
