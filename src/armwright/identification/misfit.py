"""Whether friction is of the form that was fitted: a test against forms that bend with the speed in other ways."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.identification.equations import equations
from armwright.identification.fitting import Fit, weighted_errors
from armwright.identification.model import DynamicModel
from armwright.identification.signals import Motion, Preparation

# Terms by which friction may bend, and the speed of Stribeck friction by the greatest one.
_BENDS, _SPEED_PART = ("cube_root", "stribeck"), 0.1
# A misfit is said if chance makes one as large once in so many joints.
_RARELY = 1e-4


def friction_misfits(
    model: DynamicModel, fit: Fit, preparation: Preparation, motions: Sequence[Motion]
) -> Iterator[str]:
    """Give a warning of joints whose friction is clearly not of the form that was fitted.

    Args:
        model: of the arm, with the law that was fitted.
        fit: of its base parameters.
        preparation: of the motions.
        motions: that were fitted to.

    Source:
        Wald's test, with the covariance that knows of noise in time.
    """
    from scipy.stats import chi2  # noqa: PLC0415 - takes a tenth of a second to load

    more = tuple(term for term in _BENDS if term not in model.terms)
    if not more or "coulomb" not in model.terms:
        return
    speeds = np.max([np.abs(motion.qd).max(axis=0) for motion in motions], axis=0)
    part = np.maximum(_SPEED_PART * speeds, np.finfo(float).tiny)
    richer = attrs.evolve(
        model, terms=(*model.terms, *more), stribeck_speed=model.stribeck_speed if "stribeck" in model.terms else part
    )
    found = weighted_errors(list(equations(richer, motions, preparation.decimation)), fit.sigma)
    bent: dict[str, float] = {}
    for joint in range(model.arm.n):
        own = [richer.base.names.index(name) for term in more if (name := f"{term}{joint + 1}") in richer.base.names]
        value, C = found.values[own], found.covariance[np.ix_(own, own)]
        statistic = float(value @ np.linalg.pinv(C) @ value)
        if own and chi2.sf(statistic, len(own)) < _RARELY:
            bent[str(joint + 1)] = _bend(richer, found.values, own, speeds[joint])
    if bent:
        worst = max(bent, key=lambda joint: bent[joint])
        yield (
            f"the friction of joint{'s' * (len(bent) > 1)} {', '.join(bent)} is not of the form that was fitted: with "
            f"the speed it bends by some {bent[worst]:.2g} {model.arm.joints[int(worst) - 1].units.effort} at joint "
            f"{worst}; the errors of parameters do not know that"
        )


def _bend(model: DynamicModel, values: Array, own: Sequence[int], speed: float) -> float:
    """Return how much the further terms vary over the speeds of a joint, a line and a constant taken off."""
    v = np.linspace(0.02, 1.0, 50) * speed
    shapes = {"cube_root": np.cbrt(v), "stribeck": np.exp(-((v / (_SPEED_PART * speed)) ** 2))}
    total = sum(values[k] * shapes[model.base.names[k].rstrip("0123456789")] for k in own)
    line = np.polynomial.polynomial.polyfit(v, total, 1)
    return float(np.ptp(total - np.polynomial.polynomial.polyval(v, line)))
