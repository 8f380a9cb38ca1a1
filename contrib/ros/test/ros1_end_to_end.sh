#!/usr/bin/env bash
# ROS 1 end to end: a bag with a fault is played, the node judges it, the diagnostics are read.
# Debian 12: apt-get install --no-install-recommends python3-rospy python3-rosbag python3-rosmaster python3-roslaunch \
#   python3-diagnostic-msgs python3-nav-msgs python3-geometry-msgs python3-tf2-msgs
# usage: ros1_end_to_end.sh DETECTOR LOG.txt [SPEED]   (a TUM file with a fault in it; `dose3` on the path)
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
detector=$(realpath "$1") log=$(realpath "$2") speed=${3:-4}
python=${ROS_PYTHON:-/usr/bin/python3}
work=$(mktemp -d)
jobs_=()
finish() {
  for job in "${jobs_[@]}"; do kill "$job" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap finish EXIT
export ROS_MASTER_URI=${ROS_MASTER_URI:-http://localhost:11399} ROS_HOME=$work ROS_LOG_DIR=$work PYTHONPATH=$here

"$python" "$here/test/make_bag.py" "$log" "$work/log.bag"
rosmaster --core -p "${ROS_MASTER_URI##*:}" >"$work/master.log" 2>&1 & jobs_+=($!)
for _ in $(seq 50); do "$python" -c 'import rosgraph; rosgraph.Master("/test").getPid()' 2>/dev/null && break; sleep 0.2; done

"$python" "$here/ros1_node.py" _detector:="$detector" _topic:=/odom _type:=Odometry _hold:=3 _silence:=10 \
  >"$work/node.log" 2>&1 & jobs_+=($!)
"$python" "$here/test/read_diagnostics.py" 240 & reader=$!
sleep 3
rosbag play --quiet --rate "$speed" "$work/log.bag" >"$work/play.log" 2>&1 & jobs_+=($!)
if wait "$reader"; then exit 0; fi
tail -n 20 "$work"/*.log >&2
exit 1
