"""How far a tool may run back along its line between two samples: against a parabola that turns there."""

import numpy as np
import pytest

from armwright.motion.straight_path import _backward
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
