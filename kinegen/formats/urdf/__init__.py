"""URDF, the robot description of ROS: links, and joints between them; what is only seen or weighed is left aside."""
