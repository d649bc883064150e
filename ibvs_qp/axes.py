"""ROS's axes (body front-left-up, world east-north-up) to ours (front-right-down, north-east-down), and back.

Both exchanges of axes are rotations by half a turn, so one function serves both directions:
``swap_axes(swap_axes(value))`` is the value. Lines, planes and images are in the camera's optical frame
(right-down-front), which ROS shares, and stay as they are; so does the reference in the wall plane (right, down).
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeVar

import numpy as np

from ibvs_qp.command import Command
from ibvs_qp.measurement import FeatureFrame, Measurement, Reference, SensorFrame, channels

Value = TypeVar("Value", Measurement, SensorFrame, FeatureFrame, Reference, Command)
#: Signs of a vector in B: front stays, left is minus right, up is minus down; and of roll and pitch.
_BODY, _ANGLES = np.array((1.0, -1.0, -1.0)), np.array((1.0, -1.0))


def swap_vector(vector: Any) -> np.ndarray:
    """A vector in the body frame, or a wrench, in the other axes.

    Args:
        vector: (x, y, z), or (force, moment), (3,) or (6,), any unit.

    Returns:
        (x, -y, -z) of each part.
    """
    array = np.asarray(vector, float)
    return array * np.tile(_BODY, len(array) // 3)


def swap_attitude(quaternion: Any) -> np.ndarray:
    r"""Attitude of the body in the world, in the other axes of both.

    .. math:: R_{NED \leftarrow FRD} = S\, R_{ENU \leftarrow FLU}\, \mathrm{diag}(1, -1, -1),

    with S exchanging east and north and turning up into down.

    Args:
        quaternion: (w, x, y, z), (4,). ROS messages order it (x, y, z, w).

    Returns:
        (w, x, y, z), (4,).
    """
    w, x, y, z = np.asarray(quaternion, float)
    return math.sqrt(0.5) * np.array((w + z, x + y, x - y, w - z))


def swap_covariance(covariance: Any) -> np.ndarray:
    """Covariance of a vector in the body frame, (3, 3), in the other axes."""
    return np.asarray(covariance, float) * np.outer(_BODY, _BODY)


def swap_axes(value: Value) -> Value:
    """A measurement, sensor frame, feature frame, reference or command in the other axes.

    Args:
        value: In front-left-up and east-north-up, or in front-right-down and north-east-down.

    Returns:
        The same in the other ones; stamps, lines, planes and images unchanged.

    Raises:
        TypeError: For a value of another type.
    """
    if isinstance(value, Command):
        return _changed(value, {"wrench": "vector", "unallocated_wrench": "vector"})
    for kind in (Measurement, SensorFrame, FeatureFrame, Reference):
        if isinstance(value, kind):
            return _changed(value, {name: each.axes for name, each in channels(kind).items() if each.axes})
    raise TypeError(f"{type(value).__name__} has no axes to swap")


def _changed(value: Any, axes: dict[str, str]) -> Any:
    """Copy with the named fields in the other axes, by `Channel.axes`; None stays None."""
    swaps = {"vector": swap_vector, "attitude": swap_attitude, "covariance": swap_covariance}
    swaps |= {"angles": _ANGLES.__mul__, "frame": swap_axes}
    old = {name: getattr(value, name) for name in axes}
    return dataclasses.replace(
        value, **{name: swaps[axes[name]](each) for name, each in old.items() if each is not None}
    )
