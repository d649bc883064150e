"""Perception on RGB-D pictures from files: the wall, its distance, and the lines with kind, side and accuracy.

``python examples/rgbd_files.py FOLDER`` reads every ``NAME_color.png`` with ``NAME_depth.png`` (16 bit, millimetres,
registered to the colours) in the order of their names; without a folder it writes and reads three pictures of its own.
Lines are listed from their second picture on, so the first picture has none.
``ibvs-qp detect`` does more: manifests, sequences, pictures with the lines drawn in.
"""

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from drawn_camera import DrawnCamera
from rigid_body import Vehicle

from ibvs_qp import RgbdFrame, preset
from ibvs_qp.vision.perception import Perception

INTRINSICS = (600.0, 600.0, 319.5, 239.5)  # fx, fy, cx, cy of your camera [px]
PERIOD_NS = 33_000_000  # between two pictures


def write_own(folder: Path) -> None:
    """Three pictures of a board while the camera moves to the right."""
    vehicle, camera = Vehicle(preset("qp").controller.vehicle), DrawnCamera((-0.45, -0.55, 0.05, 0.05))
    for index in range(3):
        vehicle.position[1] = 5e-4 * index
        picture = camera.picture(vehicle, 0)
        cv2.imwrite(str(folder / f"{index}_color.png"), picture.rgb[:, :, ::-1])
        cv2.imwrite(str(folder / f"{index}_depth.png"), np.rint(1e3 * picture.depth).astype(np.uint16))


def read(color: Path, stamp_ns: int) -> RgbdFrame:
    """One picture; colours to RGB, depth to metres, 0 where the camera has none."""
    depth = cv2.imread(str(color).replace("_color", "_depth"), cv2.IMREAD_UNCHANGED)
    rgb = cv2.cvtColor(cv2.imread(str(color), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    return RgbdFrame(rgb=rgb, depth=depth.astype(np.float32) / 1e3, intrinsics=INTRINSICS, stamp_ns=stamp_ns)


def main(folder: Path) -> None:
    """Look at every picture of a folder."""
    config = preset("qp")
    perception = Perception(config.vision, config.controller.vehicle)
    for index, color in enumerate(sorted(folder.glob("*_color.png")), start=1):
        perceived = perception.process(read(color, index * PERIOD_NS))
        wall = f"wall at {perceived.plane.distance_m:.3f} m" if perceived.plane else f"no wall: {perceived.refused}"
        print(f"{color.name}: {wall}")
        for line in perceived.features.lines:
            sigma_px = INTRINSICS[0] * np.sqrt(line.covariance[0, 0])
            print(
                f"  {line.kind:5s} {line.role:10s} rho {line.rho:+.4f} ({sigma_px:.2f} px)  "
                f"theta {np.degrees(line.theta):+.2f} deg  side {line.surface_side:+d}  weight {line.weight:.2f}"
            )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as own:
            write_own(Path(own))
            main(Path(own))
