"""The terminal monitor: what has been heard, as a record, and how it is shown; without ROS."""
