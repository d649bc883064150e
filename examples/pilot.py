"""From raw frames to the finished job: `Pilot` with pictures, force sensor and IMU, and nothing else.

`read` and `drive` are the two functions to write for a vehicle of your own; here they call the small simulator in this
folder. With a real clock, `ibvs_qp.pilot.runner.run` keeps the rate.
"""

import dataclasses

import numpy as np
from drawn_camera import DrawnCamera
from rigid_body import Vehicle

from ibvs_qp import Pilot, SensorFrame, preset

TICK_NS, PICTURE = 4_000_000, 8  # ticks from picture to picture
STROKE_M = 0.4
BOARD_M = (-0.45, -0.55, 0.05, 0.05)  # left, top, right, bottom of the board; the brush starts at its lower right

config = preset("qp")
job = dataclasses.replace(config.painting, stroke_m=STROKE_M)
pilot = Pilot(dataclasses.replace(config, painting=job))
vehicle, camera = Vehicle(config.controller.vehicle), DrawnCamera(BOARD_M)
pushes: list[float] = []


def read(tick: int) -> SensorFrame:
    """The newest samples: attitude and IMU at every tick, a picture when there is one."""
    stamp_ns = tick * TICK_NS
    return SensorFrame(
        stamp_ns=stamp_ns,
        attitude=vehicle.quaternion,
        angular_velocity=vehicle.omega,
        specific_force=vehicle.specific_force,
        wrench=vehicle.raw_wrench,
        wrench_stamp_ns=stamp_ns,
        image=camera.picture(vehicle, stamp_ns) if tick % PICTURE == 0 else None,
    )


def drive(thrusts: np.ndarray) -> None:
    """Thrusts to the motors [N], (n,); `ibvs_qp.interfaces.px4.thrust_curve` turns them into motor commands."""
    vehicle.fly(thrusts)
    if vehicle.contact_force[0] < 0.0:
        camera.touch(vehicle.tip_world)
        pushes.append(-vehicle.contact_force[0])


pilot.prepare(camera.picture(vehicle, 0))
tick = 0
while not pilot.status.finished:
    tick += 1
    command = pilot.step(read(tick))
    drive(command.thrusts)
    if command.rejected:
        print(f"{tick * TICK_NS * 1e-9:6.2f} s  refused: {', '.join(command.rejected)}")
for event in pilot.status.events:
    print(f"{event.time_s:6.1f} s  {event.name}  {event.reason}")
print(f"{pilot.status.phase}, failed: {pilot.status.failed}, push {np.median(pushes):.2f} N")
