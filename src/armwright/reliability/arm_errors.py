"""Errors of an arm's tool by the deviations of its dimensions, linear and in full."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, integer, joint_array
from armwright.calibration.chain import kinematic_chain
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tolerances import Tolerance

# Numbers of a block of samples.
_BLOCK = 2_000_000


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
    chain, rng = kinematic_chain(arm), np.random.default_rng(seed)
    configurations = np.atleast_2d(joint_array(q, arm.n))
    columns = [chain.names.index(tolerance.name) for tolerance in tolerances]
    widths = np.array([tolerance.half_width for tolerance in tolerances])
    nominal = chain.forward(configurations).position
    found = np.empty((integer(samples, "samples", least=1), len(configurations)))
    errors = np.zeros(len(chain.names))
    for k in range(len(found)):
        unit = rng.uniform(-1, 1, len(widths)) if uniform else rng.normal(scale=1 / 3, size=len(widths))
        errors[columns] = widths * unit
        found[k] = np.linalg.norm(chain.forward(configurations, errors).position - nominal, axis=-1)
    return found
