"""Inverse kinematics: labelled configurations that bring the tool to a pose, in closed form where there is one."""
