"""Whether a vehicle can paint: by its rotors, its reach, and the view of its camera in contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from allocation import WrenchFacets, tilted_push_reach, worst_tilted_push_reach
from allocation.actuation import SLIDING_FRICTION, Actuation, actuation
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.contact_picture import ContactPicture, contact_picture, guide_direction

#: Reach over push below which a vehicle is warned of [-]: gusts and friction take a quarter of it.
GOOD_REACH = 1.3
#: Distance of the lens from a propeller's disc along its axis within which it counts as in it [m]: a lens, and blades
#: that bend.
_DISC_DEPTH_M = 0.03
#: Least yaw at which a propeller may strike the wall [deg]: twice the turn by a sliding tip.
_LEAST_STRIKE_DEG = 2.0


@dataclass(frozen=True, kw_only=True)
class VehicleCheck:
    """Findings about a vehicle and a job.

    Attributes:
        problems: Why it cannot do the job, one line each; empty if it can.
        warnings: Difficulties of the job.
        picture: The picture in contact; None for a vehicle whose rotors cannot carry it.
    """

    problems: tuple[str, ...]
    warnings: tuple[str, ...]
    picture: ContactPicture | None


def vehicle_actuation(vehicle: VehicleParams) -> Actuation:
    """Actuation of a vehicle at its tip."""
    tip, weight = np.array(vehicle.tip_position_m), vehicle.mass_kg * GRAVITY
    return actuation(vehicle.geometry, weight, tip, vehicle.thrust_min, vehicle.thrust_max)


def rotor_problems(vehicle: VehicleParams, found: Actuation) -> list[str]:
    """Why rotors cannot carry a vehicle level; `ControllerConfig` refuses one that is not fully actuated."""
    if found.missing:
        return [f"not fully actuated: the {vehicle.geometry.count} rotors cannot give {', '.join(found.missing)}"]
    if not found.hovers:
        weight, most = vehicle.mass_kg * GRAVITY, float(vehicle.thrust_max.sum())
        words = "within the thrust limits the rotors do not carry the vehicle without a moment"
        return [f"no level hover: {words} ({weight:.1f} N of weight, {most:.1f} N of thrust in all)"]
    return []


def check_vehicle(config: PilotConfig, push_n: float, found: Actuation | None = None) -> VehicleCheck:
    """Problems and warnings of a vehicle.

    Args:
        config: Vehicle, camera, brush and margins.
        push_n: Push of the job [N].
        found: Its actuation, if it is known.
    """
    vehicle = config.controller.vehicle
    found = found or vehicle_actuation(vehicle)
    if problems := rotor_problems(vehicle, found):
        return VehicleCheck(problems=tuple(problems), warnings=(), picture=None)
    picture = contact_picture(config)
    trim_deg = config.controller.limits.trim_deg
    reach = sliding_reach(vehicle, found, trim_deg)
    problems = [*_reach(reach, trim_deg, push_n), *_lens(vehicle), *_tip(vehicle)]
    if not problems or vehicle.contact_depth_m > 0.0:
        problems += _view(config, picture)
    warnings = []
    if push_n <= reach < GOOD_REACH * push_n:
        least = GOOD_REACH * push_n
        warnings.append(
            f"reach {reach:.1f} N is less than {GOOD_REACH:g} times the push of {push_n:g} N ({least:.1f} N)"
        )
    if share := float(picture.propellers.mean()):
        warnings.append(f"propellers in view: they hide {100.0 * share:.2g} % of the picture")
    return VehicleCheck(problems=tuple(problems), warnings=tuple(warnings), picture=picture)


def sliding_reach(vehicle: VehicleParams, found: Actuation, tilt_deg: float) -> float:
    """Greatest push sliding anywhere with a friction of `SLIDING_FRICTION`, within a roll and a pitch [N].

    Args:
        vehicle: The vehicle, fully actuated.
        found: Its actuation.
        tilt_deg: Largest roll and pitch [deg]; 0 for a level one.
    """
    if tilt_deg == 0.0:
        assert found.sliding_push is not None
        return found.sliding_push.push
    return worst_tilted_push_reach(*_rotors(vehicle), tilt=math.radians(tilt_deg), friction=SLIDING_FRICTION)


def standing_reach(vehicle: VehicleParams, tilt_deg: float) -> float:
    """Greatest push of a tip at rest, within a roll and a pitch [N]; arguments as of `sliding_reach`."""
    return tilted_push_reach(*_rotors(vehicle), tilt=math.radians(tilt_deg))[0]


def _rotors(vehicle: VehicleParams) -> tuple[WrenchFacets, float, np.ndarray, np.ndarray, np.ndarray]:
    """Facets, weight [N], tip [m], least and largest thrusts [N]."""
    tip, weight = np.array(vehicle.tip_position_m), vehicle.mass_kg * GRAVITY
    return WrenchFacets(vehicle.geometry), weight, tip, vehicle.thrust_min, vehicle.thrust_max


def _reach(reach: float, trim_deg: float, push_n: float) -> list[str]:
    if reach >= push_n:
        return []
    sliding = f"sliding anywhere with a friction of {SLIDING_FRICTION:g}"
    vehicle = f"a vehicle trimmed by up to {trim_deg:g} deg" if trim_deg else "a level vehicle"
    return [f"reach {reach:.1f} N is below the job's push of {push_n:g} N: the greatest push of {vehicle} {sliding}"]


def _lens(vehicle: VehicleParams) -> list[str]:
    """The lens inside a propeller's disc."""
    camera, radius = np.array(vehicle.camera_position_m), vehicle.propeller_radius_m
    geometry = vehicle.geometry
    for rotor, hub, axis in zip(geometry.rotors, geometry.positions, geometry.axes, strict=True):
        along = float((camera - hub) @ axis)
        across = float(np.linalg.norm(camera - hub - along * axis))
        if abs(along) < _DISC_DEPTH_M and across < radius:
            words = f"{across:.2f} m from the hub, whose radius is {radius:g} m, and {abs(along):.3f} m from its plane"
            return [f"lens inside the disc of propeller {rotor.name}: vehicle.camera_position_m lies {words}"]
    return []


