"""What functions return does not change: not by hand, not in a copy, not in another process."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import pytest

import armwright
from armwright.kinematics.damped_least_squares import damped_rates
from armwright.kinematics.differential import differential_inverse
from doors import OTHER, PUMA, Q

RUN = armwright.accuracy.Trace(positions=((0, 0), (1, 0)), times=(0, 1), angles=((0,), (1,)))
RESULTS: dict[str, Callable[[], Any]] = {
    "inverse": lambda: armwright.kinematics.inverse(PUMA, armwright.kinematics.forward(PUMA, Q)),
    "inverse out of reach": lambda: armwright.kinematics.inverse(PUMA, np.eye(4) + 9 * np.eye(4, k=3)),
    "singularities": lambda: armwright.kinematics.singularities(PUMA, [0.0] * 6),
    "damped_rates": lambda: damped_rates(PUMA, [Q, OTHER], Q),
    "differential_inverse": lambda: differential_inverse(PUMA, Q, OTHER),
    "terms": lambda: armwright.dynamics.terms(PUMA, Q, Q, Q),
    "simulate": lambda: armwright.simulation.simulate(PUMA, Q, duration=2e-3),
    "quintic": lambda: armwright.motion.quintic(Q, OTHER, 1.0),
    "sampled": lambda: armwright.motion.quintic(Q, OTHER, 1.0).sampled(0.1),
    "continuity": lambda: armwright.motion.continuity(armwright.motion.quintic(Q, OTHER, 1.0)),
    "pose_repeatability": lambda: armwright.accuracy.pose_repeatability(np.eye(3), few=True),
    "path_deviation": lambda: armwright.accuracy.path_deviation(RUN, [RUN, RUN], few=True),
    "trace": lambda: RUN,
}


def arrays_of(thing: Any) -> list[np.ndarray]:
    if isinstance(thing, np.ndarray):
        return [thing]
    parts = thing if isinstance(thing, tuple) else ()
    if attrs.has(type(thing)):
        parts = tuple(getattr(thing, field.name) for field in attrs.fields(type(thing)))
    return [array for part in parts for array in arrays_of(part)]


@pytest.mark.parametrize("name", RESULTS)
def test_arrays_cannot_be_written(name: str) -> None:
    """No number of a result can be changed."""
    arrays = arrays_of(RESULTS[name]())

    assert arrays
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda result: pickle.loads(pickle.dumps(result))])
@pytest.mark.parametrize("name", RESULTS)
def test_copies(name: str, copied: Callable[[Any], Any]) -> None:
    """A copy has the same numbers, and they cannot be changed either."""
    result = RESULTS[name]()

    twin = copied(result)

    assert type(twin) is type(result)
    assert len(arrays_of(twin)) == len(arrays_of(result))
    for array, same in zip(arrays_of(result), arrays_of(twin), strict=True):
        np.testing.assert_array_equal(array, same)
        assert array.dtype == same.dtype
        assert not same.flags.writeable


def test_equal_configurations_hash_equal() -> None:
    """Two solutions of one pose are equal, hash equal, and so do their branches."""
    one, two = (armwright.kinematics.inverse(PUMA, armwright.kinematics.forward(PUMA, Q)) for _ in range(2))

    assert one == two
    assert hash(one) == hash(two)
    assert {branch: branch.label for branch in one}[two.best] == two.best.label
    assert one.branches[0] != one.branches[1]
