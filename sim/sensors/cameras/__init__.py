"""Camera back ends behind one protocol, and the late stream of their pictures."""

from sim.sensors.cameras.choose import open_camera, resolve_camera
from sim.sensors.cameras.exposure import Dropouts
from sim.sensors.cameras.gl_context import CameraUnavailable
from sim.sensors.cameras.plane import PlaneCamera
from sim.sensors.cameras.protocol import Camera, camera_intrinsics
from sim.sensors.cameras.stream import CameraStream

__all__ = [
    "Camera",
    "CameraStream",
    "CameraUnavailable",
    "Dropouts",
    "PlaneCamera",
    "camera_intrinsics",
    "open_camera",
    "resolve_camera",
]
