"""Shaded triangles of the geoms of a model, and shadows, by OpenCV's software rasterizer (OpenCV 5): no GL needed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import mujoco
import numpy as np

#: Vertical field of view, and direction from the scene to the camera: azimuth from the wall's outward normal to the
#: vehicle's right, and elevation [deg].
FIELD_DEG, AZIMUTH_DEG, ELEVATION_DEG = 32.0, 55.0, 14.0
#: Rounds of centring; halvings of the distance; least distance of a point in front of the camera [m].
_ROUNDS, _HALVINGS, _CLEAR_M = 4, 24, 0.2
#: Fraction of the picture that everything of interest fills [-]; nearest and farthest position from its middle [m].
FILLED, NEAREST_M, FARTHEST_M = 0.92, 1.0, 9.0


@dataclass(frozen=True)
class OutsideCamera:
    """A pinhole camera with upright picture, in MuJoCo's world (x into the wall, y left, z up)."""

    eye: np.ndarray  # position [m], (3,)
    target: np.ndarray  # point on its axis [m], (3,)
    size: tuple[int, int]  # (width, height) of the picture [px]

    @classmethod
    def framing(cls, points: np.ndarray, size: tuple[int, int]) -> OutsideCamera:
        """The nearest camera in the fixed direction that has all points in its picture.

        Args:
            points: Points that must be visible, MuJoCo's world [m], (N, 3).
            size: (width, height) of the picture [px].
        """
        azimuth, elevation = math.radians(AZIMUTH_DEG), math.radians(ELEVATION_DEG)
        away = np.array(
            [-math.cos(azimuth) * math.cos(elevation), -math.sin(azimuth) * math.cos(elevation), math.sin(elevation)]
        )
        target, distance = 0.5 * (points.min(axis=0) + points.max(axis=0)), FARTHEST_M
        for _ in range(_ROUNDS):  # the middle of the picture moves with the distance
            distance = cls._nearest(points, target, away, size)
            camera = cls(target + distance * away, target, size)
            seen, (right, up, _) = camera.project(points), camera.axes
            column, row = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) - 0.5 * np.array(size)
            target = target + (column * right - row * up) * distance / camera.focal_px
        return cls(target + distance * away, target, size)

    @classmethod
    def _nearest(cls, points: np.ndarray, target: np.ndarray, away: np.ndarray, size: tuple[int, int]) -> float:
        """Distance at which the extent of the points in the picture has the target value [m], by bisection."""
        near, far = NEAREST_M, FARTHEST_M
        for _ in range(_HALVINGS):
            distance = 0.5 * (near + far)
            camera = cls(target + distance * away, target, size)
            visible = ((points - camera.eye) @ camera.axes[2]).max() < -_CLEAR_M
            fits = visible and (np.ptp(camera.project(points), axis=0) <= FILLED * np.array(size)).all()
            near, far = (near, distance) if fits else (distance, far)
        return far

    @property
    def focal_px(self) -> float:
        """Focal length [px]."""
        return 0.5 * self.size[1] / math.tan(math.radians(0.5 * FIELD_DEG))

    @cached_property
    def axes(self) -> np.ndarray:
        """Rows right, up and backward in the world, (3, 3): OpenGL's camera."""
        backward = (self.eye - self.target) / np.linalg.norm(self.eye - self.target)
        right = np.cross((0.0, 0.0, 1.0), backward)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(backward, right), backward])

    @property
    def from_world(self) -> np.ndarray:
        """Homogeneous transform of world points into OpenGL's camera, (4, 4)."""
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = self.axes, -self.axes @ self.eye
        return transform

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixel coordinates (column, row) of world points in front of the camera, (N, 2)."""
        right, up, backward = self.axes @ (np.atleast_2d(points) - self.eye).T
        depth = np.maximum(-backward, 1e-6)
        width, height = self.size
        return np.column_stack((0.5 * width + self.focal_px * right / depth, 0.5 * height - self.focal_px * up / depth))


#: Drawn so many times larger and averaged, against jagged edges [-].
OVERSAMPLING = 2
#: Distances between which things are drawn [m].
NEAR_M, FAR_M = 0.2, 60.0
#: Direction in which the light travels, MuJoCo's world; fraction of light from everywhere, and from there [-].
LIGHT = np.array([0.80, -0.30, -0.52]) / np.linalg.norm((0.80, -0.30, -0.52))
AMBIENT, DIFFUSE = 0.52, 0.56


def available() -> bool:
    """Whether this OpenCV can draw triangles."""
    return hasattr(cv2, "triangleRasterize")


def light_on(normals: np.ndarray) -> np.ndarray:
    """Brightness of surfaces with these unit normals [-], (N, 3) to (N,)."""
    return AMBIENT + DIFFUSE * np.maximum(-normals @ LIGHT, 0.0)


class Rasterizer:
    """A colour and a depth buffer under one camera.

    Args:
        camera: Its pose and the size of the picture; the buffers are `OVERSAMPLING` times larger.
    """

    def __init__(self, camera: OutsideCamera) -> None:
        self.camera = camera
        width, height = (OVERSAMPLING * entry for entry in camera.size)
        self.colour = np.zeros((height, width, 3), np.float32)  # red, green, blue 0..1
        self.depth = np.ones((height, width), np.float32)  # OpenGL's, 1 is the far plane
        self._settings = cv2.TriangleRasterizeSettings()  # type: ignore[attr-defined]
        self._settings.setCullingMode(cv2.RASTERIZE_CULLING_CW)  # type: ignore[attr-defined]
        self._settings.setShadingType(cv2.RASTERIZE_SHADING_SHADED)  # type: ignore[attr-defined]
        # the default mode leaves the depth buffer as it is, so nearer surfaces would not cover farther ones
        self._settings.setGlCompatibleMode(cv2.RASTERIZE_COMPAT_INVDEPTH)  # type: ignore[attr-defined]

    def clear(self, colour: np.ndarray) -> None:
        """Begin a picture on a background without depth."""
        np.copyto(self.colour, colour)
        self.depth.fill(1.0)

    def finished(self) -> np.ndarray:
        """The picture at the camera's size, uint8 RGB (height, width, 3)."""
        small = cv2.resize(self.colour, self.camera.size, interpolation=cv2.INTER_AREA)
        return cv2.convertScaleAbs(small, alpha=255.0)

    def draw(self, surface: Triangles, pose: np.ndarray | None = None) -> None:
        """Draw a surface into the buffers, where nothing nearer has been drawn.

        Args:
            surface: Its triangles.
            pose: Homogeneous transform of the surface into the world, (4, 4); None for one that is there already.
        """
        to_camera = self.camera.from_world
        normals = surface.normals
        if pose is not None:
            to_camera, normals = to_camera @ pose, normals @ pose[:3, :3].T
        colours = np.clip(surface.colours * light_on(normals)[:, None], 0.0, 1.0)
        cv2.triangleRasterize(  # type: ignore[attr-defined]
            surface.points.astype(np.float32),
            surface.indices,
            colours.astype(np.float32),
            self.colour,
            self.depth,
            to_camera.astype(np.float32),
            math.radians(FIELD_DEG),
            NEAR_M,
            FAR_M,
            self._settings,
        )


# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false


#: Corners of a round geom's outline, and of a quarter circle of its caps.
_ROUND, _QUARTER = 20, 2


@dataclass(frozen=True)
class Triangles:
    """A surface: V corners, T triangles."""

    points: np.ndarray  # (V, 3) [m]
    normals: np.ndarray  # outward unit normals, (V, 3)
    colours: np.ndarray  # red, green, blue 0..1, (V, 3)
    indices: np.ndarray  # corners of every triangle, int32 (T, 3)

    @classmethod
    def joined(cls, parts: list[Triangles]) -> Triangles:
        """Several surfaces as one."""
        starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
        indices = [part.indices + start for part, start in zip(parts, starts, strict=True)]
        return cls(
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.colours for part in parts]),
            np.concatenate(indices).astype(np.int32),
        )


def geom_triangles(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Triangles | None:
    """Surface of a sphere, capsule, cylinder or box in the world; None for another kind.

    Args:
        model: The model.
        data: Its state with poses of the geoms.
        geom: Index of the geom.
    """
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    kind = kinds(int(model.geom_type[geom]))
    if kind == kinds.mjGEOM_BOX:
        points, normals, indices = _box(size)
    elif kind == kinds.mjGEOM_CYLINDER:
        radius, half = size[:2]
        bottom = [(0, -half, 0, -1), (radius, -half, 0, -1), (radius, -half, 1, 0)]
        points, normals, indices = _revolved([*bottom, (radius, half, 1, 0), (radius, half, 0, 1), (0, half, 0, 1)])
    elif kind in (kinds.mjGEOM_CAPSULE, kinds.mjGEOM_SPHERE):
        radius, half = size[0], (size[1] if kind == kinds.mjGEOM_CAPSULE else 0.0)
        angles = np.linspace(0.0, 0.5 * np.pi, _QUARTER + 1)
        cap = [(radius * np.cos(a), half + radius * np.sin(a), np.cos(a), np.sin(a)) for a in angles]
        points, normals, indices = _revolved([(r, -z, n, -m) for r, z, n, m in reversed(cap)] + cap)
    else:
        return None
    rotation = data.geom_xmat[geom].reshape(3, 3)
    colours = np.tile(model.geom_rgba[geom, :3].astype(float), (len(points), 1))
    return Triangles(points @ rotation.T + data.geom_xpos[geom], normals @ rotation.T, colours, indices)


def _revolved(profile: list[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Surface of revolution about z of a profile of (radius, z, normal's radial part, its z), from below."""
    outline = np.array(profile)
    angles = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    across = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    points, normals = (
        np.concatenate(
            [np.column_stack((across * radial, np.full(_ROUND, axial))) for radial, axial in outline[:, columns]]
        )
        for columns in ((0, 1), (2, 3))
    )
    ring, after = np.arange(_ROUND), (np.arange(_ROUND) + 1) % _ROUND
    indices = []
    for lower in range(len(profile) - 1):
        a, b = lower * _ROUND + ring, lower * _ROUND + after
        c, d = a + _ROUND, b + _ROUND
        indices += [np.column_stack((a, b, d)), np.column_stack((a, d, c))]
    return points, normals, np.concatenate(indices)


def _box(half: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, normals, indices = [], [], []
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    for axis in range(3):
        for side in (-1.0, 1.0):
            face = np.zeros((4, 3))
            face[:, (axis + 1) % 3], face[:, (axis + 2) % 3], face[:, axis] = square[:, 0] * side, square[:, 1], side
            start = 4 * len(points)
            points.append(face * half)
            normals.append(np.tile(side * np.eye(3)[axis], (4, 1)))
            indices += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return np.concatenate(points), np.concatenate(normals), np.array(indices)


#: Darkness of a shadow 0..1, and its softness [px].
_DARKNESS, _SOFT_PX = 0.36, 6


def cast(points: np.ndarray, depth_m: float) -> np.ndarray:
    """Where the light casts points onto the plane x = depth_m of MuJoCo's world [m], (N, 3)."""
    return points + (depth_m - points[:, :1]) / LIGHT[0] * LIGHT


def shadow(rasterizer: Rasterizer, outlines: Sequence[np.ndarray], opacities: Sequence[float]) -> np.ndarray:
    """Soft shadow of convex things whose points were cast onto a plane.

    Args:
        rasterizer: For its camera.
        outlines: Points of every thing on the plane, MuJoCo's world [m], (N, 3); the most opaque last.
        opacities: Of every thing, 0..1.

    Returns:
        Fraction of the light that is gone, float32, at the size of the finished picture.
    """
    width, height = rasterizer.camera.size
    dark = np.zeros((height, width), np.uint8)
    pixels = rasterizer.camera.project(np.concatenate(outlines)).astype(np.float32)
    ends = np.cumsum([len(points) for points in outlines])
    for points, opacity in zip(np.split(pixels, ends[:-1]), opacities, strict=True):
        hull = np.rint(cv2.convexHull(points)).astype(np.int32)
        cv2.fillConvexPoly(dark, hull, round(255 * _DARKNESS * opacity), cv2.LINE_AA)
    soft = cv2.blur(cv2.blur(dark, (_SOFT_PX, _SOFT_PX)), (_SOFT_PX, _SOFT_PX))
    return soft.astype(np.float32) / np.float32(255.0)


def darken(colour: np.ndarray, share: np.ndarray) -> None:
    """Take the light of a shadow from a picture `OVERSAMPLING` times larger, in place."""
    rows, columns = (np.flatnonzero(share.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return
    r0, r1, c0, c1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    light = np.float32(1.0) - share[r0:r1, c0:c1]
    large = cv2.resize(light, None, fx=OVERSAMPLING, fy=OVERSAMPLING)
    colour[OVERSAMPLING * r0 : OVERSAMPLING * r1, OVERSAMPLING * c0 : OVERSAMPLING * c1] *= large[..., None]
