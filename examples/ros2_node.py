"""The pilot as a ROS 2 node, for stacks with rclpy: sensor topics in, thrusts out on ``/rotor_thrusts`` [N].

Source ROS 2 first. Without ROS the same messages come by DDS: ``ibvs-qp bridge`` (docs/px4.md).
"""

import functools

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, Imu
from std_msgs.msg import Float64MultiArray

from ibvs_qp import Pilot, preset
from ibvs_qp.interfaces.ros.latest_samples import LatestSamples
from ibvs_qp.interfaces.ros.topics import Topics

TYPES = {"imu": Imu, "wrench": WrenchStamped, "color": Image, "depth": Image, "camera_info": CameraInfo}


class PilotNode(Node):
    """Steps a pilot once a tick with the last samples; messages of no use are counted in ``held.ignored``."""

    def __init__(self, topics: Topics) -> None:
        super().__init__("ibvs_qp")
        self.pilot, self.prepared = Pilot(preset("qp")), False
        self.pilot.prepare()
        self.held = LatestSamples(topics, clock=lambda: self.get_clock().now().nanoseconds)
        self.thrusts = self.create_publisher(Float64MultiArray, "/rotor_thrusts", 1)
        for role, name in topics.names(tuple(TYPES)).items():
            take = functools.partial(self.held.add, role)
            self.create_subscription(TYPES[role], name, take, qos_profile_sensor_data)
        self.create_timer(self.pilot.config.controller.tick_s, self.tick)

    def tick(self) -> None:
        """One command; none before every sensor was received."""
        frame = self.held.frame(self.get_clock().now().nanoseconds)
        if frame is None:
            return
        if frame.image is not None and not self.prepared:
            self.pilot.prepare(frame.image)
            self.prepared = True
        command = self.pilot.step(frame)
        self.thrusts.publish(Float64MultiArray(data=command.thrusts.tolist()))


def main() -> None:
    """Run until Ctrl-C."""
    rclpy.init()
    rclpy.spin(PilotNode(Topics()))


if __name__ == "__main__":
    main()
