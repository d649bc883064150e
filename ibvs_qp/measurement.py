"""Inputs: sensor frames for the pilot, measurements and references for a controller.

All are frozen keyword-only dataclasses in float64 and SI units; stamps are integer nanoseconds of one monotonic
clock. They are plain carriers: a controller checks them itself, because no step may raise in flight.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

HORIZONTAL, VERTICAL = "horizontal", "vertical"


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
        track_id: Identity kept from frame to frame; 0 for none: role and order in the frame identify the line then.
        segment: Visible end points [[x1, y1], [x2, y2]], normalised, or None.
        surface_side: +1 if the working surface lies on the side the normal (cos, sin) points to, -1 if on the
            other, 0 if unknown.
        kind: "board" for an edge of the working surface, "paint" for an edge of fresh paint on it, "" if unknown.
    """

    rho: float
    theta: float
    covariance: np.ndarray
    role: str
    weight: float = 1.0
    stamp_ns: int = 0
    track_id: int = 0
    segment: np.ndarray | None = None
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
    attitude: np.ndarray
    angular_velocity: np.ndarray
    contact_wrench: np.ndarray
    wrench_stamp_ns: int
    specific_force: np.ndarray | None = None
    lines: tuple[LineFeature, ...] = ()
    plane: tuple[float, float, float, float] | None = None
    plane_stamp_ns: int = 0
    velocity: np.ndarray | None = None
    velocity_covariance: np.ndarray | None = None
    acceleration_bias: np.ndarray | None = None
    thrust_min: np.ndarray | None = None
    thrust_max: np.ndarray | None = None
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

    push_force: float = 0.0
    standoff: float = 0.3
    lines: tuple[LineReference, ...] = ()
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(2))
    contact: bool = False
    tilt: np.ndarray = field(default_factory=lambda: np.zeros(2))
    travel: np.ndarray = field(default_factory=lambda: np.zeros(2))
    trim: np.ndarray = field(default_factory=lambda: np.zeros(2))


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
    """

    lines: tuple[LineFeature, ...]
    plane: tuple[float, float, float, float] | None
    stamp_ns: int
    velocity: np.ndarray | None = None
    velocity_covariance: np.ndarray | None = None
    velocity_stamp_ns: int = 0


@dataclass(frozen=True, kw_only=True)
class SensorFrame:
    """Raw sensors at one control tick, as a vehicle delivers them.

    Attributes:
        stamp_ns: Time of the tick.
        attitude: Quaternion (w, x, y, z) of B in I; its yaw is arbitrary.
        angular_velocity: Gyro in B [rad/s], (3,).
        specific_force: Accelerometer in B [m/s^2], (3,).
        wrench: Raw F/T sample at the sensor, FRD axes, vehicle on tool [N, N m], (6,).
        wrench_stamp_ns: Time at which that sample was taken.
        image: A new image, or None.
        features: Result of perception instead of an image, or None.
        attitude_stamp_ns: Time for which the attitude holds, or None: at the tick.
        imu_stamp_ns: Time at which gyro and accelerometer were sampled, or None: at the tick.
    """

    stamp_ns: int
    attitude: np.ndarray
    angular_velocity: np.ndarray
    specific_force: np.ndarray
    wrench: np.ndarray
    wrench_stamp_ns: int
    image: RgbdFrame | None = None
    features: FeatureFrame | None = None
    attitude_stamp_ns: int | None = None
    imu_stamp_ns: int | None = None
