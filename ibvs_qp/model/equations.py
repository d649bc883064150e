"""The tick as mathematics: from what is measured to what is wanted of every direction."""

from __future__ import annotations

import casadi as ca

from allocation.effectiveness import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.frames import GRAVITY
from ibvs_qp.model.external_wrench import external_wrench
from ibvs_qp.model.feedforward import SLIDING_COMMAND, contact_feedforward
from ibvs_qp.model.friction import cautious_friction, estimated_friction
from ibvs_qp.model.in_plane import motion_in_plane
from ibvs_qp.model.inputs import Body, Touch, Wish, packed_inputs
from ibvs_qp.model.push import push_force, standoff_force
from ibvs_qp.model.reach import STANDING_SPEED, push_reach
from ibvs_qp.model.rotors import rotor_terms
from ibvs_qp.model.signals import Signals
from ibvs_qp.model.wall import wall_axes, wanted_turn


def setpoint_model(config: ControllerConfig) -> Signals:
    r"""All equations between estimation and the two laws.

    The bias wrench h of :math:`M\dot\nu = B u + h` gathers gravity, the gyroscopic moment, the observed external
    wrench and what the contact will put on the vehicle; friction, reach, forces along n, lines and velocities follow.
    """
    signals, vehicle = Signals(), config.vehicle
    packed_inputs(signals, config.line_slots)
    effectiveness = control_effectiveness(vehicle.geometry)
    body, touch, wish = Body.of(signals), Touch.of(signals), Wish.of(signals)
    wall = wall_axes(signals, body, touch)
    wanted_turn(signals, config, body, touch, wish)
    travel = wish.velocity[0] * wall.right + wish.velocity[1] * wall.down

    tip = body.velocity_of(vehicle.tip_position_m)
    before, friction = estimated_friction(
        signals, body, touch, tip, travel, SLIDING_COMMAND, config.contact.stuck_speed_m_s
    )
    signals.output("friction", friction)
    expected, felt_moment = ca.SX.zeros(6), ca.SX.zeros(3)
    if config.contact_feedforward:
        contact = contact_feedforward(signals, config, body, touch, travel, before)
        expected, felt_moment = ca.vertcat(contact.force, contact.moment), contact.felt_moment
    near = ca.logic_or(touch.touching, touch.distance < config.contact.contact_distance_m)
    external = external_wrench(
        signals, vehicle, effectiveness, body, felt_moment, wall.normal, near, touch.noise, config.contact_feedforward
    )
    inertia = ca.DM(vehicle.inertia_kg_m2)
    gyroscopic = -ca.cross(body.rate, inertia * body.rate)
    static = signals.output("static_wrench", ca.vertcat(vehicle.mass_kg * GRAVITY * body.down, gyroscopic) + external)
    signals.output("bias_wrench", static + expected)

    planned = wish.plan[0] * wall.right + wish.plan[1] * wall.down
    ahead = ca.if_else(ca.norm_2(travel) > STANDING_SPEED, travel, planned)
    reach = push_reach(signals, vehicle, wall.normal, ahead, cautious_friction(signals, friction), static)
    push_force(signals, config, body, touch, wish, reach)
    standoff_force(signals, config, body, touch, wish)
    motion_in_plane(signals, config, body, touch, wish, wall, travel)
    rotor_terms(signals, vehicle.geometry.count)
    signals.output("contact_weight", signals.input("contact_weight"))
    return signals
