"""Names and bytes on the wire are those of ROS 2, by an encoder that is not ours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")
pytest.importorskip("cyclonedds", reason="needs the extra dds")

from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.dds import _struct, dds_topic, dds_type, raw_type
from ibvs_qp.interfaces.px4.inputs import subscriptions
from ibvs_qp.interfaces.px4.outputs import OFFBOARD_MODE, SETPOINTS
from ibvs_qp.interfaces.ros.messages import encoded, message, typestore

TYPES = {each.type_name for each in subscriptions(BridgeConfig())} | {
    OFFBOARD_MODE,
    *(name for topics in SETPOINTS.values() for name in topics.values()),
}
BASIC = {"bool": True, "string": "abc", "float32": 1.5, "float64": -2.5}


def test_names_are_mangled_as_ros_2_does() -> None:
    assert dds_topic("/fmu/in/actuator_motors") == "rt/fmu/in/actuator_motors"
    assert dds_type("px4_msgs/msg/ActuatorMotors") == "px4_msgs::msg::dds_::ActuatorMotors_"
    assert raw_type("sensor_msgs/msg/Imu").__idl_typename__ == "sensor_msgs.msg.dds_.Imu_"


def filled(name: str, ours: bool) -> Any:
    """A message with a value in every field, for our encoder or for that of Cyclone DDS."""
    kinds = {} if ours else {name: _struct(name)}

    def value(description: Any, kind: Any) -> Any:
        family, details = description
        if family.name == "BASE":
            return BASIC.get(details[0], 7)
        if family.name == "NAME":
            return struct(details, kind)
        element = details[0][1][0]
        entries = [BASIC.get(element, 7)] * (details[1] or 3)
        return np.array(entries, element) if ours else entries

    def struct(type_name: str, kind: Any) -> Any:
        values = {}
        for field, description in typestore().fielddefs[type_name][1]:
            inner = None if ours else kind.__annotations__[field]
            values[field] = value(description, inner)
        if ours:
            return message(type_name, **values)
        made = kind.__new__(kind)
        vars(made).update(values)
        return made

    return struct(name, kinds.get(name))


@pytest.mark.parametrize("name", sorted(TYPES))
def test_bytes_are_those_of_cyclone_dds(name: str) -> None:
    theirs = filled(name, ours=False).serialize(use_version_2=False)
    assert bytes(encoded(filled(name, ours=True), name)) == bytes(theirs)
