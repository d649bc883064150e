"""HybridController in a loop of your own: press a wall with 5 N and slide along an edge, without MuJoCo.

Everything that the controller needs is in `measure` and `main`; the vehicle is `rigid_body.py` in this folder.
"""

import math

import numpy as np
from rigid_body import WALL_M, Vehicle

from ibvs_qp import HybridController, LineReference, Measurement, Reference

EDGE_M, SECONDS = 0.05, 12.0  # a level edge 5 cm below the start height; duration
PUSH_N, SLIDE_M_S = 5.0, 0.05  # push; speed to the left, from 5 s on


def measure(vehicle: Vehicle, stamp_ns: int) -> Measurement:
    """Measurement of one tick."""
    left, right = (np.array([WALL_M, vehicle.tip_world[1] + side, EDGE_M]) for side in (-0.2, 0.2))
    line = vehicle.edge(left, right, stamp_ns, track=1)
    return Measurement(
        stamp_ns=stamp_ns,
        attitude=vehicle.quaternion,
        angular_velocity=vehicle.omega,
        specific_force=vehicle.specific_force,
        contact_wrench=vehicle.contact_wrench,
        wrench_stamp_ns=stamp_ns,
        lines=() if line is None else (line,),
        plane=vehicle.plane(),
        plane_stamp_ns=stamp_ns,
        velocity=vehicle.turn.inv().apply(vehicle.velocity),
    )


def main() -> None:
    """Approach, press, slide; print once per second."""
    controller = HybridController()
    vehicle, tick_s = Vehicle(controller.config.vehicle), controller.config.tick_s
    for tick in range(1, round(SECONDS / tick_s) + 1):
        measurement = measure(vehicle, round(tick * tick_s * 1e9))
        depth = 1.0 / measurement.plane[2]  # of the wall along the optical axis [m]
        below_tip = (EDGE_M - vehicle.camera[2]) / depth  # target of the edge in the picture, normalised
        reference = Reference(
            push_force=PUSH_N,
            contact=True,
            lines=(LineReference(rho=below_tip, theta=0.5 * math.pi, role="horizontal"),),
            velocity=np.array([-SLIDE_M_S if tick * tick_s > 5.0 else 0.0, 0.0]),
        )
        command = controller.step(measurement, reference)
        vehicle.fly(command.thrusts)
        if tick % 250 == 0:
            height_mm, along = 1e3 * vehicle.tip_world[2], vehicle.tip_world[1]
            print(
                f"{tick * tick_s:5.1f} s  {command.mode:8s}  push {-vehicle.contact_force[0]:5.2f} N  "
                f"height error {height_mm:+5.1f} mm  slid {along:+6.3f} m  {command.outcome}"
            )


if __name__ == "__main__":
    main()
