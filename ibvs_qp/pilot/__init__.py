"""Pilot: raw sensor frames in, commands out."""

from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.pilot import Controller, LawCall, Pilot
from ibvs_qp.pilot.status import FlightStatus

__all__ = ["Controller", "FlightStatus", "LawCall", "Pilot", "PilotConfig"]
