"""A vehicle of your own: eight rotors, each with its own place and axis, a camera that looks up, a full inertia.

The same as a TOML file: ``print(CONFIG.to_toml())``, and ``ibvs-qp vehicle FILE`` shows the reach of its rotors.
"""

import numpy as np

from allocation import Rotor, RotorGeometry
from allocation.actuation import actuation
from ibvs_qp import ControllerConfig, HybridController, Measurement, Reference, VehicleParams, preset

# Hubs on the corners of a box [m], front-right-down; every axis leans sideways by 25 degrees, in turn.
rotors = []
for number, (front, right) in enumerate([(0.5, 0.3), (0.2, 0.5), (-0.2, 0.5), (-0.5, 0.3)] * 2):
    place = (front, right if number < 4 else -right, 0.02)
    out = np.array((place[0], place[1])) / np.hypot(place[0], place[1])
    spin = 1 if number % 2 == (number < 4) else -1
    lean = np.sin(np.radians(25.0)) * spin
    axis = (-lean * out[1], lean * out[0], -np.cos(np.radians(25.0)))
    rotors.append(Rotor(name=f"motor_{number}", position_m=place, axis=tuple(axis), spin=spin, torque_ratio_m=0.018))

VEHICLE = VehicleParams(
    geometry=RotorGeometry(rotors=tuple(rotors), torque_ratio_m=0.018),
    mass_kg=7.2,
    inertia_kg_m2=(0.35, 0.40, 0.62),
    inertia_products_kg_m2=(0.0, -0.02, 0.0),
    thrust_max_n=38.0,
    tip_position_m=(0.85, 0.0, 0.05),
    camera_position_m=(0.30, 0.0, 0.10),
    camera_turn_deg=(0.0, 8.0, 0.0),  # rotation vector: 8 degrees nose up
    force_torque_position_m=(0.35, 0.0, 0.05),
)
CONFIG = ControllerConfig(vehicle=VEHICLE, gains=preset("qp").controller.gains)

weight, tip = 9.81 * VEHICLE.mass_kg, np.array(VEHICLE.tip_position_m)
found = actuation(VEHICLE.geometry, weight, tip, VEHICLE.thrust_min, VEHICLE.thrust_max)
print(f"not actuated: {', '.join(found.missing) or 'nothing'}; condition {found.condition:.1f}")
print(f"hover: {found.hover.min():.1f} to {found.hover.max():.1f} N; greatest push {found.push.push:.1f} N")

controller = HybridController(CONFIG)
for tick in range(1, 251):
    at_rest = Measurement(
        stamp_ns=4_000_000 * tick,
        attitude=np.array((1.0, 0.0, 0.0, 0.0)),
        angular_velocity=np.zeros(3),
        specific_force=np.array((0.0, 0.0, -9.81)),
        contact_wrench=np.zeros(6),
        wrench_stamp_ns=4_000_000 * tick,
        velocity=np.zeros(3),
    )
    command = controller.step(at_rest, Reference(standoff=0.3))
print(f"{command.outcome}: thrusts {np.round(command.thrusts, 1).tolist()} N, {sum(command.thrusts):.1f} N in all")
