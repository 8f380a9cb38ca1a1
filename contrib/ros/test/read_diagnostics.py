#!/usr/bin/env python3
"""Waits for diagnostics: prints every change of level, ends well once it has seen OK, ERROR, and then WARN or OK."""

import sys

import rospy
from diagnostic_msgs.msg import DiagnosticArray

NAMES = {0: "OK", 1: "WARN", 2: "ERROR", 3: "STALE"}


def main(patience):
    seen = []

    def heard(array):
        for status in array.status:
            level = NAMES[int(status.level)]
            if not seen or seen[-1] != level:
                seen.append(level)
                values = {value.key: value.value for value in status.values}
                print(level, "-", status.message, values, flush=True)

    rospy.init_node("read_diagnostics", anonymous=True)
    rospy.Subscriber("/diagnostics", DiagnosticArray, heard)
    end = rospy.get_time() + patience
    while rospy.get_time() < end and not rospy.is_shutdown():
        rospy.sleep(0.2)
        if "OK" in seen and "ERROR" in seen[seen.index("OK") :]:
            after = seen[seen.index("ERROR", seen.index("OK")) + 1 :]
            if after and after[0] in ("WARN", "OK"):
                print("passed: OK, ERROR, then", after[0], flush=True)
                return 0
    print("failed: saw", seen, flush=True)
    return 1


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1])))
