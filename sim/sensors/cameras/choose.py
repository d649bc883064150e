"""Which camera back end flies: the one asked for, or the plane camera where there is no OpenGL."""

from __future__ import annotations

from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras.gl_context import CameraUnavailable, open_context
from sim.sensors.cameras.plane import PlaneCamera
from sim.sensors.cameras.protocol import Camera
from sim.world.canvas import Canvas
from sim.world.scene import Scene

#: Words of the option: plane needs no OpenGL; gl and auto take OpenGL where there is one.
BACK_ENDS = ("plane", "gl", "auto")
#: Size of the picture of a trial [px].
_TRIAL_PX = 64


def resolve_camera(wanted: str) -> tuple[str, str | None]:
    """Find out what an option comes to on this machine.

    Args:
        wanted: One of `BACK_ENDS`.

    Returns:
        "plane" or "gl", and a line for the user where that is not what was asked for.
    """
    if wanted == "plane":
        return "plane", None
    try:
        context, _ = open_context(_TRIAL_PX, _TRIAL_PX)
    except CameraUnavailable as reason:
        return "plane", f"--camera {wanted}: {reason}; flying with plane"
    context.free()
    return "gl", None


def open_camera(wanted: str, scene: Scene, vehicle: VehicleParams, canvas: Canvas, seed: int) -> Camera:
    """The camera of a flight.

    Args:
        wanted: "plane" or "gl"; "auto" takes gl where it works.
        scene: Board, wall and camera.
        vehicle: Where camera and arm are.
        canvas: What is painted on.
        seed: Of the noise.

    Raises:
        CameraUnavailable: When gl is wanted and does not work; see `resolve_camera`.
    """
    if wanted == "plane":
        return PlaneCamera(scene, vehicle, canvas, seed)
    from sim.sensors.cameras.gl import GLCamera

    try:
        return GLCamera(scene, vehicle, canvas, seed)
    except CameraUnavailable:
        if wanted == "gl":
            raise
        return PlaneCamera(scene, vehicle, canvas, seed)
