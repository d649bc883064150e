"""Scenes of truth frames, and their random draw by families."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from sim.sensors.cameras.view import View
from sim.sensors.cameras.weathering import Ground
from sim.world.errors import OutdoorErrors
from tests.support.truth.devices import ORBBEC, REALSENSE_D435, Device

#: RGB colours of boards and paints.
LIGHT = ((228, 230, 222), (214, 205, 188), (196, 204, 214))
_DARK = ((52, 56, 62), (70, 48, 44), (38, 60, 56))
PAINTS = ((40, 90, 200), (190, 50, 50), (50, 140, 80), (230, 190, 40))


@dataclass(frozen=True, kw_only=True)
class TruthScene:
    """A board before a wall, seen from one pose.

    The board's coordinates are (right, down) [m] from its middle; it lies in the plane Z = 0 of its own frame, the
    wall `gap_m` behind it.
    """

    size_m: tuple[float, float] = (0.60, 0.40)  # width and height of the board
    gap_m: float = 0.05  # distance of the wall behind the board
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))  # board frame to camera, (3, 3)
    # middle of the board in the camera frame [m], (3,)
    translation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.9]))
    board_color: tuple[int, int, int] = LIGHT[0]  # RGB
    wall_color: tuple[int, int, int] = (150, 112, 92)  # RGB
    wall: str = "brick"  # "brick", "plaster" or "plain"
    # painted bands as (left, top, right, bottom) [m] with their colour
    strokes: tuple[tuple[tuple[float, float, float, float], tuple[int, int, int]], ...] = ()
    prints: int = 0  # number of printed tags along the board's width; 0 for none
    clutter: int = 0  # number of stickers on the board and posters on the wall
    shading: float = 0.15  # relative change of the light across the picture
    noise: float = 2.0  # standard deviation of the colour noise [grey levels]
    blur_px: float = 0.7  # standard deviation of the lens blur [px]
    motion_px: tuple[float, float] = (0.0, 0.0)  # length of the motion blur and its direction (right, down) [px]
    depth_noise: float = 0.005  # white, and again correlated, depth noise, fraction of depth
    smear_px: float = 0.0  # largest outward shift of a depth step by the depth camera [px]
    arm: bool = False  # whether arm and brush of the vehicle are in view
    camera: tuple[int, int, float] = (640, 480, 610.0)  # (width, height, focal length) [px]
    device: Device | None = None  # the real camera that takes the pictures; None for an ideal, registered one
    # velocity [m/s] and angular velocity [rad/s] of the camera in its axes, for the rows of the device's shutter
    twist: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    outdoor: OutdoorErrors = field(default_factory=OutdoorErrors)  # light, weather, wet paint and lens
    seed: int = 0  # of textures, clutter and noise

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """(fx, fy, cx, cy) [px], pixel centres at integers."""
        width, height, focal = self.camera
        return focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)

    @property
    def corners(self) -> np.ndarray:
        """Corners of the board in order (right, down) [m], (4, 2)."""
        return 0.5 * np.array(self.size_m) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]

    @property
    def view(self) -> View:
        """The same pose for the cameras of flights: x into the wall, y right and z down from the board's middle."""
        turn = self.rotation[:, [2, 0, 1]]
        return View(turn, -turn.T @ self.translation, self.intrinsics)

    @property
    def ground(self) -> Ground:
        """The board in these coordinates; its paint is that of the first stroke."""
        paint = self.strokes[0][1] if self.strokes else PAINTS[self.seed % len(PAINTS)]
        right, down = np.eye(2)
        return Ground(self.corners[0], right, down, self.size_m, paint, self.wall_color)

    def edge_planes(self, corners: np.ndarray) -> list[np.ndarray]:
        """Interpretation planes (a, b, c) of a polygon's edges, its inside on their positive side."""
        rays = corners @ self.rotation[:, :2].T + self.translation
        return [np.cross(first, second) for first, second in zip(rays, np.roll(rays, -1, axis=0), strict=True)]


@dataclass(frozen=True, kw_only=True)
class Variation:
    """Ranges of the scenes of a family; angles in degrees, uniform, both signs."""

    distance_m: tuple[float, float] = (0.7, 1.2)
    roll: float = 4.0
    yaw: float = 6.0
    tilt: float = 3.5
    shift_m: float = 0.06
    base: TruthScene = field(default_factory=TruthScene)
    dark: bool = False
    strokes: int = 1


