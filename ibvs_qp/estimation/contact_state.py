"""The wall and the contact as estimated at one tick."""

from __future__ import annotations

from typing import NamedTuple

from ibvs_qp.frames import Vector3


class ContactState(NamedTuple):
    """Result of `ibvs_qp.estimation.contact.ContactEstimator.update`.

    Attributes:
        normal: Unit vector into the wall, in B, (3,).
        known: Whether a plane was measured since the start.
        distance: Tip to wall [m], infinite while unknown.
        rate: Rate of the distance [m/s].
        acceleration: Filtered rate of `rate` [m/s^2].
        rate_noise: Standard deviation of `rate` [m/s].
        acceleration_noise: Standard deviation of one accelerometer sample along n [m/s^2].
        bias: Error of the measured acceleration along n [m/s^2]: accelerometer bias, and gravity through an
            attitude error.
        speed: Speed of the centre of mass into the wall [m/s]; the tip moves with the body's rotation as well.
        depth: Camera to wall along the normal [m], infinite while unknown.
        push: Filtered push [N].
        push_noise: Standard deviation of `push` in free flight [N].
        across_noise: Standard deviation of the filtered moments in free flight, as a force across the tip [N].
        in_contact: Whether the tip touches the wall.
        time_since_touch: Time in contact [s], 0 while free.
        ramp: 0 at touch to 1 after the ramp time; 0 while free.
        contact_weight: Lambda of the paper (corrected), 0 far from the wall to 1.
        stiffness: Of brush and wall in series [N/m].
        stiffness_known: Whether the stiffness was measured; otherwise it is the assumed one.
    """

    normal: Vector3
    known: bool
    distance: float
    rate: float
    acceleration: float
    rate_noise: float
    acceleration_noise: float
    bias: float
    speed: float
    depth: float
    push: float
    push_noise: float
    across_noise: float
    in_contact: bool
    time_since_touch: float
    ramp: float
    contact_weight: float
    stiffness: float
    stiffness_known: bool
