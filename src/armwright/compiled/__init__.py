"""The kernels of an arm: the laws of kinematics and dynamics, traced for that arm and compiled."""
