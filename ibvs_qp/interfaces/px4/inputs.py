"""Messages that the bridge receives: samples and pictures of the vehicle, and PX4's mode."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.dds import PICTURE_DEPTH, SAMPLE_DEPTH, Participant
from ibvs_qp.interfaces.ros.latest_samples import LatestSamples
from ibvs_qp.interfaces.ros.messages import IMAGE, BadMessage, decoded, from_px4
from ibvs_qp.interfaces.ros.topics import ACCEPTED

CONTROL_MODE = "px4_msgs/msg/VehicleControlMode"
#: Roles in addition to those of `ibvs_qp.interfaces.ros.topics.ACCEPTED`: PX4's mode, a colour picture with its depth.
MODE, PAIR = "mode", "pair"
#: Largest message, and picture without its pixels [bytes]: 1 kB, and names of frames.
LARGEST_MESSAGE = 4096
#: Largest picture [bytes]: 1920 x 1080 px of four bytes; decoding takes 15 ms.
LARGEST_PICTURE = 4 * 1920 * 1080
#: Places of timestamp, flag_armed and flag_control_offboard_enabled in CDR [bytes].
_TIMESTAMP, _ARMED, _OFFBOARD = 4, 12, 16
#: Byte orders by the header of CDR.
_ORDERS: dict[bytes, Literal["big", "little"]] = {b"\0\0": "big", b"\0\1": "little"}


class ControlMode(NamedTuple):
    """Mode of PX4: whether it accepts the bridge's setpoints (armed and in Offboard mode), and its time."""

    stamp_ns: int
    engaged: bool


def control_mode(data: bytes) -> ControlMode:
    """Mode from ``px4_msgs/VehicleControlMode``, or BadMessage; the later fields differ between versions of PX4."""
    order = _ORDERS.get(data[:2])
    if len(data) <= _OFFBOARD or order is None or max(data[_ARMED : _OFFBOARD + 1]) > 1:
        raise BadMessage("undecodable")
    stamp = from_px4(int.from_bytes(data[_TIMESTAMP:_ARMED], order))
    return ControlMode(stamp, bool(data[_ARMED] and data[_OFFBOARD]))


class Subscription(NamedTuple):
    """A topic to read, as PX4 or ROS name it."""

    role: str
    topic: str
    type_name: str
    depth: int

    @property
    def largest(self) -> int:
        """Largest message that is decoded [bytes]."""
        return LARGEST_MESSAGE + (LARGEST_PICTURE if self.type_name == IMAGE else 0)


def subscriptions(config: BridgeConfig) -> tuple[Subscription, ...]:
    """Topics that the bridge reads."""
    types = {role: accepted[0] for role, accepted in ACCEPTED.items()}
    types |= {"imu": config.imu_type, "attitude": config.attitude_type, MODE: CONTROL_MODE}
    names = config.topics.names(tuple(ACCEPTED)) | {MODE: "/fmu/out/vehicle_control_mode"}
    return tuple(
        Subscription(
            role,
            config.namespace + name if name.startswith("/fmu/") else name,
            types[role],
            PICTURE_DEPTH if types[role] == IMAGE else SAMPLE_DEPTH,
        )
        for role, name in names.items()
    )


class Inputs:
    """Reads all topics once a tick.

    Attributes:
        held: Samples and pictures, and the messages that were left out.
        mode: PX4's mode, None before the first one.
        arrived_ns: When the last usable message of every role arrived, in the time of the ticks [ns].

    Args:
        config: Settings.
        participant: Of the DDS domain.
        clock: The clock of the stamps [ns].
    """

    def __init__(self, config: BridgeConfig, participant: Participant, clock: Callable[[], int]) -> None:
        self._readers = {each.role: (participant.reader(*each[1:]), each) for each in subscriptions(config)}
        self._attitude_in_imu = not config.topics.attitude
        self.held = LatestSamples(config.topics, clock)
        self.mode: ControlMode | None = None
        self.arrived_ns: dict[str, int] = {}

    def poll(self, now_ns: int) -> None:
        """Take the messages since the last tick; unusable ones are counted."""
        for role, (reader, topic) in self._readers.items():
            for data in reader.take():
                pairs = self.held.pairs
                try:
                    if len(data) > topic.largest:
                        raise BadMessage("too large")
                    if role == MODE:
                        mode = control_mode(data)
                        self.held.check_clock(mode.stamp_ns)  # random bytes are a mode, but seldom with a present time
                        self.mode = mode
                    elif not self.held.add(role, decoded(data, topic.type_name)):
                        continue
                except BadMessage as error:
                    self.held.ignore(role, str(error))
                    continue
                self.arrived_ns[role] = now_ns
                if self.held.pairs > pairs:
                    self.arrived_ns[PAIR] = now_ns
                if role == "imu" and self._attitude_in_imu:
                    self.arrived_ns["attitude"] = now_ns

    def age_s(self, role: str, clock_ns: int) -> float:
        """Age of the last sample of a role by its stamp [s], at a time of the clock [ns]; infinite before the first."""
        sample = self.held.last.get(role)
        return math.inf if sample is None else 1e-9 * (clock_ns - sample.stamp_ns)

    def older(self, role: str, now_ns: int, limit_s: float) -> bool:
        """Whether the last usable message of a role arrived longer ago than a limit [s], or never."""
        arrived = self.arrived_ns.get(role)
        return arrived is None or now_ns - arrived > round(1e9 * limit_s)
