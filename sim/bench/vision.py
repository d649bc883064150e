"""Processor time of tracked pictures, detection and velocity, the paper's pipeline and cv2's LSD, one thread."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, PerceptionResult, VisionConfig, checks
from ibvs_qp.vision.paper import PaperPipeline
from ibvs_qp.vision.picture.layout import PictureLayout
from sim.bench.timing import Bench, Row
from sim.detection.manifest import FrameEntry, read_manifest
from sim.detection.pictures import read_frame
from sim.sensors.cameras import PlaneCamera
from sim.world.canvas import Canvas
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Camera period [ns]; frequency of the sway [Hz] and its amplitudes in roll, pitch and yaw [deg].
PERIOD_NS, _SWAY_HZ, _SWAY_DEG = 33_333_333, 0.4, (0.3, 0.3, 0.6)
#: Start of the approach: tip to board [m].
_START_M = 0.4
#: Error of the integrated gyro between two pictures, per axis [rad].
_GYRO_RAD = 6e-5


@dataclass(frozen=True, kw_only=True)
class Shot:
    """One picture with the motion that the vehicle's sensors measure."""

    frame: RgbdFrame  # colour and depth
    attitude: np.ndarray  # quaternion B in I, (4,)
    rotation: np.ndarray  # rotation of the body since the previous shot, in B [rad], (3,)
    velocity: np.ndarray  # velocity of the body in B [m/s], (3,)


def mission_shots(size: tuple[int, int], count: int, seed: int, vehicle: VehicleParams) -> Iterator[Shot]:
    """Shots at 30 Hz from four parts of a mission, the same number from each.

    Args:
        size: (width, height) of the pictures [px].
        count: Number of shots.
        seed: Of textures, clutter and noise.
        vehicle: Positions of tip and camera.

    Yields:
        Shots; between two parts the brush has painted the stretch between them.
    """
    scene = Scene()
    scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=size[0], height=size[1]))
    canvas, rng = Canvas(scene, seed), stream(seed, "bench")
    camera = PlaneCamera(scene, vehicle, canvas, seed)
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    before: tuple[np.ndarray, np.ndarray] | None = None
    brush: tuple[float, float] | None = None
    for k, (along, up, distance, painting) in enumerate(_path(scene, canvas, count)):
        angles = np.radians(_SWAY_DEG) * np.sin(2.0 * math.pi * _SWAY_HZ * k * PERIOD_NS * 1e-9 + phase)
        attitude = np.roll(Rotation.from_euler("ZYX", angles[::-1]).as_quat(), 1)
        rotation = rotation_from_quaternion(attitude)
        y, z = canvas.geometry.point(along, up)
        position = np.array([-distance, y, z]) - rotation @ np.array(vehicle.tip_position_m)
        if painting:
            canvas.stroke(brush, (along, up))
        brush = (along, up) if painting else None
        frame = camera.capture(position, attitude, (k + 1) * PERIOD_NS)
        turn, velocity = np.zeros(3), np.zeros(3)
        if before is not None:
            turn = cv2.Rodrigues(before[1].T @ rotation)[0].ravel() + rng.normal(0.0, _GYRO_RAD, 3)
            velocity = rotation.T @ (position - before[0]) / (PERIOD_NS * 1e-9)
        before = position, rotation
        yield Shot(frame=frame, attitude=attitude, rotation=turn, velocity=velocity)


