"""Inverse kinematics: configurations that put the hand at a pose, labelled and judged; closed forms where there are."""
