"""Which base parameters the motions told little of, and which simple motion would tell them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.dynamics.regressors import OF_LINK
from armwright.identification.feasible import body_sizes
from armwright.identification.fitting import Fit, inverse_of
from armwright.identification.model import DynamicModel

# A parameter whose standard error is a larger part of it is hardly known.
LARGEST_ERROR = 0.3
# One whose standard error is so many times as large as it is not known at all.
UNKNOWN = 100.0
# A motion that makes an error smaller by less than this part tells nothing.
_WORTH = 0.1
# Swings: their duration [s], samples per second, largest amplitude [rad] and [m], and part of the greatest speed.
_SECONDS, _RATE, _AMPLITUDES, _SPEED_PART = 10.0, 20.0, (1.0, 0.2), 0.6
# Joints of which nothing is known move so fast [rad/s], [m/s].
_SPEEDS = (1.5, 0.3)
# Where the other joints stand, by their range about its middle.
_POSES = (-0.35, 0.1, 0.4)


class WeakParameter(NamedTuple):
    """A base parameter that is hardly known.

    Attributes:
        name: of it.
        error: its standard error by its size, or by that of such a parameter of a link of this mass and extent: one
            that happens to be nothing is known well if its error is small beside that.
        motion: which would tell it, in words; empty where none of the simple ones would.
        error_after: its standard error by its size after that.
    """

    name: str
    error: float
    motion: str
    error_after: float


def weak_parameters(model: DynamicModel, fit: Fit) -> list[WeakParameter]:
    """Return the base parameters that are hardly known, with the motion of one or two joints that tells most of each.

    Args:
        model: of the arm.
        fit: of its base parameters.
    """
    size = _sizes(model, fit)
    relative = np.minimum(fit.errors / size, UNKNOWN)
    weak = np.flatnonzero(relative > LARGEST_ERROR)
    if not len(weak):
        return []
    # Noise hangs together in time in both motions, and makes both tell less by the same factor.
    before = inverse_of(fit.normal).diagonal()
    # Joints that never moved are taken for as noisy as the others.
    sigma = np.where(fit.counts > 0, fit.sigma, np.median(fit.sigma[fit.counts > 0]))
    after: list[tuple[str, Array]] = []
    for text, motion in _swings(model.arm):
        Y = model.base_columns(*motion) / sigma[:, None]
        added = np.einsum("knb,knc->bc", Y, Y, optimize=True)
        after.append((text, fit.errors * np.sqrt(inverse_of(fit.normal + added).diagonal() / before)))
    result = []
    for k in weak.tolist():
        text, errors = min(after, key=lambda each: each[1][k])
        is_worth_it = errors[k] < (1 - _WORTH) * fit.errors[k]
        result.append(
            WeakParameter(
                name=model.base.names[k],
                error=float(relative[k]),
                motion=text if is_worth_it else "",
                error_after=float(min(errors[k] / size[k], UNKNOWN)) if is_worth_it else float(relative[k]),
            )
        )
    return result


def _sizes(model: DynamicModel, fit: Fit) -> Array:
    """Return how large the base parameters (b,) of such links and drives may be."""
    sizes = body_sizes(model.arm, len(model.names))
    sizes[OF_LINK * model.arm.n :] = 0.0
    named = dict(zip(model.base.names, fit.values.tolist(), strict=True))
    for k, name in enumerate(model.names):
        # What is alike both ways may be nothing; beside it stands Coulomb friction.
        if name.startswith(("offset", "cube_root", "stribeck")):
            joint = name.lstrip("abcdefghijklmnopqrstuvwxyz_")
            sizes[k] = abs(named.get(f"coulomb{joint}", named.get(f"forward{joint}", 0.0)))
    drawn = np.abs(model.base.combinations * sizes).max(axis=1)
    unknown = fit.errors > UNKNOWN * np.where(drawn > 0, drawn, np.abs(fit.values))
    # A value of which nothing is known is no size.
    found = np.where(unknown, _of_other_joints(model, fit, unknown), np.abs(fit.values))
    return np.asarray(np.maximum(np.maximum(drawn, found), np.finfo(float).tiny))


def _of_other_joints(model: DynamicModel, fit: Fit, unknown: Flags) -> Array:
    """Return how large such parameters (b,) of other joints are, by those that are known; 1 where none is."""
    kinds = np.array([name.rstrip("0123456789") for name in model.base.names])
    sizes = np.ones(len(kinds))
    for kind in set(kinds[unknown].tolist()):
        known = (kinds == kind) & ~unknown
        if known.any():
            sizes[kinds == kind] = np.median(np.abs(fit.values[known]))
    return sizes


def _swings(arm: Arm) -> Iterator[tuple[str, tuple[Array, Array, Array]]]:
    """Give motions of one joint, and of two neighbours, while the others stand in a few poses."""
    for joint in range(arm.n):
        yield f"swing joint {joint + 1} alone, fast and far", _swing(arm, [joint])
    for joint in range(arm.n - 1):
        yield f"swing joints {joint + 1} and {joint + 2} together, fast and far", _swing(arm, [joint, joint + 1])


def _swing(arm: Arm, joints: Sequence[int]) -> tuple[Array, Array, Array]:
    t = np.arange(0, _SECONDS, 1 / _RATE)
    kind = np.where(arm.revolute, 0, 1)
    span = np.minimum(arm.limits.upper - arm.limits.lower, 8 * np.take(_AMPLITUDES, kind))
    finite = np.isfinite(arm.limits.lower) & np.isfinite(arm.limits.upper)
    middle = np.where(finite, (np.where(finite, arm.limits.lower, 0) + np.where(finite, arm.limits.upper, 0)) / 2, 0.0)
    amplitude = np.minimum(np.take(_AMPLITUDES, kind), 0.4 * span)
    speed = np.minimum(_SPEED_PART * arm.limits.speed, np.take(_SPEEDS, kind))
    pose = np.asarray(_POSES)[(np.arange(len(t)) * len(_POSES)) // len(t)][:, None]
    # Neighbours stand on different sides.
    q = middle + span * 0.5 * pose * (-1.0) ** np.arange(arm.n)
    qd, qdd = np.zeros_like(q), np.zeros_like(q)
    for k, joint in enumerate(joints):
        # Two joints never swing in step.
        w = speed[joint] / amplitude[joint] * (1 + 0.37 * k)
        a = amplitude[joint] / (1 + 0.37 * k)
        q[:, joint] = middle[joint] + a * np.sin(w * t)
        qd[:, joint], qdd[:, joint] = a * w * np.cos(w * t), -a * w * w * np.sin(w * t)
    return q, qd, qdd