def _path(scene: Scene, canvas: Canvas, count: int) -> Iterator[tuple[float, float, float, bool]]:
    """Tip's board coordinates (along, up), distance to the board [m], and whether the brush paints, per shot."""
    paint, geometry = scene.paint, canvas.geometry
    left, right = geometry.row_ends
    lower, upper = geometry.row_height(1), geometry.row_height(2)
    step = paint.speed_m_s * PERIOD_NS * 1e-9
    each = max(count // 4, 2)
    for k in range(each):
        yield right - 0.1, lower, _START_M * (1.0 - k / each) + 0.1, False
    middle = 0.5 * (left + right)
    _paint(canvas, (right, lower), (middle, lower))
    for k in range(each):
        yield middle - step * k, lower, 0.0, True
    _paint(canvas, (middle - step * each, lower), (left, lower))
    for k in range(each):
        yield left, lower + (upper - lower) * k / each, 0.0, True
    _paint(canvas, (left, upper), (middle, upper))
    for k in range(count - 3 * each):
        yield middle + step * k, upper, 0.0, True


def _paint(canvas: Canvas, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """One straight stroke."""
    canvas.stroke(None, start)
    canvas.stroke(start, stop)


#: Measured picture sizes; ratios and stages are those of the first.
SIZES = ((640, 480), (424, 240))
#: Pictures before the measurement, so that buffers, tables and caches are warm.
_WARM = 12
#: Smallest number of passes over the real frames of a camera, and of its pictures in all.
_PASSES, _LEAST = 8, 3 * _WARM
#: Stages of a tracked picture, and of a detection from nothing.
_TRACKED, _DETECTION = ("plane", "tracks"), ("plane", "tracks", "detect")
#: Pictures that each rival processes in turn.
_TURN = 10
#: A picture whose stage "detect" takes longer contains a search for lines [ms].
_SEARCH_MS = 0.3

_Seed = tuple[float, float] | None


class _Rivals:
    """Every measured pipeline on pictures of one size and camera."""

    def __init__(self, config: VisionConfig, vehicle: VehicleParams, size: str, suffix: str = "") -> None:
        self._tracker, self._detector = Perception(config, vehicle), Perception(config, vehicle)
        self._config, self._vehicle = config, vehicle
        self._paper: PaperPipeline | None = None
        self._segments = cv2.createLineSegmentDetector() if hasattr(cv2, "createLineSegmentDetector") else None
        names = ("tracked_frame", "detection", "velocity", "whole_frame", "paper", "lsd")
        self.rows = {name: Row(name=name + suffix, size=size) for name in names}
        self.stages: dict[str, list[float]] = {}
        self._count = 0

    def process(self, shots: Iterable[Shot], seeds: Iterable[_Seed] | None = None) -> None:
        """Process pictures with every pipeline, a few at a time each, so that all run warm within one run."""
        pictures = zip(shots, itertools.repeat(None) if seeds is None else seeds, strict=False)
        for few in iter(lambda: list(itertools.islice(pictures, _TURN)), []):
            if self._paper is None:
                self._make_paper(*few[0])
            first, self._count = self._count, self._count + len(few)
            for pipeline in (self._track, self._detect, self._run_paper, self._run_lsd):
                for number, (shot, seed) in enumerate(few, start=first):
                    counted = number >= _WARM
                    rows = self.rows if counted else {name: Row(name=name) for name in self.rows}
                    times = pipeline(rows, shot, seed, number)
                    for name, time_ms in times.items() if counted else ():
                        self.stages.setdefault(name, []).append(1e3 * time_ms)

    def _make_paper(self, shot: Shot, seed: _Seed) -> None:
        layout = PictureLayout(shot.frame, self._config, self._vehicle)
        self._paper = PaperPipeline(mask=layout.mask if seed is None else None)
        (row, column), grid = layout.ladder[0].cells[0], layout.grid
        self._seed = (float(grid.offset + grid.stride * column), float(grid.offset + grid.stride * row))

    def _track(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        place = seed if number == 0 else None
        perceived = rows["whole_frame"].measure(
            lambda: self._tracker.process(
                shot.frame, attitude=shot.attitude, rotation=shot.rotation, velocity=shot.velocity, seed_pixel=place
            )
        )
        times = perceived.time_ms
        searched = bool(perceived.candidates) or times.get("detect", 0.0) > _SEARCH_MS
        if perceived.plane is not None and not searched:
            rows["tracked_frame"].times_us.append(_sum_us(perceived, _TRACKED))
        if perceived.features.velocity is not None:
            rows["velocity"].times_us.append(1e3 * times["flow"])
        return {name: times[name] for name in ("plane", "tracks", "flow") if name in times}

    def _detect(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        self._detector.reset()
        perceived = self._detector.process(
            shot.frame, attitude=shot.attitude, rotation=shot.rotation, detect=True, seed_pixel=seed
        )
        rows["detection"].times_us.append(_sum_us(perceived, _DETECTION))
        return {f"detection_{name}": perceived.time_ms[name] for name in _DETECTION if name in perceived.time_ms}

    def _run_paper(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        paper = self._paper
        assert paper is not None
        found = rows["paper"].measure(lambda: paper.detect(shot.frame, seed or self._seed))
        return {f"paper_{name}": time_ms for name, time_ms in found.time_ms.items()}

    def _run_lsd(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        segments = self._segments
        if segments is not None:
            rows["lsd"].measure(lambda: segments.detect(cv2.cvtColor(shot.frame.rgb, cv2.COLOR_RGB2GRAY)))
        return {}


def _sum_us(perceived: PerceptionResult, stages: Iterable[str]) -> float:
    return 1e3 * sum(perceived.time_ms.get(name, 0.0) for name in stages)


def bench_vision(
    frames: int,
    seed: int,
    real: Path | None,
    progress: Callable[[str], None],
    sizes: tuple[tuple[int, int], ...] = SIZES,
) -> Bench:
    """Measure vision on rendered pictures of a mission and, if given, on a folder of real frames.

    Args:
        frames: Rendered pictures per size, including those that warm up.
        seed: Of the rendered scene.
        real: Folder with a manifest.csv, or None.
        progress: Called with the name of the next measurement.
        sizes: Rendered picture sizes (width, height) [px].

    Returns:
        Rows, medians of the stages and ratios at the first size (real frames if nothing is rendered).

    Raises:
        IbvsQpError: If the folder of real frames cannot be used.
    """
    threads, clock = cv2.getNumThreads(), checks.stage_time
    cv2.setNumThreads(1)
    checks.stage_time = time.thread_time
    try:
        vehicle, paint = VehicleParams(), Scene().paint
        config = VisionConfig(paint_color=paint.color, brush_width_m=paint.brush_width_m)
        measured, found = [], []
        if real is not None:
            progress("real frames")
            found = _measure_real(real, vehicle)  # first: an unusable folder raises at once
        for size in sizes:
            progress(f"rendered {size[0]}x{size[1]}")
            rivals = _Rivals(config, vehicle, f"{size[0]}x{size[1]}")
            rivals.process(mission_shots(size, frames, seed, vehicle))
            measured.append(rivals)
    finally:
        cv2.setNumThreads(threads)
        checks.stage_time = clock
    measured += found
    rows = measured[0].rows
    ratios = {
        "track_vs_paper": rows["paper"].median_us / rows["tracked_frame"].median_us,
        "detect_vs_paper": rows["paper"].median_us / rows["detection"].median_us,
        "detect_vs_lsd": rows["lsd"].median_us / rows["detection"].median_us,
    }
    stages = {name: float(np.median(times)) for name, times in measured[0].stages.items()}
    return Bench(rows=[row for one in measured for row in one.rows.values()], stages_us=stages, ratios=ratios)


def _measure_real(folder: Path, vehicle: VehicleParams) -> list[_Rivals]:
    """Every pipeline on the frames with a seed pixel, camera by camera, in the order of the manifest."""
    by_camera: dict[tuple, list[tuple[Shot, _Seed]]] = {}
    for number, entry in enumerate(read_manifest(folder), start=1):
        if entry.seed is not None:
            shot = _still(entry, number * PERIOD_NS)
            by_camera.setdefault((shot.frame.rgb.shape, entry.intrinsics), []).append((shot, entry.seed))
    measured: dict[str, _Rivals] = {}
    for (shape, _), frames in by_camera.items():
        size = f"{shape[1]}x{shape[0]}"
        rivals = _Rivals(VisionConfig(), vehicle, size, "_real")
        passes = max(_PASSES, math.ceil(_LEAST / len(frames)))
        rivals.process(*zip(*frames * passes, strict=True))
        known = measured.setdefault(size, rivals)
        if known is not rivals:
            for name, row in rivals.rows.items():
                known.rows[name].times_us.extend(row.times_us)
    return list(measured.values())


def _still(entry: FrameEntry, stamp_ns: int) -> Shot:
    """A real frame of a level camera at rest."""
    depth = entry.folder / entry.depth if entry.depth else None
    color = entry.folder / entry.color
    frame = read_frame(color, depth, entry.intrinsics, entry.depth_units_per_metre, stamp_ns)
    level, still = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
    return Shot(frame=frame, attitude=level, rotation=still, velocity=still)
