"""Tasks: one file each, with error, rate, gain, target, weight and row."""

from ibvs_qp.tasks.effort import EffortTask, SmoothnessTask
from ibvs_qp.tasks.height import HeightTask
from ibvs_qp.tasks.level import LevelTask
from ibvs_qp.tasks.line import LineTask
from ibvs_qp.tasks.margin import MarginTask
from ibvs_qp.tasks.paper_line import PaperLineTask
from ibvs_qp.tasks.push import PushTask
from ibvs_qp.tasks.standoff import StandoffTask
from ibvs_qp.tasks.task import Task
from ibvs_qp.tasks.velocity import VelocityTask
from ibvs_qp.tasks.yaw import YawTask

__all__ = [
    "EffortTask",
    "HeightTask",
    "LevelTask",
    "LineTask",
    "MarginTask",
    "PaperLineTask",
    "PushTask",
    "SmoothnessTask",
    "StandoffTask",
    "Task",
    "VelocityTask",
    "YawTask",
]
