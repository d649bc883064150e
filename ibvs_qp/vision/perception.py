"""One picture in, features out: surface, tracked lines, guides and velocity. Start reading here."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, down_in_body, to_camera
from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.validation.failure import raised
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.checks import PictureGate, StageClock, finite_vector
from ibvs_qp.vision.compilation import prepare
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion, SurfaceMotion
from ibvs_qp.vision.flow.sparse_flow import FlowVelocity, SparseFlow
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.tracks import LineHint, LineTracker, TrackState
from ibvs_qp.vision.picture.layout import UP_LEFT, PictureLayout
from ibvs_qp.vision.picture.picture import ExposureSteps, Picture
from ibvs_qp.vision.picture.unrolled import unrolled
from ibvs_qp.vision.surface.curvature import WallCurvature
from ibvs_qp.vision.surface.plane import PlaneEstimate
from ibvs_qp.vision.surface.tracker import SurfaceTracker

#: Pictures after a start in which lines are searched often: colours are learned in the first one.
_WARM_UP = 8
#: Half width of the search strips where points of the surface give the camera's motion [px at 640].
_SURFACE_STRIP_PX = 8.0


#: The four guides, by the side of the surface on which they lie.
GUIDE_SIDES = ("top", "bottom", "left", "right")
#: Direction from a guide towards the surface, in the picture (right, down).
_INWARD = {"top": (0.0, 1.0), "bottom": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}
#: A line this near to level or upright may be a guide of that direction [deg].
_WITHIN_DEG = 40.0
#: Weakest score of a guide.
_LEAST_SCORE = 0.30
#: A challenger takes a guide's place when its score is better by this in two of three pictures.
_BETTER, _WINS, _WINDOW = 0.08, 2, 3


@dataclass(frozen=True, kw_only=True)
class PerceptionResult:
    """Result of one picture."""

    features: FeatureFrame  # lines, plane and velocity for an estimator or a controller
    plane: PlaneEstimate | None = None  # the surface, or None
    tracks: tuple[TrackState, ...] = ()  # all tracks, tentative ones included
    # track of the surface's own top, bottom, left and right edge, None where none is in view
    guides: dict[str, TrackState | None] = field(default_factory=lambda: dict.fromkeys(GUIDE_SIDES))
    candidates: tuple[Candidate, ...] = ()  # lines found by a detection in this picture (empty where none ran)
    refused: str | None = None  # why there is no plane or nothing at all, or None
    velocity_refused: str | None = None  # why there is no velocity, or None
    mask: np.ndarray | None = None  # vehicle's mask of this picture, uint8 (H, W), or None
    intrinsics: tuple[float, float, float, float] | None = None  # (fx, fy, cx, cy) of this picture [px], or None
    time_ms: dict[str, float] = field(default_factory=dict)  # wall-clock time per stage [ms]


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
        self._surface, self._tracker = SurfaceTracker(config.plane, self._colors), LineTracker(config, self._colors)
        self._points, self._flow = SurfaceMotion(), SparseFlow(config.flow, self._camera_position)
        self._layout: PictureLayout | None = None
        self._curvature = WallCurvature()
        tip = self._camera_position if vehicle is None else np.asarray(vehicle.tip_position_m, float)
        self._tip = to_camera(tip, self._camera_position)
        self._exposure, self._guides = ExposureSteps(), GuideKeeper()
        self._gate = PictureGate(in_flight=vehicle is not None)
        self.reset()

    def reset(self) -> None:
        """Start again as new: the same pictures then give the same bits."""
        stages = (self._surface, self._curvature, self._tracker, self._points, self._flow, self._guides)
        for part in (self._gate, self._exposure, self._colors, *stages):
            part.reset()
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
        self._points.reset()
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
        interval = 0.0 if self._stamp_ns is None else max((frame.stamp_ns - self._stamp_ns) * 1e-9, 0.0)
        self._stamp_ns = frame.stamp_ns
        motion = self._motion(frame, rotation, velocity, interval)
        before = None if self._surface.plane is None else self._surface.plane.inverse_depth
        predicted = None if before is None else motion.plane(before)

        down = None if attitude is None else R_BODY_CAMERA.T @ np.array(down_in_body(attitude))
        seen, frame = frame, self._unrolled(frame, predicted)
        picture = Picture(frame, layout, down)
        refused = self._surface.find_surface(picture, predicted, seed_pixel)
        plane = self._surface.plane
        if plane is not None and self._config.curved:
            self._measure_curvature(frame, layout, plane, interval)
        picture.plane = None if plane is None else plane.abcd[:3]
        clock.lap("plane")

        strip = _SURFACE_STRIP_PX if motion.by_surface else self._config.line.strip_px
        self._tracker.refine_tracks(picture, motion, before, interval, strip)
        self._tracker.follow_hints(hints, picture)
        clock.lap("tracks")

        candidates = self._detect(picture, detect)
        clock.lap("detect")

        flow = self._flow.measure_velocity(seen, layout.excluded, motion, plane, busy=self._since_detection == 0)
        clock.lap("flow")

        tracks = self._tracker.tracks
        features = make_features(
            frame.stamp_ns, tracks, plane, flow, self._config.track.confidence_min, self._curvature.unrolled_by
        )
        kept = tuple(map(copy.copy, tracks))
        return PerceptionResult(
            features=features,
            plane=plane,
            tracks=kept,
            guides=self._guides.choose(kept),
            candidates=tuple(candidates),
            refused=refused,
            velocity_refused=flow if isinstance(flow, str) else None,
            mask=layout.mask,
            intrinsics=frame.intrinsics,
            time_ms=clock.times,
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
        curvature = self._curvature.seen() if predicted is not None else self._curvature.flat()
        if curvature is None or predicted is None:
            return frame
        return unrolled(frame, predicted, curvature, self._tip)

    def _measure_curvature(
        self, frame: RgbdFrame, layout: PictureLayout, plane: PlaneEstimate, interval: float
    ) -> None:
        grid = layout.sparse_grid
        if plane.component.shape == grid.shape:  # a surface just found is measured in the next picture
            self._curvature.update(grid, grid.mean_inverse_depth(frame.depth), plane, interval)

    def _laid_out(self, frame: RgbdFrame) -> PictureLayout:
        """Masks and grid of the picture; for another size or camera new ones, and nothing is followed into it."""
        if self._layout is None or not self._layout.fits(frame):
            self._layout = PictureLayout(frame, self._config, self._vehicle, self._inwards)
            for part in (self._surface, self._tracker):
                part.lose()
            for part in (self._points, self._flow, self._guides):
                part.reset()
            self._colors.light = None  # its cells are those of one picture size
        return self._layout

    def _motion(
        self, frame: RgbdFrame, rotation: np.ndarray | None, velocity: np.ndarray | None, interval: float
    ) -> CameraMotion:
        """Motion of the camera since the picture before: without a gyro by the surface's points, else as if still."""
        if rotation is not None:
            self._points.reset()
        elif (motion := self._points.motion_by_points(frame, self._surface.plane, self._surface.region)) is not None:
            return motion
        turn = np.zeros(3) if rotation is None else rotation
        return CameraMotion.of_body(turn, velocity, interval, self._camera_position)

    def _detect(self, picture: Picture, requested: bool) -> list[Candidate]:
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
        return self._tracker.find_lines(picture, self._surface.region_now(picture), calm)


