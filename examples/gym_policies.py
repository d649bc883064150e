"""Policies in the Gymnasium environment: random thrusts, a PD hover in front of the wall, and both shipped laws.

``python examples/gym_policies.py [SECONDS]`` prints a table; without SECONDS both laws do the whole job.
Needs the extra ``gym``; docs/gymnasium.md describes the environment.
"""

import sys
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from ibvs_qp import VehicleParams, control_effectiveness

SEED = 1  # of scene, start and noise
STANDOFF_M = 0.4  # tip to wall in hover
TURN, SPIN, PLACE, SPEED = 20.0, 6.0, 1.0, 2.0  # 1/s^2 per rad, 1/s per rad/s, 1/s^2 per m, 1/s per m/s

Seen = dict[str, np.ndarray]
Policy = Callable[[gymnasium.Env, Seen], np.ndarray]
VEHICLE = VehicleParams()
TO_THRUSTS = np.linalg.pinv(control_effectiveness(VEHICLE.geometry))


def hover(_: gymnasium.Env, seen: Seen) -> np.ndarray:
    """Thrusts of a level hover at `STANDOFF_M` that faces the wall [N], (n,), from the observation alone."""
    w, x, y, z = seen["attitude_wxyz"]
    down = np.array((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))  # in body axes
    normal, known = seen["wall_normal"], seen["wall_known"][0]
    turn = TURN * np.array((-down[1], down[0], known * normal[1])) - SPIN * seen["angular_velocity_rad_s"]
    push = known * PLACE * (seen["standoff_m"][0] - STANDOFF_M) * normal - SPEED * seen["velocity_m_s"]
    force = VEHICLE.mass_kg * (push - 9.81 * down)
    return TO_THRUSTS @ np.concatenate((force, np.array(VEHICLE.inertia_kg_m2) * turn))


def fly(policy: Policy, **options: Any) -> str:
    """One episode; returns a row of the table."""
    env = gymnasium.make("sim.gym_env:ibvs_qp/Paint-v0", **options)
    env.action_space.seed(SEED)
    seen, info = env.reset(seed=SEED)
    total, steps, over = 0.0, 0, False
    while not over:
        seen, reward, terminated, truncated, info = env.step(policy(env, seen))
        total, steps, over = total + float(reward), steps + 1, terminated or truncated
    env.close()
    return f"{total:8.1f} {steps:7d} {'yes' if info['completed'] else 'no':>10}  {info['reason']}"


if __name__ == "__main__":
    limit = float(sys.argv[1]) if len(sys.argv) > 1 else None
    print(f"{'policy':10}{'return':>8} {'length':>7} {'completed':>10}  reason")
    print(f"{'random':10}{fly(lambda env, _: env.action_space.sample(), action='thrusts', time_limit_s=limit)}")
    print(f"{'PD hover':10}{fly(hover, action='thrusts', time_limit_s=limit or 10.0)}")
    for law in ("qp", "paper"):
        print(f"{law:10}{fly(lambda *_: np.zeros(VEHICLE.geometry.count), law=law, time_limit_s=limit)}")
