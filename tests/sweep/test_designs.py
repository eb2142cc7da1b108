"""Which points a design has: by hand, by what its kind promises, and against SciPy."""

import copy
import itertools
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from armwright.errors import ArmwrightError, InvalidValueError, KindError, ShapeError, UnknownNameError
from armwright.sweep.designs import Design, full_factorial, latin_hypercube, sobol

BOUNDS = {"length": (0.1, 0.5), "angle": (-3.0, 3.0), "mass": (1.0, 2.0)}
UNITS = {"length": "m", "angle": "rad"}


def unit(design: Design) -> np.ndarray:
    """The points in the unit cube."""
    lower, upper = np.transpose(list(design.ranges.values()))
    return (design.points - lower) / (upper - lower)


def test_full_factorial() -> None:
    """Two by three levels are six runs, the last parameter changing fastest."""
    design = full_factorial({"a": [1, 2], "b": [10, 20, 30]}, units={"b": "mm"})

    assert design.names == ("a", "b")
    assert design.points.tolist() == [[1, 10], [1, 20], [1, 30], [2, 10], [2, 20], [2, 30]]
    assert (design.kind, design.seed, len(design)) == ("full factorial", None, 6)
    assert design.ranges == {"a": (1.0, 2.0), "b": (10.0, 20.0, 30.0)}
    assert design.units == {"a": "1", "b": "mm"}


def test_full_factorial_of_six() -> None:
    """Three levels of six parameters are 729 runs, every combination once."""
    design = full_factorial(dict.fromkeys("abcdef", (0.1, 0.3, 0.5)))

    assert list(map(tuple, design.points.tolist())) == list(itertools.product((0.1, 0.3, 0.5), repeat=6))


@pytest.mark.parametrize("n", [1, 7, 50])
def test_latin_hypercube_has_one_point_in_every_slice(n: int) -> None:
    """Cut every range into n equal slices: each has exactly one point."""
    design = latin_hypercube(BOUNDS, n, 3, units=UNITS)

    slices = np.floor(unit(design) * n).astype(int)
    for column in slices.T:
        assert sorted(column) == list(range(n))


