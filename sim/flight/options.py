"""How to fly a scene: law, seed, perception, camera, and the pilot's configuration."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ibvs_qp
from ibvs_qp.config import VehicleParams
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.pilot import PilotConfig
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.vehicles.configuration import with_vehicle
from sim.vehicles.vehicle_file import read_vehicle
from sim.world.board import BoardGeometry
from sim.world.mjcf import STEP_NS
from sim.world.scene import Scene

#: Most physics steps in a control tick: 100 Hz, at which the lag of a tick already costs half the margin.
MOST_STEPS = 10
#: Rounding of a period over that of a physics step [-].
ROUNDING = 1e-6
#: Decimals of a calibration [-]: hundredths of a pixel.
CALIBRATION_DIGITS = 2
#: Board beyond the margin up to which stroke 1 begins at the margin [m]: half the tolerance of its length.
SLACK_M = 5e-3


@dataclass(frozen=True, kw_only=True)
class FlightOptions:
    """How to fly a scene; the defaults are the main job.

    With `compiled` the controller runs as C code if there is a compiler: a bit-identical flight, faster. A `controller`
    is a class of a control law, ``module:Class`` or ``file.py:Class``, constructed with the law's `ControllerConfig`
    (and `controller_settings`, if there are any) and flown instead of the law. `rows` are classes of further tasks and
    limits of the QP law. With a `journal` the rows of the log are written to that folder while the flight goes on, with
    `mcap` an MCAP log, too.
    """

    law: str = "qp"
    controller: str = ""
    controller_settings: Any = None
    rows: tuple[str, ...] = ()
    seed: int = 0
    features: str = "rendered"
    vision: str = "own"
    camera: str = "plane"
    image_size: tuple[int, int] | None = None
    preset: str | None = None
    vehicle: str | None = None
    video: bool = True
    compiled: bool = False
    view: bool = False
    journal: str = ""
    mcap: bool = False


def ticks_in(time_s: float, tick_s: float) -> int:
    """Whole ticks in a time, at least one."""
    return max(1, round(time_s / tick_s))


def unsupervised(config: PilotConfig) -> PilotConfig:
    """The same pilot without its supervisor, for studies of the laws and for control flights."""
    return dataclasses.replace(config, safety=dataclasses.replace(config.safety, supervise=False))


def sized(scene: Scene, options: FlightOptions) -> Scene:
    """The scene with the picture size of the options, if they state one."""
    if options.image_size is None:
        return scene
    width, height = options.image_size
    return dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=width, height=height))


def calibrated(vehicle: VehicleParams, scene: Scene, options: FlightOptions) -> VehicleParams:
    """The vehicle with picture size and intrinsics of the camera that flies, as a calibration gives them."""
    camera = sized(scene, options).camera
    fx, fy, cx, cy = (round(entry, CALIBRATION_DIGITS) for entry in camera_intrinsics(camera))
    return dataclasses.replace(
        vehicle, camera_size_px=(camera.width, camera.height), camera_intrinsics_px=(fx, fy, cx, cy)
    )


def _given(options: FlightOptions) -> PilotConfig:
    """Preset and vehicle of the options; without a preset another vehicle has the law's gains, scaled to it."""
    if options.vehicle is None:
        return PilotConfig.from_toml(options.preset) if options.preset else ibvs_qp.preset(options.law)
    config = PilotConfig.from_toml(options.preset) if options.preset else PilotConfig(law=options.law)
    return with_vehicle(config, read_vehicle(Path(options.vehicle)).vehicle)


def pilot_config(scene: Scene, options: FlightOptions, config: PilotConfig | None = None) -> PilotConfig:
    """The pilot's configuration: preset, law, the scene's paint job and the camera's calibration; nothing else.

    Args:
        scene: Only its paint job is read, with the size of its board, and size and field of view of its camera.
        options: Law, preset file and vehicle file.
        config: Replaces the preset.

    Raises:
        ConfigError: If the control period is no whole number of physics steps.
    """
    if config is None:
        config = _given(options)
    steps = config.controller.tick_s * 1e9 / STEP_NS
    if abs(steps - round(steps)) > ROUNDING or not 1 <= round(steps) <= MOST_STEPS:
        allowed = f"the simulated loop ticks every 1 to {MOST_STEPS} physics steps of {STEP_NS * 1e-9:g} s"
        raise out_of_range("controller.tick_s", config.controller.tick_s, "s", allowed)
    paint = scene.paint
    painting = dataclasses.replace(
        config.painting,
        brush_width_m=paint.brush_width_m,
        edge_margin_m=paint.edge_margin_m,
        pattern=paint.pattern,
        start=paint.start,
        rows=paint.rows,
        stroke_m=paint.stroke_m,
        begins_at_margin=BoardGeometry(scene).slack_m < SLACK_M,
        overlap_m=paint.overlap_m,
        speed_m_s=paint.speed_m_s,
        push_n=paint.push_n,
    )
    vision = dataclasses.replace(config.vision, paint_color=paint.color, brush_width_m=paint.brush_width_m)
    controller = dataclasses.replace(config.controller, vehicle=calibrated(config.controller.vehicle, scene, options))
    limits = controller.limits
    if paint.trim_deg > limits.trim_deg:
        controller = dataclasses.replace(controller, limits=dataclasses.replace(limits, trim_deg=paint.trim_deg))
    if options.compiled and controller.solver.name == "osqp":  # the others have no C code
        controller = controller.on_backend("compiled")
    return dataclasses.replace(
        config,
        controller=controller,
        painting=painting,
        vision=vision,
        perception=options.vision,
        law=options.law,
    )
