"""Live view of a flight in MuJoCo's window, at real time, with the fresh paint."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import os
import sys
import threading
import time
import warnings
from typing import TYPE_CHECKING

import numpy as np

from ibvs_qp.config.errors import IbvsQpError
from sim.world.mujoco_frames import FLIP

if TYPE_CHECKING:
    from sim.world.plant import Plant

#: Pictures of the window per simulated second.
_RATE_HZ = 50.0
#: A dab of paint: spacing, half thickness, and distance in front of the board's face [m].
_DAB_STEP_M, _DAB_HALF_M, _DAB_LIFT_M = 0.01, 2e-4, 5e-4
#: View of the window: target from the board's middle (NED) [m], distance [m], and angles [deg].
_ASIDE_M, _DISTANCE_M, _AZIMUTH_DEG, _ELEVATION_DEG = (-0.45, 0.0, 0.2), 2.4, 35.0, -18.0
#: Longest wait for the window to close [s].
_CLOSE_S = 5.0
#: Headlight of the window, brighter than the model's default [-].
_AMBIENT, _DIFFUSE = 0.55, 0.45


class NoDisplay(IbvsQpError):
    """There is no display to open a window on."""


def check_display() -> None:
    """Raise if no window can be opened.

    Raises:
        NoDisplay: When there is no display, or it does not answer.
    """
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplay("--view needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set")
    try:
        import glfw

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            answers = glfw.init()
    except Exception as error:
        raise NoDisplay(f"--view cannot load the window library ({error})") from None
    if not answers:
        name = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or "the display"
        raise NoDisplay(f"--view: display {name} does not answer")


class FlightViewer:
    """A passive window: it displays the plant and does not change it.

    Args:
        plant: The plant shown.
        target_ned: Middle of the board, world NED [m], (3,).

    Raises:
        NoDisplay: When no window can be opened.
    """

    def __init__(self, plant: Plant, target_ned: np.ndarray) -> None:
        import mujoco.viewer

        self._plant, self._mujoco = plant, mujoco
        paint = plant.scene.paint
        self._color = np.append(np.array(paint.color, np.float32) / np.float32(255.0), np.float32(1.0))
        self._size = np.array([0.5 * paint.brush_width_m, 0.5 * paint.brush_width_m, _DAB_HALF_M])
        # discs lie in the wall plane: their axis is world x
        self._axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).ravel()
        self._next_s = 0.0
        self._dab: np.ndarray | None = None
        light = plant.model.vis.headlight
        light.ambient[:], light.diffuse[:] = _AMBIENT, _DIFFUSE
        before = set(threading.enumerate())
        try:
            self._window = mujoco.viewer.launch_passive(
                plant.model, plant.data, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:  # macOS needs the interpreter mjpython
            raise NoDisplay(f"--view: {error}") from None
        self._threads = set(threading.enumerate()) - before
        with self._window.lock():
            camera = self._window.cam
            camera.lookat[:] = FLIP * (target_ned + np.array(_ASIDE_M))
            camera.distance, camera.azimuth, camera.elevation = _DISTANCE_M, _AZIMUTH_DEG, _ELEVATION_DEG
        self._started = time.perf_counter()

    def show(self, pressing: bool) -> None:
        """Show the plant after a tick; sleeps while the flight is ahead of real time. Does nothing once closed.

        Args:
            pressing: Whether the brush leaves paint.
        """
        now = self._plant.time_ns * 1e-9
        if now < self._next_s or not self._window.is_running():
            return
        self._next_s = now + 1.0 / _RATE_HZ
        if pressing:
            self._paint()
        self._window.sync()
        ahead = now - (time.perf_counter() - self._started)
        if ahead > 0.0:
            time.sleep(ahead)

    def close(self) -> None:
        """Close the window."""
        self._window.close()
        for thread in self._threads:  # a thread that draws while the interpreter ends would crash it
            thread.join(_CLOSE_S)

    def _paint(self) -> None:
        place = FLIP * np.array([-_DAB_LIFT_M, *self._plant.tip[1:]])
        if self._dab is not None and np.linalg.norm(place - self._dab) < _DAB_STEP_M:
            return
        with self._window.lock():
            scene = self._window.user_scn
            if scene is None or scene.ngeom >= scene.maxgeom:
                return
            kind = self._mujoco.mjtGeom.mjGEOM_CYLINDER
            self._mujoco.mjv_initGeom(scene.geoms[scene.ngeom], kind, self._size, place, self._axes, self._color)
            scene.ngeom += 1
        self._dab = place
