"""One picture in, features out: surface, tracked lines, guides and velocity. Start reading here."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, down_in_body, to_camera
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.validation.failure import raised
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.checks import PictureGate, StageClock, finite_vector
from ibvs_qp.vision.compilation import prepare
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion, surface_motion
from ibvs_qp.vision.flow.sparse_flow import SparseFlow
from ibvs_qp.vision.lines.candidates import Candidate, find_candidates
from ibvs_qp.vision.lines.guides import GuideKeeper
from ibvs_qp.vision.lines.line_state import LineHint
from ibvs_qp.vision.lines.segments import half_resolution
from ibvs_qp.vision.lines.tracks import LineTracker
from ibvs_qp.vision.perception_result import PerceptionResult, make_result
from ibvs_qp.vision.picture.exposure import ExposureSteps
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.picture.unrolled import unrolled
from ibvs_qp.vision.surface.curvature import WallCurvature
from ibvs_qp.vision.surface.layout import PictureLayout
from ibvs_qp.vision.surface.plane import PlaneEstimate
from ibvs_qp.vision.surface.seeds import UP_LEFT
from ibvs_qp.vision.surface.tracker import SurfaceTracker

#: Pictures after a start in which lines are searched often: colours are learned in the first one.
_WARM_UP = 8
#: Half width of the search strips where points of the surface give the camera's motion [px at 640].
_SURFACE_STRIP_PX = 8.0


class Perception:
    """Surface, lines and velocity from RGB-D pictures; attitude, gyro, vehicle and colours help where they are known.

    Every picture: the surface is refitted from its prediction, every track is refined in a narrow strip around its
    prediction, points are followed. Every few pictures lines are searched at the end of the surface. Without a gyro
    the camera's motion is that of the surface's points.

    Args:
        config: Settings.
        vehicle: Geometry of the vehicle in the picture; None for a camera alone, not in
            flight, whose surface is named by a seed.
        inwards: Where the surface lies from the tip at the beginning of a job, (right, down): +1 or -1 each.
    """

    def __init__(self, config: VisionConfig, vehicle: VehicleParams | None, inwards: tuple[int, int] = UP_LEFT) -> None:
        prepare()
        self._config, self._vehicle, self._inwards = config, vehicle, inwards
        self._camera_position = np.zeros(3) if vehicle is None else np.asarray(vehicle.camera_position_m, float)
        self._colors = SurfaceColors(config.board_color, config.paint_color, config.line.color_gate)
        self._surface = SurfaceTracker(config.plane, self._colors)
        self._tracker, self._flow = LineTracker(config), SparseFlow(config.flow, self._camera_position)
        self._layout: PictureLayout | None = None
        self._curvature = WallCurvature()
        tip = self._camera_position if vehicle is None else np.asarray(vehicle.tip_position_m, float)
        self._tip = to_camera(tip, self._camera_position)
        self._exposure, self._guides = ExposureSteps(), GuideKeeper()
        self._gate = PictureGate(in_flight=vehicle is not None)
        self.reset()

    def reset(self) -> None:
        """Start again as new: the same pictures then give the same bits."""
        for part in (self._gate, self._surface, self._curvature, self._tracker, self._flow, self._colors):
            part.reset()
        self._exposure.reset()
        self._guides.reset()
        self._grey: np.ndarray | None = None
        self._stamp_ns: int | None = None
        self._missed_turn = np.zeros(3)  # over pictures that were refused [rad]
        self._since_detection, self._frames = self._config.detect.period, 0

    def process(
        self,
        frame: RgbdFrame,
        *,
        attitude: np.ndarray | None = None,
        rotation: np.ndarray | None = None,
        velocity: np.ndarray | None = None,
        hints: tuple[LineHint, ...] = (),
        detect: bool = False,
        seed_pixel: tuple[float, float] | None = None,
    ) -> PerceptionResult:
        """Process one picture; never raises, a picture that cannot be used is refused with a reason.

        Args:
            frame: Colour and depth with intrinsics and capture time.
            attitude: Quaternion B in I at capture, (4,), or None for an upright camera of unknown attitude.
            rotation: Turn of the body since the picture before, in B [rad], (3,), or None without a gyro.
            velocity: Velocity of the centre of mass in B [m/s] for the prediction, (3,), or None.
            hints: Lines the caller expects.
            detect: Search for new lines in this picture in any case.
            seed_pixel: (u, v) of a place on the surface [px], for its search; None for the places beside the brush.

        Returns:
            Features, plane, tracks, guides and times.
        """
        try:
            problem, turned = self._gate.problem(frame), finite_vector(rotation, 3)
            if turned is not None:
                turned = turned + self._missed_turn
                self._missed_turn = np.zeros(3) if problem is None else turned
            if problem is None:
                moved = finite_vector(velocity, 3)
                return self._process(frame, finite_vector(attitude, 4), turned, moved, hints, detect, seed_pixel)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            problem = raised("picture not understood", error)
        self._surface.lose()
        self._grey = None
        self._flow.reset()
        stamp = frame.stamp_ns if isinstance(frame.stamp_ns, int) else 0
        return PerceptionResult(
            features=FeatureFrame(lines=(), plane=None, stamp_ns=stamp), refused=problem, velocity_refused=problem
        )

    def _process(
        self,
        frame: RgbdFrame,
        attitude: np.ndarray | None,
        rotation: np.ndarray | None,
        velocity: np.ndarray | None,
        hints: tuple[LineHint, ...],
        detect: bool,
        seed_pixel: tuple[float, float] | None,
    ) -> PerceptionResult:
        clock = StageClock()
        frame = self._plain(frame)
        layout = self._laid_out(frame)
        down = None if attitude is None else R_BODY_CAMERA.T @ np.array(down_in_body(attitude))
        tilt = None if down is None else float(np.arctan2(-down[0], down[1]))
        interval = 0.0 if self._stamp_ns is None else max((frame.stamp_ns - self._stamp_ns) * 1e-9, 0.0)
        self._stamp_ns = frame.stamp_ns

        motion = self._motion(frame, rotation, velocity, interval)
        before = None if self._surface.plane is None else self._surface.plane.inverse_depth
        predicted = None if before is None else motion.plane(before)
        seen, frame = frame, self._unrolled(frame, predicted)
        refused = self._surface.update(frame, layout, predicted, down, seed_pixel)
        plane = self._surface.plane
        if plane is not None:
            self._measure_curvature(frame, layout, plane, interval)
        clock.lap("plane")

        inverse_depth = None if plane is None else plane.inverse_depth
        picture = Picture.of(frame.rgb, layout.mask, frame.intrinsics, frame.depth, inverse_depth)
        strip = _SURFACE_STRIP_PX if motion.by_surface else self._config.line.strip_px
        self._tracker.advance(picture, motion, before, interval, self._colors, tilt or 0.0, strip)
        self._tracker.hints(hints, picture, self._colors, tilt or 0.0)
        clock.lap("tracks")

        candidates = self._detect(picture, frame, layout, down, tilt, detect)
        clock.lap("detect")

        flow = self._flow.update(seen, layout.excluded, motion, plane, busy=self._since_detection == 0)
        clock.lap("flow")

        tracks, least, times = self._tracker.tracks, self._config.track.confidence_min, clock.times
        return make_result(
            frame,
            tracks,
            plane,
            flow,
            tuple(candidates),
            refused,
            layout.mask,
            times,
            self._guides,
            least,
            self._curvature.unrolled_by,
        )

    def _plain(self, frame: RgbdFrame) -> RgbdFrame:
        """The picture as the kernels read it, without steps of the exposure."""
        rgb = np.require(self._exposure.level(frame.rgb, frame.stamp_ns), np.uint8, ("C", "W"))
        depth = np.require(frame.depth, np.float32, ("C", "W"))
        if rgb is frame.rgb and depth is frame.depth:
            return frame
        return dataclasses.replace(frame, rgb=rgb, depth=depth)

    def _unrolled(self, frame: RgbdFrame, predicted: np.ndarray | None) -> RgbdFrame:
        """The picture before the tangent plane at the tip, where the wall is curved."""
        curvature = self._curvature.seen()
        if curvature is None or predicted is None:
            return frame
        return unrolled(frame, predicted, curvature, self._tip)

    def _measure_curvature(
        self, frame: RgbdFrame, layout: PictureLayout, plane: PlaneEstimate, interval: float
    ) -> None:
        grid = layout.sparse_grid
        if plane.component.shape == grid.shape:  # a surface just found is measured in the next picture
            self._curvature.update(grid, grid.mean_inverse_depth(frame.depth, self._config.plane), plane, interval)

    def _laid_out(self, frame: RgbdFrame) -> PictureLayout:
        """Masks and grid of the picture; for another size or camera new ones, and nothing is followed into it."""
        if self._layout is None or not self._layout.fits(frame):
            self._layout = PictureLayout(frame, self._config, self._vehicle, self._inwards)
            self._grey = None
            for part in (self._surface, self._tracker):
                part.lose()
            for part in (self._flow, self._guides):
                part.reset()
            self._colors.forget_light()
        return self._layout

    def _motion(
        self, frame: RgbdFrame, rotation: np.ndarray | None, velocity: np.ndarray | None, interval: float
    ) -> CameraMotion:
        """Motion of the camera since the picture before: without a gyro by the surface's points, else as if still."""
        if rotation is not None:
            self._grey = None
            return CameraMotion.of_body(rotation, velocity, interval, self._camera_position)
        small, factor = half_resolution(frame.rgb)
        before, self._grey = self._grey, cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)
        plane, region = self._surface.plane, self._surface.region
        if before is not None and plane is not None and region is not None:
            motion = surface_motion(before, self._grey, factor, region.cells, plane, frame.intrinsics)
            if motion is not None:
                return motion
        return CameraMotion.of_body(np.zeros(3), velocity, interval, self._camera_position)

    def _detect(
        self,
        picture: Picture,
        frame: RgbdFrame,
        layout: PictureLayout,
        down: np.ndarray | None,
        tilt: float | None,
        requested: bool,
    ) -> list[Candidate]:
        """Search for lines when a search is due or requested."""
        self._since_detection += 1
        self._frames += 1
        settings = self._config.detect
        confirmed = any(track.confirmed for track in self._tracker.tracks)
        calm = confirmed and self._frames > _WARM_UP and not requested
        period = settings.period if calm else settings.lost_period
        if self._surface.plane is None or not (self._since_detection >= period or requested):
            return []
        self._since_detection = 0
        surface = self._surface.region_now(frame, layout, down)
        self._tracker.rescore(picture, surface, self._colors, tilt)
        followed = tuple(track.line for track in self._tracker.tracks if calm and track.settled)
        candidates = find_candidates(picture, surface, self._colors, self._config, tilt, followed)
        self._tracker.offer(candidates, picture)
        return candidates
