r"""Allocators: rotor thrusts within their limits for a desired wrench.

- `allocate_pseudo_inverse`: the textbook, pseudo-inverse and clipping.
- `allocate_least_squares`: the nearest wrench within the limits.
- `allocate_px4` and `allocate_sequential`: sequential desaturation, as flight stacks do.

PX4 (``ControlAllocationSequentialDesaturation``) takes the pseudo-inverse thrusts of the desired wrench and shifts them
along the thrust pattern of one axis at a time until as little as possible is saturated. Its order suits multicopters:
lift yields first, then roll, pitch and yaw; lateral forces are never reduced. On a fully-actuated vehicle that order
is upside down, so `allocate_sequential` makes the same passes in `FULLY_ACTUATED_ORDER`.

Reason for that order: rotors that carry the weight in level flight meet their idle limit, rarely their ceiling.
Only a smaller lateral force, a smaller moment or MORE lift brings a rotor off its idle limit. Lateral force (the push)
brought the rotor there and can be missed for a moment; yaw is next, because the wall takes most of an error; lift comes
after both, because shifting it makes the vehicle climb or sink along the wall; roll and pitch are last, because a
fully-actuated vehicle that tips loses push and height together. Along the lateral and the yaw axis a shift ends at
zero, so that it never reverses the desired force or moment.
"""

from __future__ import annotations

import math

import numpy as np

from allocation.geometry import RotorGeometry, as_matrix

#: Row weights of [Fx Fy Fz Mx My Mz]. Moments are divided by a lever near 0.2 m to compare with forces. Roll and pitch
#: come first (a vehicle that tips is lost), then yaw, then height; the lateral forces yield first.
DEFAULT_ROW_WEIGHTS = (1.0, 1.0, 4.0, 30.0, 30.0, 8.0)
#: Axes of `allocate_sequential` and the rows of the wrench [Fx Fy Fz Mx My Mz] that they shift.
AXES = {"lateral": (0, 1), "vertical": (2,), "roll": (3,), "pitch": (4,), "yaw": (5,)}
#: Axes from the first to yield to the last on a fully-actuated vehicle, for the reason above.
FULLY_ACTUATED_ORDER = ("lateral", "yaw", "vertical", "roll", "pitch")
#: Rotors below this fraction of the pattern's root mean square do not count in its shift: they would need enormous
#: ones (PX4 compares its normalised mixer column with the same number).
WEAK_FRACTION = 0.2
#: PX4 lets yaw exceed the ceiling by this fraction of the thrust range before it reduces yaw; lift makes up for it.
PX4_YAW_MARGIN = 0.15


