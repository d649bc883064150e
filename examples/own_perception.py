"""Lines from your own detector: pixels to `LineFeature` with a covariance, and a `FeatureFrame` for the pilot.

The detector here takes the steepest change of brightness in every column and fits a line: replace `edge_pixels`. The
wall plane comes from the simulator's truth: fit yours to the depth.
"""

import numpy as np
from drawn_camera import DrawnCamera
from rigid_body import Vehicle

from ibvs_qp import FeatureFrame, LineFeature, Pilot, RgbdFrame, preset

BOARD_M = (-0.45, -0.55, 0.05, 0.05)  # left, top, right, bottom of the board; the brush starts at its lower right
STEP = 60.0  # least change of brightness across an edge [grey levels]


def edge_pixels(picture: RgbdFrame) -> np.ndarray:
    """Pixels (u, v) on the lower edge of the bright board, (n, 2)."""
    grey = picture.rgb.mean(axis=2)
    fall = grey[:-4] - grey[4:]  # from the board down to the wall
    rows = fall.argmax(axis=0)
    columns = np.flatnonzero(fall.max(axis=0) > STEP)
    return np.column_stack((columns, rows[columns] + 2.0))


def line_of(pixels: np.ndarray, picture: RgbdFrame, side: int, track_id: int) -> LineFeature:
    """Least squares v = p0 + p1 u through pixels (n, 2) of a level edge, as x cos(theta) + y sin(theta) = rho."""
    fx, fy, cx, cy = picture.intrinsics
    x, y = ((pixels - (cx, cy)) / (fx, fy)).T
    (slope, height), scatter = np.polyfit(x, y, 1, cov="unscaled")
    residual = np.std(y - slope * x - height)
    theta = 0.5 * np.pi + np.arctan(slope)  # the normal points down
    rho = height * np.sin(theta)
    to_line = np.array([[-slope * height * np.sin(theta) ** 3, np.sin(theta)], [np.sin(theta) ** 2, 0.0]])
    covariance = to_line @ (residual**2 * scatter) @ to_line.T + np.diag((2e-4, 1e-3)) ** 2  # fit, and its model's
    return LineFeature(
        rho=float(rho),
        theta=float(theta),
        covariance=covariance,
        role="horizontal",
        stamp_ns=picture.stamp_ns,
        track_id=track_id,
        segment=np.array([(x[0], slope * x[0] + height), (x[-1], slope * x[-1] + height)]),
        surface_side=side,
        kind="board",
    )


def main() -> None:
    """Two seconds of flight on the own detector: the pilot finds the guide and flies along it, to the board's end."""
    pilot = Pilot(preset("qp"))
    vehicle, camera = Vehicle(pilot.config.controller.vehicle), DrawnCamera(BOARD_M)
    for tick in range(1, 501):
        stamp_ns, features = 4_000_000 * tick, None
        if tick % 8 == 0:
            picture = camera.picture(vehicle, stamp_ns)
            line = line_of(edge_pixels(picture), picture, side=-1, track_id=1)  # the board is above: side -1
            features = FeatureFrame(lines=(line,), plane=vehicle.plane(), stamp_ns=stamp_ns)
        vehicle.fly(pilot.step(vehicle.sense(stamp_ns, features=features)).thrusts)
        if tick % 100 == 0 and (found := pilot.motion.lines.get(1)):
            print(f"{0.004 * tick:.1f} s  {pilot.status.phase:8s}  edge {1e3 * found.offset:.1f} mm below the brush")


if __name__ == "__main__":
    main()
