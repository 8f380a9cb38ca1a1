#!/usr/bin/env python3
"""ROS 2: poses in, diagnostics out. UNTESTED: no ROS 2 was at hand where it was written. All but this shell is shared
with the node for ROS 1, which is tested.

``python3 ros2_node.py --ros-args -p detector:=d.dose3 -p topic:=/odom -p type:=Odometry``; parameters as in
``ros1_node.py``.
"""

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node as RosNode
from rclpy.qos import qos_profile_sensor_data
from tf2_msgs.msg import TFMessage

from dose3_ros.backend import open_backend
from dose3_ros.core import Core

TYPES = {
    "PoseStamped": (PoseStamped, lambda m: m.pose),
    "PoseWithCovarianceStamped": (PoseWithCovarianceStamped, lambda m: m.pose.pose),
    "Odometry": (Odometry, lambda m: m.pose.pose),
}


class Node(RosNode):
    """The shell around :class:`dose3_ros.core.Core`."""

    def __init__(self):
        super().__init__("dose3_monitor")
        get = lambda name, default: self.declare_parameter(name, default).value
        frame = get("frame", "") or None
        backend = open_backend(get("detector", ""), frame, float(get("alarms_per_hour", 1.0)))
        self.core = Core(backend, float(get("hold", 10.0)), float(get("silence", 2.0)))
        self.name_shown = get("name", "dose3: pose monitor")
        self.publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        child = get("child", "")
        if child:
            self.frames = (get("parent", "").lstrip("/"), child.lstrip("/"))
            self.create_subscription(TFMessage, "/tf", self.transforms, 1000)
        else:
            kind, self.pose_of = TYPES[get("type", "Odometry")]
            self.create_subscription(kind, get("topic", ""), self.message, qos_profile_sensor_data)
        self.create_timer(1.0, self.publish)

    def now(self):
        return self.get_clock().now().nanoseconds * 1e-9

    def message(self, message):
        pose = self.pose_of(message)
        self.push(message.header.stamp, pose.position, pose.orientation)

    def transforms(self, message):
        for one in message.transforms:
            if (one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")) == self.frames:
                self.push(one.header.stamp, one.transform.translation, one.transform.rotation)

    def push(self, stamp, p, q):
        stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        self.core.push(self.now(), stamp_ns, (p.x, p.y, p.z), (q.x, q.y, q.z, q.w))

    def publish(self):
        status = self.core.status(self.now())
        array = DiagnosticArray()
        array.header.stamp = self.get_clock().now().to_msg()
        values = [KeyValue(key=str(k), value=str(v)) for k, v in status.values.items()]
        one = DiagnosticStatus(name=self.name_shown, message=status.message, values=values)
        one.level = bytes([status.level])
        array.status = [one]
        self.publisher.publish(array)


def main():
    rclpy.init()
    node = Node()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.core.close()
        node.destroy_node()


if __name__ == "__main__":
    main()
