"""Pictures of the job: path, weights, contact, and results of estimation and vision in a flight."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
from diagrams import BLUE, GREEN, INK, ORANGE
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from panels import panels

import ibvs_qp
from ibvs_qp.config.contact_margin import contact_mode_damping
from ibvs_qp.config.vehicle import VehicleParams
from sim.evaluate.paint_plan import nominal_plan
from sim.flight.closed_loop import fly
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions
from sim.flight.pictures import unpack_picture
from sim.report.catalogue import Setting
from sim.world.scene import Scene

VEHICLE, SCENE = VehicleParams(), Scene()
#: Camera to wall in contact [m]: a unit of the picture is so many metres.
SCENE_DEPTH_M = VEHICLE.tip_position_m[0] - VEHICLE.camera_position_m[0]
#: Width of the picture of vision [px].
VISION_PX = 560


def estimation() -> Figure:
    """Closing speed of a flown touch: truth, estimate, and differentiated depth."""
    scene = dataclasses.replace(SCENE, start=dataclasses.replace(SCENE.start, distance_m=0.15))
    flown = fly(scene, FlightOptions(features="geometric"), job=PressJob(hold_s=1.0))
    time, speed = flown.t, flown.velocity[:, 0]
    taken = np.arange(time[0], time[-1], 1 / SCENE.camera.rate_hz)
    distance = np.interp(taken, time, -flown.tip[:, 0])
    late = taken[1:] + SCENE.camera.latency_s
    touch = time[np.argmax(flown.push_true > 0.5)]
    figure, (axes,) = panels(2.6)
    axes.plot(time - touch, 1e3 * speed, color=INK, label="true", linewidth=1)
    axes.plot(time - touch, 1e3 * flown.velocity_estimate[:, 0], color=BLUE, label="estimate", linewidth=1)
    axes.step(late - touch, -1e3 * np.diff(distance) * SCENE.camera.rate_hz, color=ORANGE, where="post",
              label="depth differentiated (without noise)", linewidth=1)  # fmt: skip
    axes.set(xlim=(-0.3, 0.25), ylim=(-10, 30), xlabel="time since touch [s]", ylabel="closing speed [mm/s]")
    axes.legend(frameon=False, fontsize=8)
    return figure


def model() -> Figure:
    """Error that costs as much in every task: the inverse root of its weight."""
    config = ibvs_qp.preset("qp").controller
    rows = [
        ("height", "m/s²"),
        ("velocity", "m/s²"),
        ("level", "rad/s²"),
        ("yaw", "rad/s²"),
        ("line", "1/s²"),
        ("push", "N"),
    ]
    mass, arm = VEHICLE.mass_kg, VEHICLE.tip_position_m[0]
    lever = float(np.mean(VEHICLE.inertia_kg_m2)) / arm
    newtons = {"m/s²": mass, "rad/s²": lever, "1/s²": mass * SCENE_DEPTH_M, "N": 1.0}
    errors = [newtons[unit] / np.sqrt(Setting.of(config, f"weights.{name}").value) for name, unit in rows]
    figure, (axes,) = panels(2.4)
    axes.barh([name for name, _ in rows], errors, color=[ORANGE if name == "push" else BLUE for name, _ in rows])
    axes.set(
        xscale="log", xlabel="errors of equal cost, as a force at the tip [N]: the longer, the sooner the task yields"
    )
    axes.invert_yaxis()
    return figure


def painting() -> Figure:
    """Lower part of the board, path of the brush centre with its band, and the guides."""
    plan, width, brush = nominal_plan(SCENE), SCENE.board.width_m, SCENE.paint.brush_width_m
    figure, (axes,) = panels(2.6)
    axes.add_patch(Rectangle((0, 0), width, SCENE.board.height_m, facecolor="#eeeee8", edgecolor=INK))
    guides = ["guide of row 1: the board's bottom edge", "guide of row 2: the upper edge of row 1 as painted"]
    for segment in plan.segments:
        low, high = segment.points.min(axis=0), segment.points.max(axis=0)
        middle = (low + high) / 2
        axes.annotate("", segment.points[-1], segment.points[0], arrowprops={"arrowstyle": "-|>", "color": BLUE})
        if segment.kind == "climb":
            axes.text(middle[0] + 0.015, high[1] - 0.014, "climb", fontsize=8, va="center", color=BLUE)
            continue
        axes.add_patch(Rectangle(low - (0, brush / 2), high[0] - low[0], brush, color="#9db8e6", alpha=0.35))
        axes.text(middle[0], middle[1] + 0.008, f"row {segment.row}", fontsize=8, ha="center", color=BLUE)
    axes.text(*(plan.segments[0].points[0] + (0, 0.008)), "touch", fontsize=8, ha="right")
    heights = (0.0, plan.segments[0].points[0][1] + brush / 2)
    for height, words, place in zip(heights, guides, (-0.03, 0.19), strict=True):
        axes.plot((0, width), (height, height), color=ORANGE, linewidth=1.5, linestyle="--" if height else "-")
        axes.text(width / 2, place, words, fontsize=8, color=ORANGE, ha="center", va="center")
    axes.plot((0, 0), (0, 0.3), color=GREEN, linewidth=3)
    axes.text(0.015, 0.26, "stop edge of row 1, guide of the climb", fontsize=8, color=GREEN, va="center")
    axes.set(xlim=(-0.03, width + 0.03), ylim=(-0.06, 0.3), aspect="equal", xlabel="along the board [m]")
    return figure


def contact() -> Figure:
    """Least damping ratio of the contact over stiffness: bare wall, shipped gains, too much force gain."""
    config, stiffness = ibvs_qp.preset("qp").controller, np.geomspace(1e3, 3e4, 60)
    delay, damping = config.brush.force_delay_s, SCENE.wall.damping_n_s_m
    hot = dataclasses.replace(config, gains=dataclasses.replace(config.gains, force_kfp=1.6))
    figure, (axes,) = panels(2.7)
    for law, name, colour in ((config, "shipped gains", BLUE), (hot, "K_fp 1.6", ORANGE)):
        ratios = [contact_mode_damping(law, k, damping, delay).least_damping_ratio for k in stiffness]
        axes.plot(stiffness / 1e3, ratios, color=colour, label=name)
    passive = [contact_mode_damping(config, k, damping, delay).passive_damping_ratio for k in stiffness]
    axes.plot(stiffness / 1e3, passive, color=INK, linestyle="--", label="wall alone, 30 N s/m")
    axes.axhline(0.1, color="#a02020", linewidth=0.8)
    axes.text(1.05, 0.115, "refused below", fontsize=7.5, color="#a02020")
    axes.set(xscale="log", xlabel="stiffness of wall and brush [kN/m]", ylabel="damping ratio")
    axes.legend(frameon=False, fontsize=8)
    return figure


def vision() -> np.ndarray:
    """Overlay of perception on a rendered picture of a flight, RGB."""
    short = dataclasses.replace(SCENE, paint=dataclasses.replace(SCENE.paint, stroke_m=0.5))
    flown = fly(short, FlightOptions())
    painted = [picture for _, picture, phase in flown.pictures if phase.startswith("paint")]
    picture = unpack_picture(painted[len(painted) // 4])
    return cv2.resize(
        picture, (VISION_PX, round(VISION_PX * picture.shape[0] / picture.shape[1])), interpolation=cv2.INTER_AREA
    )
