"""When joints of an arm are at their limits."""

from collections.abc import Iterator
from typing import Literal

import attrs
import numpy as np

from armwright.arm.limits import JointLimits
from armwright.arrays import Array

LimitKind = Literal["position", "speed", "acceleration", "effort"]
# Their names where there is little room.
SHORT: dict[LimitKind, str] = {"position": "pos", "speed": "speed", "acceleration": "acc", "effort": "effort"}

# A joint is at a limit from this share of it on, which is shown as 100 %.
_REACHED = 0.995
# Spans that are nearer to each other than this share of the motion are one.
_GAP = 1 / 400


@attrs.frozen(kw_only=True)
class LimitSpan:
    """A joint is at a limit for a while.

    Attributes:
        t0: from when on [s].
        t1: until when [s].
        joint: its number, from 0.
        limit: which one.
        share: the largest share of it.
    """

    t0: float
    t1: float
    joint: int
    limit: LimitKind
    share: float


def limit_spans(limits: JointLimits, motion: tuple[Array, Array, Array, Array, Array | None]) -> Iterator[LimitSpan]:
    """Yield when joints reach 99.5 % of their limits, by limit and joint.

    Args:
        limits: of n joints.
        motion: (k,) instants [s]; (k, n) positions [rad] or [m], speeds, accelerations, and efforts [N m] or [N], which
            may be unknown.
    """
    t, q, qd, qdd, tau = motion
    with np.errstate(invalid="ignore"):
        # Without both ends there is no middle, and no share.
        shares: dict[LimitKind, Array] = {"position": np.abs(2 * q - limits.lower - limits.upper)}
        shares["position"] = shares["position"] / (limits.upper - limits.lower)
        shares["speed"], shares["acceleration"] = np.abs(qd) / limits.speed, np.abs(qdd) / limits.acceleration
        if tau is not None:
            shares["effort"] = np.abs(tau) / limits.effort
    gap = _GAP * float(t[-1] - t[0]) if len(t) else 0.0
    for limit, share in shares.items():
        for joint in np.flatnonzero((share >= _REACHED).any(axis=0)):
            rows = np.flatnonzero(share[:, joint] >= _REACHED)
            ends = np.flatnonzero(np.diff(t[rows]) > max(gap, 0.0)) + 1
            for span in np.split(rows, ends):
                first, last = float(t[span[0]]), float(t[span[-1]])
                yield LimitSpan(t0=first, t1=last, joint=int(joint), limit=limit, share=float(share[span, joint].max()))
