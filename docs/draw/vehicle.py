"""Pictures of the vehicle: rotors and reach, frames, and the vehicle at the wall."""

from __future__ import annotations

import matplotlib
import numpy as np
from diagrams import BLUE, GREEN, INK, ORANGE
from matplotlib.figure import Figure
from panels import panels

from allocation import TAROT_T960, WrenchFacets, level_polygon
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.world.scene import Scene

VEHICLE, SCENE = VehicleParams(), Scene()


def allocation() -> Figure:
    """Rotors from above with the horizontal part of their thrust, and the horizontal forces in level flight."""
    figure, (above, forces) = panels(3.4, 2)
    for rotor, hub, axis in zip(TAROT_T960.rotors, TAROT_T960.positions, TAROT_T960.axes, strict=True):
        colour = BLUE if rotor.spin > 0 else ORANGE
        place = np.array((hub[1], hub[0]))
        above.add_patch(matplotlib.patches.Circle(place, VEHICLE.propeller_radius_m, color=colour, alpha=0.2))
        above.annotate("", place + 0.3 * axis[[1, 0]], place, arrowprops={"arrowstyle": "-|>", "color": colour})
        above.plot(*zip((0, 0), place, strict=True), color="#999999", linewidth=0.8)
        above.text(*(1.62 * place), rotor.name, fontsize=7, ha="center", va="center")
    above.plot((0, 0), (0, VEHICLE.tip_position_m[0]), color=INK, linewidth=2)
    above.set(xlim=(-0.95, 0.95), ylim=(-0.85, 0.85), xlabel="right [m]", ylabel="front [m]", aspect="equal")
    corners = level_polygon(WrenchFacets(TAROT_T960), GRAVITY * VEHICLE.mass_kg, VEHICLE.thrust_min, VEHICLE.thrust_max)
    forces.fill(corners[:, 1], corners[:, 0], color=GREEN, alpha=0.25)
    forces.plot(*np.vstack((corners, corners[:1]))[:, ::-1].T, color=GREEN)
    forces.set(xlabel="force right [N]", ylabel="force front [N]", aspect="equal")
    return figure


def frames() -> Figure:
    """Body, camera and end-effector axes and the wall, seen from the left."""
    figure, (axes,) = panels(2.9)
    body, camera, tip = np.zeros(2), np.array((0.2, -0.08)), np.array((0.7, 0.0))  # front, up
    axes.plot((0, 0.7), (0, 0), color="#bbbbbb", linewidth=5, solid_capstyle="round", zorder=0)
    axes.axvspan(0.95, 1.0, color="#cbbba8")
    for origin, letter, colour, first, second in (
        (body, "b", BLUE, ((1, 0), "x front"), ((0, -1), "z down")),
        (camera, "c", GREEN, ((1, 0), "z front"), ((0, -1), "y down")),
        (tip, "e", ORANGE, ((-1, 0), "z back"), ((0, 1), "y up")),
    ):
        for direction, name in (first, second):
            step, (symbol, word) = 0.13 * np.array(direction, float), name.split()
            axes.annotate(
                "", origin + step, origin, arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.5}
            )
            beside = np.array((0.0, 0.025)) if step[1] == 0.0 else np.array((0.055, 0.0))
            axes.text(
                *(origin + step + beside),
                f"${symbol}_{letter}$ {word}",
                color=colour,
                ha="center",
                va="center",
                fontsize=8,
            )
        axes.plot(*origin, "o", color=colour, markersize=5)
    axes.annotate("", (0.93, 0.1), (0.81, 0.1), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.5})
    axes.text(0.86, 0.125, "n", fontsize=10, fontweight="bold", ha="center")
    for place, words in (((-0.02, 0.05), "B: centre of mass\n(y right: into the page)"), ((0.975, 0.29), "wall")):
        axes.text(*place, words, fontsize=8, ha="center" if words == "wall" else "right", color=INK)
    axes.set(xlim=(-0.42, 1.05), ylim=(-0.27, 0.31), aspect="equal")
    axes.axis("off")
    return figure


def simulation() -> Figure:
    """The vehicle in contact from the left: arm, sensors, propellers, field of view, board and wall."""
    figure, (axes,) = panels(3.0)
    tip, camera = VEHICLE.tip_position_m[0], np.array(VEHICLE.camera_position_m)[[0, 2]] * (1, -1)
    half = np.radians(SCENE.camera.vertical_fov_deg / 2)
    reach = tip - camera[0]
    axes.fill((camera[0], tip, tip), (camera[1], camera[1] + reach * np.tan(half), camera[1] - reach * np.tan(half)),
              color=GREEN, alpha=0.12)  # fmt: skip
    for hub, axis in zip(TAROT_T960.positions, TAROT_T960.axes, strict=True):
        along = np.array((axis[2], -axis[0]))  # in the plane of the page, across the thrust axis
        ends = np.array([hub[[0, 2]] + side * VEHICLE.propeller_radius_m * along for side in (-1, 1)]) * (1, -1)
        axes.plot(*ends.T, color=BLUE, linewidth=2.5, alpha=0.6)
    axes.plot((0, tip), (0, 0), color="#888888", linewidth=4)
    gap = SCENE.board.gap_m
    axes.axvspan(tip, tip + 0.012, ymin=0.12, ymax=0.9, color="#d8d8cf")
    axes.axvspan(tip + gap, tip + gap + 0.03, color="#9a7b66")
    marks = {"centre of mass": (0, 0), "force/torque sensor": (VEHICLE.force_torque_position_m[0], 0),
             "camera": camera, "brush tip": (tip, 0)}  # fmt: skip
    for name, place in marks.items():
        axes.plot(*place, "o", color=INK, markersize=5)
        below = -0.06 if name == "camera" else 0.03
        axes.text(place[0] - (0.02 if name == "brush tip" else 0), place[1] + below, name, fontsize=8,
                  ha="right" if name == "brush tip" else "center")  # fmt: skip
    axes.text(tip - 0.02, 0.2, "board", fontsize=8, ha="right")
    axes.text(tip + gap + 0.04, 0.2, "wall", fontsize=8)
    axes.set(xlim=(-0.75, 0.88), ylim=(-0.32, 0.27), aspect="equal", xlabel="front [m]", ylabel="up [m]")
    return figure
