"""Quantities of arms as compiled kernels."""

from collections.abc import Callable

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.quantities import compile_quantity, emit_quantity, quantity_names
from armwright.errors import UnknownNameError
from armwright.kinematics.forward import forward
from armwright.kinematics.jacobian import jacobian
from oracles.arms import random_postures

ROUNDING = 1e-11  # two orders of the same sums, and sines that differ by two units in the last place


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile into one folder of the tests' own."""
    monkeypatch.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.getbasetemp() / "kernels"))


@pytest.mark.parametrize("name", ["stanford", "ur5"])
@pytest.mark.parametrize(
    ("quantity", "plain", "inputs"),
    [("forward", forward, 1), ("jacobian", jacobian, 1), ("inverse_dynamics", inverse_dynamics, 3)],
)
def test_agrees_with_the_plain_function(
    name: str, quantity: str, plain: Callable[..., Array], inputs: int, rng: np.random.Generator
) -> None:
    """The compiled quantity has the values and the shape of the plain function, drives included."""
    arm = load_arm(name)
    q = random_postures(arm, rng, 20 * inputs).reshape(inputs, 4, 5, arm.n)

    values = compile_quantity(arm, quantity)(*q)

    expected = plain(arm, *q)
    assert values.shape == expected.shape
    np.testing.assert_allclose(values, expected, atol=ROUNDING * max(1.0, np.abs(expected).max()))


def test_unknown_quantity() -> None:
    """A misspelt quantity gets the nearest name."""
    with pytest.raises(UnknownNameError, match="Did you mean 'jacobian'"):
        emit_quantity(load_arm("ur5"), "jacobain")


def test_right_angles_make_it_cheaper() -> None:
    """The Stanford arm, with two lengths fewer than the UR5, takes fewer operations for every quantity."""

    def total(arm: Arm, quantity: str) -> int:
        return sum(emit_quantity(arm, quantity).operations.values())

    for quantity in quantity_names():
        assert total(load_arm("stanford"), quantity) < total(load_arm("ur5"), quantity)
