"""Board and wall as a MuJoCo scene drawn by its classic renderer, one pass for colour and depth."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import contextlib
from typing import Any

import mujoco
import numpy as np

from sim.sensors.cameras.finish import FAR_M, NEAR_M
from sim.sensors.cameras.gl_context import CameraUnavailable, open_context
from sim.sensors.cameras.view import View
from sim.world.board import BoardGeometry
from sim.world.mjcf import numbers
from sim.world.mujoco_frames import FLIP

#: Half size of the plain wall beyond its picture [m], and how far it lies behind it [m]: below the depth's accuracy.
_PLAIN_M, _BEHIND_M = 100.0, 2e-5
#: Emissive materials: drawn colours equal those of the textures in any light.
_GLOW = 'emission="1" specular="0" shininess="0" reflectance="0" texuniform="false" texrepeat="1 1"'


def _plane_xml(name: str, centre: np.ndarray, right: np.ndarray, up: np.ndarray, half: tuple[float, float]) -> str:
    """A plane that carries the picture ``name``: columns along ``right``, row 0 at the top; world NED."""
    axes = numbers(FLIP * right, FLIP * up)
    return (
        f'<geom type="plane" pos="{numbers(FLIP * centre)}" xyaxes="{axes}" size="{numbers(*half, 1.0)}" '
        f'material="{name}" contype="0" conaffinity="0"/>'
    )


class GlScene:
    """The two textured planes in an OpenGL context of their own.

    Everything here must be called from the thread that made it, or after `close` from nowhere.

    Args:
        geometry: The board.
        size: (width, height) of the pictures [px].
        board: Picture of the board's face, uint8 (h, w, 4), row 0 at the top.
        wall: Picture of the wall, uint8 (h, w, 4).
        wall_origin: World (y, z) of the wall picture's upper left corner [m], (2,).
        wall_pixels_per_m: Resolution of the wall picture [px/m].

    Attributes:
        platform: "egl" or "osmesa".

    Raises:
        CameraUnavailable: When there is no OpenGL, or a picture is larger than it can take.
    """

    def __init__(
        self,
        geometry: BoardGeometry,
        size: tuple[int, int],
        board: np.ndarray,
        wall: np.ndarray,
        wall_origin: np.ndarray,
        wall_pixels_per_m: float,
    ) -> None:
        self._context, self._mjr = None, None
        self._size = size
        model = _compile(geometry, size, board.shape, wall, wall_origin, wall_pixels_per_m)
        self._context, self.platform = open_context(*size)
        try:
            self._open(model, board, wall)
        except CameraUnavailable:
            self.close()
            raise
        except Exception as error:  # a driver too old for the renderer: FatalError, GLError
            self.close()
            raise CameraUnavailable(f"{self.platform} cannot draw the scene: {error}") from None

    def _open(self, model: Any, board: np.ndarray, wall: np.ndarray) -> None:
        from OpenGL import GL

        self._gl = GL
        largest = int(GL.glGetIntegerv(GL.GL_MAX_TEXTURE_SIZE))
        widest = max(*board.shape[:2], *wall.shape[:2])
        if widest > largest:
            raise CameraUnavailable(f"a picture of {widest} px exceeds OpenGL's largest of {largest} px")
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        self._scene = mujoco.MjvScene(model, maxgeom=8)
        every, camera = mujoco.mjtCatBit.mjCAT_ALL, mujoco.MjvCamera()
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, every, self._scene)
        self._scene.flags[:] = 0  # no shadow, reflection, skybox, fog
        self._mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._mjr)
        if self._mjr.currentBuffer != mujoco.mjtFramebuffer.mjFB_OFFSCREEN:
            raise CameraUnavailable("OpenGL offers no off-screen buffer")
        self._mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        width, height = self._size
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._rgb, self._depth = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32)
        self._textures = {name: int(self._mjr.texture[model.texture(name).id]) for name in ("board", "wall")}
        for name, picture in (("board", board), ("wall", wall)):
            self._bind(name)
            # mipmaps would blur painted edges, and repetition would blend opposite rims
            for parameter, value in (
                (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
            ):
                GL.glTexParameteri(GL.GL_TEXTURE_2D, parameter, value)
            self._upload(picture, (0, picture.shape[0], 0, picture.shape[1]))

    def paint(self, board: np.ndarray, box: tuple[int, int, int, int]) -> None:
        """Bring a part of the board's texture up to date.

        Args:
            board: The whole picture, uint8 (h, w, 4).
            box: (row, row end, column, column end) that has changed.
        """
        self._current()
        self._bind("board")
        self._upload(board, box)

    def draw(self, view: View) -> tuple[np.ndarray, np.ndarray]:
        """Draw the scene from a camera pose.

        Returns:
            Colour, uint8 (height, width, 3), and inverse depth [1/m], float32 (height, width), both with the LOWEST
            row first and valid until the next call.
        """
        self._current()
        forward, up = FLIP * (view.rotation.T @ (0.0, 0.0, 1.0)), FLIP * (view.rotation.T @ (0.0, -1.0, 0.0))
        half = 0.5 * NEAR_M * self._size[1] / view.intrinsics[1]
        for camera in self._scene.camera:
            camera.pos, camera.forward, camera.up = FLIP * view.center, forward, up
            camera.frustum_center = camera.frustum_width = 0.0  # as wide as the picture
            camera.frustum_bottom, camera.frustum_top = -half, half
            camera.frustum_near, camera.frustum_far = NEAR_M, FAR_M
        mujoco.mjr_render(self._rectangle, self._scene, self._mjr)
        mujoco.mjr_readPixels(self._rgb, self._depth, self._rectangle, self._mjr)
        # reversed depth d = (1 / Z - 1 / far) / (1 / near - 1 / far)
        np.multiply(self._depth, np.float32(1.0 / NEAR_M - 1.0 / FAR_M), out=self._depth)
        np.add(self._depth, np.float32(1.0 / FAR_M), out=self._depth)
        return self._rgb, self._depth

    def close(self) -> None:
        """Free the renderer and its context; happens by itself when the scene is gone."""
        if self._context is None:
            return
        try:
            if self._mjr is not None:
                self._current()
                self._mjr.free()
        finally:
            self._context.free()
            self._context = self._mjr = None

    def __del__(self) -> None:
        with contextlib.suppress(Exception):  # at the interpreter's end the libraries may be gone
            self.close()

    def _current(self) -> None:
        """Other cameras, or MuJoCo's viewer, may have made their own context current."""
        assert self._context is not None
        self._context.make_current()

    def _bind(self, name: str) -> None:
        self._gl.glBindTexture(self._gl.GL_TEXTURE_2D, self._textures[name])

    def _upload(self, picture: np.ndarray, box: tuple[int, int, int, int]) -> None:
        """Send the box of a picture to the bound texture."""
        gl, (r0, r1, c0, c1) = self._gl, box
        part = np.ascontiguousarray(picture[r0:r1, c0:c1])
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
        gl.glTexSubImage2D(gl.GL_TEXTURE_2D, 0, c0, r0, c1 - c0, r1 - r0, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, part)


