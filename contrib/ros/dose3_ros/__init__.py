"""A monitor of poses for ROS: what ROS 1 and ROS 2 share."""
