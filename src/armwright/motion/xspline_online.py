"""The X-spline while its knots come in: push a knot, get the segment that is now settled.

A planner is a vector of 3 n + 1 numbers, whatever the number of knots that went through it: the last knot, this knot,
the rate at the last knot, and the step between them. It is a value: what pushes a knot returns the next one.

    push = xspline_kernel(n).function("push")
    state = begin(q0, q1, h)                  # the first two knots; nothing can be settled yet
    state, segment = push(state, q2, [h])     # from q0 to q1, as four coefficient rows
    state, segment = push(state, q3, [h])     # from q1 to q2
    segment = finish(state)                   # the last one, to rest

Compiled loops call ``xspline_kernel(n).single(state, knot, step, state, segment)``, which works in place.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, floats, integer, one_per_joint, positive
from armwright.errors import InvalidValueError, ShapeError
from armwright.motion.cubic_polynomials import hermite
from armwright.motion.knots import joint_vector, rate_or_rest
from armwright.motion.xspline_path import rate_of_knot
from armwright.tracing.emit import Guarded, emit
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar


def begin(first: ArrayLike, second: ArrayLike, step: float, rate: ArrayLike | None = None) -> Array:
    """Return the planner that knows two knots.

    Args:
        first: (n,) the first knot, joint positions [rad] or [m].
        second: (n,) the second one.
        step: time from one to the other [s].
        rate: (n,) at the first knot; at rest when left out.

    Returns:
        (3 n + 1,).

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: the knots or the rate are not (n,).
        InvalidValueError: a number is NaN or infinite, or the step not above 0.
    """
    q0 = joint_vector(first, "first")
    q1 = one_per_joint(second, len(q0), "second")
    return np.concatenate([q0, q1, rate_or_rest(rate, len(q0), "rate"), [positive(step, "step", "s")]])


def finish(state: ArrayLike, rate: ArrayLike | None = None) -> Array:
    """Return the coefficients (4, n) of the segment to the last knot.

    Args:
        state: (3 n + 1,) the planner.
        rate: (n,) at the last knot; at rest when left out.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: the planner is none, or the rate not (n,).
        InvalidValueError: a number is NaN or infinite, or the step of the planner not above 0.
    """
    array = floats(state, "state", LARGEST)
    if array.ndim != 1 or len(array) < 4 or len(array) % 3 != 1:
        raise ShapeError(f"state: expected a planner, shape (3 n + 1,), got {array.shape}; see begin")
    q_last, q, m_last = array[:-1].reshape(3, -1)
    h_last = positive(float(array[-1]), "the last step", "s")
    return np.stack(hermite(q_last, m_last, q, rate_or_rest(rate, len(q), "rate"), h_last))


@cache
def xspline_kernel(joints: int) -> Kernel:
    """Return the kernel that takes the next knot of n joints in; it is kept on disk.

    Its inputs are the planner (3 n + 1,), the next knot (n,) and the step to it (1,); it fills the planner after it
    and the coefficients (4, n) of the segment between the two knots before it. ``single(state, knot, step, state,
    segment)`` is called from compiled loops, allocates nothing and may fill the planner in place; it returns 0, or
    another number where a number is not finite or a step not above 0. ``function(name)`` is called from Python, for one
    planner or for rows of them.

    Args:
        joints: n.

    Raises:
        KindError: ``joints`` is no whole number.
        InvalidValueError: it is below 1.
    """
    joints = integer(joints, "joints", least=1)
    width = 3 * joints + 1
    emitted = emit(
        f"a knot of an X-spline of {joints} joints",
        _equation,
        {"state": width, "knot": joints, "step": 1},
        shapes=[(width,), (4, joints)],
    )
    return Kernel(emitted=emitted, raise_for_invalid=_raise_for_invalid)


def _equation(state: Sequence[Scalar], knot: Sequence[Scalar], step: Sequence[Scalar]) -> Guarded:
    n = len(knot)
    q_last, q, m_last, h_last = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n]
    joints = list(zip(q_last, q, knot, m_last, strict=True))
    rates = [rate_of_knot((q0, q1, q2), m0, (h_last, step[0])) for q0, q1, q2, m0 in joints]
    segments = [hermite(q0, m0, q1, m, h_last) for (q0, q1, _, m0), m in zip(joints, rates, strict=True)]
    rows = [x for row in zip(*segments, strict=True) for x in row]
    return Guarded([[*q, *knot, *rates, step[0]], rows], [h_last, step[0]])


def _raise_for_invalid(state: Array, knot: Array, step: Array) -> None:  # noqa: ARG001 - called with all inputs
    """Raise the error of steps that are none."""
    for steps, what in ((state[..., -1], "the last step"), (step[..., 0], "step")):
        wrong = steps[~(steps > 0)]
        if wrong.size:
            raise InvalidValueError(f"{what}: expected more than 0 s, got {wrong.flat[0]:g}")
