"""A force/torque sensor in other axes than the body's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from recorded_inputs import recording

from ibvs_qp.pilot import Pilot, PilotConfig


def test_a_force_sensor_in_other_axes_flies_the_same() -> None:
    """Turned by a right angle about x: its y is our z, its z our -y."""
    config = PilotConfig()
    vehicle = dataclasses.replace(config.controller.vehicle, force_torque_turn_deg=(90.0, 0.0, 0.0))
    own = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))
    straight, turned = Pilot(config), Pilot(own)
    for frame in recording("rotor_loss").frames[:300]:
        x, y, z, a, b, c = frame.wrench
        other = dataclasses.replace(frame, wrench=np.array((x, z, -y, a, c, -b)))
        assert turned.step(other).thrusts == pytest.approx(straight.step(frame).thrusts, abs=1e-6)
