"""One picture in, features out: surface, tracked lines and velocity. Start reading here."""

from __future__ import annotations

import time

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA, down_in_body
from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.vehicle import VehicleParams
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.detect import Candidate, detect_lines
from ibvs_qp.vision.flow import FlowVelocity, SparseFlow
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.mask import brush_zone, vehicle_mask
from ibvs_qp.vision.motion import CameraMotion
from ibvs_qp.vision.percept import LineHint, Percept
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneEstimate, PlaneFitter
from ibvs_qp.vision.seeds import seed_cells
from ibvs_qp.vision.tracks import LineTracker

#: Pictures after a start in which lines are searched often: colours are learned in the first one.
_WARM_UP = 8


class Perception:
    """Surface, lines and velocity from RGB-D pictures, gyro and attitude.

    Every picture: the surface is refitted from its prediction, every track is refined in a narrow strip around its
    prediction, points are followed. Every dozen pictures, and while nothing is tracked, lines are searched anew.
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
        self._layout_key: tuple[object, ...] = ()
        self.reset()

    def reset(self) -> None:
        """Forget everything seen: the same pictures then give the same bits."""
        for part in (self._fitter, self._tracker, self._flow, self._colors):
            part.reset()
        self._plane: PlaneEstimate | None = None
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
            problem = frame_problem(frame)
            if problem is None:
                turned, moved = _vector(rotation, 3), _vector(velocity, 3)
                return self._process(frame, _vector(attitude, 4), turned, moved, hints, detect, seed_pixel)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            problem = f"picture not understood: {type(error).__name__}: {error}"
        self._plane = None
        self._flow.reset()
        stamp = frame.stamp_ns if isinstance(frame.stamp_ns, int) else 0
        return Percept(
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
    ) -> Percept:
        clock = _Clock()
        self._lay_out(frame)
        down = None if attitude is None else R_BODY_CAMERA.T @ np.array(down_in_body(attitude))
        tilt = 0.0 if down is None else float(np.arctan2(-down[0], down[1]))
        turn = np.zeros(3) if rotation is None else rotation
        interval = 0.0 if self._stamp_ns is None else max((frame.stamp_ns - self._stamp_ns) * 1e-9, 0.0)
        motion = CameraMotion.of_body(turn, velocity, interval, self._camera_position)
        self._stamp_ns = frame.stamp_ns
        before = None if self._plane is None else self._plane.inverse_depth
        coarse = self._grid.sample(frame.rgb)
        labels = self._colors.label(coarse)
        refused = self._fit_plane(frame, motion, labels, coarse, down, seed_pixel)
        if self._plane is not None:
            labels = np.where(self._plane.component, np.maximum(labels, 1), 0)
        clock.lap("plane")
        surface = None if self._plane is None else self._plane.inverse_depth
        picture = Picture.of(frame.rgb, self._mask, frame.intrinsics, frame.depth, surface)
        self._tracker.advance(picture, motion, before, interval, self._colors, tilt)
        self._tracker.hints(hints, picture, self._colors, tilt)
        clock.lap("tracks")
        candidates = self._detect(picture, frame, labels, coarse, down, detect)
        clock.lap("detect")
        flow = self._flow.update(
            frame.rgb,
            frame.depth,
            self._excluded,
            frame.intrinsics,
            frame.stamp_ns,
            turn,
            self._plane,
            self._camera_position,
        )
        clock.lap("flow")
        return self._percept(frame, flow, candidates, refused, clock.times)

    def _lay_out(self, frame: RgbdFrame) -> None:
        """Masks and grid, made anew when size or camera change."""
        shape = (frame.rgb.shape[0], frame.rgb.shape[1])
        key = (shape, tuple(frame.intrinsics))
        if key == self._layout_key:
            return
        config, vehicle = self._config, self._vehicle
        self._mask = vehicle_mask(vehicle, config.brush_width_m, config.mask, frame.intrinsics, shape)
        zone = brush_zone(vehicle, config.brush_width_m, config.mask, frame.intrinsics, shape)
        self._excluded = np.ascontiguousarray((self._mask | zone)[: shape[0] // 2 * 2 : 2, : shape[1] // 2 * 2 : 2])
        self._grid = CoarseGrid(shape, frame.intrinsics, self._mask, config.plane.grid_columns)
        self._seeds = seed_cells(self._grid, vehicle, config.brush_width_m)
        self._layout_key = key
        self._plane = None
        self._tracker.reset()
        self._flow.reset()

    def _fit_plane(
        self,
        frame: RgbdFrame,
        motion: CameraMotion,
        labels: np.ndarray,
        coarse: np.ndarray,
        down: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> str | None:
        """Follow the surface or search it; returns the reason when there is none."""
        config = self._config.plane
        inverse = self._grid.inverse_depth(frame.depth, config.distance_min_m, config.distance_max_m)
        prefer = labels if self._colors.board is not None else None
        if self._plane is not None and seed_pixel is None:
            tracked = self._fitter.track(self._grid, inverse, motion.plane(self._plane.inverse_depth), down, prefer)
            if (
                isinstance(tracked, PlaneEstimate)
                and tracked.component.sum() >= config.lost_share * self._plane.component.sum()
            ):
                self._plane = tracked
                return None
        seeds = self._seeds
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
        # a wall a few centimetres behind differs in colour, hardly in depth: before the board is known, the colour
        # around each seed stands for it
        wanted = [
            self._colors.like_around(self._grid, coarse, seed, config.seed_radius) if prefer is None else prefer
            for seed in seeds
        ]
        found = self._fitter.search(self._grid, inverse, seeds, down, wanted)
        self._plane = found if isinstance(found, PlaneEstimate) else None
        return None if isinstance(found, PlaneEstimate) else found

    def _detect(
        self,
        picture: Picture,
        frame: RgbdFrame,
        labels: np.ndarray,
        coarse: np.ndarray,
        down: np.ndarray | None,
        wanted: bool,
    ) -> list[Candidate]:
        """Search for lines when it is time to, or when asked."""
        self._since_detection += 1
        self._frames += 1
        settings = self._config.detect
        confirmed = any(track.confirmed for track in self._tracker.tracks)
        due = self._since_detection >= (
            settings.period if confirmed and self._frames > _WARM_UP else settings.lost_period
        )
        if self._plane is None or not (due or wanted):
            return []
        self._since_detection = 0
        known = self._colors.board is not None
        self._colors.learn(coarse[self._plane.component])
        if not known:
            labels = np.where(self._plane.component, np.maximum(self._colors.label(coarse), 1), 0)
        candidates = detect_lines(
            picture, frame.depth, self._plane, self._grid, labels, self._colors, self._config, down
        )
        self._tracker.offer(candidates, picture)
        return candidates

    def _percept(
        self,
        frame: RgbdFrame,
        flow: FlowVelocity | str,
        candidates: list[Candidate],
        refused: str | None,
        times: dict[str, float],
    ) -> Percept:
        tracks = tuple(track.state() for track in self._tracker.tracks)
        lines = tuple(
            LineFeature(
                rho=track.rho,
                theta=track.theta,
                covariance=track.covariance,
                role=track.role,
                weight=track.weight,
                stamp_ns=frame.stamp_ns,
                track_id=track.track_id,
                segment=track.segment,
                surface_side=track.surface_side,
                kind=track.kind,
            )
            for track in tracks
            if track.confirmed and track.weight > 0.0
        )
        moving = flow if isinstance(flow, FlowVelocity) else None
        features = FeatureFrame(
            lines=lines,
            plane=None if self._plane is None else self._plane.abcd,
            stamp_ns=frame.stamp_ns,
            velocity=None if moving is None else moving.velocity,
            velocity_covariance=None if moving is None else moving.covariance,
            velocity_stamp_ns=0 if moving is None else moving.stamp_ns,
        )
        return Percept(
            features=features,
            plane=self._plane,
            tracks=tracks,
            candidates=tuple(candidates),
            refused=refused,
            velocity_refused=None if moving is not None else str(flow),
            mask=self._mask,
            intrinsics=frame.intrinsics,
            time_ms=times,
        )


class _Clock:
    """Wall-clock times of the stages [ms]; never enter a result."""

    def __init__(self) -> None:
        self.times: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.times[stage], self._last = 1e3 * (now - self._last), now


def _vector(values: np.ndarray | None, size: int) -> np.ndarray | None:
    """The values as floats, or None if they are absent or cannot be used."""
    if values is None:
        return None
    vector = np.asarray(values, float).ravel()
    return vector if vector.shape == (size,) and bool(np.isfinite(vector).all()) else None