def _tip(vehicle: VehicleParams) -> list[str]:
    """The tip lies ahead of sensor, camera and propellers."""
    tip, found = vehicle.tip_position_m[0], []
    for name, place in (
        ("force/torque sensor", vehicle.force_torque_position_m[0]),
        ("camera", vehicle.camera_position_m[0]),
    ):
        if tip <= place:
            found.append(f"tip behind the {name}: vehicle.tip_position_m has x = {tip:g} m, the {name} {place:g} m")
    if not found and (strike := vehicle.strike_yaw_deg) < _LEAST_STRIKE_DEG:
        least = f"allowed is at least {_LEAST_STRIKE_DEG:g} deg"
        found.append(
            f"tip behind the propellers: one strikes the wall at a yaw of {strike:.1f} deg in contact, {least}"
        )
    return found


def _view(config: PilotConfig, picture: ContactPicture) -> list[str]:
    """Brush and guides in the picture in contact, and the wall in the range of the depth camera."""
    plane, painting = config.vision.plane, config.painting
    if not plane.distance_min_m <= picture.depth <= plane.distance_max_m:
        allowed = f"allowed is {plane.distance_min_m:g} to {plane.distance_max_m:g} m"
        return [f"wall out of the depth camera's range: it is {picture.depth:.2f} m away in contact, {allowed}"]
    column, row = picture.tip
    height, width = picture.seen.shape
    if not picture.shows_tip:
        place = f"in contact the tip is at column {column:.0f}, row {row:.0f} of a picture of {width} x {height} px"
        return [f"brush outside the picture: {place}"]
    least, found = config.vision.detect.min_length, []
    level, sign = guide_direction(painting)
    edge, last = painting.edge_margin_m, 0.5 * painting.brush_width_m - painting.overlap_m
    for name, distance in (("board's edge", edge), ("last stroke's edge", last)):
        shown = picture.beside(sign * distance, level)
        if min(shown) < least:
            place, axis = picture.place(sign * distance, level), "row" if level else "column"
            most = height if level else width
            words = f"the {name}, {distance:.3g} m beside the tip, is at {axis} {place:.0f} of {most}"
            parts = " and ".join(f"{100 * share:.0f} %" for share in shown)
            needed = f"needed are {100 * least:.0f} % of the picture's width on both sides of the brush"
            found.append(f"no guide position in view: {words}; {parts} are seen, {needed}")
    return found[:1]
