"""From a new picture to sound features: perception, checks, and whether the picture shows anything new."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.estimator import Estimator
from ibvs_qp.estimation.turned_camera import TurnedCamera
from ibvs_qp.estimation.wall_lines import WallAxes, image_line
from ibvs_qp.frames import down_in_body
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, FeatureFrame, RgbdFrame, SensorFrame
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.contact_picture import hint_span
from ibvs_qp.pilot.estimation import Plane
from ibvs_qp.pilot.painting.command import ExpectedEdge
from ibvs_qp.pilot.perception_loader import PerceptionLoader
from ibvs_qp.pilot.rolling_shutter import RollingShutter
from ibvs_qp.validation.features import check_features
from ibvs_qp.validation.measurement import LINES_PER_SLOT
from ibvs_qp.vision.checks import PictureGate
from ibvs_qp.vision.lines.tracks import LineHint
from ibvs_qp.vision.picture.camera import RgbdCamera

#: Pixels by which pictures are compared: every 16th row and column, of 4096 at most.
_SPARSE = (slice(0, 4096, 16), slice(0, 4096, 16))


class CameraInput:
    """Pictures or features of one flight.

    Attributes:
        perception_result: Result of perception for the last picture, or None.
        picture: That picture, registered and rectified, or None.
        plane, plane_ns: Wall in the camera frame (nx, ny, nz, d) of the last features with one, and their stamp.
        image_ns: Stamp of the last features, -1 for never.
        plane_doubt: Why the last picture has no sound plane; empty after one.

    Args:
        config: Configuration of the flight.
        estimator: Attitude and turn at the time of capture.
        seen_as: Applied to the features of every picture, for studies of perception errors.
    """

    STATE = ("perception_result", "picture", "_capture_ns", "plane", "plane_ns", "image_ns", "plane_doubt")

    def __init__(
        self,
        config: PilotConfig,
        estimator: Estimator,
        seen_as: Callable[[FeatureFrame], FeatureFrame] | None,
    ) -> None:
        self._config, self._estimator, self._seen_as = config, estimator, seen_as
        self._most_lines = LINES_PER_SLOT * config.controller.line_slots
        self._loader = PerceptionLoader(config)
        self._mount = TurnedCamera(config.controller.vehicle.camera_turn_deg)
        self._pictures = PictureGate()
        self._camera = RgbdCamera(config.camera, self._mount.rotation, self._pictures.problem)
        vehicle, brush = config.controller.vehicle, config.vision.brush_width_m
        place = np.array(vehicle.camera_position_m)
        self._tip_from_camera = (np.array(vehicle.tip_position_m) - place).tolist()
        ways = [(role, ahead) for role in (HORIZONTAL, VERTICAL) for ahead in (-1, 1)]
        self._hint_spans = {way: hint_span(vehicle, brush, *way) for way in ways}
        self._shutter = RollingShutter(config.camera.readout_s, self._camera.lens, place)

    def prepare(self, picture: RgbdFrame | None = None) -> None:
        """Load perception and call every stage of it once; `Pilot.prepare`."""
        if picture is not None:
            picture = self._camera.picture(picture)
            self._pictures.reset()
        self._loader.start(picture).join()
        if self._loader.problem:
            raise RuntimeError(self._loader.problem)

    def load_perception(self) -> None:
        """Load perception unless it is loaded."""
        if self._loader.perception is None:
            self.prepare()

    def reset(self) -> None:
        """As before the first picture; perception stays loaded."""
        self._loader.reset()
        self._pictures.reset()
        self.perception_result, self.picture, self._capture_ns = None, None, -1
        self.plane: Plane | None = None
        self.plane_ns = self.image_ns = -1
        self.plane_doubt = ""

    def hints(self, stamp_ns: int, expected: ExpectedEdge | None, contact: ContactState) -> tuple[LineHint, ...]:
        """Place of the expected painted edge beside the brush in a picture, by the contact of the tick before."""
        if expected is None or not contact.known:
            return ()
        axes = WallAxes.of(contact.normal, down_in_body(self._estimator.attitude_at(stamp_ns)))
        angle = 0.5 * math.pi if expected.role == HORIZONTAL else 0.0
        rho, theta, _ = image_line(expected.offset, angle, axes, self._tip_from_camera, contact.distance)
        span = self._hint_spans[expected.role, expected.ahead]
        if span[0] >= span[1]:
            return ()
        return (LineHint(name="fresh", rho=rho, theta=theta, kind="paint", surface_side=expected.side, span=span),)

    def perceive(
        self,
        frame: SensorFrame,
        velocity: np.ndarray | None,
        hints: tuple[LineHint, ...],
        is_new_picture: Callable[[object], bool],
        rejected: list[str],
    ) -> FeatureFrame | None:
        """Sound features of a new picture, or None; stores their plane.

        Args:
            frame: The frame.
            velocity: Of the tip in B [m/s], (3,), or None.
            hints: Lines that are expected in the picture.
            is_new_picture: Whether a content differs from the last one.
            rejected: Receives the refusals.
        """
        if frame.image is None:
            features = frame.features
        else:
            features = self._process(frame.image, velocity, hints, rejected)
        if features is None:
            return None
        features = check_features(features, self._most_lines, rejected)
        if frame.image is None:
            features = self._mount.features(features, rejected)
        if not is_new_picture(_content(frame, features)):
            rejected.append("picture: repeats the last one")
            return None
        self.image_ns = features.stamp_ns
        if features.plane is not None:
            self.plane, self.plane_ns = features.plane, features.stamp_ns
        return features

    def _process(
        self, image: RgbdFrame, velocity: np.ndarray | None, hints: tuple[LineHint, ...], rejected: list[str]
    ) -> FeatureFrame | None:
        """Run perception on a picture, with the gyro's turn since the last one; None for a refused picture."""
        if (perception := self._loader.perception) is None:
            if not self._loader.problem:
                self._loader.start()
            rejected.append(f"image: {self._loader.problem}")
            return None
        last_ns = self._capture_ns if self._capture_ns >= 0 else image.stamp_ns
        self._capture_ns = image.stamp_ns
        self.picture = self._camera.picture(image)
        self.perception_result = perception.process(
            self.picture,
            attitude=np.array(self._estimator.attitude_at(image.stamp_ns)),
            rotation=self._estimator.turn(last_ns, image.stamp_ns),
            velocity=velocity,
            hints=hints,
        )
        if self.perception_result.refused:
            self.plane_doubt = self.perception_result.refused
            rejected.append(f"image: {self.plane_doubt}")
            return None
        surface = self.perception_result.plane
        scatter = surface.residual_sigma if surface is not None else 0.0
        self.plane_doubt = ""
        if scatter > (most := self._config.vision.plane.sound_scatter):
            sound = f"at most {100.0 * most:.2f} % is sound"
            self.plane_doubt = f"depth scatters by at least {100.0 * scatter:.1f} % about a plane, {sound}"
        seen = self.perception_result.features
        if seen is not None:
            plane = self.plane if seen.plane is None else seen.plane
            motion = seen.velocity if velocity is None else velocity
            seen = self._shutter.features(seen, image, plane, motion, self._estimator.rate_at(image.stamp_ns))
        return seen if self._seen_as is None or seen is None else self._seen_as(seen)


def _content(frame: SensorFrame, features: FeatureFrame) -> object:
    """Content that differs from picture to picture: sparse pixels, or the features themselves."""
    if frame.image is not None:
        return frame.image.rgb[_SPARSE].tobytes(), frame.image.depth[_SPARSE].tobytes()
    return tuple(features.plane or ()), tuple([(line.rho, line.theta) for line in features.lines])
