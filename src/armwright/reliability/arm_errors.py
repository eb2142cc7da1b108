"""Errors of an arm's tool by the deviations of its dimensions, linear and in full."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Numbers, joint_array
from armwright.calibration.chain import kinematic_chain
from armwright.reliability.allocation import Rule
from armwright.reliability.assessment import Mechanism, ToleranceAssessment, assess
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tolerances import Tolerance, sampled_deviations


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
    deviations = sampled_deviations(tolerances, samples=samples, seed=seed, uniform=uniform)
    return _error_lengths(arm, np.atleast_2d(joint_array(q, arm.n)), tolerances, deviations)


def _error_lengths(arm: Arm, q: Array, tolerances: Sequence[Tolerance], deviations: Array) -> Array:
    """Return (samples, p) lengths of the tool's errors by the full kinematics for deviations (samples, k) [m]."""
    chain = kinematic_chain(arm)
    columns = [chain.names.index(tolerance.name) for tolerance in tolerances]
    nominal = chain.forward(q).position
    found = np.empty((len(deviations), len(q)))
    errors = np.zeros(len(chain.names))
    for k, own in enumerate(deviations):
        errors[columns] = own
        found[k] = np.linalg.norm(chain.forward(q, errors).position - nominal, axis=-1)
    return found


def assess_tolerances(
    arm: Arm,
    q: ArrayLike,
    tolerances: Sequence[Tolerance],
    *,
    limit: float | None = None,
    allocation: Rule | None = None,
    samples: int = 1000,
    seed: int = 0,
    uniform: bool = False,
    most: int = 200,
    progress: Callable[[str], None] | None = None,
) -> ToleranceAssessment:
    """Assess what tolerances of an arm's dimensions do to the position of its tool.

    Args:
        arm: with n joints.
        q: (p, n) configurations, or one of them [rad] or [m].
        tolerances: of dimensions of the arm.
        limit: of the error [m]; without it there are no probabilities.
        allocation: rule by which tolerances of least cost keep the limit; None for no such tolerances.
        samples: how many random arms are drawn, with their full kinematics.
        seed: of all samples.
        uniform: whether the deviations of these are uniform within tolerances, and not normal.
        most: of more configurations, so many are computed, evenly spread, the first and the last included.
        progress: is told what is being done.

    Raises:
        ShapeError: ``q`` does not fit the arm.
        InvalidValueError: a number is out of its range, or tolerances of least cost are asked for without a limit.
        TooFewError: there is no configuration, or no tolerance.
    """
    every = np.atleast_2d(joint_array(q, arm.n))

    def mechanism_at(rows: Numbers) -> Mechanism:
        return Mechanism(
            name=arm.name,
            kind="arm",
            point="tool",
            complete="full kinematics",
            poses={"q": every[rows]},
            error=tool_error(arm, every[rows], tolerances),
            lengths=lambda deviations, _: _error_lengths(arm, every[rows], tolerances, deviations),
        )

    return assess(
        mechanism_at,
        len(every),
        tolerances,
        limit=limit,
        allocation=allocation,
        samples=samples,
        seed=seed,
        uniform=uniform,
        most=most,
        progress=progress,
    )
