"""Which joints are held and which give way."""

import itertools

import numpy as np
import pytest

from armwright.simulation.complementarity import solve_complementarity

ROUNDING = 1e-9


def _mass(rng: np.random.Generator, n: int) -> np.ndarray:
    A = rng.normal(size=(n, n))
    return A @ A.T + 0.01 * np.eye(n)


def _hold_is_lawful(M: np.ndarray, b: np.ndarray, at_rest: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> None:
    lower, upper = bounds
    x, r, _ = solve_complementarity(M, b, at_rest, lower, upper)
    np.testing.assert_allclose(M @ x, b + r, atol=ROUNDING * (1 + np.abs(b).max()))
    assert not r[~at_rest].any()
    for i in np.flatnonzero(at_rest):
        assert lower[i] - ROUNDING <= r[i] <= upper[i] + ROUNDING
        assert x[i] <= 0 or r[i] == lower[i]
        assert x[i] >= 0 or r[i] == upper[i]


@pytest.mark.parametrize("n", [1, 2, 3, 6, 10])
def test_the_answer_obeys_the_law(n: int, rng: np.random.Generator) -> None:
    """Held joints stand still inside their bounds; the others move and feel the bound against their motion."""
    for _ in range(200):
        lower, upper = -rng.uniform(0, 2, n), rng.uniform(0, 2, n)
        lower[rng.random(n) < 0.2] = -np.inf
        upper[rng.random(n) < 0.2] = np.inf
        lower[rng.random(n) < 0.1] = 0.0

        _hold_is_lawful(_mass(rng, n), rng.normal(scale=3, size=n), rng.random(n) < 0.7, (lower, upper))


def test_it_is_the_only_answer(rng: np.random.Generator) -> None:
    """Of all ways in which three joints can hold or give way, only one obeys the law."""
    for _ in range(50):
        M, b = _mass(rng, 3), rng.normal(scale=3, size=3)
        bounds = np.array((-1.0, 1.0))
        found = solve_complementarity(M, b, np.ones(3, dtype=bool), np.full(3, -1.0), np.full(3, 1.0))
        lawful = []
        for direction in itertools.product((-1, 0, 1), repeat=3):
            free = [i for i in range(3) if direction[i]]
            x, r = np.zeros(3), np.array([-float(w) for w in direction])
            if free:
                x[free] = np.linalg.solve(M[np.ix_(free, free)], (b + r)[free])
            locked = [i for i in range(3) if not direction[i]]
            r[locked] = (M @ x - b)[locked]
            if all(x * direction >= 0) and all(bounds[0] <= r) and all(r <= bounds[1]):
                lawful.append(direction)

        assert lawful == [tuple(found.direction)]


def test_one_block_by_hand() -> None:
    """Friction of 3 N holds a block against 2 N and gives way to 5 N, of which 2 N are left for 4 kg."""
    M, rest = np.array([[4.0]]), np.array([True])
    lower, upper = np.array([-3.0]), np.array([3.0])

    locked = solve_complementarity(M, np.array([2.0]), rest, lower, upper)
    slides = solve_complementarity(M, np.array([5.0]), rest, lower, upper)

    assert (locked.x[0], locked.r[0], locked.direction[0]) == (0.0, -2.0, 0)
    assert (slides.x[0], slides.r[0], slides.direction[0]) == (0.5, -3.0, 1)


def test_one_joint_drags_another() -> None:
    """A joint that nothing pushes gives way when the inertia of its moving neighbour drags it along."""
    M, b = np.array([[2.0, 1.9], [1.9, 2.0]]), np.array([4.0, 0.0])
    rest, strong, weak = np.array([False, True]), np.array([9.0, 9.0]), np.array([1.0, 1.0])

    assert solve_complementarity(M, b, rest, -strong, strong).direction[1] == 0
    assert solve_complementarity(M, b, rest, -weak, weak).direction[1] == -1
