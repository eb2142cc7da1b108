"""What holds and what moves: joints at rest under dry friction, stops and brakes, all at once.

A joint at rest is held by an effort between two bounds. Inside them it stays; where the lower bound is not low enough
it moves forward and the effort stays at that bound, and the reverse. Whether one joint moves depends on
what the others do, so all are found together:

    M x = b + r,    and for every joint at rest  x = 0 and lower <= r <= upper,
                                             or  x > 0 and r = lower,
                                             or  x < 0 and r = upper.

With a positive definite M there is exactly one answer. The same question answers impacts, with impulses for efforts
and speeds for accelerations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array

# What rounding may add to a number beside the largest of its kind, so that it never makes a joint change its mind.
_ROUNDING = 1e-13

Signs = npt.NDArray[np.int8]


class ComplementaritySolution(NamedTuple):
    """The answer.

    Attributes:
        x: (n,) accelerations, or speeds after an impact.
        r: (n,) efforts that hold or resist, or impulses; 0 for joints that are not at rest.
        direction: (n,) of the joints at rest: 0 held, 1 moves forward, -1 backward; 0 for all others.
    """

    x: Array
    r: Array
    direction: Signs


def solve_complementarity(
    M: Array, b: Array, at_rest: npt.NDArray[np.bool_], lower: Array, upper: Array
) -> ComplementaritySolution:
    """Find which joints at rest are held, and the accelerations of all.

    Args:
        M: (n, n) mass matrix, positive definite.
        b: (n,) efforts that are left to accelerate with, before anything holds.
        at_rest: (n,) joints that something may hold.
        lower: (n,) smallest effort that can hold a joint, 0 or below; minus infinity where it may be any.
        upper: (n,) largest effort that can hold a joint, 0 or above.

    Source:
        Júdice & Pires (1994), block principal pivoting; when it goes in circles, Murty (1974), which never does.
    """
    n = len(b)
    direction: Signs = np.zeros(n, dtype=np.int8)
    fewest, patience = n + 1, 3
    slack = _ROUNDING * (1.0 + np.abs(b).max())
    for _ in range(3**n + 3 * n + 4):
        x, r = _of_guess(M, b, at_rest, direction, (lower, upper))
        locked = at_rest & (direction == 0)
        better = np.where(locked & (r < lower - slack), 1, np.where(locked & (r > upper + slack), -1, direction))
        better = np.where(at_rest & (direction * x < -_ROUNDING * np.abs(x).max()), 0, better).astype(np.int8)
        wrong = np.flatnonzero(better != direction)
        if not len(wrong):
            return ComplementaritySolution(x=x, r=r, direction=direction)
        if len(wrong) < fewest:
            fewest, patience = len(wrong), 3
        else:
            patience -= 1
        changed = wrong if patience > 0 else wrong[-1:]
        direction[changed] = better[changed]
    raise AssertionError("a positive definite mass matrix leaves one answer")


def _of_guess(
    M: Array, b: Array, at_rest: npt.NDArray[np.bool_], direction: Signs, bounds: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Return accelerations and efforts when the held joints are held and the others move as guessed."""
    lower, upper = bounds
    r = np.where(direction > 0, lower, np.where(direction < 0, upper, 0.0))
    locked = at_rest & (direction == 0)
    x = np.zeros_like(b)
    free = np.flatnonzero(~locked)
    if len(free):
        x[free] = np.linalg.solve(M[np.ix_(free, free)], b[free] + r[free])
    r[locked] = M[locked] @ x - b[locked]
    return x, r
