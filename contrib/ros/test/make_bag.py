#!/usr/bin/env python3
"""Writes a bag of odometry from a TUM file: ``make_bag.py log.txt out.bag``."""

import sys

import rosbag
import rospy
from nav_msgs.msg import Odometry


def main(source, target):
    with open(source) as lines, rosbag.Bag(target, "w") as bag:
        for line in lines:
            if line.startswith("#") or not line.strip():
                continue
            t, x, y, z, qx, qy, qz, qw = line.split()
            whole, _, part = t.partition(".")
            # rosbag refuses the time 0.
            stamp = rospy.Time(int(whole) + 1, int((part + "0" * 9)[:9]))
            message = Odometry()
            message.header.stamp = stamp
            message.header.frame_id = "odom"
            message.child_frame_id = "base_link"
            pose = message.pose.pose
            pose.position.x, pose.position.y, pose.position.z = float(x), float(y), float(z)
            pose.orientation.x, pose.orientation.y = float(qx), float(qy)
            pose.orientation.z, pose.orientation.w = float(qz), float(qw)
            bag.write("/odom", message, stamp)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
