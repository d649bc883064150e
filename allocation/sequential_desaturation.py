r"""Sequential desaturation: shift saturated thrusts along one wrench axis after another, as flight stacks do.

PX4 (``ControlAllocationSequentialDesaturation``) adds up the pseudo-inverse's thrusts for the wanted wrench and then
moves them along the thrust pattern of one axis at a time until as little as possible is saturated. It knows
multicopters: the lift gives way first, then roll, pitch and yaw, while lateral forces are added in and never reduced.
On a fully-actuated vehicle that order is upside down, so two functions stand here:

- `allocate_px4`: PX4's order, airmode off or full. The baseline as people fly it.
- `allocate_sequential`: the same passes in an order that suits tilted rotors, `FULLY_ACTUATED_ORDER`.

Why that order. Rotors that carry the weight in level flight meet their idle floor, hardly ever their ceiling. Only a
smaller lateral force, a smaller moment or MORE lift brings a rotor off its floor, so what is asked first decides what
is lost. Lateral force (the push) is what brought the rotor there and can be missed for a moment; yaw next, because the
wall takes most of an error; lift after both, because shifting it makes the vehicle climb or sink along the wall; roll
and pitch last, because a fully-actuated vehicle that tips loses push and height together. Along the lateral and the
yaw axis a shift ends at zero: giving up a wish must not turn it round.
"""

from __future__ import annotations

import math

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.geometry import RotorGeometry

#: Axes of `allocate_sequential` and the rows of the wrench [Fx Fy Fz Mx My Mz] that they shift.
AXES = {"lateral": (0, 1), "vertical": (2,), "roll": (3,), "pitch": (4,), "yaw": (5,)}
#: What gives way first to last on a fully-actuated vehicle; the module's text says why.
FULLY_ACTUATED_ORDER = ("lateral", "yaw", "vertical", "roll", "pitch")
#: Rotors whose share in an axis is below this part of the pattern's root mean square take no part in its shift: they
#: would need enormous ones (PX4 compares its normalised mixer column with the same number).
WEAK_SHARE = 0.2
#: PX4 lets yaw reach this part of the thrust range above the ceiling before it is reduced; lift pays for the rest.
PX4_YAW_MARGIN = 0.15


def allocate_sequential(
    wrench: np.ndarray,
    rotors: RotorGeometry | np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    order: tuple[str, ...] = FULLY_ACTUATED_ORDER,
) -> np.ndarray:
    """Pseudo-inverse thrusts, relieved of saturation along one axis after another, then clipped.

    Args:
        wrench: Wanted body wrench, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].
        order: Axes from the first to give way to the last; an axis left out never gives way.

    Returns:
        Thrusts, (n,) [N].

    Raises:
        ValueError: On an unknown axis.
    """
    unknown = set(order) - set(AXES)
    if unknown:
        raise ValueError(f"order: unknown axis {sorted(unknown)[0]!r}, known are {', '.join(AXES)}")
    inverse, wanted = np.linalg.pinv(_matrix(rotors)), np.asarray(wrench, float)
    thrusts = inverse @ wanted
    for axis in order:
        rows = list(AXES[axis])
        if axis in ("lateral", "yaw"):
            # Shifting by k in [-1, 0] along the pattern of the wish itself leaves its share 1 + k.
            thrusts = _desaturate(thrusts, inverse[:, rows] @ wanted[rows], lower, upper, (-1.0, 0.0))
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
        wrench: Wanted body wrench, (6,) [N, N m].
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N].
        airmode: Whether lift may be raised to save roll and pitch (PX4's full airmode); off is its default.

    Returns:
        Thrusts, (n,) [N].

    Source: PX4-Autopilot, ``src/lib/control_allocation``, ControlAllocationSequentialDesaturation; described from the
    published source and written anew in newtons instead of its normalised outputs.
    """
    inverse, wanted = np.linalg.pinv(_matrix(rotors)), np.asarray(wrench, float)
    lift, yaw = -inverse[:, 2], inverse[:, 5]
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    thrusts = inverse[:, :5] @ wanted[:5]
    thrusts = _desaturate(thrusts, lift, low, high, (-math.inf, math.inf if airmode else 0.0))
    if not airmode:
        thrusts = _desaturate(thrusts, inverse[:, 3], low, high)
        thrusts = _desaturate(thrusts, inverse[:, 4], low, high)
    thrusts = _desaturate(thrusts + yaw * wanted[5], yaw, low, high + PX4_YAW_MARGIN * (high - low))
    thrusts = _desaturate(thrusts, lift, low, high, (-math.inf, 0.0))
    return np.clip(thrusts, low, high)


def _matrix(rotors: RotorGeometry | np.ndarray) -> np.ndarray:
    return control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)


def _desaturate(
    thrusts: np.ndarray,
    pattern: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> np.ndarray:
    """Shift along a pattern, then by half of what is still wanted; the sum of both steps stays within bounds."""
    low, high = bounds
    first = min(max(_gain(thrusts, pattern, lower, upper), low), high)
    thrusts = thrusts + first * pattern
    second = min(max(0.5 * _gain(thrusts, pattern, lower, upper), low - first), high - first)
    return thrusts + second * pattern


def _gain(thrusts: np.ndarray, pattern: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Shift that relieves the worst saturation of either sign; opposite needs share the rest."""
    root_mean_square = math.sqrt(float(pattern @ pattern) / len(pattern))
    excess = np.where(thrusts < lower, lower - thrusts, np.where(thrusts > upper, upper - thrusts, 0.0))
    used = (np.abs(pattern) >= WEAK_SHARE * root_mean_square) & (excess != 0.0)
    if not used.any():
        return 0.0
    shifts = excess[used] / pattern[used]
    return min(float(shifts.min()), 0.0) + max(float(shifts.max()), 0.0)
