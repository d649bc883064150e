"""Limits: the bounds of the program, one class each, hard or soft with a price."""

from ibvs_qp.limits.barrier import TiltLimit, YawLimit
from ibvs_qp.limits.limit import Limit
from ibvs_qp.limits.thrust import ThrustLimit

__all__ = ["Limit", "ThrustLimit", "TiltLimit", "YawLimit"]
