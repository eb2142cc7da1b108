"""How far an arm comes and how fast its hand is, where its file does not say."""

from __future__ import annotations

import math

import numpy as np

from armwright.arm.model import Arm, Joint

# Speed of a tool at full reach where nothing is stated [m/s]: what makers of small arms call typical of straight lines.
USUAL_TOOL_SPEED = 1.0


def stretched_length(arm: Arm) -> float:
    """Return how far the tool would be from the base if the arm were straight [m]; farther away it never is.

    A slide without a limit counts as drawn in; an arm with one may come farther. An arm without any length is 1 m long.
    """
    spans = (joint.span(_farthest(joint)) for joint in arm.joints)
    return float(sum(spans) + np.linalg.norm(arm.tool[:3, 3])) or 1.0


def _farthest(joint: Joint) -> float:
    if joint.revolute:
        return 0.0
    return max((abs(x) for x in (joint.limits.lower, joint.limits.upper) if math.isfinite(x)), default=0.0)


def reach_of(arm: Arm) -> float:
    """Return the reach that the report's rule divides by: the stated one, or the length of the stretched arm [m]."""
    return arm.reach if math.isfinite(arm.reach) else stretched_length(arm)


def tool_speed_of(arm: Arm) -> float:
    """Return the speed of the tool at full reach: the stated one, or ``USUAL_TOOL_SPEED`` [m/s]."""
    return arm.tool_speed if math.isfinite(arm.tool_speed) else USUAL_TOOL_SPEED
