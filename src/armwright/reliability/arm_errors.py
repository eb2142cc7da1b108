"""Errors of an arm's tool by the deviations of its dimensions, linear and in full."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, integer, joint_array
from armwright.calibration.chain import kinematic_chain
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tolerances import SIGMAS, Tolerance


def tool_error(arm: Arm, q: ArrayLike, tolerances: Sequence[Tolerance]) -> LinearError:
    """Return the error of the tool's position in configurations, linear in the deviations within tolerances.

    Args:
        arm: with n joints.
        q: (p, n) configurations [rad] or [m].
        tolerances: of its dimensions; the deviations are normal and independent, a tolerance is three of their standard
            deviations.

    Raises:
        ShapeError: ``q`` does not fit the arm.
        UnknownNameError: a tolerance is of no dimension of the arm.
    """
    chain = kinematic_chain(arm)
    columns = [chain.names.index(tolerance.name) for tolerance in tolerances]
    jacobian = chain.forward(q).position_jacobian[:, :, columns]
    return LinearError(
        names=tuple(tolerance.name for tolerance in tolerances),
        deviations=[tolerance.standard_deviation for tolerance in tolerances],
        offset=np.zeros(jacobian.shape[:2]),
        jacobian=jacobian,
    )


def sampled_deviations(tolerances: Sequence[Tolerance], *, samples: int, seed: int = 0, uniform: bool = False) -> Array:
    """Return the deviations (samples, k) of random arms within k tolerances [m] or [rad]; see ``sampled_errors``."""
    widths = np.array([tolerance.half_width for tolerance in tolerances])
    shape = (integer(samples, "samples", least=1), len(widths))
    rng = np.random.default_rng(seed)
    return np.asarray(widths * (rng.uniform(-1, 1, shape) if uniform else rng.normal(scale=1 / SIGMAS, size=shape)))


def sampled_errors(
    arm: Arm, q: ArrayLike, tolerances: Sequence[Tolerance], *, samples: int, seed: int = 0, uniform: bool = False
) -> Array:
    """Return the lengths of the tool's errors of random arms within tolerances, by their full kinematics.

    Args:
        arm: with n joints.
        q: (p, n) configurations [rad] or [m].
        tolerances: of its dimensions.
        samples: how many arms are drawn.
        seed: of the sample.
        uniform: whether deviations are uniform within their tolerances, not normal with a third as standard deviation.

    Returns:
        (samples, p) [m].
    """
    chain = kinematic_chain(arm)
    configurations = np.atleast_2d(joint_array(q, arm.n))
    columns = [chain.names.index(tolerance.name) for tolerance in tolerances]
    deviations = sampled_deviations(tolerances, samples=samples, seed=seed, uniform=uniform)
    nominal = chain.forward(configurations).position
    found = np.empty((len(deviations), len(configurations)))
    errors = np.zeros(len(chain.names))
    for k, own in enumerate(deviations):
        errors[columns] = own
        found[k] = np.linalg.norm(chain.forward(configurations, errors).position - nominal, axis=-1)
    return found
