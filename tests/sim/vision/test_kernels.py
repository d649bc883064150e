"""Kernels of vision: compiled before the first picture, each for the one signature that it declares."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.compilation import KERNELS, prepare
from ibvs_qp.vision.paper import PaperConfig, PaperPerception
from ibvs_qp.vision.picture.camera import RgbdCamera
from ibvs_qp.vision.picture.settings import RgbdCameraSettings
from sim.bench.vision import mission_shots


def _signatures() -> dict[str, int]:
    return {kernel.py_func.__name__: len(kernel.signatures) for kernel, _ in KERNELS}


def _signatures_around_pictures() -> tuple[dict[str, int], dict[str, int]]:
    """Signatures compiled for each kernel before the first picture, and after twenty of every use."""
    prepare()
    before = _signatures()
    vehicle = VehicleParams()
    follows, searches = (Perception(VisionConfig(paint_color=(40, 90, 200)), vehicle) for _ in range(2))
    alone = Perception(VisionConfig(), None)
    published = PaperPerception(PaperConfig(), VisionConfig(), vehicle)
    beside = RgbdCameraSettings(depth_intrinsics=(320.0, 320.0, 211.5, 119.5), depth_translation_m=(0.05, 0.0, 0.0))
    apart = RgbdCamera(beside)
    for number, shot in enumerate(itertools.islice(mission_shots((424, 240), 20, 3, vehicle), 20)):
        for array in (shot.frame.rgb, shot.frame.depth):
            array.setflags(write=number % 2 == 0)
        apart.picture(shot.frame)
        follows.process(shot.frame, attitude=shot.attitude, rotation=shot.rotation, velocity=shot.velocity)
        published.process(shot.frame, rotation=shot.rotation)
        searches.reset()
        searches.process(shot.frame, attitude=shot.attitude, detect=True)
        alone.process(shot.frame, seed_pixel=(100.0, 60.0), velocity=np.zeros(3))
    return before, _signatures()


@pytest.mark.slow
def test_no_picture_waits_for_a_compiler() -> None:
    """An argument of another type (an integer, a picture that must not be written) would compile a kernel in flight.

    In a process of its own: signatures that other tests compiled do not count.
    """
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as process:
        before, after = process.submit(_signatures_around_pictures).result()
    assert set(before.values()) == set(after.values()) == {1}, (before, after)


def test_vision_loads_where_nothing_is_compiled() -> None:
    """NUMBA_DISABLE_JIT=1, to debug, to measure coverage, or on a platform without LLVM."""
    code = (
        "from ibvs_qp.vision.compilation import prepare; import ibvs_qp.vision.perception; prepare(); print('loaded')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True
    )
    assert done.stdout == "loaded\n", done.stderr


_STORED = """
import importlib, sys
sys.path.insert(0, sys.argv[1])
kernel = importlib.import_module("some_kernel").kernel_of_parts
print(kernel(2.0), sum(kernel.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_a_clock_behind_the_files_compiles_once_and_an_edit_compiles_again(tmp_path: Path) -> None:
    """A board without a battery-backed clock starts in the past; the part's own file is not watched by numba."""
    kernel, part = tmp_path / "some_kernel.py", tmp_path / "some_part.py"
    part.write_text("from ibvs_qp.vision.compilation import inner\n\n\n@inner\ndef part(x):\n    return x + 1.0\n")
    kernel.write_text(
        "from ibvs_qp.vision.compilation import kernel\nfrom some_part import part\n\n\n"
        "@kernel('f8(f8)')\ndef kernel_of_parts(x):\n    return part(x)\n"
    )
    for file in (kernel, part):
        os.utime(file, (time.time() + 1e6,) * 2)

    def start() -> str:
        done = subprocess.run([sys.executable, "-B", "-c", _STORED, str(tmp_path)], capture_output=True, text=True)
        return done.stdout.strip() or done.stderr

    assert [start(), start()] == ["3.0 0", "3.0 1"]
    part.write_text(part.read_text().replace("1.0", "5.0"))
    assert start() == "7.0 0"
