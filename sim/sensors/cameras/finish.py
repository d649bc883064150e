"""Common last stage of every camera back end: vehicle, lens blur, noise, depth holes, and a real camera's errors."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras.arm import clip_near, shade_propellers, vehicle_layer
from sim.sensors.cameras.defects import CameraDefects
from sim.sensors.cameras.noise import NoiseBank
from sim.sensors.cameras.outdoor import Outdoor
from sim.sensors.cameras.outline import Box, CutLine, cut_lines
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.sensors.cameras.view import View, board_steps
from sim.sensors.cameras.weathering import Ground
from sim.world.board import BoardGeometry
from sim.world.canvas import TEXTURE_PAD_PX, Canvas
from sim.world.errors import OutdoorErrors
from sim.world.random_streams import stream
from sim.world.scene import Scene

#: Least depth drawn, and largest depth with a reading [m].
NEAR_M, FAR_M = 0.05, 20.0


class PictureFinish:
    """Turns drawn colours and inverse depths into those of the camera; the same noise of one seed for all back ends.

    For one picture call `common_error`, `color` and `depth`, in this order: each draws from one generator.

    Args:
        scene: Camera, paint and errors.
        vehicle: Where camera, arm and propellers are.
        seed: Seed of the noise.
        noise: Whether to add colour and depth noise and depth holes.

    Attributes:
        intrinsics: (fx, fy, cx, cy) [px].
        defects: Errors of a real camera.
        outdoor: Light, weather and lens outside, or None.
        propeller_box: (row, row end, column, column end) around the propellers visible in the colours, or None.
        arm_box: The same around arm and brush, or None; ``depth_box`` is theirs in the depth.
        arm: Colours of arm and brush, uint8 (H, W, 3), under the mask.
        arm_inverse: Their inverse depths [1/m], float32 (H, W).
        mask: 255 where arm or brush hide the scene in the colours, uint8 (H, W); ``depth_mask`` is that of the depth.
        propellers: 255 where a propeller lies before the scene, uint8 (H, W).
        no_depth: Flat indices of pixels without depth in every picture.
        noise: Banks of noise, or None.
        rng: Source of the ragged holes.
    """

    def __init__(self, scene: Scene, vehicle: VehicleParams, seed: int, noise: bool) -> None:
        self.intrinsics = camera_intrinsics(scene.camera)
        bank, ragged = np.random.SeedSequence([seed, 0xCA3E]).spawn(2)
        self.rng = np.random.default_rng(ragged)
        shape = (scene.camera.height, scene.camera.width)
        relative = scene.camera.depth_noise_relative
        self.noise = NoiseBank(shape, relative, np.random.default_rng(bank)) if noise else None
        if self.noise and scene.errors.depth.noise_relative:
            self.noise.add_white_depth(scene.errors.depth.noise_relative, stream(seed, "depth noise"))
        self.defects = CameraDefects(scene, vehicle, self.intrinsics, seed)
        self.outdoor = None
        if (outdoor := scene.errors.outdoor.drawn(stream(seed, "outdoor effects"))) != OutdoorErrors():
            self.outdoor = Outdoor(outdoor, Ground.of(BoardGeometry(scene)), vehicle, shape, seed)
        layer = vehicle_layer(scene, vehicle, self.intrinsics, self.rng)
        seen, grown = self.defects.layer(layer), self.defects.depth.grown
        self.arm_box, self.propeller_box = _bounding_box(seen.mask), _bounding_box(seen.propellers)
        self.arm, self.mask, self.propellers = np.ascontiguousarray(seen.picture[..., :3]), seen.mask, seen.propellers
        self.arm_inverse, self.depth_mask, self.depth_box = layer.inverse_depth, layer.mask, _bounding_box(layer.mask)
        self._hides = grown(layer.mask)
        self.no_depth = np.flatnonzero((grown(layer.holes) | layer.propellers) & ~self._hides)
        self._soft, self._ones = np.empty((*shape, 3), np.uint8), np.ones(shape, np.float32)

    def common_error(self, view: View) -> float:
        """Depth error common to one picture, relative to the depth at its centre."""
        return self.noise.depth_common() * float(view.plane(0.0)[2]) if self.noise else 0.0

    def outline(self, view: View, corners: np.ndarray) -> tuple[list[CutLine], Box | None]:
        """Lines along which the board's outline, corners (4, 3) in the world, cuts the picture, and the board's box."""
        polygon = view.to_camera(corners)
        if polygon[:, 2].min() < NEAR_M:
            polygon = clip_near(polygon, NEAR_M)
        fx, fy, cx, cy = self.intrinsics
        height, width = self.mask.shape
        return cut_lines(polygon[:, :2] / polygon[:, 2:] * (fx, fy) + (cx, cy), width, height)

    def go_outside(self, rgb: np.ndarray, view: View, canvas: Canvas) -> np.ndarray:
        """Put surface and light outside into a drawn picture, uint8 (H, W, 3), in place.

        Args:
            rgb: Board and wall.
            view: Pose of the camera.
            canvas: The painted board.

        Returns:
            Flat indices of the pixels that wet paint leaves without depth.
        """
        if self.outdoor is None:
            return np.zeros(0, np.intp)
        painted = None
        if self.outdoor.needs_paint:
            coverage = canvas.painted
            steps = board_steps(canvas.geometry, canvas.pixels_per_m, TEXTURE_PAD_PX)
            size = rgb.shape[1::-1]
            painted = cv2.warpPerspective(coverage, view.from_texture(*steps), size) / np.float32(255.0)
        rgb[:] = np.clip(np.rint(self.outdoor.scene(rgb, view, painted)), 0.0, 255.0)
        return self.outdoor.holes(painted)

    def color(self, rgb: np.ndarray, view: View, twist: np.ndarray | None, stamp_ns: int) -> np.ndarray:
        """A new picture from a drawn one: vehicle, lens blur, sensor noise.

        Args:
            rgb: The drawn one, uint8 (H, W, 3), which may be overwritten.
            view: Pose at the stamp.
            twist: Velocity of the body's origin [m/s] and angular velocity [rad/s] in B, (6,), or None at rest.
            stamp_ns: Time of the middle row.
        """
        rgb = self.defects.moved(rgb, view.plane(0.0), twist)
        if self.propeller_box is not None:
            r0, r1, c0, c1 = self.propeller_box
            shade_propellers(rgb[r0:r1, c0:c1], self.propellers[r0:r1, c0:c1])
        if self.arm_box is not None:
            r0, r1, c0, c1 = self.arm_box
            cv2.copyTo(self.arm[r0:r1, c0:c1], self.mask[r0:r1, c0:c1], rgb[r0:r1, c0:c1])
        self.defects.expose(rgb, stamp_ns, self._soft)
        if self.outdoor is not None:
            self._soft[:] = self.outdoor.lens(self._soft)
        return self.noise.add_color(self._soft) if self.noise else self._soft.copy()

    def holes(self, cuts: list[CutLine]) -> list[np.ndarray]:
        """Flat indices of pixels without depth along each line of the outline; none without noise."""
        return [cut.holes(self.rng, self.defects.depth.growth_px) for cut in cuts] if self.noise else []

    def depth(self, inverse: np.ndarray, holes: list[np.ndarray]) -> np.ndarray:
        """Depth [m] from drawn inverse depths (H, W), which the vehicle overwrites: noise, and holes along steps."""
        depth = np.empty(inverse.shape, np.float32)
        farthest = 1.0 / FAR_M
        if inverse[:: len(inverse) - 1, :: inverse.shape[1] - 1].min() < farthest:  # only when a horizon comes near
            np.maximum(inverse, np.float32(farthest), out=inverse)
        if self.depth_box is not None:  # the vehicle takes no part in the scene's common error
            r0, r1, c0, c1 = self.depth_box
            cv2.copyTo(self.arm_inverse[r0:r1, c0:c1], self.depth_mask[r0:r1, c0:c1], inverse[r0:r1, c0:c1])
        defects = self.defects.depth
        defects.fatten(inverse)
        defects.measure(self.noise.depth_factor() if self.noise else self._ones, inverse, depth)
        if self.noise is not None:
            flat, hidden = depth.reshape(-1), self._hides.reshape(-1)
            for places in holes:
                flat[places[hidden.take(places) == 0]] = 0.0  # arm and brush hide the step
            flat[self.no_depth] = 0.0
        return defects.placed(depth)


def _bounding_box(mask: np.ndarray) -> Box | None:
    if not mask.any():
        return None
    left, top, width, height = cv2.boundingRect(mask)
    return top, top + height, left, left + width
