"""A vehicle from above and from the left, and its camera's picture in contact: brush, propellers, guides."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon, Rectangle

from allocation.geometry import disc_rim
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_vector
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.contact_picture import contact_picture, guide_direction
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


def vehicle_figure(vehicle: VehicleParams, config: PilotConfig | None = None) -> Figure:
    """Draw the vehicle.

    Args:
        vehicle: The vehicle.
        config: Its configuration, for the picture in contact; None leaves that out.
    """
    with styled():
        figure = new_figure(4.0 if config is None else 8.0)
        grid = figure.add_gridspec(1 if config is None else 2, 2)
        if config is not None:
            _draw_picture(figure.add_subplot(grid[1, :]), config)
        views = [figure.add_subplot(grid[0, column]) for column in range(2)]
        for axes, (title, right, up, *labels) in zip(views, _VIEWS, strict=True):

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
        views[1].legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.35), ncols=2)
    return figure


def _draw_picture(axes: Axes, config: PilotConfig) -> None:
    """The straightened picture in contact: white where it shows wall, grey where the vehicle hides it."""
    picture, painting, limits = contact_picture(config), config.painting, config.controller.limits
    fx, fy, cx, cy = picture.intrinsics
    height, width = picture.seen.shape
    shades = np.where(picture.seen, 1.0, 0.35)
    shades[picture.propellers] = 0.65
    axes.imshow(shades, cmap="gray", vmin=0.0, vmax=1.0, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    column, row = picture.tip
    radius = 0.5 * painting.brush_width_m / picture.depth
    axes.add_patch(Ellipse((column, row), 2 * fx * radius, 2 * fy * radius, color="#0b6f9e", alpha=0.6, label="brush"))
    level, sign = guide_direction(painting)
    draw = axes.axhline if level else axes.axvline
    for name, distance, colour in (
        ("board's edge, stroke 1", painting.edge_margin_m, "#d55e1a"),
        ("edge of the last stroke", 0.5 * painting.brush_width_m - painting.overlap_m, "#2a7f3f"),
    ):
        draw(picture.place(sign * distance, level), color=colour, label=name)
    for index, bound in enumerate((limits.view_up, limits.view_down)):
        axes.axhline(fy * bound + cy, color="#777777", linestyle=":", label="view limits" if index == 0 else None)
    for bound in (limits.view_left, limits.view_right):
        axes.axvline(fx * bound + cx, color="#777777", linestyle=":")
    axes.add_patch(Rectangle((0, 0), 0, 0, color="0.65", label="propellers"))
    axes.set(title="the picture in contact", xlabel="column [px]", ylabel="row [px]")
    axes.set_xlim(min(-0.5, column - fx * radius), max(width - 0.5, column + fx * radius))
    axes.set_ylim(max(height - 0.5, row + fy * radius), min(-0.5, row - fy * radius))
    axes.legend(fontsize=6, loc="lower left", bbox_to_anchor=(1.0, 0.0))
