"""A ROS 2 bag through the pilot, without ROS: distance, edges and decisions.

It needs ``pip install -c constraints.txt -e '.[ros]'``. The bag is made up here: a second of hovering.
Give your own instead: ``Bag(path, Topics(imu="/imu", ...))``.
"""

import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from ibvs_qp import Pilot, RgbdFrame, SensorFrame, preset
from ibvs_qp.interfaces.ros.bag import Bag, commands
from ibvs_qp.interfaces.ros.write_bag import write_bag

TICK_NS, TICKS, PICTURE_TICKS = 4_000_000, 250, 25  # 250 Hz for 1 s, pictures at 10 Hz
DISTANCE, SIZE, INTRINSICS = 0.9, (240, 424), (312.6, 312.6, 211.5, 119.5)  # camera to board [m]; [px]
TOOL_WEIGHT = 0.35 * 9.81  # on the force sensor [N]


def picture(stamp_ns: int, rng: np.random.Generator) -> RgbdFrame:
    """A bright board that ends in the picture, 5 cm before a dark wall."""
    rows, columns = np.indices(SIZE)
    board = (rows < 150) & (columns < 300)
    grey = np.where(board, 190, 70) + rng.integers(-3, 4, SIZE)
    depth = np.where(board, DISTANCE, DISTANCE + 0.05) * (1.0 + 0.003 * rng.standard_normal(SIZE))
    rgb, depth = np.dstack([grey.astype(np.uint8)] * 3), depth.astype(np.float32)
    return RgbdFrame(rgb=rgb, depth=depth, intrinsics=INTRINSICS, stamp_ns=stamp_ns)


def hover(rng: np.random.Generator) -> list[SensorFrame]:
    """Sensor frames at rest, with the noise of their sensors."""
    return [
        SensorFrame(
            stamp_ns=(stamp := (tick + 1) * TICK_NS),
            attitude=np.array([1.0, 0.0, 0.0, 0.0]),
            angular_velocity=rng.normal(0.0, 1e-3, 3),
            specific_force=np.array([0.0, 0.0, -9.81]) + rng.normal(0.0, 0.02, 3),
            wrench=np.array([0.0, 0.0, -TOOL_WEIGHT, 0.0, 0.25 * TOOL_WEIGHT, 0.0]) + rng.normal(0.0, 0.05, 6),
            wrench_stamp_ns=stamp,
            image=picture(stamp, rng) if tick % PICTURE_TICKS == 0 else None,
        )
        for tick in range(TICKS)
    ]


def main() -> None:
    """Write a bag, read it, run the pilot on it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "hover")
        write_bag(hover(np.random.default_rng(0)), path)
        bag, pilot = Bag(path), Pilot(preset("qp"))
        answered = list(commands(bag.sensor_frames(), pilot))
        print(f"{len(answered)} frames, messages ignored: {dict(bag.held.ignored)}")
        print(f"tip {pilot.contact.state.distance:.3f} m from the board, {len(pilot.motion.lines)} of its edges seen")
        print(*(f"{event.time_s:.2f} s  {event.name}: {event.reason}" for event in pilot.status.events), sep="\n")
        print(f"commands: {Counter(str(command.outcome) for _, command in answered)}")


if __name__ == "__main__":
    main()