def allocate_pseudo_inverse(
    wrench: np.ndarray, rotors: RotorGeometry | np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    r"""Smallest thrusts of the desired wrench, :math:`u = B^+ w`, clipped to lower <= u <= upper.

    Clipping has no priorities: a rotor raised to its idle limit adds undesired lift, roll, pitch and yaw.

    Args:
        wrench: Desired body wrench w, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].

    Returns:
        Clipped and unclipped thrusts, (n,) each [N].
    """
    unclipped = np.linalg.pinv(as_matrix(rotors)) @ np.asarray(wrench, float)
    return np.clip(unclipped, lower, upper), unclipped


def allocate_least_squares(
    wrench: np.ndarray,
    effectiveness: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    row_weights: np.ndarray | tuple[float, ...] = DEFAULT_ROW_WEIGHTS,
) -> np.ndarray:
    r"""Box-constrained weighted least squares, :math:`\min_u \|W (B u - w)\|` with lower <= u <= upper.

    Args:
        wrench: Desired body wrench w, (6,) [N, N m].
        effectiveness: Matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N], above lower.
        row_weights: Diagonal of W, (6,): cost of one newton or newton metre of error.

    Returns:
        Thrusts, (n,) [N].

    Raises:
        ValueError: When a lower limit is not below its upper limit.
    """
    from scipy.optimize import lsq_linear  # slow to import, and most users of this package allocate otherwise

    weights = np.asarray(row_weights, float)
    matrix = weights[:, None] * np.asarray(effectiveness, float)
    result = lsq_linear(matrix, weights * np.asarray(wrench, float), bounds=(lower, upper), method="bvls")
    return np.clip(result.x, lower, upper)


def allocate_sequential(
    wrench: np.ndarray,
    rotors: RotorGeometry | np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    order: tuple[str, ...] = FULLY_ACTUATED_ORDER,
) -> np.ndarray:
    """Pseudo-inverse thrusts, desaturated along one axis after another, then clipped.

    Args:
        wrench: Desired body wrench, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].
        order: Axes from the first to yield to the last; an axis that is missing never yields.

    Returns:
        Thrusts, (n,) [N].

    Raises:
        ValueError: On an unknown axis.
    """
    unknown = set(order) - set(AXES)
    if unknown:
        raise ValueError(f"order: unknown axis {sorted(unknown)[0]!r}, known are {', '.join(AXES)}")
    inverse, desired = np.linalg.pinv(as_matrix(rotors)), np.asarray(wrench, float)
    thrusts = inverse @ desired
    for axis in order:
        rows = list(AXES[axis])
        if axis in ("lateral", "yaw"):
            # A shift by k in [-1, 0] along the pattern of the desired component scales that component by 1 + k.
            thrusts = _desaturate(thrusts, inverse[:, rows] @ desired[rows], lower, upper, (-1.0, 0.0))
        else:
            thrusts = _desaturate(thrusts, inverse[:, rows[0]], lower, upper)
    return np.clip(thrusts, lower, upper)


def allocate_px4(
    wrench: np.ndarray,
    rotors: RotorGeometry | np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    *,
    airmode: bool = False,
) -> np.ndarray:
    """PX4's sequential desaturation: lift, roll, pitch, then yaw; lateral force is never reduced.

    Args:
        wrench: Desired body wrench, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].
        airmode: Whether lift may rise in favour of roll and pitch (PX4's full airmode); off is its default.

    Returns:
        Thrusts, (n,) [N].

    Source: PX4-Autopilot, ``src/lib/control_allocation``, ControlAllocationSequentialDesaturation; described from the
    published source and written in newtons instead of its normalised outputs.
    """
    inverse, desired = np.linalg.pinv(as_matrix(rotors)), np.asarray(wrench, float)
    lift, yaw = -inverse[:, 2], inverse[:, 5]
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    thrusts = inverse[:, :5] @ desired[:5]
    thrusts = _desaturate(thrusts, lift, low, high, (-math.inf, math.inf if airmode else 0.0))
    if not airmode:
        thrusts = _desaturate(thrusts, inverse[:, 3], low, high)
        thrusts = _desaturate(thrusts, inverse[:, 4], low, high)
    thrusts = _desaturate(thrusts + yaw * desired[5], yaw, low, high + PX4_YAW_MARGIN * (high - low))
    thrusts = _desaturate(thrusts, lift, low, high, (-math.inf, 0.0))
    return np.clip(thrusts, low, high)


def _desaturate(
    thrusts: np.ndarray,
    pattern: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> np.ndarray:
    """Shift along a pattern, then by half of the remaining need; the sum of both shifts stays within bounds."""
    low, high = bounds
    first = min(max(_gain(thrusts, pattern, lower, upper), low), high)
    thrusts = thrusts + first * pattern
    second = min(max(0.5 * _gain(thrusts, pattern, lower, upper), low - first), high - first)
    return thrusts + second * pattern


def _gain(thrusts: np.ndarray, pattern: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Shift that removes the worst saturation of either sign; opposite needs are added."""
    root_mean_square = math.sqrt(float(pattern @ pattern) / len(pattern))
    excess = np.where(thrusts < lower, lower - thrusts, np.where(thrusts > upper, upper - thrusts, 0.0))
    used = (np.abs(pattern) >= WEAK_FRACTION * root_mean_square) & (excess != 0.0)
    if not used.any():
        return 0.0
    shifts = excess[used] / pattern[used]
    return min(float(shifts.min()), 0.0) + max(float(shifts.max()), 0.0)
