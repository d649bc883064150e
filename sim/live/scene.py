"""The three-dimensional picture: vehicle, board and paint, forces and limits, camera, path, and the other law's ghost.

Positions are the simulator's, z up: world NED and body FRD turned half about x (`sim.world.mujoco_frames`).
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import trimesh
import viser
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from allocation.wrench_facets import WrenchFacets
from ibvs_qp.frames import GRAVITY, rotation_from_quaternion, skew
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.quaternion import multiply
from sim.live.camera_picture import picture_of
from sim.live.process import PAINT_PX_M
from sim.live.rows import NEAR_N
from sim.live.site import guarded
from sim.world.board import BoardGeometry
from sim.world.mjcf import build_model
from sim.world.mujoco_frames import FLIP, FLIP_QUATERNION, quaternion_of_axes, rotor_quaternion
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, true_vehicle

#: Length of a drawn newton [m]: of arrows and polytope, and of thrust bars.
FORCE_M_N, THRUST_M_N = 0.02, 0.005
#: Colours (r, g, b): push, friction, thrusts inside their limits and at one, limits, path, ghost, polytope, camera.
_PUSH, _FRICTION, _THRUST, _AT_LIMIT = (205, 40, 40), (230, 150, 20), (40, 150, 70), (220, 40, 40)
_LIMIT, _PATH, _GHOST, _REACH, _CAMERA = (40, 40, 40), (20, 90, 200), (90, 120, 230), (60, 160, 90), (40, 40, 90)
_BLADES = (90, 90, 100, 255), (60, 60, 70, 255)
#: A rotor is turned in one of so many frames: every message is packed for every browser [-].
_EVERY = 3
#: The arrows are drawn this far above the tip, beside the brush [m].
_ABOVE_M = 0.07
#: Turn of a rotor per frame and newton of thrust [rad/N]: slow enough for the frames.
_SPIN = 0.06
#: First view: from behind to the right; direction from the target, and distances that show this radius [m].
_VIEW, _SEEN_M, _FOV = np.array([-0.5, -0.85, 0.35]), 1.1, math.radians(45.0)
#: The wall behind the board is drawn so far beyond its outline [m]; paths lie before the face [m].
_WALL_M, _BEFORE_M = 0.8, 0.004
#: Cells of the wall, of a path, and of a curved board [-].
_CELLS = 24


def turned(quaternion: np.ndarray) -> np.ndarray:
    """Attitude (w, x, y, z) of the body, z up, of one of FRD in NED."""
    return FLIP_QUATERNION * quaternion


class Board:
    """Board, wall and path of the strokes; on a curved wall the board is strips in tangent planes.

    Args:
        server: viser's server.
        scene: The truth.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        geometry, board = BoardGeometry(scene), scene.board
        surface, self._scene, self._strips = geometry.surface, scene, list[viser.ImageHandle]()

        def place(along: Any, up: Any, depth: float) -> np.ndarray:
            spots = geometry.point(along, up)
            return FLIP * surface.points(np.concatenate((np.full((*spots.shape[:-1], 1), depth), spots), axis=-1))

        ways = (np.linspace(-_WALL_M, size + _WALL_M, _CELLS + 1) for size in (board.width_m, board.height_m))
        along, up = (each.ravel() for each in np.meshgrid(*ways))
        corner = np.arange((_CELLS + 1) * _CELLS).reshape(_CELLS, _CELLS + 1)[:, :-1].ravel()
        right, above = corner + 1, corner + _CELLS + 1
        faces = np.concatenate((np.stack((corner, right, above), 1), np.stack((right, above + 1, above), 1)))
        server.scene.add_mesh_simple(
            "/wall", place(along, up, board.gap_m), faces, color=scene.wall.color, side="double", cast_shadow=False
        )
        ends, lines = np.linspace(*geometry.stroke_ends, _CELLS + 1), []
        for stroke in range(1, geometry.strokes + 1):
            spots = geometry.from_pattern(np.column_stack((ends, np.full(len(ends), geometry.stroke_place(stroke)))))
            points = place(spots[:, 0], spots[:, 1], -_BEFORE_M)
            lines.append(np.stack((points[:-1], points[1:]), 1))
        server.scene.add_line_segments("/path", np.concatenate(lines), _PATH, thickness=0.006)
        count = 1 if surface.flat else _CELLS
        self._axis = 0 if scene.surface.axis == "horizontal" else 1
        share = (np.arange(count) + 0.5) / count
        middle, size = np.full(count, 0.5), np.array([board.width_m, board.height_m])
        shares = np.column_stack((share, middle) if self._axis else (middle, 1.0 - share))
        size[1 - self._axis] /= count
        for index, (picture, spot) in enumerate(zip(self._cut(None, count), shares, strict=True)):
            chart = np.array([0.0, *geometry.point(spot[0] * board.width_m, spot[1] * board.height_m)])
            axes = surface.axes(chart) @ np.array([[0.0, *geometry.along], [0.0, *-geometry.up], [1.0, 0.0, 0.0]]).T
            self._strips.append(
                server.scene.add_image(
                    f"/board/{index}", picture, size[0], size[1], wxyz=quaternion_of_axes(FLIP[:, None] * axes),
                    position=FLIP * surface.points(chart), format="jpeg", jpeg_quality=80,
                )
            )  # fmt: skip
        ground = np.array([-3.0, geometry.point(0.5 * board.width_m, 0.0)[0], 0.0])
        ground += (geometry.ground - geometry.down @ ground) * geometry.down
        server.scene.add_grid(
            "/ground", 8.0, 8.0, plane="xy", position=FLIP * ground, cell_size=0.5, shadow_opacity=0.2,
            wxyz=quaternion_of_axes(FLIP[:, None] * geometry.from_ned * FLIP),
        )  # fmt: skip

    def show(self, painted: np.ndarray) -> None:
        """Show the paint, see `board_picture`."""
        for strip, picture in zip(self._strips, self._cut(painted, len(self._strips)), strict=True):
            strip.image = picture

    def _cut(self, painted: np.ndarray | None, count: int) -> list[np.ndarray]:
        return np.array_split(board_picture(self._scene, painted), count, axis=self._axis)


