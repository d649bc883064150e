"""Reference rival from another field: one tick of mink's inverse kinematics on an arm with twelve joints."""

from __future__ import annotations

import importlib.util

import numpy as np

from sim.bench.timing import Row

#: Joints of the arm: as many columns as the controller's program has thrusts and slacks.
JOINTS = 12
#: Length of a link [m], control period [s] and joint speed limit [rad/s].
LINK_M, TICK_S, SPEED_RAD_S = 0.15, 0.004, 3.0
#: Circle that the hand follows: radius [m] and turns per tick.
CIRCLE_M, TURNS_PER_TICK = 0.25, 1.0 / 500.0


def mink_row(ticks: int) -> Row | None:
    """Times of `mink.solve_ik` with a hand task, a posture task and joint speed limits; None without mink."""
    if importlib.util.find_spec("mink") is None:
        return None
    import mink  # pyright: ignore[reportMissingImports] -- from the extra "solvers"
    import mujoco

    model = mujoco.MjModel.from_xml_string(_arm())  # type: ignore[attr-defined, reportAttributeAccessIssue]
    configuration = mink.Configuration(model)
    configuration.update(np.full(JOINTS, 0.2))
    hand = mink.FrameTask("hand", "site", position_cost=1.0, orientation_cost=0.2, lm_damping=1e-6)
    posture = mink.PostureTask(model, cost=1e-3)
    posture.set_target(np.full(JOINTS, 0.2))
    speeds = {f"joint_{i}": SPEED_RAD_S for i in range(JOINTS)}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    start, row = configuration.get_transform_frame_to_world("hand", "site"), Row(name="mink_12_joints")
    for tick in range(ticks):
        angle = 2.0 * np.pi * tick * TURNS_PER_TICK
        offset = CIRCLE_M * np.array([0.0, np.cos(angle) - 1.0, np.sin(angle)])
        hand.set_target(mink.SE3.from_rotation_and_translation(start.rotation(), start.translation() + offset))
        speed = row.measure(
            lambda: mink.solve_ik(configuration, [hand, posture], TICK_S, "daqp", damping=1e-6, limits=limits)
        )
        configuration.integrate_inplace(speed, TICK_S)
    return row


def _arm() -> str:
    """A chain of links whose joint axes alternate between z and y."""
    head, tail = "", ""
    for i in range(JOINTS):
        axis = "0 1 0" if i % 2 else "0 0 1"
        head += (
            f'<body pos="{LINK_M if i else 0} 0 0"><joint name="joint_{i}" axis="{axis}" range="-2.5 2.5"/>'
            f'<geom type="capsule" size="0.02" fromto="0 0 0 {LINK_M} 0 0"/>'
        )
        tail += "</body>"
    site = f'<site name="hand" pos="{LINK_M} 0 0"/>'
    return f'<mujoco><compiler angle="radian"/><worldbody>{head}{site}{tail}</worldbody></mujoco>'
