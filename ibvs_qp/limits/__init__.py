"""Limits: the bounds of the program, one class each, hard or soft with a price."""

from ibvs_qp.limits.barrier import TiltLimit, YawLimit
from ibvs_qp.limits.force import ApproachLimit, PushCeiling
from ibvs_qp.limits.limit import Limit
from ibvs_qp.limits.thrust import ThrustLimit
from ibvs_qp.limits.view import ViewLimit

__all__ = ["ApproachLimit", "Limit", "PushCeiling", "ThrustLimit", "TiltLimit", "ViewLimit", "YawLimit"]
