"""Pilot: raw sensor frames in, commands out."""

from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.pilot import Controller, Pilot

__all__ = ["Controller", "Pilot", "PilotConfig"]
