"""One flight: plant, sensors, camera and pilot in one deterministic loop."""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import ibvs_qp
from ibvs_qp.config.errors import out_of_range
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot, PilotConfig
from sim.flight.faults import Fault, FaultSchedule
from sim.flight.jobs import Job, PaintJob
from sim.flight.recorder import Recorder
from sim.flight.trace import Event, Trace
from sim.sensors.cameras import CameraStream, open_camera
from sim.sensors.features import GeometricFeatures, add_sigma_vs
from sim.sensors.imu_ft import SensorSuite
from sim.sensors.miscalibration import Miscalibration
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.plant import TICK_NS, Plant
from sim.world.random_streams import stream
from sim.world.readout import PLACES
from sim.world.scene import Scene

if TYPE_CHECKING:
    from sim.flight.viewer import FlightViewer

#: Called with simulated time [s], phase name and real-time factor.
Progress = Callable[[float, str, float], None]

#: Reason of a flight that Ctrl-C ended.
INTERRUPTED = "interrupted"
#: Shipped presets, one per law.
PRESETS = Path(ibvs_qp.__file__).parent / "presets"
#: Normal force above which the brush leaves paint [N].
PAINTING_FORCE = 0.05
#: Pressed ticks per drawn stroke: 1.2 mm at 0.1 m/s, below the 2 mm between stamps.
STROKE_TICKS = 3
#: Control ticks between calls of the progress function.
PROGRESS_TICKS = 125
_SEEN_FROM = [PLACES[name] for name in ("position", "quaternion", "body_velocity")]
#: Time-out of a flight [s]: start and corners, plus the strokes at half speed.
BASE_TIME, STROKE_FACTOR = 90.0, 2.0


@dataclass(frozen=True, kw_only=True)
class FlightOptions:
    """How to fly a scene; the defaults are the main job.

    With `machine_code` the C compiler, where there is one, compiles the controller's tick: the same flight to the bit,
    faster.
    """

    law: str = "qp"
    seed: int = 0
    features: str = "rendered"
    vision: str = "own"
    camera: str = "plane"
    image_size: tuple[int, int] | None = None
    preset: str | None = None
    video: bool = True
    machine_code: bool = False
    view: bool = False


@functools.lru_cache(maxsize=4)
def default_preset(law: str) -> PilotConfig:
    """The shipped preset of a law; both were tuned by the same search (docs/tuning.md)."""
    file = PRESETS / f"tarot_t960_{law}.toml"
    return PilotConfig.from_toml(file) if file.exists() else PilotConfig(law=law)


def pilot_config(scene: Scene, options: FlightOptions, config: PilotConfig | None = None) -> PilotConfig:
    """The pilot's configuration: preset, law, and the scene's paint job; nothing else of the scene.

    Args:
        scene: Only its paint job is read.
        options: Law and preset file.
        config: Replaces the preset.

    Raises:
        ConfigError: If the controller expects another period than the one that is simulated.
    """
    if config is None:
        config = PilotConfig.from_toml(options.preset) if options.preset else default_preset(options.law)
    if round(config.controller.tick_s * 1e9) != TICK_NS:
        allowed = f"the simulated loop ticks every {TICK_NS * 1e-9:g} s"
        raise out_of_range("controller.tick_s", config.controller.tick_s, "s", allowed)
    paint = scene.paint
    painting = dataclasses.replace(
        config.painting,
        brush_width_m=paint.brush_width_m,
        edge_margin_m=paint.edge_margin_m,
        rows=paint.rows,
        stroke_m=paint.stroke_m,
        overlap_m=paint.overlap_m,
        speed_m_s=paint.speed_m_s,
        push_n=paint.push_n,
    )
    vision = dataclasses.replace(config.vision, paint_color=paint.color, brush_width_m=paint.brush_width_m)
    controller = config.controller
    if options.machine_code:
        controller = dataclasses.replace(controller, machine_code=True)
    return dataclasses.replace(
        config,
        controller=controller,
        painting=painting,
        vision=vision,
        perception=options.vision,
        law=options.law,
    )


