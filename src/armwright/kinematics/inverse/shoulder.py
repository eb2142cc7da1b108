"""The first three joints: where they must stand to put the wrist centre at a point, over abstract scalars.

Both shoulders turn about a vertical axis and carry the arm at a fixed distance beside it, so both begin with
the same question: which angle of joint 1 puts the point at that distance from the plane of the arm.
"""

import math
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.tracing.scalar import atan2, cos, sin, sqrt
from armwright.tracing.vectors import Vector

Family: TypeAlias = Literal["puma", "stanford"]
Sign: TypeAlias = Literal[1, -1]

_RIGHT = math.pi / 2
# Twists and joint kinds that make an arm one of the family; joints 4 to 6 are the wrist.
_PATTERNS: dict[Family, tuple[str, tuple[float, ...]]] = {
    "puma": ("RRRRRR", (-_RIGHT, 0.0, _RIGHT, -_RIGHT, _RIGHT, 0.0)),
    "stanford": ("RRPRRR", (-_RIGHT, _RIGHT, 0.0, -_RIGHT, _RIGHT, 0.0)),
}
_SAME_LENGTH = 1e-12


@attrs.frozen(kw_only=True)
class Shoulder:
    """The lengths of a shoulder that its closed form needs, in [m].

    Attributes:
        family: which closed form.
        height: of the shoulder above frame 0.
        side: distance of the plane of the arm from the vertical axis.
        upper: length of the upper arm (PUMA).
        fore: (along, across) of the forearm: a3 and d4 (PUMA).
        hand: distance of the hand from the wrist centre.
    """

    family: Family
    height: float
    side: float
    upper: float = 0.0
    fore: tuple[float, float] = (0.0, 0.0)
    hand: float = 0.0

    @property
    def nearest(self) -> float:
        """Smallest distance of the wrist centre from the shoulder [m]."""
        return math.hypot(self.upper - math.hypot(*self.fore), self.side) if self.family == "puma" else abs(self.side)

    @property
    def farthest(self) -> float:
        """Largest distance of the wrist centre from the shoulder [m]; a slide has none but its limit."""
        return math.hypot(self.upper + math.hypot(*self.fore), self.side) if self.family == "puma" else math.inf


def shoulder_of(arm: Arm) -> Shoulder | None:
    """Return the shoulder of ``arm``, or None when the arm belongs to neither family."""
    kinds = "".join("R" if joint.revolute else "P" for joint in arm.joints)
    twists = [joint.alpha for joint in arm.joints]
    a, d = [joint.a for joint in arm.joints], [joint.d for joint in arm.joints]
    for family, (pattern, angles) in _PATTERNS.items():
        if kinds != pattern or not np.allclose(twists, angles, rtol=0, atol=_SAME_LENGTH):
            continue
        zero = [a[0], a[3], a[4], a[5], d[4]] + ([a[1], a[2], d[3]] if family == "stanford" else [])
        if np.abs(zero).max() > _SAME_LENGTH:
            continue
        if family == "puma":
            return Shoulder(family=family, height=d[0], side=d[1] + d[2], upper=a[1], fore=(a[2], d[3]), hand=d[5])
        return Shoulder(family=family, height=d[0], side=d[1], hand=d[5])
    return None


def first_three(shoulder: Shoulder, p: Vector, arm: Sign, elbow: Sign) -> Vector:
    """Return joint variables 1 to 3 (theta, or d of a slide) that put the wrist centre at ``p``.

    A point out of reach gives the posture that stretches, or folds, towards it.

    Args:
        shoulder: the lengths.
        p: wrist centre in frame 0 [m].
        arm: 1 for the left arm as PUMA users say, which reaches out on the side joint 1 faces; -1 for the right.
        elbow: 1 or -1, which of the two elbow postures; for a slide, forwards or backwards.

    Source:
        PUMA: Paul (1981) ch. 3. Stanford: Paul (1981) ch. 3; TR-83-008 appendix 1.
    """
    x, y, z = p
    across = sqrt(x * x + y * y - shoulder.side**2)
    theta_1 = atan2(y, x) - atan2(shoulder.side, arm * across)
    # In the plane of the arm: X outwards, Z upwards, from the shoulder.
    X, Z = arm * across, z - shoulder.height
    if shoulder.family == "stanford":
        return [theta_1, atan2(elbow * X, elbow * Z), elbow * sqrt(X * X + Z * Z)]
    a2, (a3, d4) = shoulder.upper, shoulder.fore
    fore = math.hypot(a3, d4)
    K = (X * X + Z * Z - a2 * a2 - fore * fore) / (2 * a2)
    theta_3 = math.atan2(d4, a3) + elbow * atan2(sqrt(fore * fore - K * K), K)
    u = a2 + a3 * cos(theta_3) + d4 * sin(theta_3)
    v = a3 * sin(theta_3) - d4 * cos(theta_3)
    theta_2 = atan2(-Z, X) - atan2(v, u)
    return [theta_1, theta_2, theta_3]


def nearest_wrist(shoulder: Shoulder, p: Vector) -> Vector:
    """Return the point nearest to ``p`` where the wrist centre can be, in frame 0 [m].

    Seen in the half-plane of ``p``, the reach is the ring between two circles, less the strip beside the axis.
    """
    x, y, z = (float(value) for value in p)
    rho, height = math.hypot(x, y), z - shoulder.height
    inner, outer, side = shoulder.nearest, shoulder.farthest, abs(shoulder.side)
    rounding = 1e-12 * max(1.0, rho, abs(height))

    def reachable(point: tuple[float, float]) -> bool:
        return point[0] >= side - rounding and inner - rounding <= math.hypot(*point) <= outer + rounding

    candidates = [(rho, height), (side, height)]
    for radius in (inner, outer):
        if math.isinf(radius):
            continue
        distance = math.hypot(rho, height)
        candidates.append((rho * radius / distance, height * radius / distance) if distance else (radius, 0.0))
        corner = math.sqrt(max(radius**2 - side**2, 0.0))
        candidates += [(side, corner), (side, -corner)]
    best = min(filter(reachable, candidates), key=lambda c: math.hypot(c[0] - rho, c[1] - height))
    c, s = (x / rho, y / rho) if rho else (1.0, 0.0)
    return [best[0] * c, best[0] * s, best[1] + shoulder.height]
