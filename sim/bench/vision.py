"""What vision costs: tracked picture, detection, velocity, beside the paper's pipeline and cv2's LSD, one thread."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Percept, Perception, VisionConfig, checks
from ibvs_qp.vision.layout import PictureLayout
from ibvs_qp.vision.paper import PaperPipeline
from sim.bench.mission import Shot, mission_shots
from sim.bench.real_frames import real_frames
from sim.bench.timing import Bench, Row
from sim.world.scene import Scene

#: Picture sizes measured; the ratios and stages are those of the first.
SIZES = ((640, 480), (424, 240))
#: Pictures seen before any is timed: buffers, tables and caches are warm then.
_WARM = 12
#: Times each real frame is seen at least, and real pictures seen in all at least.
_REPEATS, _LEAST = 8, 3 * _WARM
#: What a tracked picture consists of, and a detection from nothing.
_TRACKED, _DETECTION = ("plane", "tracks"), ("plane", "tracks", "detect")

#: Pictures that each rival sees in turn.
_TURN = 10
#: A search for lines takes longer than this, the decision against one does not [ms].
_SEARCH_MS = 0.3

_Seed = tuple[float, float] | None
Progress = Callable[[str], None]


class _Rivals:
    """All that is measured on pictures of one size and camera."""

    def __init__(self, config: VisionConfig, vehicle: VehicleParams, size: str, suffix: str = "") -> None:
        self._tracker, self._detector = Perception(config, vehicle), Perception(config, vehicle)
        self._config, self._vehicle = config, vehicle
        self._paper: PaperPipeline | None = None
        self._segments = cv2.createLineSegmentDetector() if hasattr(cv2, "createLineSegmentDetector") else None
        names = ("tracked_frame", "detection", "velocity", "whole_frame", "paper", "lsd")
        self.rows = {name: Row(name=name + suffix, size=size) for name in names}
        self.stages: dict[str, list[float]] = {}
        self._seen = 0

    def see(self, shots: Iterable[Shot], seeds: Iterable[_Seed] | None = None) -> None:
        """Have all rivals see pictures, a few at a time each: every one finds its code and tables warm, in one run."""
        pictures = zip(shots, itertools.repeat(None) if seeds is None else seeds, strict=False)
        for few in iter(lambda: list(itertools.islice(pictures, _TURN)), []):
            self._prepare(*few[0])
            first, self._seen = self._seen, self._seen + len(few)
            for see in (self._see_tracker, self._see_detector, self._see_paper, self._see_segments):
                for number, (shot, seed) in enumerate(few, start=first):
                    counted = number >= _WARM
                    rows = self.rows if counted else {name: Row(name=name) for name in self.rows}
                    times = see(rows, shot, seed, number)
                    for name, time_ms in times.items() if counted else ():
                        self.stages.setdefault(name, []).append(1e3 * time_ms)

    def _prepare(self, shot: Shot, seed: tuple[float, float] | None) -> None:
        if self._paper is None:
            layout = PictureLayout(shot.frame, self._config, self._vehicle)
            self._paper = PaperPipeline(mask=layout.mask if seed is None else None)
            (row, column), grid = layout.seeds[0], layout.grid
            self._seed = (float(grid.offset + grid.stride * column), float(grid.offset + grid.stride * row))

    def _see_tracker(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        place = seed if number == 0 else None
        percept = rows["whole_frame"].measure(
            lambda: self._tracker.process(
                shot.frame, attitude=shot.attitude, rotation=shot.rotation, velocity=shot.velocity, seed_pixel=place
            )
        )
        times = percept.time_ms
        searched = bool(percept.candidates) or times.get("detect", 0.0) > _SEARCH_MS
        if percept.plane is not None and not searched:
            rows["tracked_frame"].times_us.append(_sum_us(percept, _TRACKED))
        if percept.features.velocity is not None:
            rows["velocity"].times_us.append(1e3 * times["flow"])
        return {name: times[name] for name in ("plane", "tracks", "flow") if name in times}

    def _see_detector(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        self._detector.reset()
        percept = self._detector.process(shot.frame, attitude=shot.attitude, detect=True, seed_pixel=seed)
        rows["detection"].times_us.append(_sum_us(percept, _DETECTION))
        return {f"detection_{name}": percept.time_ms[name] for name in _DETECTION if name in percept.time_ms}

    def _see_paper(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        paper = self._paper
        assert paper is not None
        found = rows["paper"].measure(lambda: paper.detect(shot.frame, seed or self._seed))
        return {f"paper_{name}": time_ms for name, time_ms in found.time_ms.items()}

    def _see_segments(self, rows: dict[str, Row], shot: Shot, seed: _Seed, number: int) -> dict[str, float]:
        segments = self._segments
        if segments is not None:
            rows["lsd"].measure(lambda: segments.detect(cv2.cvtColor(shot.frame.rgb, cv2.COLOR_RGB2GRAY)))
        return {}

    def ratio(self, rival: str, ours: str) -> float:
        """Median of a rival to the median of ours."""
        return self.rows[rival].median_us / self.rows[ours].median_us


def _sum_us(percept: Percept, stages: Iterable[str]) -> float:
    return 1e3 * sum(percept.time_ms.get(name, 0.0) for name in stages)


def bench_vision(
    frames: int,
    seed: int,
    real: Path | None,
    progress: Progress,
    sizes: tuple[tuple[int, int], ...] = SIZES,
) -> Bench:
    """Measure vision on rendered pictures of a mission, and on real ones where there is a folder of them.

    Args:
        frames: Rendered pictures per size, those that warm up included.
        seed: Of the rendered scene.
        real: Folder with a manifest.csv, or None.
        progress: Told what is measured.
        sizes: Rendered picture sizes (width, height) [px].

    Returns:
        Rows, the stages' medians and the ratios at the first size (real frames, where none is rendered).

    Raises:
        IbvsQpError: When the folder of real frames cannot be used.
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
            found = _see_real(real, vehicle)  # first, so that a folder that cannot be used is refused at once
        for size in sizes:
            progress(f"rendered {size[0]}x{size[1]}")
            rivals = _Rivals(config, vehicle, f"{size[0]}x{size[1]}")
            rivals.see(mission_shots(size, frames, seed, vehicle))
            measured.append(rivals)
    finally:
        cv2.setNumThreads(threads)
        checks.stage_time = clock
    measured += found
    first = measured[0]
    ratios = {
        "track_vs_paper": first.ratio("paper", "tracked_frame"),
        "detect_vs_paper": first.ratio("paper", "detection"),
        "detect_vs_lsd": first.ratio("lsd", "detection"),
    }
    stages = {name: float(np.median(times)) for name, times in first.stages.items()}
    return Bench(rows=[row for one in measured for row in one.rows.values()], stages_us=stages, ratios=ratios)


def _see_real(folder: Path, vehicle: VehicleParams) -> list[_Rivals]:
    """All rivals on real frames, each camera by itself; frames of one camera follow each other as they are listed."""
    by_camera: dict[tuple, list[tuple[RgbdFrame, tuple[float, float]]]] = {}
    for frame, seed in real_frames(folder):
        by_camera.setdefault((frame.rgb.shape, frame.intrinsics), []).append((frame, seed))
    measured: dict[str, _Rivals] = {}
    level, still = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
    for (shape, _), frames in by_camera.items():
        size = f"{shape[1]}x{shape[0]}"
        rivals = _Rivals(VisionConfig(), vehicle, size, "_real")
        shots = [Shot(frame=frame, attitude=level, rotation=still, velocity=still) for frame, _ in frames]
        times = max(_REPEATS, math.ceil(_LEAST / len(frames)))
        rivals.see(shots * times, [seed for _, seed in frames] * times)
        known = measured.setdefault(size, rivals)
        if known is not rivals:
            for name, row in rivals.rows.items():
                known.rows[name].times_us.extend(row.times_us)
    return list(measured.values())
