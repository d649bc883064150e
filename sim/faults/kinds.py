"""Every kind of fault by its name, as scenarios name it."""

from __future__ import annotations

from sim.faults.air import SidePush, WindStep
from sim.faults.camera import CameraFrozen, CameraJitter, CameraLatency, CameraLost, CameraReordered
from sim.faults.clock import ClockJump, LoopStall, SlowLoop, TicksSkipped
from sim.faults.fault import ChannelFault, Fault, NoFault
from sim.faults.features import DepthFlipped, FeatureNan, LinesLost, PlaneLost, WrongLines
from sim.faults.force_torque import ForceTorqueBias, ForceTorqueLost, ForceTorqueNan, ForceTorqueStuck, ForceTorqueZero
from sim.faults.imu import AccelerometerBias, AttitudeStep, GyroBias, ImuLate, ImuNan, ImuStuck
from sim.faults.picture import PictureCovered
from sim.faults.rotors import Derate, RotorStuck, ThrustLoss
from sim.faults.solver import SolverInfeasible, SolverSilent
from sim.faults.wall import BoardMoved, EdgeBroken, OtherWall

KINDS: dict[str, type[Fault]] = {
    kind.__name__: kind
    for kind in (
        NoFault, ChannelFault,
        CameraLost, CameraLatency, CameraJitter, CameraReordered, CameraFrozen,
        PlaneLost, LinesLost, WrongLines, DepthFlipped, FeatureNan, PictureCovered,
        ForceTorqueLost, ForceTorqueStuck, ForceTorqueNan, ForceTorqueZero, ForceTorqueBias,
        ImuStuck, ImuLate, ImuNan, GyroBias, AttitudeStep, AccelerometerBias,
        Derate, RotorStuck, ThrustLoss, WindStep, SidePush, OtherWall, BoardMoved, EdgeBroken,
        ClockJump, LoopStall, SlowLoop, TicksSkipped, SolverInfeasible, SolverSilent,
    )
}  # fmt: skip