class World:
    """Plant, sensors, canvas and camera: everything but the pilot."""

    def __init__(self, scene: Scene, options: FlightOptions, config: PilotConfig) -> None:
        if options.image_size is not None:
            width, height = options.image_size
            scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=width, height=height))
        self.scene, self.geometry = scene, BoardGeometry(scene)
        vehicle = config.controller.vehicle
        self._rendered = options.features == "rendered"
        self.stream: CameraStream | None = None
        self.plant = Plant(scene, vehicle, options.seed, options.view)
        self.sensors = SensorSuite(scene, vehicle, options.seed)
        self.canvas = Canvas(scene, options.seed)
        self._miscalibration = Miscalibration(scene.camera, vehicle, self._rendered)
        if self._rendered:
            camera = open_camera(options.camera, scene, vehicle, self.canvas, options.seed)
            self.stream = CameraStream(camera, scene.camera.rate_hz, scene.camera.latency_s)
        else:
            self._features = GeometricFeatures(scene, vehicle, self.canvas, options.seed)
        self._seen_from = tuple(self.plant.truth[place] for place in _SEEN_FROM)  # views
        self.viewer = self._open_viewer() if options.view else None
        self._brush: tuple[float, float] | None = None
        self._pressed = 0

    def _open_viewer(self) -> FlightViewer:
        from sim.flight.viewer import FlightViewer

        board = self.scene.board
        middle = self.geometry.point(0.5 * board.width_m, 0.5 * board.height_m)
        return FlightViewer(self.plant, np.append(0.0, middle))

    def sense(self) -> SensorFrame:
        """Sensor frame of the present tick."""
        plant = self.plant
        if self.stream is not None:
            pose = self._miscalibration.pose(plant.position, plant.quaternion)
            image = self.stream.tick(plant.time_ns, *pose)
            return self.sensors.sample(plant, image=None if image is None else self._miscalibration.picture(image))
        features, now = self._features, plant.time_ns
        if features.rests(now):
            return self.sensors.sample(plant)
        position, quaternion, velocity = self._seen_from
        pose = self._miscalibration.pose(position, quaternion)
        return self.sensors.sample(plant, None, features.tick(now, *pose, velocity))

    def act(self, thrusts: np.ndarray) -> None:
        """Advance one control tick and paint where the brush presses."""
        plant = self.plant
        plant.step(thrusts)
        pressing = plant.contact_normal_force > PAINTING_FORCE
        if self.viewer is not None:
            self.viewer.show(pressing)
        if pressing:
            self._pressed += 1
            if self._brush is not None and self._pressed % STROKE_TICKS:
                return
            point = self.geometry.spot(*plant.tip_on_wall)
            self.canvas.stroke(self._brush, point)
            self._brush = point
        else:
            self._brush = None

    def close(self) -> None:
        """Close the window."""
        if self.viewer is not None:
            self.viewer.close()


def make_pilot(scene: Scene, options: FlightOptions, config: PilotConfig, job: Job) -> Pilot:
    """The pilot of one flight; with the scene's extra feature noise after its own perception."""
    sigma, noise = scene.features.sigma_vs, stream(options.seed, "sigma_vs")
    rendered = options.features == "rendered"  # the sensor model of lines adds the same noise itself
    seen_as = (lambda frame: add_sigma_vs(frame, sigma, noise)) if rendered and sigma > 0.0 else None
    return Pilot(config, job.strategy(config.painting), seen_as)


def fly(
    scene: Scene,
    options: FlightOptions,
    progress: Progress | None = None,
    config: PilotConfig | None = None,
    job: Job | None = None,
    faults: tuple[Fault, ...] = (),
) -> Trace:
    """Fly one scene under one law; Ctrl-C ends the flight and returns the partial trace.

    Args:
        scene: The truth.
        options: Law, seed, features, picture size and so on.
        progress: Called every `PROGRESS_TICKS` with time, phase and real-time factor.
        config: Flown instead of the preset.
        job: Task at the wall; None paints.
        faults: Faults and their times.

    Returns:
        The trace; incomplete with a reason when the flight crashed, timed out or was interrupted.
    """
    config, job = pilot_config(scene, options, config), job or PaintJob()
    pilot, world = make_pilot(scene, options, config, job), World(scene, options, config)
    recorder, schedule = Recorder(scene, options, world, pilot), FaultSchedule(faults)
    limit = BASE_TIME + STROKE_FACTOR * job.expected_s(config.painting)
    start, reason, tick = time.perf_counter(), "", 0
    try:
        while not pilot.painter.finished:
            for text in schedule.tick(world, pilot):
                recorder.note(tick * TICK_NS * 1e-9, "fault", text)
            frame = world.sense()
            command = pilot.step(frame)
            world.act(command.thrusts)
            recorder.tick(frame, command)
            tick += 1
            if world.plant.crashed:
                reason = f"crash: {world.plant.crashed}"
                break
            if tick * TICK_NS * 1e-9 > limit:
                reason = f"time-out after {limit:.0f} s of flight"
                break
            if progress is not None and tick % PROGRESS_TICKS == 0:
                flown = tick * TICK_NS * 1e-9
                progress(flown, pilot.painter.phase, flown / max(time.perf_counter() - start, 1e-9))
    except KeyboardInterrupt:
        reason = INTERRUPTED
    finally:
        world.close()
    trace = recorder.trace()
    trace.wall_time_s = time.perf_counter() - start  # includes the trace
    trace.completed = not reason and pilot.painter.finished and not pilot.painter.failed
    trace.reason = reason or pilot.painter.reason
    if reason:
        trace.events.append(Event(t=tick * TICK_NS * 1e-9, kind="end", text=reason))
    return trace
