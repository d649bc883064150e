"""Top and side view of a vehicle: rotors with thrust axes and spins, arm, tip, camera and force/torque sensor."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from allocation.rotor import disc_rim
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_vector
from sim.figures.style import new_figure, styled

#: Views: title, body axes to the right and upwards with their signs, labels.
_VIEWS = (
    ("from above", (1, 1), (0, 1), "right [m]", "front [m]"),
    ("from the left", (0, 1), (2, -1), "front [m]", "up [m]"),
)
_SPIN_COLOURS = {1: "#0b6f9e", -1: "#d55e1a"}
#: Length of a thrust axis, and of the camera's line of sight [m].
_AXIS_M, _SIGHT_M = 0.15, 0.2
#: Corners of a propeller disc [-].
_RIM_POINTS = 60


def vehicle_figure(vehicle: VehicleParams) -> Figure:
    """Draw the vehicle."""
    with styled():
        figure = new_figure(4.0)
        for axes, (title, right, up, *labels) in zip(figure.subplots(1, 2), _VIEWS, strict=True):

            def seen(points: np.ndarray, right=right, up=up) -> np.ndarray:
                points = np.atleast_2d(points)
                return np.column_stack((right[1] * points[:, right[0]], up[1] * points[:, up[0]]))

            geometry, above = vehicle.geometry, title == _VIEWS[0][0]
            rotors = enumerate(zip(geometry.rotors, geometry.positions, geometry.axes, strict=True))
            for number, (rotor, hub, axis) in rotors:
                colour = _SPIN_COLOURS[rotor.spin]
                axes.add_patch(
                    Polygon(seen(hub + disc_rim(axis, vehicle.propeller_radius_m, 60)), color=colour, alpha=0.25)
                )
                axes.plot(*seen(np.array((hub, hub + _AXIS_M * axis))).T, color=colour)
                axes.plot(*seen(np.array((np.zeros(3), hub))).T, color="#777777", linewidth=0.6)
                if above:
                    axes.annotate(f"{number} {rotor.name}", seen(hub)[0], fontsize=6, ha="center", va="bottom")
            base, tip, camera = map(
                np.array, (vehicle.force_torque_position_m, vehicle.tip_position_m, vehicle.camera_position_m)
            )
            sight = _SIGHT_M * rotation_from_vector(np.radians(vehicle.camera_turn_deg))[:, 0]
            axes.plot(*seen(np.array((base, tip))).T, color="#333333", linewidth=2.0)
            axes.plot(*seen(tip).T, "v", color="#333333", label="tip")
            axes.plot(*seen(base).T, "s", color="#333333", markersize=4, label="force/torque sensor")
            axes.plot(*seen(camera).T, "o", color="#2a7f3f", markersize=4, label="camera")
            axes.plot(*seen(np.array((camera, camera + sight))).T, ":", color="#2a7f3f")
            axes.plot(0.0, 0.0, "+", color="#333333", label="centre of mass")
            axes.set(title=title, xlabel=labels[0], ylabel=labels[1], aspect="equal")
        figure.axes[1].legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.9), ncols=2)
    return figure
