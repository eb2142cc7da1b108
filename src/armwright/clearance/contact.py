"""The contact law of a journal in its bearing: stiffness, damping by impact speed, friction.

    F_N = K δ^1.5 (1 + χ δ̇ / v0)

with the indentation δ and the impact speed v0; χ stands for the loss of an impact, and each law has its own. The force
is never negative.

Source:
    Thesis eq. (3.17)-(3.20); Lankarani & Nikravesh (1990); spec of the clearance, 1.1 and 2.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Literal, TypeAlias

import numpy as np
from scipy.optimize import brentq

from armwright.arrays import Array, ArrayLike
from armwright.errors import InvalidValueError, one_of
from armwright.tracing.scalar import Scalar, select, sqrt

ImpactLaw: TypeAlias = Literal[
    "lankarani-nikravesh", "flores", "hu-guo", "carvalho-martins", "hunt-crossley", "lee-wang", "herbert-mcwhannell",
    "gonthier", "exact",
]  # fmt: skip
FrictionLaw: TypeAlias = Literal["linear", "tanh", "lugre"]

FRICTION_LAWS: tuple[FrictionLaw, ...] = ("linear", "tanh", "lugre")
# The lower limit of the impact speed, by which the law divides [m/s].
SLOWEST_IMPACT = 1e-3
# A χ below which rounding makes the closed forms useless.
_MIN_DAMPING = 1e-6


def exact_damping(restitution: float) -> float:
    """Return the χ that yields exactly this restitution: the root of the closed form."""
    if restitution == 1:
        return 0.0

    def excess(chi: float) -> float:
        return math.log1p(chi) - math.log1p(-chi * restitution) - chi * (1 + restitution)

    # χ e stays below 1; the second root is χ = 0.
    largest = (1 - 1e-15) / restitution
    if excess(largest) < 0:
        # Of a restitution below 0.027 the root is 1 / e to all digits.
        return largest
    return float(brentq(excess, min(1e-9, 1e-3 * (1 - restitution)), largest, xtol=1e-15, rtol=1e-14))


# χ by the requested restitution, after the papers of its authors.
_LAWS: Mapping[str, Callable[[float], float]] = {
    "hunt-crossley": lambda e: 3 * (1 - e) / 2,
    "lankarani-nikravesh": lambda e: 3 * (1 - e * e) / 4,
    "lee-wang": lambda e: 3 * (1 - e) / 4,
    "herbert-mcwhannell": lambda e: 6 * (1 - e) / ((2 * e - 1) ** 2 + 3),
    "gonthier": lambda e: (1 - e * e) / e,
    "flores": lambda e: 8 * (1 - e) / (5 * e),
    "hu-guo": lambda e: 3 * (1 - e) / (2 * e),
    "carvalho-martins": lambda e: 3 * (1 - e) * (11 - e) / (2 * (1 + 9 * e)),
    "exact": exact_damping,
}
IMPACT_LAWS = tuple(_LAWS)


def damping(law: str, restitution: float) -> float:
    """Return χ, the damping that determines the loss of an impact.

    Args:
        law: name of the impact law; ``exact`` yields exactly the requested restitution.
        restitution: requested, above 0, at most 1.

    Raises:
        UnknownNameError: there is no such law.
        InvalidValueError: the restitution is out of range.
    """
    if not 0 < restitution <= 1:
        raise InvalidValueError(f"restitution: expected a number above 0, at most 1, got {restitution:g}")
    return _LAWS[one_of("law of impact", law, _LAWS)](restitution)


def restitution_of_damping(chi: float) -> float:
    """Return the restitution of an impact: the root e of 1 + e = ln[(1 + χ) / (1 - χ e)] / χ."""
    if chi < _MIN_DAMPING:
        # Rounding spoils the equation, but not its series.
        return 1.0 - chi * 2 / 3

    def excess(e: float) -> float:
        return chi * (1 + e) - math.log1p(chi) + math.log1p(-chi * e)

    # Written for e χ < 1, of which e = -1 is always a root.
    largest = min(1.0, (1 - 1e-15) / chi)
    return largest if excess(largest) > 0 else float(brentq(excess, 0.0, largest, xtol=1e-15))


def largest_indentation(mass: float, stiffness: float, speed: float, chi: float) -> float:
    """Return the largest indentation of an impact [m].

    Args:
        mass: of the body that hits a wall [kg].
        stiffness: K [N/m^1.5].
        speed: of the impact [m/s].
        chi: see ``damping``.
    """
    part = 0.5 if chi < _MIN_DAMPING else (chi - math.log1p(chi)) / chi**2
    return float((2.5 * mass * speed**2 / stiffness * part) ** 0.4)


def stiffness(clearance: ArrayLike, journal_radius: float, young: float, poisson: float) -> Array:
    """Return K of a journal in a bearing of one material [N/m^1.5].

    Args:
        clearance: radius of the bearing minus that of the journal, any shape [m].
        journal_radius: [m].
        young: modulus of elasticity [Pa].
        poisson: ratio.

    Raises:
        InvalidValueError: a clearance is not above 0, so that the law has no meaning.

    Source:
        Thesis eq. (3.18), (3.19); the π of the paper cancels.
    """
    c = np.asarray(clearance, dtype=np.float64)
    if not np.all(c > 0):
        raise InvalidValueError(f"clearance: contact needs clearances above 0, got {float(c.min()) * 1e3:g} mm")
    h = (1 - poisson**2) / young
    return 4 / (3 * (h + h)) * np.sqrt((journal_radius + c) * journal_radius / c)


def normal_force(depth: Scalar, rate: Scalar, impact_speed: Scalar, K: Scalar, chi: Scalar) -> Scalar:
    """Return the normal force between journal and bearing [N], never negative.

    Args:
        depth: δ, above 0 where they touch [m].
        rate: δ̇ [m/s].
        impact_speed: v0 [m/s].
        K: stiffness [N/m^1.5].
        chi: see ``damping``.
    """
    inside = select(depth > 0.0, depth, 0.0)
    force = elastic_force(inside, K) * (1.0 + chi * rate / impact_speed)
    return select(force > 0.0, force, 0.0)


def elastic_force(depth: Scalar, K: Scalar) -> Scalar:
    """Return K δ^1.5 [N] of a depth that is not negative."""
    return K * (depth * sqrt(depth))


def linear_slip(speed: Scalar, threshold: Scalar) -> Scalar:
    """Return the direction of sliding: -1 or 1, and between them a straight line below the threshold."""
    part = speed / threshold
    part = select(part > 1.0, 1.0, part)
    return select(part < -1.0, -1.0, part)


def smooth_slip(speed: Scalar, threshold: Scalar) -> Scalar:
    """Return tanh(speed / threshold)."""
    x = abs(speed) / threshold
    decay = exp_negative(2.0 * x)
    size = (1.0 - decay) / (1.0 + decay)
    return select(speed < 0.0, -size, size)


def exp_negative(x: Scalar) -> Scalar:
    """Return exp(-x) of an x that is not negative, to 13 digits; 0 beyond 700.

    The power series of exp(-x / 1024), and ten squarings: a processor does many at once.
    """
    x = select(x > 700.0, 700.0, x)
    small = x * (-1.0 / 1024.0)
    series = 1.0
    for i in range(11, 0, -1):
        series = 1.0 + small * series * (1.0 / i)
    for _ in range(10):
        series = series * series
    return series


class Bristles:
    """The LuGre law: bristles that deflect before they slip.

    Attributes:
        stiffness: σ0 [1/m].
        damping: σ1 [s/m].
        viscosity: σ2 [s/m].
        stribeck: the speed at which friction has fallen to that of sliding [m/s].
        static_ratio: friction at rest by that of sliding.

    Source:
        Canudas de Wit, Olsson, Åström, Lischinsky (1995), with forces divided by the normal force.
    """

    stiffness = 1e5
    damping = 316.0
    viscosity = 0.4
    stribeck = 1e-3
    static_ratio = 1.2

    @classmethod
    def step(cls, deflection: Scalar, speed: Scalar, friction: Scalar) -> tuple[Scalar, Scalar]:
        """Return the coefficient of friction and the rate of the bristle deflection [m/s].

        Args:
            deflection: of the bristles [m].
            speed: of sliding [m/s].
            friction: coefficient of sliding.
        """
        ratio = speed / cls.stribeck
        limit = friction * (1.0 + (cls.static_ratio - 1.0) * exp_negative(ratio * ratio))
        # Without friction the deflection has no limit to refer to.
        divisor = select(limit > 0.0, limit, 1.0)
        rate = speed - cls.stiffness * abs(speed) * deflection / divisor
        force = cls.stiffness * deflection + cls.damping * rate + cls.viscosity * speed
        return select(limit > 0.0, force, 0.0), select(limit > 0.0, rate, 0.0)
