"""One picture in, features out: surface, tracked lines and velocity. Start reading here."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, down_in_body
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.validation.failure import raised
from ibvs_qp.vision.checks import PictureGate, StageClock, finite_vector
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.detect import Candidate, detect_lines
from ibvs_qp.vision.exposure import ExposureSteps
from ibvs_qp.vision.flow import SparseFlow
from ibvs_qp.vision.layout import PictureLayout
from ibvs_qp.vision.light_samples import on_surface
from ibvs_qp.vision.make_percept import make_percept
from ibvs_qp.vision.motion import CameraMotion
from ibvs_qp.vision.percept import LineHint, Percept
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.tracks import LineTracker

#: Pictures after a start in which lines are searched often: colours are learned in the first one.
_WARM_UP = 8


class _Likenesses:
    """Labels by colour for every seed, made when they are looked at: mostly the first seed does."""

    def __init__(self, make: Callable[[int], np.ndarray]) -> None:
        self._make = make

    def __getitem__(self, index: int, /) -> np.ndarray:
        return self._make(index)


class Perception:
    """Surface, lines and velocity from RGB-D pictures, gyro and attitude.

    Every picture: the surface is refitted from its prediction, every track is refined in a narrow strip around its
    prediction, points are followed. Every few pictures level and upright lines are searched in turn; while nothing is
    tracked, both at once.
    """

    def __init__(self, config: VisionConfig, vehicle: VehicleParams) -> None:
        """Take settings and geometry; start without memory."""
        self._config, self._vehicle = config, vehicle
        self._camera_position = np.asarray(vehicle.camera_position_m, float)
        self._fitter, self._tracker, self._flow = (
            PlaneFitter(config.plane),
            LineTracker(config),
            SparseFlow(config.flow),
        )
        self._colors = SurfaceColors(config.board_color, config.paint_color, config.line.color_gate)
        self._layout: PictureLayout | None = None
        self._exposure, self._gate = ExposureSteps(), PictureGate()
        self.reset()

    def reset(self) -> None:
        """Forget everything seen: the same pictures then give the same bits."""
        for part in (self._gate, self._fitter, self._tracker, self._flow, self._colors, self._exposure):
            part.reset()
        self._plane: PlaneEstimate | None = None
        self._stamp_ns: int | None = None
        self._since_detection, self._frames, self._upright_next = self._config.detect.period, 0, False

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
    ) -> Percept:
        """See one picture; never raises, a picture that cannot be used is refused with a reason.

        Args:
            frame: Colour and depth with intrinsics and capture time.
            attitude: Quaternion B in I at capture, (4,), or None for an upright camera of unknown attitude.
            rotation: Turn of the body since the picture before, in B [rad], (3,), or None for none.
            velocity: Velocity of the centre of mass in B [m/s] for the prediction, (3,), or None.
            hints: Lines the caller expects.
            detect: Search for new lines in this picture in any case.
            seed_pixel: (u, v) of a place on the surface, or None for the places beside the brush.

        Returns:
            Features, plane, tracks and times.
        """
        try:
            problem = self._gate.problem(frame)
            if problem is None:
                turned, moved = finite_vector(rotation, 3), finite_vector(velocity, 3)
                return self._process(frame, finite_vector(attitude, 4), turned, moved, hints, detect, seed_pixel)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            problem = raised("picture not understood", error)
        self._plane = None
        self._flow.reset()
        stamp = frame.stamp_ns if isinstance(frame.stamp_ns, int) else 0
        return Percept(
            features=FeatureFrame(lines=(), plane=None, stamp_ns=stamp), refused=problem, velocity_refused=problem
        )

    def _at_one_exposure(self, frame: RgbdFrame) -> RgbdFrame:
        levelled = self._exposure.level(frame.rgb, frame.stamp_ns)
        return frame if levelled is frame.rgb else dataclasses.replace(frame, rgb=levelled)

    def _process(
        self,
        frame: RgbdFrame,
        attitude: np.ndarray | None,
        rotation: np.ndarray | None,
        velocity: np.ndarray | None,
        hints: tuple[LineHint, ...],
        detect: bool,
        seed_pixel: tuple[float, float] | None,
    ) -> Percept:
        clock = StageClock()
        frame = self._at_one_exposure(frame)
        if self._layout is None or not self._layout.fits(frame):
            self._layout = PictureLayout(frame, self._config, self._vehicle)
            self._plane = None
            self._tracker.reset()
            self._flow.reset()
        self._grid = self._layout.grid
        down = None if attitude is None else R_BODY_CAMERA.T @ np.array(down_in_body(attitude))
        tilt = 0.0 if down is None else float(np.arctan2(-down[0], down[1]))
        turn = np.zeros(3) if rotation is None else rotation
        interval = 0.0 if self._stamp_ns is None else max((frame.stamp_ns - self._stamp_ns) * 1e-9, 0.0)
        motion = CameraMotion.of_body(turn, velocity, interval, self._camera_position)
        self._stamp_ns = frame.stamp_ns
        before = None if self._plane is None else self._plane.inverse_depth
        self._coarse: np.ndarray | None = None  # the picture's colours on the grid, where the surface was searched
        refused = self._fit_plane(frame, motion, down, seed_pixel)
        clock.lap("plane")
        surface = None if self._plane is None else self._plane.inverse_depth
        picture = Picture.of(frame.rgb, self._layout.mask, frame.intrinsics, frame.depth, surface)
        self._tracker.advance(picture, motion, before, interval, self._colors, tilt)
        self._tracker.hints(hints, picture, self._colors, tilt)
        clock.lap("tracks")
        candidates = self._detect(picture, frame, down, detect)
        clock.lap("detect")
        flow = self._flow.update(
            frame.rgb,
            frame.depth,
            self._layout.excluded,
            frame.intrinsics,
            frame.stamp_ns,
            turn,
            motion.rotation,
            self._plane,
            self._camera_position,
            busy=self._since_detection == 0,
        )
        clock.lap("flow")
        return make_percept(
            frame, self._tracker.tracks, self._plane, flow, tuple(candidates), refused, self._layout.mask, clock.times
        )

    def _fit_plane(
        self,
        frame: RgbdFrame,
        motion: CameraMotion,
        down: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> str | None:
        """Follow the surface or search it; returns the reason when there is none."""
        config = self._config.plane
        assert self._layout is not None
        if self._plane is not None and seed_pixel is None:
            before, predicted = self._plane, motion.plane(self._plane.inverse_depth)
            tracked = self._layout.follower.follow(
                frame.rgb, frame.depth, predicted, before.residual_sigma, self._colors, down
            )
            if (
                isinstance(tracked, PlaneEstimate)
                and tracked.component.mean() >= config.lost_share * before.component.mean()
            ):
                self._plane = tracked
                return None
        coarse = self._coarse = self._grid.sample(frame.rgb)
        prefer = None if self._colors.board is None else self._labels(coarse)
        inverse = self._grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
        seeds = self._layout.seeds
        if seed_pixel is not None:
            u, v = seed_pixel
            rows, columns = self._grid.shape
            cell = (
                round((v - self._grid.offset) / self._grid.stride),
                round((u - self._grid.offset) / self._grid.stride),
            )
            if not (0 <= cell[0] < rows and 0 <= cell[1] < columns):
                self._plane = None
                return f"seed pixel ({u:g}, {v:g}) lies outside the picture"
            seeds = [cell]
        elif prefer is None:
            seeds = self._colors.bare(self._grid, coarse, seeds, config.seed_radius)
        # a wall a few centimetres behind differs in colour, hardly in depth: before the board is known, the colour
        # around each seed stands for it
        wanted = _Likenesses(
            lambda index: (
                self._colors.like_around(self._grid, coarse, seeds[index], config.seed_radius)
                if prefer is None
                else prefer
            )
        )
        found = self._fitter.search(self._grid, inverse, seeds, down, wanted)
        self._plane = found if isinstance(found, PlaneEstimate) else None
        return None if isinstance(found, PlaneEstimate) else found

    def _detect(
        self,
        picture: Picture,
        frame: RgbdFrame,
        down: np.ndarray | None,
        wanted: bool,
    ) -> list[Candidate]:
        """Search for lines when it is time to, or when asked."""
        self._since_detection += 1
        self._frames += 1
        settings = self._config.detect
        confirmed = any(track.confirmed for track in self._tracker.tracks)
        calm = confirmed and self._frames > _WARM_UP and not wanted
        period = max(1, settings.period // 2) if calm else settings.lost_period
        if self._plane is None or not (self._since_detection >= period or wanted):
            return []
        self._since_detection = 0
        self._upright_next = not self._upright_next
        directions = (self._upright_next,) if calm else (False, True)
        followed = tuple(track.line for track in self._tracker.tracks if calm and track.settled)
        coarse = self._grid.sample(frame.rgb) if self._coarse is None else self._coarse
        surface = self._whole_surface(frame, coarse, down)
        self._colors.learn(coarse, surface.component)
        surface = self._in_its_light(surface, frame, coarse, down)
        labels = np.maximum(self._labels(coarse), 1) * surface.component
        candidates = detect_lines(
            picture,
            frame.depth,
            surface,
            self._grid,
            labels,
            self._colors,
            self._config,
            down,
            directions,
            followed,
        )
        self._tracker.offer(candidates, picture)
        return candidates

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

    def _whole_surface(self, frame: RgbdFrame, coarse: np.ndarray, down: np.ndarray | None) -> PlaneEstimate:
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
