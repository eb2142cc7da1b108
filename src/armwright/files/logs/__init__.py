"""Logs of robots: joint states out of MCAP files and bags of ROS 2, whoever wrote them."""
