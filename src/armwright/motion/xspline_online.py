"""The X-spline while its knots come in: push a knot, get the segment that is now settled.

A planner is a vector of 3 n + 1 numbers, whatever the number of knots that went through it: the last knot, this knot,
the rate at the last knot, and the step between them. It is a value: what pushes a knot returns the next one.

    state = begin(q0, q1, h)                  # the first two knots; nothing can be settled yet
    state, segment = push(state, q2, h)       # from q0 to q1, as four coefficient rows
    state, segment = push(state, q3, h)       # from q1 to q2
    segment = finish(state)                   # the last one, to rest

``xspline_kernel(n).single(state, knot, step, state, segment)`` does the same from compiled loops, in place.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, floats, integer, one_per_joint, positive
from armwright.errors import InvalidValueError, ShapeError
from armwright.motion.cubic_polynomials import hermite
from armwright.motion.knots import one_way
from armwright.motion.xspline_path import Pair, Triple, rate_of_knot
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
    q0 = one_way(first, "first")
    q1 = one_per_joint(second, len(q0), "second")
    m0 = np.zeros(len(q0)) if rate is None else one_per_joint(rate, len(q0), "rate")
    return np.concatenate([q0, q1, m0, [positive(step, "step", "s")]])


def push(state: ArrayLike, knot: ArrayLike, step: float) -> tuple[Array, Array]:
    """Take the next knot in, and return what it settles.

    Args:
        state: (3 n + 1,) the planner.
        knot: (n,) the next knot.
        step: time to it from the knot before [s].

    Returns:
        The planner after it, and the coefficients (4, n) of the segment between the two knots before it.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: the planner is none, or the knot not (n,).
        InvalidValueError: a number is NaN or infinite, or a step not above 0.
    """
    q_last, q, m_last, h_last = _parts(state)
    coming = one_per_joint(knot, len(q), "knot")
    h = positive(step, "step", "s")
    m, segment = _advanced((q_last, q, coming), m_last, (h_last, h))
    return np.concatenate([q, coming, m, [h]]), np.stack(segment)


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
    q_last, q, m_last, h_last = _parts(state)
    m = np.zeros(len(q)) if rate is None else one_per_joint(rate, len(q), "rate")
    return np.stack(hermite(q_last, m_last, q, m, h_last))


@cache
def xspline_kernel(joints: int) -> Kernel:
    """Return the kernel of ``push`` for n joints: the same equations, compiled; kept on disk.

    Its inputs are the planner (3 n + 1,), the next knot (n,) and the step to it (1,); it fills the planner after it
    and the segment (4, n). ``one(state, knot, step, state, segment)`` is called from compiled loops, allocates
    nothing and may fill the planner in place; it returns 0, or another number where a number is not finite or a step
    not above 0. ``function(name)`` is called from Python, for one planner or for rows of them.

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


def _advanced(knots: Triple, m_last: Scalar, steps: Pair) -> tuple[Scalar, tuple[Scalar, ...]]:
    """Return the rate at the middle one of three knots, and the coefficients of the segment that ends in it."""
    m = rate_of_knot(knots, m_last, steps)
    return m, hermite(knots[0], m_last, knots[1], m, steps[0])


def _equation(state: Sequence[Scalar], knot: Sequence[Scalar], step: Sequence[Scalar]) -> Guarded:
    n = len(knot)
    q_last, q, m_last, h_last = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n]
    knots = zip(q_last, q, knot, strict=True)
    joints = [_advanced(three, m, (h_last, step[0])) for three, m in zip(knots, m_last, strict=True)]
    rates, segments = zip(*joints, strict=True)
    rows = [x for row in zip(*segments, strict=True) for x in row]
    return Guarded([[*q, *knot, *rates, step[0]], rows], [h_last, step[0]])


def _raise_for_invalid(state: Array, knot: Array, step: Array) -> None:  # noqa: ARG001 - called with all inputs
    """Raise the error of steps that are none."""
    for steps, what in ((state[..., -1], "the last step"), (step[..., 0], "step")):
        wrong = steps[~(steps > 0)]
        if wrong.size:
            raise InvalidValueError(f"{what}: expected more than 0 s, got {wrong.flat[0]:g}")


def _parts(state: ArrayLike) -> tuple[Array, Array, Array, float]:
    """Return the last knot, this knot, the rate at the last one, and the step between them."""
    array = floats(state, "state", LARGEST)
    if array.ndim != 1 or len(array) < 4 or len(array) % 3 != 1:
        raise ShapeError(f"state: expected a planner, shape (3 n + 1,), got {array.shape}; see begin")
    n = len(array) // 3
    q_last, q, m_last = exact_shape(array[:-1].reshape(3, n), (3, n), "state")
    return q_last, q, m_last, positive(float(array[-1]), "the last step", "s")