def board_picture(scene: Scene, painted: np.ndarray | None) -> np.ndarray:
    """The board's face, uint8 (h, w, 3), with its paint.

    Args:
        scene: Colours and size.
        painted: Fraction of the paint in 255ths, uint8 (h, w); None for a fresh board.
    """
    size = round(scene.board.height_m * PAINT_PX_M), round(scene.board.width_m * PAINT_PX_M)
    part = np.zeros((*size, 1)) if painted is None else painted[..., None] / 255.0
    colors = np.array(scene.board.color, float), np.array(scene.paint.color, float)
    return ((1.0 - part) * colors[0] + part * colors[1]).astype(np.uint8)


def vehicle_meshes(scene: Scene, vehicle: TrueVehicle) -> tuple[trimesh.Trimesh, list[trimesh.Trimesh]]:
    """Vehicle without its propellers, and one propeller in its rotor's axes per rotor: of the simulator's own model."""
    model, ids = build_model(scene, vehicle)
    bodies = {ids.vehicle}
    for body in range(model.nbody):
        if model.body_parentid[body] in bodies:
            bodies.add(body)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    origin, axes = data.xpos[ids.vehicle], data.xmat[ids.vehicle].reshape(3, 3)
    parts = []
    for geom in range(model.ngeom):
        color, size = model.geom_rgba[geom], model.geom_size[geom]
        if model.geom_bodyid[geom] not in bodies or color[3] < 0.9:
            continue
        kind, pose = mujoco.mjtGeom(int(model.geom_type[geom])), np.eye(4)
        pose[:3, :3] = axes.T @ data.geom_xmat[geom].reshape(3, 3)
        pose[:3, 3] = axes.T @ (data.geom_xpos[geom] - origin)
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            part = trimesh.creation.box(2.0 * size)
        elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
            part = trimesh.creation.cylinder(size[0], 2.0 * size[1], sections=20)
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            part = trimesh.creation.icosphere(2, size[0])
        else:
            continue
        part.apply_transform(pose)
        part.visual = trimesh.visual.ColorVisuals(part, np.round(255.0 * color).astype(np.uint8))
        parts.append(part)
    blades = []
    for index in range(vehicle.geometry.count):
        radius = vehicle.propeller_radius_m
        blade = trimesh.creation.box((2.0 * radius, 0.09 * radius, 0.004))
        blade.visual = trimesh.visual.ColorVisuals(blade, _BLADES[index % 2])
        blades.append(blade)
    whole = trimesh.util.concatenate(parts)
    assert isinstance(whole, trimesh.Trimesh)
    return whole, blades


