"""The files in which arms of Universal Robots keep their calibration: ``calibration.conf``, and the YAML of ROS 2."""
