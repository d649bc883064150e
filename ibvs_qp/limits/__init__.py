"""Limits: one file each, with bounds, slack weight and row."""

from ibvs_qp.limits.approach import ApproachLimit
from ibvs_qp.limits.limit import Limit
from ibvs_qp.limits.push_ceiling import PushCeiling
from ibvs_qp.limits.thrust import ThrustLimit
from ibvs_qp.limits.tilt import TiltLimit
from ibvs_qp.limits.view import ViewLimit
from ibvs_qp.limits.yaw import YawLimit

__all__ = ["ApproachLimit", "Limit", "PushCeiling", "ThrustLimit", "TiltLimit", "ViewLimit", "YawLimit"]
