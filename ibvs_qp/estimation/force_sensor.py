"""Raw force/torque samples to the contact wrench at the centre of mass: tool weight, inertia and bias removed."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.noise import WhiteNoise
from ibvs_qp.frames import GRAVITY
from ibvs_qp.symbolic.logic import both, where
from ibvs_qp.symbolic.signals import Signals

#: The moments of a shorter lever carry no information about a force [m].
LEAST_LEVER = 0.05
#: Time to which `tare_acceleration_gain` refers [s].
GAIN_TIME = 0.004


def contact_wrench(
    signals: Signals,
    vehicle: VehicleParams,
    config: EstimationConfig,
    *,
    sample: ca.SX,
    interval: ca.SX,
    force: ca.SX,
    dt: ca.SX,
    free: ca.SX,
) -> tuple[ca.SX, ca.SX]:
    r"""Contact wrench ON the vehicle from the wrench that the vehicle exerts on the tool.

    The tool obeys :math:`m_t f_t = F_{raw} + F_c` with its specific force f_t, so
    :math:`F_c = m_t f_t - F_{raw}`, and likewise for moments about the sensor; the mean in free flight is the bias.

    Args:
        signals: Registry.
        vehicle: Tool, sensor and tip.
        config: Filter of the tool's load, averaging times, noise.
        sample: Of the sensor, FRD axes, vehicle on tool [N, N m], (6,).
        interval: Time since the last sample [s], 0 without a new one.
        force: Accelerometer in B [m/s^2], (3,).
        dt: Time since the last tick [s].
        free: Whether the tip is known to be away from the wall, so that the mean is bias.

    Returns:
        Contact wrench at the centre of mass [N, N m], (6,), and whether the bias has been averaged long enough.
    """
    sensor = np.array(vehicle.force_torque_position_m)
    specific = signals.state("tare.specific_force", 3, (0.0, 0.0, -GRAVITY))
    gain = 1.0 - (1.0 - config.tare_acceleration_gain) ** (dt / GAIN_TIME)
    specific = signals.remember("tare.specific_force", specific + gain * (force - specific))
    load, new = vehicle.tool_mass_kg * specific, interval > 0.0
    contact = ca.vertcat(load, ca.cross(ca.DM(np.array(vehicle.tool_position_m) - sensor), load)) - sample

    bias, time, counts = signals.state("tare.bias", 6), signals.state("tare.time"), both(new, free)
    time = signals.remember("tare.time", where(counts, time + interval, time))
    mean = interval / ca.fmin(ca.fmax(time, interval), config.tare_follow_s)
    bias = signals.remember("tare.bias", where(counts, bias + mean * (contact - bias), bias))
    tared = contact - bias
    across = _force_across(signals, vehicle, config, tared[:3], tared[3:], new)
    tared_force = ca.vertcat(tared[0], *across)
    wrench = ca.vertcat(tared_force, tared[3:] + ca.cross(ca.DM(sensor), tared_force))
    wrench = signals.remember("tare.wrench", where(new, wrench, signals.state("tare.wrench", 6)))
    return wrench, time >= config.tare_time_s


def _force_across(
    signals: Signals, vehicle: VehicleParams, config: EstimationConfig, force: ca.SX, moment: ca.SX, new: ca.SX
) -> tuple[ca.SX, ca.SX]:
    r"""Force across the tool, y and z [N]: inverse-variance mean of force and moments.

    A force f at the tip, r from the sensor, gives :math:`M_z = r_x f_y - r_y f_x` and
    :math:`M_y = r_z f_x - r_x f_z`. So the moments measure the force as well; their variance is that of successive
    samples plus :math:`(s f_x / r_x)^2`, where s is how far from the tip the contact may press. The moments about the
    sensor and the force along the tool stay as measured.
    """
    fx, fy, fz = ca.vertsplit(force)
    _, my, mz = ca.vertsplit(moment)
    ahead, right, below = np.subtract(vehicle.tip_position_m, vehicle.force_torque_position_m).tolist()
    if ahead < LEAST_LEVER:
        return fy, fz
    off_tip, least = (config.contact_spread_m * fx / ahead) ** 2, config.force_std_n**2

    def variance(name: str, value: ca.SX) -> ca.SX:
        """Variance of one sample [N^2], estimated from successive samples."""
        states = [signals.state(f"tip_force.{name}_{entry}") for entry in WhiteNoise._fields]
        noise = WhiteNoise(*states)
        noise = noise.averaged(noise.sample(value - noise.residual, least))._replace(residual=value)
        for entry, old, now in zip(WhiteNoise._fields, states, noise, strict=True):
            signals.remember(f"tip_force.{name}_{entry}", where(new, now, old))
        return noise.total(least)

    def mean(axis: str, direct: ca.SX, by_moment: ca.SX) -> ca.SX:
        own = variance(f"{axis}_force", direct)
        return direct + own / (own + variance(f"{axis}_moment", by_moment) + off_tip) * (by_moment - direct)

    return mean("y", fy, (mz + right * fx) / ahead), mean("z", fz, (below * fx - my) / ahead)
