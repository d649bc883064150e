"""What is wanted of every direction at one tick, shared word for word by both laws."""

from ibvs_qp.setpoints.setpoints import Setpoints

__all__ = ["Setpoints"]
