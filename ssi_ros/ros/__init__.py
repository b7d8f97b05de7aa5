"""ROS 2 nodes: messages in, records through the stages, messages out."""
