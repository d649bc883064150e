from ibvs_qp.pilot.config import PilotConfig as PilotConfig
from ibvs_qp.pilot.pilot import Controller as Controller
from ibvs_qp.pilot.pilot import LawCall as LawCall
from ibvs_qp.pilot.pilot import Pilot as Pilot
from ibvs_qp.pilot.status import FlightStatus as FlightStatus
