#!/usr/bin/env python3
"""ROS 1: poses in, diagnostics out. ``rosrun``, or ``python3 ros1_node.py _detector:=d.dose3 _topic:=/odom``.

Parameters: ``~detector`` (file), ``~topic`` and ``~type`` (``PoseStamped``, ``PoseWithCovarianceStamped``, ``Odometry``),
or ``~parent`` and ``~child`` (a transform of ``/tf``), ``~frame`` (body frame; default: that of the trusted logs),
``~alarms_per_hour``, ``~hold``, ``~silence`` (seconds).
"""

import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from dose3_ros.backend import open_backend
from dose3_ros.core import Core

TYPES = {
    "PoseStamped": (PoseStamped, lambda m: m.pose),
    "PoseWithCovarianceStamped": (PoseWithCovarianceStamped, lambda m: m.pose.pose),
    "Odometry": (Odometry, lambda m: m.pose.pose),
}


class Node:
    """The shell around :class:`dose3_ros.core.Core`."""

    def __init__(self):
        get = rospy.get_param
        backend = open_backend(get("~detector"), get("~frame", None), float(get("~alarms_per_hour", 1.0)))
        self.core = Core(backend, float(get("~hold", 10.0)), float(get("~silence", 2.0)))
        # Callbacks come on threads of their own.
        self.lock = threading.Lock()
        self.name = get("~name", "dose3: pose monitor")
        self.publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        child = get("~child", None)
        if child:
            self.frames = (get("~parent").lstrip("/"), child.lstrip("/"))
            rospy.Subscriber("/tf", TFMessage, self.transforms, queue_size=1000)
        else:
            kind, self.pose_of = TYPES[get("~type", "Odometry")]
            rospy.Subscriber(get("~topic"), kind, self.message, queue_size=1000)
        rospy.Timer(rospy.Duration(1.0), self.publish)
        rospy.on_shutdown(self.close)

    def message(self, message):
        pose = self.pose_of(message)
        self.push(message.header.stamp, pose.position, pose.orientation)

    def transforms(self, message):
        for one in message.transforms:
            if (one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")) == self.frames:
                self.push(one.header.stamp, one.transform.translation, one.transform.rotation)

    def push(self, stamp, p, q):
        with self.lock:
            self.core.push(rospy.get_time(), stamp.to_nsec(), (p.x, p.y, p.z), (q.x, q.y, q.z, q.w))

    def publish(self, _event):
        with self.lock:
            status = self.core.status(rospy.get_time())
        array = DiagnosticArray()
        array.header.stamp = rospy.Time.now()
        values = [KeyValue(str(key), str(value)) for key, value in status.values.items()]
        array.status = [DiagnosticStatus(status.level, self.name, status.message, "", values)]
        self.publisher.publish(array)

    def close(self):
        with self.lock:
            self.core.close()


if __name__ == "__main__":
    rospy.init_node("dose3_monitor")
    Node()
    rospy.spin()