#: Slow flight along the board before a device with a rolling shutter: 0.6 px of slant over the picture.
_DRIFT = (0.02, 0.01, 0.0, 0.0, 0.01, 0.0)
#: Families of scenes: a board 5 cm and 1.2 m before a brick wall, 2 cm before plaster near the camera, 1.5 cm
#: before brick (too near for depth), dark on light, turned and oblique, printed, moving, smeared as by real depth
#: cameras, hard: faint, noisy, 1.5 cm before the wall, with undetectable edges and low confidence; and of real devices,
#: from their raw pictures.
FAMILIES = {
    "near wall": Variation(),
    "far wall": Variation(base=TruthScene(gap_m=1.2)),
    "flush wall": Variation(
        distance_m=(0.45, 0.6), shift_m=0.02, base=TruthScene(gap_m=0.02, size_m=(0.32, 0.24), wall="plaster")
    ),
    "thin board": Variation(base=TruthScene(gap_m=0.015)),
    "dark board": Variation(dark=True, base=TruthScene(wall="plaster", wall_color=(205, 200, 190))),
    "oblique": Variation(roll=25.0, yaw=32.0, tilt=20.0, distance_m=(0.75, 1.1)),
    "printed": Variation(yaw=25.0, strokes=0, base=TruthScene(prints=4, gap_m=0.8, size_m=(0.55, 0.42))),
    "cluttered": Variation(base=TruthScene(clutter=6)),
    "moving": Variation(base=TruthScene(motion_px=(3.0, 2.0), noise=3.0)),
    "smeared depth": Variation(yaw=20.0, base=TruthScene(gap_m=0.6, smear_px=14.0, depth_noise=0.006, prints=4)),
    "hard": Variation(
        yaw=25.0,
        strokes=2,
        base=TruthScene(
            gap_m=0.015,
            wall="plaster",
            wall_color=(186, 182, 176),
            clutter=8,
            noise=5.0,
            blur_px=1.5,
            motion_px=(5.0, 3.0),
            depth_noise=0.008,
            smear_px=8.0,
        ),
    ),
    "small picture": Variation(base=TruthScene(camera=(424, 240, 312.6), gap_m=0.05)),
    "realsense_d435": Variation(base=TruthScene(gap_m=0.15, device=REALSENSE_D435, twist=_DRIFT)),
    "orbbec": Variation(base=TruthScene(gap_m=0.15, camera=(640, 480, 554.0), device=ORBBEC, twist=_DRIFT)),
}


def turned(roll: float, yaw: float, tilt: float) -> np.ndarray:
    """Board frame to camera for a board rolled, yawed and tilted by angles [rad], (3, 3)."""
    parts = (np.array([0.0, 0.0, roll]), np.array([0.0, yaw, 0.0]), np.array([tilt, 0.0, 0.0]))
    rotation = np.eye(3)
    for part in parts:
        rotation = rotation @ cv2.Rodrigues(part)[0]
    return rotation


def sample_scene(variation: Variation, seed: int) -> TruthScene:
    """One scene of a family; the same seed gives the same scene."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x7472]))
    roll, yaw, tilt = np.radians(rng.uniform(-1.0, 1.0, 3) * (variation.roll, variation.yaw, variation.tilt))
    distance = float(rng.uniform(*variation.distance_m))
    shift = rng.uniform(-1.0, 1.0, 2) * variation.shift_m
    board = (_DARK if variation.dark else LIGHT)[rng.integers(3)]
    strokes = []
    for _ in range(variation.strokes):
        width, height = variation.base.size_m
        top = float(rng.uniform(-0.25, 0.25)) * height
        left, right = (float(entry) * width for entry in (rng.uniform(-0.45, -0.2), rng.uniform(0.2, 0.45)))
        strokes.append(((left, top, right, top + 0.16 * height), PAINTS[rng.integers(len(PAINTS))]))
    motion = tuple(float(entry) for entry in np.array(variation.base.motion_px) * rng.choice([-1.0, 1.0], 2))
    return replace(
        variation.base,
        rotation=turned(float(roll), float(yaw), float(tilt)),
        translation=np.array([*shift, distance]),
        board_color=board,
        strokes=tuple(strokes),
        motion_px=(motion[0], motion[1]),
        shading=float(rng.uniform(0.0, 0.3)),
        seed=seed,
    )
