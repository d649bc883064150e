"""Stand-in for rclpy and its message packages: nodes whose clock, subscriptions and timers the test drives.

Messages have the attributes of rclpy's and, as those, no `__msgtype__`; their classes lie in modules like
``sensor_msgs.msg._imu``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

TYPES = {
    "sensor_msgs": ("Imu", "Image", "CameraInfo"),
    "geometry_msgs": ("WrenchStamped",),
    "std_msgs": ("Float64MultiArray",),
}


class Node:
    """A node of the stand-in; `now_ns` is its clock."""

    def __init__(self, name: str) -> None:
        self.name, self.now_ns = name, 0
        self.taken: dict[str, tuple[type, Callable[[Any], Any]]] = {}
        self.published: dict[str, list[Any]] = {}
        self.timers: list[tuple[float, Callable[[], None]]] = []

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self.now_ns))

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        sent = self.published.setdefault(topic, [])
        return SimpleNamespace(publish=sent.append)

    def create_subscription(self, kind: type, topic: str, take: Callable[[Any], Any], qos: Any) -> None:
        self.taken[topic] = kind, take

    def create_timer(self, period_s: float, call: Callable[[], None]) -> None:
        self.timers.append((period_s, call))

    def receive(self, topic: str, value: Any) -> None:
        """Hand a message of rosbags to the subscription of a topic as one of rclpy."""
        kind, take = self.taken[topic]
        assert value.__msgtype__.endswith(f"/{kind.__name__}")
        own = kind()
        vars(own).update({name: getattr(value, name) for name in value.__dataclass_fields__ if name != "__msgtype__"})
        take(own)


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the stand-in in the place of ROS for one test."""
    modules = {"rclpy": {"init": lambda: None, "spin": lambda node: None}, "rclpy.node": {"Node": Node}}
    modules["rclpy.qos"] = {"qos_profile_sensor_data": object()}
    for package, names in TYPES.items():
        places = {name: {"__module__": f"{package}.msg._{name.lower()}"} for name in names}
        kinds = {name: type(name, (SimpleNamespace,), place) for name, place in places.items()}
        modules |= {package: {}, f"{package}.msg": kinds}
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