def make_features(
    stamp_ns: int,
    tracks: Sequence[TrackState],
    plane: PlaneEstimate | None,
    flow: FlowVelocity | str,
    least_certainty: float = 0.0,
    curvature: np.ndarray | None = None,
) -> FeatureFrame:
    """Features of one picture: of its tracks the confirmed and certain ones of positive weight, seen or not."""
    lines = tuple(
        LineFeature(
            rho=track.rho,
            theta=track.theta,
            covariance=track.covariance,
            role=track.role,
            weight=track.weight,
            stamp_ns=stamp_ns,
            track_id=track.track_id,
            segment=track.segment,
            surface_side=track.surface_side,
            kind=track.kind,
        )
        for track in tracks
        if track.confirmed and track.weight > 0.0 and track.certainty >= least_certainty
    )
    moving = flow if isinstance(flow, FlowVelocity) else None
    return FeatureFrame(
        lines=lines,
        plane=None if plane is None else plane.abcd,
        stamp_ns=stamp_ns,
        velocity=None if moving is None else moving.velocity,
        velocity_covariance=None if moving is None else moving.covariance,
        velocity_stamp_ns=0 if moving is None else moving.stamp_ns,
        curvature=curvature,
    )


def guide_side(line: TrackState) -> str | None:
    """Which guide a line could be, by the direction in which the surface lies from it; None if it is too slanted."""
    if line.surface_side == 0:
        return None
    x, y = line.surface_side * math.cos(line.theta), line.surface_side * math.sin(line.theta)
    limit = math.cos(math.radians(_WITHIN_DEG))
    return next((side for side in GUIDE_SIDES if x * _INWARD[side][0] + y * _INWARD[side][1] > limit), None)


class GuideKeeper:
    """Chooses the guides picture by picture, so that they do not flicker."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the guides so far."""
        self._holders: dict[str, int] = {}
        self._wins: dict[str, deque[int]] = {side: deque(maxlen=_WINDOW) for side in GUIDE_SIDES}

    def choose(self, tracks: tuple[TrackState, ...]) -> dict[str, TrackState | None]:
        """The guide of every side, None where no line is good enough."""
        result: dict[str, TrackState | None] = dict.fromkeys(GUIDE_SIDES)
        able = [track for track in tracks if track.borders_plane and track.score >= _LEAST_SCORE]
        for side in GUIDE_SIDES:
            lines = [track for track in able if guide_side(track) == side]
            best = max(lines, key=lambda track: track.score, default=None)
            if best is None:
                continue
            holder = next((track for track in lines if track.track_id == self._holders.get(side)), None)
            result[side] = self._winner(side, best, holder)
            self._holders[side] = result[side].track_id  # type: ignore[union-attr]
        return result

    def _winner(self, side: str, best: TrackState, holder: TrackState | None) -> TrackState:
        """The best line, or the holder until a challenger was better often enough."""
        wins = self._wins[side]
        if holder is None or best.track_id == holder.track_id:
            wins.append(0)
            return best
        wins.append(best.track_id if best.score > holder.score + _BETTER else 0)
        return best if wins.count(best.track_id) >= _WINS else holder
