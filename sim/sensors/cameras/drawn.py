"""Pictures of board and wall by one pass of machine code over their rows, where there is a C compiler.

`sim.sensors.cameras.plane` and `sim.sensors.cameras.finish` compute the same with OpenCV and numpy, and serve
without a compiler. Both agree to rounding: samples are mixed in 256ths here and in single precision there.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import subprocess
from pathlib import Path

import numpy as np

from ibvs_qp.model.shared_library import compiler, shared_library, wide_registers
from sim.sensors.cameras.arm import shade_propellers
from sim.sensors.cameras.finish import FAR_M, PictureFinish
from sim.sensors.cameras.outline import Box, CutLine

#: The files, in the order in which they are joined.
FILES = ("draw.h", "sheet.c", "rows.c", "picture.c")
#: No contraction of products and sums, so that all processors of one kind agree.
FLAGS = ("-O3", "-fPIC", "-shared", "-ffp-contract=off", "-fno-trapping-math")
#: As in draw.h: lines of an outline, spare columns of a row, bytes of working memory per column.
_MOST_CUTS, _SPARE, _SCRATCH_BYTES = 6, 8, 36
#: Numbers of a sheet and of a cut in a view.
_SHEET, _CUT = 12, 7
_COUNT = 2 * _SHEET + _MOST_CUTS * _CUT

log = logging.getLogger(__name__)


@functools.cache
def native() -> ctypes.CDLL | None:
    """The translated drawing, or None where it cannot be had."""
    command = compiler()
    if command is None:
        return None
    try:
        folder = Path(__file__).with_name("native")
        code = "".join((folder / name).read_text() for name in FILES)
        return ctypes.CDLL(str(shared_library("drawing", code, command, (*FLAGS, *wide_registers()))))
    except (OSError, subprocess.SubprocessError) as error:
        log.warning("pictures are drawn by OpenCV: %s", error)
        return None


class _Camera(ctypes.Structure):
    """``struct camera`` of draw.h."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("rows", "columns", "board_rows", "board_columns", "wall_rows")),
        *((name, ctypes.c_int64) for name in ("wall_columns", "depth_stride", "holes")),
        ("propeller_box", 4 * ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("board", "wall", "plain", "arm", "mask", "propellers", "dimmed")),
        *((name, ctypes.c_void_p) for name in ("arm_inverse", "color_bank", "depth_bank", "no_depth", "widths")),
        *((name, ctypes.c_void_p) for name in ("starts", "runs", "scratch")),
        ("farthest", ctypes.c_double),
    ]


class Drawing:
    """Draws pictures of one camera in front of one board and wall.

    Args:
        draw: ``draw_picture`` of the translated code.
        finish: Vehicle and noise.
        board: Texture of the board, uint8 (h, w, 4), C-contiguous, read at every picture.
        wall: Texture of the wall, likewise.
        plain: Colour where the wall's texture ends, uint8 (4,).
    """

    def __init__(self, draw, finish: PictureFinish, board: np.ndarray, wall: np.ndarray, plain: np.ndarray) -> None:
        self._draw, self.finish, self.board = draw, finish, board
        noise, shape = finish.noise, finish.mask.shape
        height, width = shape
        dimmed = np.arange(256, dtype=np.uint8)[None]
        shade_propellers(dimmed, np.full_like(dimmed, 255))
        self._widths = np.zeros((_MOST_CUTS, max(shape)), np.int64)
        starts, runs = _runs(finish.mask)
        arrays = {
            "board": board,
            "wall": wall,
            "plain": plain,
            "arm": finish.arm,
            "mask": finish.mask,
            "propellers": finish.propellers,
            "dimmed": dimmed,
            "arm_inverse": finish.arm_inverse,
            "color_bank": noise and noise.color,
            "depth_bank": noise and noise.factors,
            "no_depth": finish.no_depth,
            "widths": self._widths,
            "starts": starts,
            "runs": runs,
            "scratch": np.empty(_SCRATCH_BYTES * (width + _SPARE), np.uint8),
        }
        self._kept = arrays
        self._view = np.zeros(_COUNT + 3)
        self._whole = self._view.view(np.int64)
        nothing: Box = (0, 0, 0, 0)
        self._camera = _Camera(
            rows=height,
            columns=width,
            board_rows=board.shape[0],
            board_columns=board.shape[1],
            wall_rows=wall.shape[0],
            wall_columns=wall.shape[1],
            depth_stride=noise.factors.shape[1] if noise else 0,
            holes=len(finish.no_depth),
            propeller_box=finish.propeller_box or nothing,
            farthest=1.0 / FAR_M,
            **{name: _address(array) for name, array in arrays.items()},
        )

    def picture(self, sheets: list[float], cuts: list[CutLine]) -> tuple[np.ndarray, np.ndarray] | None:
        """Colours, uint8 (H, W, 3), and depths [m], float32 (H, W), or None for a view that only OpenCV draws.

        Args:
            sheets: Homography from picture to texture (9 numbers, by rows) and plane (3) of the board, and of the wall.
            cuts: Lines of the board's outline.
        """
        view, whole = self._view, self._whole
        view[: 2 * _SHEET] = sheets
        if len(cuts) > _MOST_CUTS or not np.isfinite(view[: 2 * _SHEET]).all():
            return None
        noise, (height, width) = self.finish.noise, self.finish.mask.shape
        whole[_COUNT] = len(cuts)
        if noise is not None:
            whole[_COUNT + 1] = noise.color_place()
            row, column = noise.factor_place()
            whole[_COUNT + 2] = row * noise.factors.shape[1] + column
        for k, cut in enumerate(cuts):
            at = 2 * _SHEET + k * _CUT
            first, end = cut.extent()
            view[at : at + _CUT - 1] = (*cut.normal.tolist(), cut.offset, cut.flat, first, end)
            whole[at + _CUT - 1] = k * self._widths.shape[1]
            if noise is not None:
                widths = cut.hole_widths(self.finish.rng)
                self._widths[k, : len(widths)] = widths
        rgb, depth = (np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32))
        self._draw(ctypes.byref(self._camera), _address(view), _address(rgb), _address(depth))
        return rgb, depth


def _runs(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Runs of a mask (H, W): index of every row's first, int64 (H + 1,), and their columns [from, to), int64 (n, 2)."""
    edges = np.diff((mask > 0).astype(np.int8), axis=1, prepend=0, append=0)
    rows, first = np.nonzero(edges > 0)
    runs = np.column_stack((first, np.nonzero(edges < 0)[1])).astype(np.int64)
    return np.searchsorted(rows, np.arange(len(mask) + 1)).astype(np.int64), np.ascontiguousarray(runs)


def _address(array: np.ndarray | None) -> ctypes.c_void_p:
    """Where an array lies in memory, NULL without one."""
    if array is None:
        return ctypes.c_void_p(None)
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.__array_interface__["data"][0])
