"""A recorded flight in the same scene: a run of `paint`, or an MCAP log of an own loop, of a bag or of `paint`."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import viser

from ibvs_qp.command import SafetyState
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.controller import HybridController
from ibvs_qp.estimation.turned_camera import straightened
from ibvs_qp.frames import quaternion_from_rotation
from ibvs_qp.interfaces.log import read_log, replayed
from ibvs_qp.interfaces.log.header import recorded_controller
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.supervision.assured import Assured
from sim.evaluate.explanation import flown_config
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.live.charts import Charts
from sim.live.explaining import WhatIf, markdown
from sim.live.rows import NUMBERS, READ
from sim.live.scene import LiveScene
from sim.world.scene import Scene

#: Rows of the charts, at most [-].
_MOST_ROWS = 2000
