"""Inverse kinematics in closed form: every posture that puts the hand at a pose, labelled and judged."""
