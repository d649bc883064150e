"""Draws shaded triangles with OpenCV's software rasterizer (OpenCV 5): no GL, no display, the same on every machine."""

from __future__ import annotations

import math

import cv2
import numpy as np

from sim.video.outside_camera import FIELD_DEG, OutsideCamera
from sim.video.triangles import Triangles

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
