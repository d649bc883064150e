"""Inputs: sensor frames for the pilot, measurements and references for a controller.

All are frozen keyword-only dataclasses in float64 and SI units; stamps are integer nanoseconds of one monotonic
clock. They are plain carriers: a controller checks them itself, because no step may raise in flight. A field states
its unit, shape, bounds and times once (`Channel`): gates, logs, ROS topics, sensor models, faults and docs/sensors.md
read them there.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from ibvs_qp.frames import GRAVITY

HORIZONTAL, VERTICAL = "horizontal", "vertical"
#: Largest curvature of a wall [1/m]: a pier of 1 m across.
LARGEST_CURVATURE = 2.0
#: Length of a vector with one entry a rotor.
ROTORS = -1


@dataclass(frozen=True)
class Channel:
    """Content of one field of an input.

    Attributes:
        name: The field.
        shape: Of its float array; empty for a plain number.
        low: Smallest value of an entry; entries of a channel without bounds have checks of their own.
        high: Largest value of an entry.
        unit: Unit of entries and bounds.
        fallback: Entries in force until an input was accepted; empty for None.
        held: Whether the last accepted value stays in force where one is refused; None replaces it otherwise.
        optional: Whether None is accepted.
        unit_length: Whether the vector must have length 1.
        axes: How it changes with the axes of B: "vector" (of three, or a wrench), "attitude", "covariance", "angles"
            (roll, pitch), "frame" (a dataclass with such fields); empty for not at all.
        stamp: Field with the time of its sample; empty for the time of the tick.
        rate_hz: Nominal rate [Hz]; 0 for every tick.
        latency_s: Nominal time from sample to delivery [s].
        oldest_s: Greatest age in use [s]: an older value that is not held is refused, of others the supervisor decides.
    """

    name: str = ""
    shape: tuple[int, ...] = ()
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    fallback: tuple[float, ...] = ()
    held: bool = True
    optional: bool = False
    unit_length: bool = False
    axes: str = ""
    stamp: str = ""
    rate_hz: float = 0.0
    latency_s: float = 0.0
    oldest_s: float = math.inf


def channel(*shape: int, bound: float = math.inf, default: Any = dataclasses.MISSING, **more: Any) -> Any:
    """A field of a dataclass with its `Channel`.

    Args:
        shape: Of its array; none for a number.
        bound: Largest size of an entry, where ``low`` and ``high`` are not given.
        default: Of the field; a tuple or an array is copied for every instance.
        more: Further attributes of the `Channel`.
    """
    metadata = {"channel": Channel(**{"shape": shape, "low": -bound, "high": bound, **more})}
    if isinstance(default, np.ndarray):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


@cache
def channels(kind: type) -> dict[str, Channel]:
    """Channels of a dataclass by the names of its fields, in their order."""
    return {
        each.name: dataclasses.replace(each.metadata["channel"], name=each.name, optional=each.default is None)
        for each in dataclasses.fields(kind)
        if "channel" in each.metadata
    }


#: Channels that several inputs have: attitude and gyro; velocity; speed and tilt in the wall plane.
_ATTITUDE: dict[str, Any] = {
    "bound": 1.01, "unit": "-", "fallback": (1.0, 0.0, 0.0, 0.0), "unit_length": True,
    "axes": "attitude", "stamp": "attitude_stamp_ns", "rate_hz": 250.0, "oldest_s": 0.02,
}  # fmt: skip
_INERTIAL: dict[str, Any] = {
    "axes": "vector", "stamp": "imu_stamp_ns", "rate_hz": 250.0, "oldest_s": 0.02,
}  # fmt: skip
_RATE: dict[str, Any] = {"bound": 35.0, "unit": "rad/s", "fallback": (0.0,) * 3, **_INERTIAL}
_FORCE: dict[str, Any] = {"bound": 200.0, "unit": "m/s^2", **_INERTIAL}
_WRENCH: dict[str, Any] = {
    "bound": 500.0, "unit": "N or N m", "fallback": (0.0,) * 6, "axes": "vector", "stamp": "wrench_stamp_ns",
    "rate_hz": 100.0, "latency_s": 0.004, "oldest_s": 0.03,
}  # fmt: skip
_PICTURE: dict[str, Any] = {"default": None, "rate_hz": 30.0, "latency_s": 0.060, "oldest_s": 0.3}
_VELOCITY: dict[str, Any] = {
    "bound": 20.0, "unit": "m/s", "default": None, "held": False, "axes": "vector", "stamp": "velocity_stamp_ns",
    "oldest_s": 0.3,
}  # fmt: skip
_COVARIANCE: dict[str, Any] = {"default": None, "axes": "covariance", "unit": "m^2/s^2"}
_THRUSTS: dict[str, Any] = {"bound": 1e4, "unit": "N", "default": None}
_STILL: dict[str, Any] = {"bound": 20.0, "unit": "m/s", "default": np.zeros(2)}
_LEVEL: dict[str, Any] = {"bound": 0.6, "unit": "rad", "default": np.zeros(2), "axes": "angles"}


@dataclass(frozen=True, kw_only=True)
class LineFeature:
    """One line in the image, x cos(theta) + y sin(theta) = rho in normalised coordinates.

    Attributes:
        rho: Signed distance of the line from the image centre [-].
        theta: Angle of the line's normal [rad].
        covariance: Of (rho, theta), shape (2, 2).
        role: "horizontal" or "vertical".
        weight: 0 (fading out) to 1 (trusted).
        stamp_ns: Time at which the line was as described.
        track_id: Identity kept from frame to frame, positive; 0 for none: role and order in the frame identify the line
            then. Of features, a line with a negative one is refused.
        segment: Visible end points [[x1, y1], [x2, y2]], normalised, or None.
        surface_side: +1 if the working surface lies on the side the normal (cos, sin) points to, -1 if on the
            other, 0 if unknown.
        kind: "board" for an edge of the working surface, "paint" for an edge of fresh paint on it, "" if unknown.
    """

    rho: float
    theta: float
    covariance: np.ndarray = channel(2, 2)
    role: str
    weight: float = 1.0
    stamp_ns: int = 0
    track_id: int = 0
    segment: np.ndarray | None = channel(2, 2, default=None)
    surface_side: int = 0
    kind: str = ""


@dataclass(frozen=True, kw_only=True)
class LineReference:
    """Target of a line: rho [-], theta [rad] and role, at the nominal tip image point."""

    rho: float
    theta: float
    role: str


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Input of a controller at one tick.

    Attributes:
        stamp_ns: Time of the tick.
        attitude: Quaternion (w, x, y, z) of B in I; its yaw is arbitrary.
        angular_velocity: Omega in B [rad/s], (3,).
        specific_force: Accelerometer in B [m/s^2], (3,), or None.
        contact_wrench: Tared wrench ON the vehicle at the centre of mass, FRD [N, N m], (6,).
        wrench_stamp_ns: Time at which the contact wrench was measured.
        lines: Lines, each with its own stamp.
        plane: (A, B, C, D) of the wall in C with D = -1, or None.
        plane_stamp_ns: Time at which the plane was measured.
        velocity: Linear velocity in B [m/s], (3,), or None.
        velocity_covariance: Of the velocity, (3, 3), or None.
        acceleration_bias: Specific force plus gravity by the attitude, minus the true acceleration, in B [m/s^2],
            (3,), or None: the estimate of the caller's velocity filter. Only its part along the wall is used.
        thrust_min: Lower thrust limits [N], (n,), or None for the configured ones.
        thrust_max: Upper thrust limits [N], (n,), or None for the configured ones.
        attitude_stamp_ns: Time for which the attitude holds, or None: at the tick.
        imu_stamp_ns: Time at which gyro and accelerometer were sampled, or None: at the tick.
        velocity_stamp_ns: Time for which the velocity holds, or None: at the tick. A late velocity and late lines are
            carried to the tick by gyro, velocity and accelerometer.
    """

    stamp_ns: int
    attitude: np.ndarray = channel(4, **_ATTITUDE)
    angular_velocity: np.ndarray = channel(3, **_RATE)
    contact_wrench: np.ndarray = channel(6, **_WRENCH)
    wrench_stamp_ns: int
    specific_force: np.ndarray | None = channel(3, default=None, held=False, **_FORCE)
    lines: tuple[LineFeature, ...] = channel(default=(), oldest_s=0.3)
    plane: tuple[float, float, float, float] | None = None
    plane_stamp_ns: int = 0
    velocity: np.ndarray | None = channel(3, **_VELOCITY)
    velocity_covariance: np.ndarray | None = channel(3, 3, **_COVARIANCE)
    acceleration_bias: np.ndarray | None = channel(3, bound=5.0, unit="m/s^2", default=None, held=False, axes="vector")
    thrust_min: np.ndarray | None = channel(ROTORS, **_THRUSTS)
    thrust_max: np.ndarray | None = channel(ROTORS, **_THRUSTS)
    attitude_stamp_ns: int | None = None
    imu_stamp_ns: int | None = None
    velocity_stamp_ns: int | None = None


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Targets of a controller.

    Attributes:
        push_force: Push on the wall [N], >= 0.
        standoff: Distance from tip to wall while not in contact [m].
        lines: Targets of lines; they pair with the measured ones by role, then order.
        velocity: Velocity in the wall plane (right, down) [m/s], (2,).
        contact: Press the wall (True) or keep the stand-off (False: lambda = 0).
        travel: Velocity in the wall plane that is planned at this push [m/s], (2,): reach is taken for it before it
            begins.
        tilt: Roll and pitch [rad], (2,): level, except for a vehicle that lost a rotor. Then only the tilt moves it.
        trim: Roll and pitch [rad], (2,), at which a vehicle with a limited rotor hovers without a lateral force; it is
            controlled like a level one.
    """

    push_force: float = channel(low=0.0, high=1e3, unit="N", default=0.0)
    standoff: float = channel(low=-1.0, high=10.0, unit="m", default=0.3)
    lines: tuple[LineReference, ...] = ()
    velocity: np.ndarray = channel(2, **_STILL)
    contact: bool = False
    tilt: np.ndarray = channel(2, **_LEVEL)
    travel: np.ndarray = channel(2, **_STILL)
    trim: np.ndarray = channel(2, **_LEVEL)


@dataclass(frozen=True, kw_only=True)
class RgbdFrame:
    """One registered colour and depth image; the Pilot also takes raw ones, of the camera in its ``[camera]``.

    Attributes:
        rgb: uint8 (H, W, 3).
        depth: float32 (H, W) [m], 0 where invalid.
        intrinsics: (fx, fy, cx, cy) [px], pixel centres at integers.
        stamp_ns: Time of capture.
    """

    rgb: np.ndarray
    depth: np.ndarray
    intrinsics: tuple[float, float, float, float]
    stamp_ns: int


@dataclass(frozen=True, kw_only=True)
class FeatureFrame:
    """Result of perception on one image.

    Attributes:
        lines: Lines at the time of capture.
        plane: (A, B, C, D) of the wall in C with D = -1, or None.
        stamp_ns: Time of capture.
        velocity: Linear velocity of the centre of mass in B at capture [m/s], (3,), or None.
        velocity_covariance: Its covariance, (3, 3); unobserved directions have a large variance.
        velocity_stamp_ns: Time for which the velocity holds; 0 means at capture (flow: half a frame earlier).
        curvature: Normal curvatures of the wall (right right, right down, down down) [1/m], (3,), right being level,
            > 0 where it bulges towards the camera, or None for a flat one. Plane and lines are then those of the
            tangent plane at the tip, onto which the wall is unrolled.
    """

    lines: tuple[LineFeature, ...]
    plane: tuple[float, float, float, float] | None
    stamp_ns: int
    velocity: np.ndarray | None = channel(3, **_VELOCITY)
    velocity_covariance: np.ndarray | None = channel(3, 3, **_COVARIANCE)
    velocity_stamp_ns: int = 0
    curvature: np.ndarray | None = channel(3, bound=LARGEST_CURVATURE, unit="1/m", default=None, held=False)


@dataclass(frozen=True, kw_only=True)
class SensorFrame:
    """Raw sensors at one control tick, as a vehicle delivers them.

    Attributes:
        stamp_ns: Time of the tick; increases. A step above 1 s is a jump, and is followed within 0.5 s.
        attitude: Quaternion (w, x, y, z) of B in I; its yaw is arbitrary.
        angular_velocity: Gyro in B [rad/s], (3,).
        specific_force: Accelerometer in B at the centre of mass [m/s^2], (3,); at rest (0, 0, -9.81).
        wrench: Raw F/T sample at the sensor in its axes, vehicle on tool: a push reads +x [N, N m], (6,).
        wrench_stamp_ns: Time at which that sample was taken.
        image: A new image, or None.
        features: Result of perception on a new image, instead of it, or None.
        attitude_stamp_ns: Time for which the attitude holds, or None: at the tick.
        imu_stamp_ns: Time at which gyro and accelerometer were sampled, or None: at the tick.
        height_rate: Rate of climb by a barometer's vertical-speed filter [m/s], positive upwards, or None.
        height_rate_stamp_ns: Time for which the rate of climb holds, or None: at the tick.
    """

    stamp_ns: int
    attitude: np.ndarray = channel(4, **_ATTITUDE)
    angular_velocity: np.ndarray = channel(3, **_RATE)
    specific_force: np.ndarray = channel(3, fallback=(0.0, 0.0, -GRAVITY), **_FORCE)
    wrench: np.ndarray = channel(6, **_WRENCH)
    wrench_stamp_ns: int
    image: RgbdFrame | None = channel(**_PICTURE)
    features: FeatureFrame | None = channel(axes="frame", **_PICTURE)
    attitude_stamp_ns: int | None = None
    imu_stamp_ns: int | None = None
    height_rate: float | None = channel(
        bound=20.0,
        unit="m/s",
        default=None,
        held=False,
        stamp="height_rate_stamp_ns",
        rate_hz=25.0,
        latency_s=0.04,
        oldest_s=0.2,
    )
    height_rate_stamp_ns: int | None = None
