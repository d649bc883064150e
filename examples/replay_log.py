"""A flight recorder for a loop of your own: record, replay bit-identically, compare other settings.

Foxglove and Rerun open the file as well. Needs ``pip install -c constraints.txt -e '.[log]'``.
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

from ibvs_qp import ControllerConfig, HybridController, Measurement, Reference
from ibvs_qp.interfaces.log import Recorder, read_log, replay

TICK_S = 0.004
config = ControllerConfig()
mass, position, velocity = config.vehicle.mass_kg, 0.0, 0.0  # of a vehicle that only moves sideways, to the right
file = Path(tempfile.mkdtemp()) / "flight.mcap"

recorder = Recorder(file, HybridController(config))  # the line to add; its step() replaces the controller's
side_n = 0.0
for tick in range(1, 1001):
    target = 0.2 if tick < 600 else 0.0
    command = recorder.step(
        Measurement(
            stamp_ns=round(tick * TICK_S * 1e9),
            attitude=np.array((1.0, 0.0, 0.0, 0.0)),
            angular_velocity=np.zeros(3),
            specific_force=np.array((0.0, side_n / mass, -9.81)),
            contact_wrench=np.zeros(6),
            wrench_stamp_ns=round(tick * TICK_S * 1e9),
            velocity=np.array((0.0, velocity, 0.0)),
            velocity_covariance=1e-4 * np.eye(3),
        ),
        Reference(velocity=np.array((target, 0.0))),
    )
    side_n = float(command.wrench[1])
    velocity, position = velocity + TICK_S * side_n / mass, position + TICK_S * velocity
recorder.close()

flight = read_log(file)
same = replay(flight)
print(f"{same.ticks} ticks recorded in {file} ({file.stat().st_size / 1e6:.1f} MB); bit-identical: {same.same}")

limits = dataclasses.replace(config.vehicle, thrust_max_n=12.0)
weaker = replay(flight, HybridController(dataclasses.replace(config, vehicle=limits)))
assert weaker.first is not None
first, most = weaker.first, weaker.largest["thrusts"]
print(f"rotors of 12 N: {weaker.differing} ticks differ, first at {first.stamp_ns * 1e-9:.3f} s in {first.field},")
print(f"  most at {most.stamp_ns * 1e-9:.3f} s by {most.amount:.2f} N")
