"""MCAP bags in the layout of rosbag2, read and written without ROS."""