class ReachPolytope:
    """Forces that the tip can hold against the wall without a moment, in the body's axes.

    Args:
        vehicle: The vehicle flown.
        down: Unit vector of gravity in the world, (3,).
    """

    def __init__(self, vehicle: TrueVehicle, down: np.ndarray) -> None:
        self._down, self._vehicle, self._facets = down, vehicle, WrenchFacets(vehicle.geometry)
        self._wrench = np.vstack((np.eye(3), skew(np.array(vehicle.tip_position_m))))

    def mesh(
        self, quaternion: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Vertices [N], FRD, (v, 3), and faces (f, 3); None where not even hover is attainable."""
        vehicle = self._vehicle
        down = rotation_from_quaternion(quaternion).T @ self._down
        weight = np.concatenate((-vehicle.mass_kg * GRAVITY * down, np.zeros(3)))
        low, high = self._facets.rooms(weight, lower, upper)
        if low.max() >= 0.0 or high.min() <= 0.0:
            return None
        slopes = self._facets.normals @ self._wrench
        planes = np.vstack((np.column_stack((slopes, -high)), np.column_stack((-slopes, low))))
        try:
            points = HalfspaceIntersection(planes, np.zeros(3)).intersections
            hull = ConvexHull(points)
        except QhullError:
            return None
        return points.astype(np.float32), hull.simplices.astype(np.uint32)


class LiveScene:
    """Nodes of the scene, moved frame by frame.

    Args:
        server: viser's server.
        scene: The truth.
        config: Configuration of the vehicle.
        seed: Draws the errors of the vehicle.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene, config: PilotConfig, seed: int) -> None:
        self._server = server
        self._geometry = BoardGeometry(scene)
        self._upwards = FLIP * -self._geometry.down  # a leaning wall turns gravity, not the world
        server.scene.set_up_direction(self._upwards)
        server.scene.configure_default_lights(cast_shadow=False)
        self._board = Board(server, scene)
        vehicle = true_vehicle(scene, config.controller.vehicle, seed)
        body, blades = vehicle_meshes(scene, vehicle)
        add = server.scene
        self._frame = add.add_frame("/vehicle", show_axes=False)
        add.add_mesh_trimesh("/vehicle/body", body)
        geometry, self._rotors = vehicle.geometry, []
        self._hubs = [FLIP * place for place in geometry.positions]
        self._ups = [FLIP * axis for axis in geometry.axes]
        self._turns = [rotor_quaternion(axis).tolist() for axis in geometry.axes]
        for index, blade in enumerate(blades):
            hub = add.add_frame(
                f"/vehicle/rotor_{index}", show_axes=False, wxyz=self._turns[index], position=self._hubs[index]
            )
            add.add_mesh_trimesh(f"/vehicle/rotor_{index}/blade", blade)
            disc = trimesh.creation.cylinder(vehicle.propeller_radius_m, 0.002, sections=32)
            add.add_mesh_simple(
                f"/vehicle/rotor_{index}/disc", disc.vertices, disc.faces, color=(120, 140, 160), opacity=0.25,
                cast_shadow=False,
            )  # fmt: skip
            self._rotors.append(hub)
        self._angles, self._frames = np.zeros(len(blades)), 0
        nowhere = np.zeros((1, 2, 3))
        self._bars = add.add_line_segments("/vehicle/thrusts", nowhere, _THRUST, thickness=0.014)
        self._bar_colors, both = np.zeros(0, np.uint8), np.zeros((2, 2, 3))
        forces = np.array([_PUSH, _FRICTION], np.uint8)
        self._forces = add.add_arrows("/forces", both, forces, shaft_radius=0.008, head_radius=0.02, head_length=0.04)
        self._reach_shape = ReachPolytope(vehicle, self._geometry.down)
        tip = FLIP * vehicle.tip_position_m
        self._reach = add.add_mesh_simple(
            "/vehicle/reach", np.zeros((3, 3)), np.zeros((1, 3), int), color=_REACH, opacity=0.18, side="double",
            position=tip, scale=FORCE_M_N, cast_shadow=False, receive_shadow=False, visible=False,
        )  # fmt: skip
        camera = scene.camera
        looks = quaternion_of_axes(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))
        self._frustum = add.add_camera_frustum(
            "/vehicle/camera", math.radians(camera.vertical_fov_deg), camera.width / camera.height, scale=0.12,
            thickness=0.004, color=_CAMERA, wxyz=looks, position=FLIP * vehicle.camera_position_m,
        )  # fmt: skip
        self._ghost = add.add_frame("/ghost", show_axes=False, visible=False)
        add.add_mesh_simple(
            "/ghost/body", body.vertices, body.faces, color=_GHOST, opacity=0.3, cast_shadow=False, side="double"
        )
        self.show_ghost, self.show_reach = True, False
        self._reach_due = 0
        self._view()

    def _view(self) -> None:
        """The first view: vehicle and board from the side, at any size of the window."""
        tip = self._geometry.surface.points(self._geometry.start_tip)
        target = FLIP * (-0.45, tip[1], tip[2]) + (0.0, 0.0, 0.1)
        self._target = target
        camera = self._server.initial_camera
        camera.fov, camera.look_at, camera.up = _FOV, target, self._upwards
        camera.position = target + _VIEW * (_SEEN_M / math.sin(0.5 * _FOV))

        self._server.on_client_connect(guarded(self.fit))

    def fit(self, client: viser.ClientHandle) -> None:
        """Move a narrow window's camera back until the width of the scene fits."""
        aspect = max(client.camera.aspect, 0.2)
        half = min(0.5 * _FOV, math.atan(math.tan(0.5 * _FOV) * aspect))
        client.camera.position = self._target + _VIEW * (_SEEN_M / math.sin(half))
        client.camera.look_at = self._target

    def show(self, frame: dict[str, Any], places: dict[str, slice]) -> None:
        """Move everything to a frame of the flight."""
        row = frame["row"]
        if row is None:
            return
        part = {name: row[place] for name, place in places.items()}
        with self._server.atomic():
            self._frames += 1
            self._frame.position, self._frame.wxyz = FLIP * part["position"], turned(part["quaternion"])
            self._thrusts(part["thrusts"], part["actual"], *frame["limits"], spins=frame["running"])
            self._arrows(part)
            ghost = frame["ghost"]
            if self._ghost.visible != (shown := ghost is not None and self.show_ghost):
                self._ghost.visible = shown
            if ghost is not None and shown:
                self._ghost.position, self._ghost.wxyz = FLIP * ghost[0], turned(ghost[1])
            if frame.get("paint") is not None:
                self._board.show(frame["paint"])
            if frame.get("picture") is not None:
                self._frustum.image = picture_of(frame["picture"])
                self._polytope(part["quaternion"], *frame["limits"])

    def _polytope(self, quaternion: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
        found = self._reach_shape.mesh(quaternion, lower, upper) if self.show_reach else None
        self._reach.visible = found is not None
        if found is not None:
            self._reach.vertices, self._reach.faces = (FLIP * found[0]).astype(np.float32), found[1]

    def _thrusts(
        self, thrusts: np.ndarray, actual: np.ndarray, lower: np.ndarray, upper: np.ndarray, *, spins: bool
    ) -> None:
        """Bars of the commanded thrusts on the rotors, with ticks at their limits; the rotors turn."""
        points, colors = [], []
        for index, (hub, up) in enumerate(zip(self._hubs, self._ups, strict=True)):
            side = 0.04 * np.cross(up, [1.0, 0.0, 0.0])
            at_limit = min(thrusts[index] - lower[index], upper[index] - thrusts[index]) < NEAR_N
            points.append((hub, hub + THRUST_M_N * thrusts[index] * up))
            colors.append([_AT_LIMIT if at_limit else _THRUST] * 2)
            for bound in (lower[index], upper[index]):
                place = hub + THRUST_M_N * bound * up
                points.append((place - side, place + side))
                colors.append([_LIMIT] * 2)
            if spins:
                self._angles[index] += _SPIN * actual[index] * (1.0 if index % 2 else -1.0)
                if (index + self._frames) % _EVERY:
                    continue
                half = 0.5 * self._angles[index]
                self._rotors[index].wxyz = multiply(self._turns[index], (math.cos(half), 0.0, 0.0, math.sin(half)))
        self._bars.points, painted = np.array(points, np.float32), np.array(colors, np.uint8)
        if not np.array_equal(painted, self._bar_colors):
            self._bar_colors = self._bars.colors = painted

    def _arrows(self, part: dict[str, np.ndarray]) -> None:
        """Push of the tip on the wall, and friction of the wall on the tip."""
        surface, force = self._geometry.surface, float(part["push"][0])
        axes = FLIP[:, None] * surface.axes(part["tip"])
        tip, friction = FLIP * surface.points(part["tip"]) + _ABOVE_M * np.eye(3)[2], axes[:, 1:] @ part["friction"]
        push = force * axes[:, 0]
        ends = [(tip - FORCE_M_N * push, tip), (tip, tip + FORCE_M_N * friction)]
        if self._forces.visible != (shown := force > 0.0):
            self._forces.visible = shown
        if shown:
            self._forces.points = np.array(ends, np.float32)
