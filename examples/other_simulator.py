"""The whole painter on a simulator that is not MuJoCo: two rows on a board, by features instead of pictures.

The simulator is `rigid_body.py` in this folder; yours needs to deliver the numbers that its `sense` collects.
"""

import dataclasses
import operator

import numpy as np
from rigid_body import WALL_M, Vehicle

from ibvs_qp import FeatureFrame, LineFeature, Pilot, preset

STROKE_M, MARGIN_M, BOARD_M = 0.4, 0.05, (0.5, 0.6)  # of a row; brush to edge; width and height of the board
RIGHT, BOTTOM = MARGIN_M, MARGIN_M  # edges of the board, from the tip's start, to the right and down [m]
LEFT, TOP = RIGHT - BOARD_M[0], BOTTOM - BOARD_M[1]
CORNERS = [np.array((WALL_M, y, z)) for y, z in ((LEFT, TOP), (RIGHT, TOP), (RIGHT, BOTTOM), (LEFT, BOTTOM))]
BRUSH_UP = np.array((0.0, 0.0, 0.04))  # radius of the brush
PICTURE, LEVEL_M = 8, 0.005  # ticks from picture to picture; the brush is on the first row this close to its height
EAST = operator.itemgetter(1)


def seen(vehicle: Vehicle, first_row: list[np.ndarray], stamp_ns: int) -> FeatureFrame:
    """The picture of this tick: edges of the board, upper edge of the paint, the wall and the velocity."""
    ends, sides = ((0, 1), (1, 2), (3, 2), (0, 3)), (1, -1, -1, 1)  # top, right, bottom, left; where the board lies
    found = [
        vehicle.edge(CORNERS[start], CORNERS[end], stamp_ns, track, side=side)
        for track, ((start, end), side) in enumerate(zip(ends, sides, strict=True), start=1)
    ]
    if first_row:
        left, right = (end - BRUSH_UP for end in (min(first_row, key=EAST), max(first_row, key=EAST)))
        found.append(vehicle.edge(left, right, stamp_ns, track=5, kind="paint", side=-1))
    lines: tuple[LineFeature, ...] = tuple(line for line in found if line is not None)
    velocity = vehicle.turn.inv().apply(vehicle.velocity)
    return FeatureFrame(
        lines=lines, plane=vehicle.plane(), stamp_ns=stamp_ns, velocity=velocity, velocity_covariance=1e-5 * np.eye(3)
    )


def main() -> None:
    """Fly the job to its end."""
    config = preset("qp")
    pilot = Pilot(dataclasses.replace(config, painting=dataclasses.replace(config.painting, stroke_m=STROKE_M)))
    vehicle, first_row, pushes, tick = Vehicle(config.controller.vehicle), [], [], 0
    while not pilot.status.finished:
        tick += 1
        stamp_ns = 4_000_000 * tick
        features = seen(vehicle, first_row, stamp_ns) if tick % PICTURE == 0 else None
        vehicle.fly(pilot.step(vehicle.sense(stamp_ns, features=features)).thrusts)
        if vehicle.contact_force[0] < 0.0:
            pushes.append(-vehicle.contact_force[0])
            if abs(vehicle.tip_world[2]) < LEVEL_M:
                first_row.append(vehicle.tip_world)
    print(f"{pilot.status.phase} after {0.004 * tick:.1f} s, failed: {pilot.status.failed} {pilot.status.reason}")
    for event in pilot.status.events:
        print(f"{event.time_s:6.1f} s  {event.name}  {event.reason}")
    print(f"push {np.median(pushes):.2f} N, at most {np.max(pushes):.2f} N")


if __name__ == "__main__":
    main()
