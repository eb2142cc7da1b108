"""The X-spline while its knots come in: from Python, from compiled loops, and what it does with bad knots."""

import numpy as np
import pytest
from numba import njit

from armwright.arrays import Array
from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_online import begin, finish, xspline_kernel
from armwright.motion.xspline_path import xspline

# Fused operations round once where plain ones round twice.
ROUNDING = 1e-11


def walk(rng: np.random.Generator, knots: int, joints: int) -> tuple[Array, Array]:
    """Steps and knots of a wandering motion."""
    return rng.uniform(0.1, 0.3, size=knots - 1), np.cumsum(rng.normal(size=(knots, joints)), axis=0)


def test_segments_are_those_of_the_whole(rng: np.random.Generator) -> None:
    """Pushed one by one, knots give the segments that they give all together; each needs only the next knot."""
    h, q = walk(rng, 20, 6)
    start, end = rng.normal(size=(2, 6))
    segments = []
    push = xspline_kernel(6).function("push")

    state = begin(q[0], q[1], h[0], start)
    for knot, step in zip(q[2:], h[1:], strict=True):
        state, segment = push(state, knot, [step])
        segments.append(segment)
    segments.append(finish(state, end))

    times = np.concatenate([[0.0], np.cumsum(h)])
    whole = xspline(times, q, start, end)
    np.testing.assert_allclose(segments, whole.coefficients, rtol=ROUNDING, atol=1e-9)
    np.testing.assert_allclose(Trajectory(times=times, coefficients=np.array(segments))(times), q, atol=1e-10)


def test_two_knots(rng: np.random.Generator) -> None:
    """With no knot between them, two knots are joined by one cubic, from rest to rest."""
    h, q = walk(rng, 2, 3)

    segment = finish(begin(q[0], q[1], h[0]))

    np.testing.assert_allclose(segment, xspline([0, h[0]], q).coefficients[0], rtol=1e-12)


def test_memory_is_constant(rng: np.random.Generator) -> None:
    """A planner of n joints is 3 n + 1 numbers, however many knots went through it."""
    h, q = walk(rng, 50, 4)
    state, push = begin(q[0], q[1], h[0]), xspline_kernel(4).function("push")
    for knot, step in zip(q[2:], h[1:], strict=True):
        state, _ = push(state, knot, [step])
        assert state.shape == (13,)


@pytest.mark.parametrize("joints", [1, 6])
def test_pushed_from_a_compiled_loop(joints: int, rng: np.random.Generator) -> None:
    """A compiled loop that pushes knots, the planner filled in place, gets the segments of the plain functions."""
    h, q = walk(rng, 40, joints)
    one = xspline_kernel(joints).single

    @njit
    def plan(state: Array, knots: Array, steps: Array, segments: Array) -> int:
        lost = 0
        for i in range(len(knots)):
            lost += one(state, knots[i], steps[i : i + 1], state, segments[i])
        return lost

    state, segments = begin(q[0], q[1], h[0]), np.empty((38, 4, joints))
    assert plan(state, q[2:], h[1:], segments) == 0

    np.testing.assert_allclose(
        [*segments, finish(state)], xspline(np.append(0.0, np.cumsum(h)), q).coefficients, rtol=ROUNDING, atol=1e-9
    )


def test_compiled_from_python(rng: np.random.Generator) -> None:
    """The function of the kernel takes one planner or rows of them; the segment is that of a spline through all."""
    h, q = walk(rng, 3, 6)
    push = xspline_kernel(6).function("push")
    states = np.stack([begin(q[0], q[1], step) for step in (0.1, 0.2, 0.3)])

    after, segments = push(states, q[2], [h[1]])

    for i, state in enumerate(states):
        whole = xspline([0.0, state[-1], state[-1] + h[1]], q)
        np.testing.assert_allclose(segments[i], whole.coefficients[0], rtol=ROUNDING, atol=1e-9)
        one, of_one = push(state, q[2], [h[1]])
        np.testing.assert_array_equal(one, after[i])
        np.testing.assert_array_equal(of_one, segments[i])


def test_status_of_bad_knots() -> None:
    """A compiled push answers 0 for what it can use, and another number for a knot or a step that is none."""
    one = xspline_kernel(2).single
    state, knot = begin([0.0, 0.0], [1.0, 2.0], 0.1), np.ones(2)
    after, segment = np.empty(7), np.empty((4, 2))

    assert one(state, knot, np.array([0.1]), after, segment) == 0
    for step in (0.0, -0.1, np.nan, np.inf):
        assert one(state, knot, np.array([step]), after, segment) != 0
    assert one(state, np.array([0.0, np.nan]), np.array([0.1]), after, segment) != 0
    assert one(state, np.ones(3), np.array([0.1]), after, segment) != 0


def test_bad_knots_are_refused() -> None:
    """Steps that do not rise, knots of other joints, planners that are none: each with what came."""
    state, push = begin([0.0, 0.0], [1.0, 2.0], 0.1), xspline_kernel(2).function("push")
    with pytest.raises(InvalidValueError, match="step: expected more than 0 s, got 0"):
        push(state, [1.0, 2.0], [0.0])
    with pytest.raises(InvalidValueError, match="step: expected more than 0 s, got nan"):
        begin([0.0], [1.0], np.nan)
    with pytest.raises(ShapeError, match="knot: expected"):
        push(state, [1.0, 2.0, 3.0], [0.1])
    with pytest.raises(ShapeError, match=r"state: expected a planner, shape \(3 n \+ 1,\), got \(6,\)"):
        finish(state[:-1])
    with pytest.raises(InvalidValueError, match="knot: every number must be finite, got nan"):
        push(state, [1.0, np.nan], [0.1])
    with pytest.raises(InvalidValueError, match="the last step: expected more than 0 s, got -1"):
        finish(np.append(state[:-1], -1.0))
    with pytest.raises(InvalidValueError, match="step: expected more than 0 s, got -1"):
        push(state, [1.0, 2.0], [-1.0])
    with pytest.raises(InvalidValueError, match="joints: expected an integer of at least 1, got 0"):
        xspline_kernel(0)
    with pytest.raises(KindError, match=r"joints: expected an integer, got 2\.5"):
        xspline_kernel(2.5)  # type: ignore[arg-type]
