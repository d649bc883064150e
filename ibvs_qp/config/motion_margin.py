"""Robustness of the loops of roll, pitch, yaw, lines and stand-off of a controller."""

from __future__ import annotations

import math

from ibvs_qp.analysis.motion_loop import MotionLoop
from ibvs_qp.config.controller import ControllerConfig

#: Gains with a larger sensitivity peak are not searched: 2.0 bears twice the gain and 29 degrees of phase. The same
#: with motors of another lag than the configured one, and the ratios of that lag: 2.3 bears 1.8 times the gain.
LARGEST_SENSITIVITY, LARGEST_WITH_OTHER_LAG, LAG_RATIOS = 2.0, 2.3, (0.75, 1.3)
#: Ticks from a sample to the middle of its command's hold: half a tick, and a tick that a sample may be old.
TICKS_LATE = 1.5


def motion_sensitivity(config: ControllerConfig, lag_ratio: float = 1.0) -> dict[str, float]:
    """Sensitivity peaks of "attitude", "yaw", "line", "standoff" and "landing"; see `ibvs_qp.analysis.motion_loop`.

    The rates of lines and distance come from the accelerometer and the camera; their leads from the motors' model. The
    last centimetre of an approach, "landing", has a damping of its own. Its speed follows the distance here; at the
    constant speed of a touch the search for the wall has a fifth of that stiffness. The analytic law has no filter of
    the stand-off, so its margin is larger.

    Args:
        config: Gains, leads, filters, tick and motors.
        lag_ratio: Lag of the real motors over the configured one [-].
    """
    gains, rate, vehicle = config.gains, config.angular_rate, config.vehicle
    gyro, approach, landing = rate.gyro_bandwidth_hz, gains.standoff_kd, config.contact.landing_kd
    along, no_motor_model = (gains.push_lead_s, gains.push_filter_s), math.inf
    loops = {
        "attitude": (gains.attitude_kp, gains.attitude_kd, 0.0, rate.lead_s, gains.attitude_filter_s, gyro),
        "yaw": (gains.yaw_kp, gains.yaw_kd, 0.0, rate.lead_s, gains.yaw_filter_s, gyro),
        "line": (gains.line_kp, gains.line_kd, gains.line_ki, gains.line_lead_s, gains.line_filter_s, no_motor_model),
        "standoff": (approach * gains.standoff_kp, approach, 0.0, *along, no_motor_model),
        "landing": (landing * gains.standoff_kp, landing, 0.0, *along, no_motor_model),
    }
    return {
        name: MotionLoop(
            kp=kp,
            kd=kd,
            ki=ki,
            lag=vehicle.motor_lag_s,
            delay=TICKS_LATE * config.tick_s,
            lead=lead,
            filter_s=filter_s,
            tick_s=config.tick_s,
            lag_ratio=lag_ratio,
            bandwidth_hz=bandwidth,
        ).sensitivity_peak
        for name, (kp, kd, ki, lead, filter_s, bandwidth) in loops.items()
    }
