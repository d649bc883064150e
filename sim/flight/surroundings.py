"""The world of one flight: plant, sensors, canvas and camera."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import PilotConfig
from sim.flight.options import FlightOptions, sized, ticks_in
from sim.flight.viewer import FlightViewer
from sim.sensors.camera_mount import CameraMount
from sim.sensors.cameras import CameraStream, Dropouts, open_camera
from sim.sensors.cameras.timing import delivery_errors
from sim.sensors.features import GeometricFeatures
from sim.sensors.suite import SensorSuite
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.plant import Plant
from sim.world.random_streams import stream
from sim.world.readout import PLACES
from sim.world.scene import Scene

#: Normal force above which the brush leaves paint [N].
PAINTING_FORCE = 0.05
#: Time pressed per drawn stroke [s]: 1.2 mm at 0.1 m/s, below the 2 mm between stamps.
STROKE_S = 0.012
_SEEN_FROM = [PLACES[name] for name in ("position", "quaternion", "body_velocity", "rate")]


class World:
    """Plant, sensors, canvas and camera: everything but the pilot."""

    def __init__(self, scene: Scene, options: FlightOptions, config: PilotConfig) -> None:
        scene = sized(scene, options)
        self.scene, self.geometry = scene, BoardGeometry(scene)
        self._rendered = options.features == "rendered"
        self.stream: CameraStream | None = None
        self.plant = Plant(scene, config.controller.vehicle, options.seed, config.controller.tick_s, options.view)
        self.sensors = SensorSuite(scene, self.plant.vehicle, options.seed)
        self.canvas = Canvas(scene, options.seed)
        self._mount = CameraMount(self.plant.vehicle, config.controller.vehicle)
        if self._rendered:
            camera = open_camera(options.camera, scene, self._mount.vehicle, self.canvas, options.seed)
            dropouts = Dropouts(scene.errors.camera.dropped, stream(options.seed, "dropped pictures"))
            late = delivery_errors(scene.errors.timing, options.seed)
            self.stream = CameraStream(camera, scene.camera.rate_hz, scene.camera.latency_s, dropouts, errors=late)
        elif scene.plant.focal_ratio != 1.0:
            raise ConfigError("plant.focal_ratio needs pictures; fly it with --features rendered")
        else:
            self._features = GeometricFeatures(scene, self._mount.vehicle, self.canvas, options.seed)
        self._seen_from = tuple(self.plant.truth[place] for place in _SEEN_FROM)  # views
        self.viewer = self._open_viewer() if options.view else None
        self._brush: tuple[float, float] | None = None
        self._pressed, self._stroke_ticks = 0, ticks_in(STROKE_S, config.controller.tick_s)

    def _open_viewer(self) -> FlightViewer:
        from sim.flight.viewer import FlightViewer

        board = self.scene.board
        middle = self.geometry.point(0.5 * board.width_m, 0.5 * board.height_m)
        return FlightViewer(self.plant, np.append(0.0, middle))

    def sense(self) -> SensorFrame:
        """Sensor frame of the present tick."""
        plant, now = self.plant, self.plant.time_ns
        if (self.stream or self._features).rests(now):
            return self.sensors.sample(plant)
        position, quaternion, *motion = self._seen_from
        if self.stream is None:  # lines are reported as tangents at the tip
            place = np.array((0.0, *self.plant.tip_on_wall))
            surface = self.geometry.surface
            position, quaternion = surface.flattened(position, quaternion, place)
            self._features.curvature = None if surface.flat else surface.curvature_tensor(place)
        pose, seen = self._mount.pose(position, quaternion), [self._mount.velocity(part) for part in motion]
        if self.stream is None:
            return self.sensors.sample(plant, None, self._mount.features(self._features.tick(now, *pose, *seen)))
        image = self.stream.tick(now, *pose, np.concatenate(seen))
        return self.sensors.sample(plant, image=None if image is None else self._mount.picture(image))

    def act(self, thrusts: np.ndarray) -> None:
        """Advance one control tick and paint where the brush presses the board."""
        plant = self.plant
        plant.step(thrusts)
        pressing = plant.on_board and plant.contact_normal_force > PAINTING_FORCE
        if self.viewer is not None:
            self.viewer.show(pressing)
        if pressing:
            self._pressed += 1
            if self._brush is not None and self._pressed % self._stroke_ticks:
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