def test_sobol_balances() -> None:
    """Of 64 points every half, quarter and eighth of each range has its share, and every quarter of each square."""
    points = unit(sobol(BOUNDS, 64, 11))

    for cells in (2, 4, 8, 64):
        for column in points.T:
            counts = np.bincount(np.floor(column * cells).astype(int), minlength=cells)
            assert counts.tolist() == [64 // cells] * cells
    for i, j in itertools.combinations(range(3), 2):
        counts = np.bincount(2 * (points[:, i] >= 0.5) + (points[:, j] >= 0.5), minlength=4)
        assert counts.tolist() == [16] * 4


def test_against_scipy() -> None:
    """The points are those of SciPy with the same seed, scaled to the bounds."""
    lower, upper = np.transpose(list(BOUNDS.values()))
    by_chance = qmc.LatinHypercube(3, rng=np.random.default_rng(5)).random(20)
    even = qmc.Sobol(3, rng=np.random.default_rng(5)).random_base2(5)

    np.testing.assert_array_equal(latin_hypercube(BOUNDS, 20, 5).points, lower + (upper - lower) * by_chance)
    np.testing.assert_array_equal(sobol(BOUNDS, 32, 5).points, lower + (upper - lower) * even)


def test_sobol_is_more_even_than_chance(rng: np.random.Generator) -> None:
    """The discrepancy falls from chance to Latin hypercube to Sobol."""
    even, sliced = (qmc.discrepancy(unit(make(BOUNDS, 256, 1))) for make in (sobol, latin_hypercube))

    assert even < sliced < qmc.discrepancy(rng.random((256, 3)))


@pytest.mark.parametrize("make", [latin_hypercube, sobol])
def test_seed(make: Callable[..., Design]) -> None:
    """The same seed makes the same points, another one others; all lie inside the bounds."""
    design = make(BOUNDS, 64, 1)

    assert design == make(BOUNDS, 64, 1)
    assert hash(design) == hash(make(BOUNDS, 64, 1))
    assert design != make(BOUNDS, 64, 2)
    assert ((unit(design) >= 0) & (unit(design) <= 1)).all()
    assert (design.seed, design.ranges) == (1, BOUNDS)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_points_stay(copied: Callable[[Any], Any]) -> None:
    """The points of a design cannot be changed, nor those of its copies; a given array is not kept."""
    mine = np.array([[1.0], [2.0]])
    design = Design(names=["a"], points=mine)
    mine[0] = 5.0

    twin = copied(design)

    assert twin == design
    assert twin.points.tolist() == [[1.0], [2.0]]
    for one in (design, twin):
        with pytest.raises(ValueError, match="read-only"):
            one.points[0] = 0.0


MISTAKES: list[tuple[Callable[[], Any], type[ArmwrightError], str]] = [
    (lambda: full_factorial({}), InvalidValueError, "levels: expected one parameter or more, got none"),
    (lambda: sobol({}, 4, 0), InvalidValueError, "bounds: expected one parameter or more, got none"),
    (lambda: full_factorial([1, 2]), KindError, "levels: expected numbers by parameter"),
    (lambda: full_factorial({"a": []}), ShapeError, "levels of a: expected one level or more"),
    (lambda: full_factorial({"a": [1, 2, 1]}), InvalidValueError, "levels of a: a level occurs twice"),
    (lambda: full_factorial({"a": [1, np.nan]}), InvalidValueError, "levels of a: every number must be finite"),
    (lambda: full_factorial({"a": ["x"]}), KindError, "levels of a: expected numbers"),
    (lambda: full_factorial({n: range(10) for n in "abcdefgh"}), InvalidValueError, "got 100000000; use fewer"),
    (lambda: sobol({"a": (2, 1)}, 4, 0), InvalidValueError, "bounds of a: they are reversed: from 2 to 1"),
    (lambda: sobol({"a": (1, 1)}, 4, 0), InvalidValueError, "bounds of a: they are equal: from 1 to 1"),
    (lambda: sobol({"a": (1, np.inf)}, 4, 0), InvalidValueError, "bounds of a: every number must be finite, got inf"),
    (lambda: sobol({"a": (-1.7e308, 1.7e308)}, 4, 0), InvalidValueError, "no larger than 1e\\+100"),
    (lambda: sobol({"a": (1, 2, 3)}, 4, 0), ShapeError, "bounds of a: expected a lower and an upper one"),
    (lambda: sobol({"a": (0, 1)}, 100, 0), InvalidValueError, "got 100; the nearest are 64 and 128"),
    (lambda: latin_hypercube({"a": (0, 1)}, 0, 0), InvalidValueError, "n: expected an integer of at least 1, got 0"),
    (lambda: latin_hypercube({"a": (0, 1)}, 2.5, 0), KindError, "n: expected an integer, got 2.5"),
    (lambda: latin_hypercube({"a": (0, 1)}, True, 0), KindError, "n: expected an integer, got True"),
    (lambda: latin_hypercube({"a": (0, 1)}, 4, -1), InvalidValueError, "seed: expected an integer of at least 0"),
    (lambda: sobol({"a": (0, 1)}, 4, 0, units={"aa": "m"}), UnknownNameError, "no parameter 'aa'"),
    (lambda: Design(names="ab", points=[[1.0, 2.0]]), KindError, "got the string 'ab'"),
    (lambda: Design(names=["a"], points=[[1.0, 2.0]]), ShapeError, "1 names, but points of 2 parameters"),
    (lambda: Design(names=["a"], points=np.empty((0, 1))), ShapeError, r"neither empty, got shape \(0, 1\)"),
]


@pytest.mark.parametrize("number", range(len(MISTAKES)))
def test_mistakes(number: int) -> None:
    """A design that cannot be says what is wrong with it."""
    make, error, text = MISTAKES[number]

    with pytest.raises(error, match=text):
        make()
