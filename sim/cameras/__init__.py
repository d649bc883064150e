"""Camera back ends behind one protocol, and the late stream of their pictures."""

from sim.cameras.choose import open_camera, resolve_camera
from sim.cameras.gl_context import CameraUnavailable
from sim.cameras.plane import PlaneCamera
from sim.cameras.protocol import Camera, camera_intrinsics
from sim.cameras.remote import RemoteCamera, spare_core
from sim.cameras.stream import CameraStream

__all__ = [
    "Camera",
    "CameraStream",
    "CameraUnavailable",
    "PlaneCamera",
    "RemoteCamera",
    "camera_intrinsics",
    "open_camera",
    "resolve_camera",
    "spare_core",
]
