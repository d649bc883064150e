"""Tasks: the wishes of the program, one class each, as symbolic least-squares rows."""

from ibvs_qp.tasks.attitude import LevelTask, YawTask
from ibvs_qp.tasks.effort import EffortTask, SmoothnessTask
from ibvs_qp.tasks.height import HeightTask
from ibvs_qp.tasks.line import LineTask
from ibvs_qp.tasks.push import PushTask, StandoffTask
from ibvs_qp.tasks.task import Task
from ibvs_qp.tasks.velocity import VelocityTask

__all__ = [
    "EffortTask",
    "HeightTask",
    "LevelTask",
    "LineTask",
    "PushTask",
    "SmoothnessTask",
    "StandoffTask",
    "Task",
    "VelocityTask",
    "YawTask",
]
