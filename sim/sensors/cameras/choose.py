"""Choice of the camera back end: the requested one, or the plane camera where there is no OpenGL."""

from __future__ import annotations

from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras.curved import CurvedCamera
from sim.sensors.cameras.gl_context import CameraUnavailable, open_context
from sim.sensors.cameras.plane import PlaneCamera
from sim.sensors.cameras.protocol import Camera
from sim.world.canvas import Canvas
from sim.world.scene import Scene

#: Values of the option: plane needs no OpenGL; gl and auto use OpenGL where there is one.
BACK_ENDS = ("plane", "gl", "auto")
#: Picture size of the test context [px].
_TRIAL_PX = 64


def resolve_camera(option: str) -> tuple[str, str | None]:
    """Back end that an option selects on this machine.

    Args:
        option: One of `BACK_ENDS`.

    Returns:
        "plane" or "gl", and a line for the user where that differs from the option.
    """
    if option == "plane":
        return "plane", None
    try:
        context, _ = open_context(_TRIAL_PX, _TRIAL_PX)
    except CameraUnavailable as reason:
        return "plane", f"--camera {option}: {reason}; flying with plane"
    context.free()
    return "gl", None


def open_camera(option: str, scene: Scene, vehicle: VehicleParams, canvas: Canvas, seed: int) -> Camera:
    """The camera of a flight.

    Args:
        option: "plane" or "gl"; "auto" takes gl where it works.
        scene: Board, wall and camera.
        vehicle: Where camera and arm are.
        canvas: The painted board and the wall.
        seed: Of the noise.

    Raises:
        CameraUnavailable: When gl is requested and does not work; see `resolve_camera`.
    """
    if not canvas.geometry.surface.flat:
        if option == "gl":
            raise CameraUnavailable("--camera gl draws flat walls alone")
        return CurvedCamera(scene, vehicle, canvas, seed)
    if option == "plane":
        return PlaneCamera(scene, vehicle, canvas, seed)
    from sim.sensors.cameras.gl import GLCamera

    try:
        return GLCamera(scene, vehicle, canvas, seed)
    except CameraUnavailable:
        if option == "gl":
            raise
        return PlaneCamera(scene, vehicle, canvas, seed)
