"""The paper's pipeline behind the interface of the own perception, so that the same pilot can use it."""

from __future__ import annotations

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from ibvs_qp.validation.failure import raised
from ibvs_qp.vision.checks import PictureGate, StageClock, finite_vector
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.flow.sparse_flow import SparseFlow
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.tracks import LineHint, TrackState
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.paper.pipeline import PaperPipeline
from ibvs_qp.vision.paper.result import PaperDetection
from ibvs_qp.vision.perception import PerceptionResult, make_features
from ibvs_qp.vision.picture.layout import UP_LEFT, PictureLayout
from ibvs_qp.vision.surface.search import facing

#: Identities of the two lines: the paper has no others, whichever edge is topmost or first at the moment.
TOPMOST_TRACK, FIRST_TRACK = 1, 2


class PaperPerception:
    """Topmost level line, first upright line, surface and flow velocity of every picture.

    No line is followed from picture to picture and none is expected: hints have no effect, and the two identities
    belong to the topmost or first edge. The search for the surface begins at the middle of the last box (the paper),
    or beside the brush where that place is hidden or nothing was found. Velocity is that of the own sparse flow, since
    the paper only states that it uses one.

    Args:
        config: Settings of the pipeline.
        vision: Settings shared with the own perception: brush width, masks, flow.
        vehicle: Geometry.
    """

    def __init__(
        self, config: PaperConfig, vision: VisionConfig, vehicle: VehicleParams, inwards: tuple[int, int] = UP_LEFT
    ) -> None:
        self._config, self._vision, self._vehicle, self._inwards = config, vision, vehicle, inwards
        self._camera_position = np.asarray(vehicle.camera_position_m, float)
        self._flow, self._gate = SparseFlow(vision.flow, self._camera_position), PictureGate()
        self._layout: PictureLayout | None = None
        self.reset()

    def reset(self) -> None:
        """Clear the memory."""
        self._gate.reset()
        self._flow.reset()
        self._center: tuple[float, float] | None = None
        self._stamp_ns: int | None = None
        self._age = {TOPMOST_TRACK: 0, FIRST_TRACK: 0}

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
        """See one picture; never raises. Arguments as for `ibvs_qp.vision.Perception.process`.

        Attitude, hints and ``detect`` change nothing: the vehicle is taken to be level and every picture is searched.
        """
        try:
            problem = self._gate.problem(frame)
            if problem is None:
                return self._process(frame, finite_vector(rotation, 3), finite_vector(velocity, 3), seed_pixel)
        except Exception as error:  # in flight nothing may raise; the reason is reported instead
            problem = raised("picture not understood", error)
        self._center = None
        self._flow.reset()
        stamp = frame.stamp_ns if isinstance(frame.stamp_ns, int) else 0
        features = FeatureFrame(lines=(), plane=None, stamp_ns=stamp)
        return PerceptionResult(features=features, refused=problem, velocity_refused=problem)

    def _process(
        self,
        frame: RgbdFrame,
        rotation: np.ndarray | None,
        velocity: np.ndarray | None,
        seed_pixel: tuple[float, float] | None,
    ) -> PerceptionResult:
        if self._layout is None or not self._layout.fits(frame):
            self._layout = PictureLayout(frame, self._vision, self._vehicle, self._inwards)
            self._pipeline = PaperPipeline(self._config, self._layout.mask)
            self._center = None
            self._flow.reset()
        layout = self._layout
        found = self._find(frame, seed_pixel)
        clock = StageClock()
        turn = np.zeros(3) if rotation is None else rotation
        interval = 0.0 if self._stamp_ns is None else max((frame.stamp_ns - self._stamp_ns) * 1e-9, 0.0)
        self._stamp_ns = frame.stamp_ns
        motion = CameraMotion.of_body(turn, velocity, interval, self._camera_position)
        flow = self._flow.measure_velocity(frame, layout.excluded, motion, found.plane, busy=False)
        times = dict(found.time_ms)
        clock.lap("flow")
        chosen = ((TOPMOST_TRACK, found.horizontal), (FIRST_TRACK, found.vertical))
        tracks = tuple(track for track in (self._track(*each) for each in chosen) if track is not None)
        return PerceptionResult(
            features=make_features(frame.stamp_ns, tracks, found.plane, flow),
            plane=found.plane,
            tracks=tracks,
            candidates=found.candidates,
            refused=found.refused,
            velocity_refused=flow if isinstance(flow, str) else None,
            mask=layout.mask,
            intrinsics=frame.intrinsics,
            time_ms=times | clock.times,
        )

    def _find(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> PaperDetection:
        """Detect from the first seed at which there is a surface."""
        assert self._layout is not None
        grid = self._layout.grid
        seeds = [] if self._center is None else [self._center]
        seeds += [
            (float(grid.offset + grid.stride * column), float(grid.offset + grid.stride * row))
            for row, column in facing(
                grid, grid.inverse_depth(frame.depth), self._layout.ladder, self._vision.plane.seed_radius
            )
        ]
        seeds = seeds if seed_pixel is None else [seed_pixel]
        found = self._pipeline.detect(frame, *seeds)
        self._center = None if found.box is None else found.box.center
        return found

    def _track(self, track_id: int, chosen: Candidate | None) -> TrackState | None:
        """The chosen line as a track of full weight: it counts from the first picture on."""
        self._age[track_id] = 0 if chosen is None else self._age[track_id] + 1
        if chosen is None:
            return None
        return TrackState.of(track_id, chosen, weight=1.0, age=self._age[track_id], confirmed=True)
