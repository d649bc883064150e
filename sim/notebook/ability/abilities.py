"""What a vehicle can do at a wall, in numbers: hover, pushes, sideways force, and what the loss of a rotor leaves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from allocation import hover_wrench, push_direction, push_reach, worst_level_reach, worst_push_reach
from sim.notebook.ability.case import VehicleCase, vehicle_case

#: Travel of a sliding tip in B, by name.
TRAVELS = {"up": (0.0, 0.0, -1.0), "sideways": (0.0, 1.0, 0.0), "down": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, kw_only=True)
class Abilities:
    """What a case can do in level flight; NaN where not even hover is possible.

    Attributes:
        hover_share: Hover thrust over full thrust, mean of the rotors [-].
        hover_power_w: Ideal induced power of hover [W].
        push_still_n: Greatest push standing still [N].
        push_least_n: Smallest push that can be held [N]; above 0 where only a push relieves a weak rotor.
        push_sliding_n: Greatest push sliding up, sideways and down [N].
        push_any_n: Greatest push whichever way the tip slides [N].
        lateral_worst_n: Horizontal force possible in every direction [N].
        binding: Rotor limits that end the push standing still.
    """

    hover_share: float
    hover_power_w: float
    push_still_n: float
    push_least_n: float
    push_sliding_n: dict[str, float]
    push_any_n: float
    lateral_worst_n: float
    binding: tuple[str, ...]


def abilities(case: VehicleCase, friction: float) -> Abilities:
    """Everything about one case.

    Args:
        case: The vehicle.
        friction: Coulomb coefficient of tip and wall [-].
    """
    facets, names = case.facets, case.vehicle.geometry.names
    asked = (facets, case.weight_n, case.tip, case.lower, case.upper)
    still = push_reach(*asked)
    sliding = {name: push_reach(*asked, friction=friction, travel=np.array(way)).push for name, way in TRAVELS.items()}
    lateral, _ = worst_level_reach(facets, case.weight_n, case.lower, case.upper)
    return Abilities(
        hover_share=float(np.mean(case.hover_thrusts / case.vehicle.thrust_max)),
        hover_power_w=case.hover_power_w,
        push_still_n=still.push,
        push_least_n=still.least,
        push_sliding_n=sliding,
        push_any_n=worst_push_reach(*asked, friction=friction).push,
        lateral_worst_n=lateral if math.isfinite(lateral) else math.nan,
        binding=tuple(f"{names[index]} {side}" for index, side in still.binding),
    )


def push_thrusts(case: VehicleCase, push_n: float) -> np.ndarray:
    """Thrusts of a static push in level flight, least squares, limits not looked at [N], (n,)."""
    wrench = hover_wrench(case.weight_n) + push_n * push_direction(case.tip)
    return np.linalg.pinv(case.matrix) @ wrench


def push_around(case: VehicleCase, friction: float, azimuths: np.ndarray) -> np.ndarray:
    """Greatest push of a tip that slides right at azimuth 0, down at pi/2 [N], same shape as the azimuths [rad]."""
    facets = case.facets
    ways = np.column_stack((np.zeros(len(azimuths)), np.cos(azimuths), np.sin(azimuths)))
    asked = (facets, case.weight_n, case.tip, case.lower, case.upper)
    return np.array([push_reach(*asked, friction=friction, travel=way).push for way in ways])


def push_over_share(rotor: str, shares: np.ndarray, mass_kg: float, tilt_deg: float) -> np.ndarray:
    """(least, greatest) push while one rotor gives a share of its thrust [N], (k, 2); NaN where none can be held."""
    rows = []
    for share in shares:
        case = vehicle_case(mass_kg=mass_kg, tilt_deg=tilt_deg, weak_rotor=rotor, share=float(share))
        reach = push_reach(case.facets, case.weight_n, case.tip, case.lower, case.upper)
        rows.append((reach.least, reach.push))
    return np.array(rows)


def push_over_tip(
    lengths: Sequence[float], heights: np.ndarray, mass_kg: float, tilt_deg: float, friction: float
) -> tuple[np.ndarray, np.ndarray]:
    """Push standing still, and whichever way it slides [N], over the tip's place; (lengths, heights) each.

    Args:
        lengths: Tip ahead of the centre of mass [m].
        heights: Tip below the centre of mass [m], (heights,).
        mass_kg: Mass.
        tilt_deg: Tilt of the rotors.
        friction: Coulomb coefficient [-].
    """
    still, sliding = np.empty((len(lengths), len(heights))), np.empty((len(lengths), len(heights)))
    facets = vehicle_case(tilt_deg=tilt_deg).facets
    for i, length in enumerate(lengths):
        for j, height in enumerate(heights):
            case = vehicle_case(mass_kg=mass_kg, tilt_deg=tilt_deg, tip_m=(float(length), 0.0, float(height)))
            asked = (facets, case.weight_n, case.tip, case.lower, case.upper)
            still[i, j] = push_reach(*asked).push
            sliding[i, j] = worst_push_reach(*asked, friction=friction).push
    return still, sliding


def kept_after_loss(case: VehicleCase) -> dict[str, float]:
    r"""What must be let go so that the weight is still carried without roll and pitch moment.

    Returns:
        Least horizontal force with yaw kept [N] (named ``lateral_n``), least yaw moment with the horizontal forces
        kept at zero [N m] (``yaw_nm``), and the lean that turns the former into level motion [deg] (``lean_deg``);
        0 where nothing need be let go, NaN where letting that go does not help.
    """
    matrix, weight = case.matrix, case.weight_n
    held = np.array([-weight, 0.0, 0.0])
    lateral = _least(matrix[[0, 1]], np.vstack((matrix[2:5], matrix[5:])), np.append(held, 0.0), case)
    yaw = _least(matrix[[5]], np.vstack((matrix[2:5], matrix[:2])), np.concatenate((held, [0.0, 0.0])), case)
    return {"lateral_n": lateral, "yaw_nm": yaw, "lean_deg": math.degrees(math.atan2(lateral, weight))}


#: Directions that stand for the disc of horizontal forces: its radius is met within 0.02 %.
_DIRECTIONS = 180


def _least(freed: np.ndarray, kept: np.ndarray, values: np.ndarray, case: VehicleCase) -> float:
    """Least length of freed @ u with kept @ u = values within the limits, by a linear program over its directions."""
    angles = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
    faces = np.column_stack((np.cos(angles), np.sin(angles)))[:, : len(freed)] @ freed
    count = case.matrix.shape[1]
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.column_stack((faces, -np.ones(len(faces)))),
        b_ub=np.zeros(len(faces)),
        A_eq=np.column_stack((kept, np.zeros(len(kept)))),
        b_eq=values,
        bounds=[*zip(case.lower, case.upper, strict=True), (0.0, None)],
        method="highs",
    )
    return float(found.x[-1]) if found.status == 0 else math.nan