def _compile(
    geometry: BoardGeometry,
    size: tuple[int, int],
    board_shape: tuple[int, ...],
    wall: np.ndarray,
    wall_origin: np.ndarray,
    wall_pixels_per_m: float,
) -> Any:
    """The model: board, wall picture, plain wall beyond it."""
    scene, (width, height) = geometry.scene, size
    board = scene.board
    gap = board.gap_m
    along, up = np.append(0.0, geometry.along), np.append(0.0, geometry.up)
    centre = np.append(0.0, geometry.point(0.5 * board.width_m, 0.5 * board.height_m))
    wall_size = np.array(wall.shape[1::-1]) / wall_pixels_per_m
    wall_centre = np.append(gap, wall_origin + 0.5 * wall_size)
    right, above = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])
    behind = wall_centre + np.array([_BEHIND_M, 0.0, 0.0])
    plain = numbers(np.array(scene.wall.color) / 255.0)
    pictures = (("board", board_shape), ("wall", wall.shape))
    textures = "".join(
        f'<texture name="{name}" type="2d" builtin="flat" rgb1="0 0 0" width="{shape[1]}" height="{shape[0]}"/>'
        f'<material name="{name}" texture="{name}" {_GLOW}/>'
        for name, shape in pictures
    )
    return mujoco.MjModel.from_xml_string(f"""<mujoco model="pictures">
  <compiler angle="radian"/>
  <statistic extent="1" center="0 0 0"/>
  <visual>
    <global offwidth="{width}" offheight="{height}"/>
    <quality offsamples="0" shadowsize="0"/>
    <headlight ambient="0 0 0" diffuse="0 0 0" specular="0 0 0"/>
    <map znear="{NEAR_M}" zfar="{FAR_M}"/>
  </visual>
  <asset>{textures}<material name="plain" rgba="{plain} 1" {_GLOW}/></asset>
  <worldbody>
    {_plane_xml("board", centre, along, up, (0.5 * board.width_m, 0.5 * board.height_m))}
    {_plane_xml("wall", wall_centre, right, above, (0.5 * float(wall_size[0]), 0.5 * float(wall_size[1])))}
    {_plane_xml("plain", behind, right, above, (_PLAIN_M, _PLAIN_M))}
  </worldbody>
</mujoco>""")
