"""What is made of samples beside a straight segment: held against motions of which the error is known."""

import numpy as np
import pytest

from armwright.motion.straight_path import _backward, _errors
from armwright.tracing.loops import Loops, Runner, Table, compiled, with_numpy


def _written(loops: Loops, way: Table, between: Table, result: Table) -> None:
    result[0] = _backward(loops, way, lambda i: between[i], 0.0 * between[0])


@pytest.mark.parametrize("run", [with_numpy, compiled])
@pytest.mark.parametrize("rise", [-1.0, 0.5, 1.5, 2.5, 3.5, 3.9, 4.1, 10.0])
def test_a_parabola_that_turns_between_two_samples(run: Runner, rise: float) -> None:
    """A way that bends evenly turns before the second sample where its chord rises by less than four times its arc."""
    between = 0.01  # of the chord in the middle, for a step of 1 and a second derivative of 0.08
    speed = rise * between + 4 * between
    t = np.linspace(0, 1, 100_001)
    x = speed * t - 4 * between * t**2
    back = float((np.maximum.accumulate(x) - x).max())

    (found,) = run(_written, [np.array([[0.0, rise * between]]), np.array([between])], (1,))

    assert back <= found[0] <= max(back, 0.0) + 2 * between + max(-rise, 0.0) * between
    assert (found[0] > 0) == (rise < 4)


@pytest.mark.parametrize("run", [with_numpy, compiled])
@pytest.mark.parametrize("along", [-0.1, 1.1])
def test_a_tool_beyond_an_end(run: Runner, along: float) -> None:
    """A tool that stands beyond an end, turned on as if the line went on, is turned too far by as much as it is out."""
    angle, one = 0.2, np.ones(1)
    seen = np.array([[[0.0, along, 0.0, 0.0]] * 2])
    poses = np.broadcast_to(np.eye(4), (1, 2, 4, 4)).copy()
    inputs = [np.array([[0.0, 0.1]]), poses, seen, 0.1 * one, *[0 * one] * 5, angle * one, one]

    _, sines, *_ = run(_errors, inputs, (1,), (2, 1), (1,), (1,), (1,))

    off = np.sin(0.1 * angle / 2)
    assert off <= sines[0, 0] <= 1.001 * off


@pytest.mark.parametrize("run", [with_numpy, compiled])
def test_a_tool_that_gathers_speed(run: Runner) -> None:
    """Where the chord rises at 1 1/s and the tool may gather 2 1/s², it may pass any point at 1 + 2 · 1 1/s."""
    angle, one = 0.3, np.ones(1)
    sampled = np.array([[[0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]])
    poses = np.broadcast_to(np.eye(4), (1, 2, 4, 4)).copy()
    inputs = [np.array([[0.0, 1.0]]), poses, sampled, one, 2 * one, *[0 * one] * 4, angle * one, one]

    _, sines, *_ = run(_errors, inputs, (1,), (2, 1), (1,), (1,), (1,))

    # The orientation of the line changes by the angle per unit of progress: half of 2 angle, a quarter of (3 angle)²,
    # and the tool may be beyond an end by an eighth of 2.
    at_most = (2 * angle / 2 + (3 * angle) ** 2 / 4) / 8
    beyond = angle * (2 / 8) / 2
    assert sines[0, 0] == pytest.approx(at_most + beyond, rel=1e-12)
