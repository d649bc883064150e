"""One picture in, features out: surface, tracked lines, guides and velocity. Start reading here."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, down_in_body
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.validation.failure import raised
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.appearance.light_samples import on_surface
from ibvs_qp.vision.checks import PictureGate, StageClock, finite_vector
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.camera_motion import CameraMotion
from ibvs_qp.vision.flow.ego_motion import surface_motion
from ibvs_qp.vision.flow.sparse_flow import SparseFlow
from ibvs_qp.vision.kernels import prepare
from ibvs_qp.vision.layout import PictureLayout
from ibvs_qp.vision.lines.candidates import Candidate, find_candidates
from ibvs_qp.vision.lines.edge_segments import half_resolution
from ibvs_qp.vision.lines.guides import GuideKeeper
from ibvs_qp.vision.lines.line_state import LineHint
from ibvs_qp.vision.lines.tracks import LineTracker
from ibvs_qp.vision.make_result import make_result
from ibvs_qp.vision.perception_result import PerceptionResult
from ibvs_qp.vision.picture.exposure import ExposureSteps
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.find_surface import find_surface, followed_region
from ibvs_qp.vision.surface.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.surface.region import SurfaceRegion

#: Pictures after a start in which lines are searched often: colours are learned in the first one.
_WARM_UP = 8
#: Half width of the search strips where points of the surface tell the camera's motion [px at 640].
_SEEN_STRIP_PX = 8.0


class Perception:
    """Surface, lines and velocity from RGB-D pictures; attitude, gyro, vehicle and colours help where they are known.

    Every picture: the surface is refitted from its prediction, every track is refined in a narrow strip around its
    prediction, points are followed. Every few pictures lines are searched at the end of the surface. Without a gyro
    the camera's motion is that of the surface's points.

    Args:
        config: Settings.
        vehicle: Geometry of the vehicle in the picture; None for a camera alone, whose surface is named by a seed.
    """

    def __init__(self, config: VisionConfig, vehicle: VehicleParams | None) -> None:
        prepare()
        self._config, self._vehicle = config, vehicle
        self._camera_position = np.zeros(3) if vehicle is None else np.asarray(vehicle.camera_position_m, float)
        self._fitter, self._tracker, self._flow = (
            PlaneFitter(config.plane),
            LineTracker(config),
            SparseFlow(config.flow),
        )
        self._colors = SurfaceColors(config.board_color, config.paint_color, config.line.color_gate)
        self._layout: PictureLayout | None = None
        self._exposure, self._gate, self._guides = ExposureSteps(), PictureGate(), GuideKeeper()
        self.reset()

    def reset(self) -> None:
        """Forget everything seen: the same pictures then give the same bits."""
        parts = (self._gate, self._fitter, self._tracker, self._flow, self._colors, self._exposure, self._guides)
        for part in parts:
            part.reset()
        self._plane: PlaneEstimate | None = None
        self._region: SurfaceRegion | None = None
        self._grey: np.ndarray | None = None
        self._stamp_ns: int | None = None
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
        """See one picture; never raises, a picture that cannot be used is refused with a reason.

        Args:
            frame: Colour and depth with intrinsics and capture time.
            attitude: Quaternion B in I at capture, (4,), or None for an upright camera of unknown attitude.
            rotation: Turn of the body since the picture before, in B [rad], (3,), or None if no gyro tells it.
            velocity: Velocity of the centre of mass in B [m/s] for the prediction, (3,), or None.
            hints: Lines the caller expects.
            detect: Search for new lines in this picture in any case.
            seed_pixel: (u, v) of a place on the surface [px], for its search; None for the places beside the brush.

        Returns:
            Features, plane, tracks, guides and times.
        """
        try:
            problem = self._gate.problem(frame)
            if problem is None:
                turned, moved = finite_vector(rotation, 3), finite_vector(velocity, 3)
                return self._process(frame, finite_vector(attitude, 4), turned, moved, hints, detect, seed_pixel)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            problem = raised("picture not understood", error)
        self._plane, self._grey = None, None
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
        motion, turn, seen = self._motion(frame, rotation, velocity, interval)
        before = None if self._plane is None else self._plane.inverse_depth
        refused = self._fit_plane(frame, motion, down, seed_pixel)
        clock.lap("plane")
        surface = None if self._plane is None else self._plane.inverse_depth
        picture = Picture.of(frame.rgb, layout.mask, frame.intrinsics, frame.depth, surface)
        strip = _SEEN_STRIP_PX if seen else self._config.line.strip_px
        self._tracker.advance(picture, motion, before, interval, self._colors, tilt or 0.0, strip)
        self._tracker.hints(hints, picture, self._colors, tilt or 0.0)
        clock.lap("tracks")
        candidates = self._detect(picture, frame, down, tilt, detect)
        clock.lap("detect")
        flow = self._flow.update(
            frame.rgb,
            frame.depth,
            layout.excluded,
            frame.intrinsics,
            frame.stamp_ns,
            turn,
            motion.rotation,
            self._plane,
            self._camera_position,
            busy=self._since_detection == 0,
        )
        clock.lap("flow")
        followed = self._tracker.tracks
        return make_result(
            frame,
            followed,
            self._plane,
            flow,
            tuple(candidates),
            refused,
            layout.mask,
            clock.times,
            self._guides,
            self._config.track.confidence_min,
        )

    def _plain(self, frame: RgbdFrame) -> RgbdFrame:
        """The picture as the kernels read it, at the exposure of the first one."""
        rgb = np.require(self._exposure.level(frame.rgb, frame.stamp_ns), np.uint8, ("C", "W"))
        depth = np.require(frame.depth, np.float32, ("C", "W"))
        if rgb is frame.rgb and depth is frame.depth:
            return frame
        return dataclasses.replace(frame, rgb=rgb, depth=depth)

    def _laid_out(self, frame: RgbdFrame) -> PictureLayout:
        """Masks and grid of the picture; for another size or camera new ones, and nothing is followed into it."""
        if self._layout is None or not self._layout.fits(frame):
            self._layout = PictureLayout(frame, self._config, self._vehicle)
            self._plane, self._grey = None, None
            self._tracker.reset()
            self._flow.reset()
        self._grid = self._layout.grid
        return self._layout

    def _motion(
        self, frame: RgbdFrame, rotation: np.ndarray | None, velocity: np.ndarray | None, interval: float
    ) -> tuple[CameraMotion, np.ndarray, bool]:
        """Motion of the camera, turn of the body, and whether the surface's points tell them instead of the gyro."""
        if rotation is not None:
            self._grey = None
            return CameraMotion.of_body(rotation, velocity, interval, self._camera_position), rotation, False
        small, factor = half_resolution(frame.rgb)
        before, self._grey = self._grey, cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)
        if before is not None and self._plane is not None and self._region is not None:
            region = dataclasses.replace(self._region, plane=self._plane)
            seen = surface_motion(before, self._grey, factor, region, frame.intrinsics)
            if seen is not None:
                return seen, cv2.Rodrigues(R_BODY_CAMERA @ seen.rotation @ R_BODY_CAMERA.T)[0].ravel(), True
        return CameraMotion.of_body(np.zeros(3), velocity, interval, self._camera_position), np.zeros(3), False

    def _fit_plane(
        self,
        frame: RgbdFrame,
        motion: CameraMotion,
        down: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> str | None:
        """Follow the surface or search it; returns the reason when there is none."""
        config, layout = self._config.plane, self._layout
        assert layout is not None
        if self._plane is not None:
            before, predicted = self._plane, motion.plane(self._plane.inverse_depth)
            tracked = layout.follower.follow(
                frame.rgb, frame.depth, predicted, before.residual_sigma, self._colors, down
            )
            if (
                isinstance(tracked, PlaneEstimate)
                and tracked.component.mean() >= config.lost_share * before.component.mean()
            ):
                self._plane = tracked
                return None
        seeds = layout.seeds
        if seed_pixel is not None:
            u, v = seed_pixel
            height, width = frame.depth.shape
            if not (0 <= u < width and 0 <= v < height):
                self._plane = None
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture of {width} x {height} px"
            seeds = [self._grid.cell_at(u, v)]
        found = find_surface(frame, self._grid, self._fitter, config, seeds, self._colors, down, seed_pixel is None)
        if isinstance(found, str):
            self._plane = None
            return found
        self._plane, self._region = found.plane, found
        return None

    def _detect(
        self, picture: Picture, frame: RgbdFrame, down: np.ndarray | None, tilt: float | None, wanted: bool
    ) -> list[Candidate]:
        """Search for lines when it is time to, or when asked."""
        self._since_detection += 1
        self._frames += 1
        settings = self._config.detect
        confirmed = any(track.confirmed for track in self._tracker.tracks)
        calm = confirmed and self._frames > _WARM_UP and not wanted
        period = settings.period if calm else settings.lost_period
        if self._plane is None or not (self._since_detection >= period or wanted):
            return []
        self._since_detection = 0
        surface = self._surface_now(frame, down)
        self._tracker.judge(picture, frame.depth, surface, self._colors, tilt)
        followed = tuple(track.line for track in self._tracker.tracks if calm and track.settled)
        candidates = find_candidates(picture, frame.depth, surface, self._colors, self._config, tilt, followed)
        self._tracker.offer(candidates, picture)
        return candidates

    def _surface_now(self, frame: RgbdFrame, down: np.ndarray | None) -> SurfaceRegion:
        """The surface on the full coarse grid; colours and light are learned on it."""
        assert self._plane is not None
        coarse, searched = self._grid.sample(frame.rgb), self._region
        plane = self._whole_plane(frame, coarse, down)
        self._colors.learn(coarse, plane.component)
        plane = self._in_its_light(plane, frame, coarse, down)
        if (searched is None or searched.plane is not plane) and self._colors.board is not None:
            searched = followed_region(frame, self._grid, self._config.plane, plane, self._colors, searched)
        assert searched is not None
        self._region = searched
        return searched

    def _labels(self, coarse: np.ndarray) -> np.ndarray:
        """Colour labels of the samples in the light that falls on them."""
        return self._colors.label(coarse, self._colors.levels_at(*self._grid.pixels))

    def _in_its_light(
        self, surface: PlaneEstimate, frame: RgbdFrame, coarse: np.ndarray, down: np.ndarray | None
    ) -> PlaneEstimate:
        """Learn how light falls on the surface; where it is uneven, all of the surface instead of its well-lit part."""
        grid, config = self._grid, self._config.plane
        shape = (frame.rgb.shape[0], frame.rgb.shape[1])
        near = on_surface(grid, frame.depth, surface.inverse_depth, config.fine_gate_high)
        uneven = False
        if not self._colors.surely_even(coarse, near):
            places = grid.design[:, :2].take(near, axis=0)
            samples = coarse.reshape(-1, 3).take(near, axis=0)
            uneven = self._colors.learn_light(samples, places, shape, frame.intrinsics)
        assert self._layout is not None
        self._colors.learn_paint(grid, coarse, self._layout.beside_brush)
        if not uneven:
            return surface
        inverse = grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
        refit = self._fitter.track(grid, inverse, surface.inverse_depth, down, self._labels(coarse))
        return refit if isinstance(refit, PlaneEstimate) else surface

    def _whole_plane(self, frame: RgbdFrame, coarse: np.ndarray, down: np.ndarray | None) -> PlaneEstimate:
        """The surface on the full coarse grid, for a search of lines; followed on a coarser one between searches."""
        assert self._plane is not None
        if self._plane.component.shape == self._grid.shape:
            return self._plane
        config = self._config.plane
        inverse = self._grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
        prefer = None if self._colors.board is None else self._labels(coarse)
        refit = self._fitter.track(self._grid, inverse, self._plane.inverse_depth, down, prefer)
        if isinstance(refit, PlaneEstimate):
            return refit
        rows, columns = self._grid.shape
        component = cv2.resize(
            self._plane.component.view(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST
        ).astype(bool)
        return dataclasses.replace(self._plane, component=component)
