"""Camera before a curved wall: the picture before its tangent plane, each pixel moved to where the wall shows it."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.finish import PictureFinish
from sim.sensors.cameras.plane import PlaneCamera
from sim.sensors.cameras.view import View
from sim.world.canvas import Canvas
from sim.world.scene import CameraScene, Scene

#: Distance of the rays that are followed to the wall; the map between them is interpolated [px]. Off by 0.002 px.
NODE_PX = 8
#: Rim of the flat picture beyond the real one [px]: at a radius of 1.5 m a corner moves by 24 px.
RIM_PX = 40


class CurvedCamera:
    """RGB-D camera before a curved board and wall; arguments as for `PlaneCamera`.

    A ray of a pixel meets the wall at a place of its chart. The flat picture, before the tangent plane ahead of the
    camera with the same chart, shows that place at another pixel, from which the colour is taken.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams, canvas: Canvas, seed: int, noise: bool = True) -> None:
        self.vehicle, self._board = vehicle, canvas.geometry
        self._flat = PlaneCamera(
            dataclasses.replace(scene, camera=_with_rim(scene.camera)), vehicle, canvas, seed, noise=False
        )
        self.finish = PictureFinish(scene, vehicle, seed, noise)
        self.intrinsics = self.finish.intrinsics
        height, width = scene.camera.height, scene.camera.width
        self._shape = height, width
        # Nodes start one cell before the picture: OpenCV's resize puts pixel j at node (j + 0.5) / cell - 0.5.
        v, u = (np.mgrid[: height // NODE_PX + 3, : width // NODE_PX + 3] - 0.5) * NODE_PX - 0.5
        fx, fy, cx, cy = self.intrinsics
        self._rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones_like(u)), axis=-1)

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        stamp_ns: int,
        twist: np.ndarray | None = None,
    ) -> RgbdFrame:
        """Take a picture, see `sim.sensors.cameras.protocol.Camera`; the frame owns its arrays."""
        surface, camera = self._board.surface, self.vehicle.camera_position_m
        view = View.of_vehicle(position_ned, quaternion_b_in_i, camera, self.intrinsics)
        place = surface.chart(view.center)
        place[0] = 0.0
        pose = surface.flattened(position_ned, quaternion_b_in_i, place)
        flat = View.of_vehicle(*pose, camera, self._flat.intrinsics)
        common = self.finish.common_error(flat)
        cuts = self._flat.draw(flat, 0.0)
        board, wall = (self._seen(view, flat, place, depth) for depth in (0.0, self._board.scene.board.gap_m))
        along, up = board[..., 3], board[..., 4]
        size = self._board.scene.board
        on_board = (along >= 0.0) & (along <= size.width_m) & (up >= 0.0) & (up <= size.height_m)
        seen = np.where(on_board[..., None], board, wall)
        places = np.ascontiguousarray(seen[..., :2], np.float32)
        rgb = cv2.remap(self._flat.drawn_rgb, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
        inverse = np.ascontiguousarray(seen[..., 2], np.float32) * np.float32(1.0 / (1.0 + common))
        color = self.finish.color(rgb, flat, twist, stamp_ns)
        depth = self.finish.depth(inverse, self._holes(self._flat.finish.mask.shape, places, cuts))
        return RgbdFrame(rgb=color, depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)

    def _seen(self, view: View, flat: View, place: np.ndarray, depth: float) -> np.ndarray:
        """Of every pixel: its place in the flat picture [px], 1/Z [1/m], and (along, up) on the board [m], (H, W, 5).

        ``depth`` is that of the surface behind the board's face [m].
        """
        surface = self._board.surface
        directions = self._rays @ view.rotation
        ways = surface.hit(view.center, directions, place, depth)
        chart = surface.chart(view.center + ways[..., None] * directions)
        along_up = self._board.board_coordinates(chart[..., 1:])
        nodes = np.concatenate((flat.pixels(chart), 1.0 / ways[..., None], along_up), axis=-1)
        height, width = self._shape
        rows, columns = (NODE_PX * count for count in nodes.shape[:2])
        dense = cv2.resize(nodes, (columns, rows), interpolation=cv2.INTER_LINEAR)
        return dense[NODE_PX : NODE_PX + height, NODE_PX : NODE_PX + width]

    def _holes(self, shape: tuple[int, ...], places: np.ndarray, cuts: list) -> list[np.ndarray]:
        """Flat indices of pixels without depth along the outline, from those of the flat picture."""
        flat = [*self.finish.holes(cuts), self._flat.shiny]
        if not any(len(places) for places in flat):
            return []
        mask = np.zeros(shape, np.uint8)
        mask.reshape(-1)[np.concatenate(flat)] = 1
        return [np.flatnonzero(cv2.remap(mask, places, None, cv2.INTER_NEAREST))]  # type: ignore[call-overload]


def _with_rim(camera: CameraScene) -> CameraScene:
    """A camera of the same focal length with a larger picture."""
    height, width = camera.height + 2 * RIM_PX, camera.width + 2 * RIM_PX
    slope = math.tan(0.5 * math.radians(camera.vertical_fov_deg)) * height / camera.height
    return dataclasses.replace(
        camera, height=height, width=width, vertical_fov_deg=2.0 * math.degrees(math.atan(slope))
    )
