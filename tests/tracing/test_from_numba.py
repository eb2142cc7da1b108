"""Kernels called from loops that Numba compiles: only arrays that they can take, and no address kept on disk."""

from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.errors import NumbaWarning, TypingError

from armwright.tracing.emit import emit
from armwright.tracing.emit_llvm import MEANINGLESS, UNUSUAL
from armwright.tracing.kernel import Kernel

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture(scope="module")
def kernel() -> Kernel:
    """The square of a matrix (2, 2), and which of its numbers are above 0."""

    def equation(m: list[Any]) -> list[list[Any]]:
        a, b, c, d = m
        return [[a * a + b * c, a * b + b * d, c * a + d * c, c * b + d * d], [x > 0.0 for x in m]]

    bounds = {"m": [100.0] * 4}
    return Kernel(emitted=emit("square", equation, {"m": (2, 2)}, shapes=[(2, 2), (4,)], flags=(1,), bounds=bounds))


def test_in_a_loop(kernel: Kernel, rng: np.random.Generator) -> None:
    """A compiled loop gets the numbers of NumPy, the flags, and the status of every configuration."""
    single = kernel.single

    @njit  # type: ignore[untyped-decorator,unused-ignore]
    def loop(m: Any, squares: Any, flags: Any) -> Any:
        found = 0
        for k in range(len(m)):
            found |= single(m[k], squares[k], flags[k])
        return found

    m = rng.integers(-9, 10, (30, 2, 2)).astype(float)
    squares, flags = np.empty_like(m), np.empty((30, 4), dtype=bool)

    assert loop(m, squares, flags) == 0
    np.testing.assert_array_equal(squares, m @ m)
    np.testing.assert_array_equal(flags, m.reshape(30, 4) > 0)
    for bad, status in ((np.nan, MEANINGLESS), (101.0, UNUSUAL)):
        m[17, 1, 0] = bad
        assert loop(m, squares, flags) == status


def test_other_shapes_have_no_meaning(kernel: Kernel) -> None:
    """Where the shape of an array is another, nothing is read or written."""
    m, square, flags = np.ones((2, 2)), np.zeros((2, 2)), np.zeros(4, dtype=bool)

    for arrays in (
        (np.ones((1, 2)), square, flags),
        (m, np.zeros((2, 3)), flags),
        (m, square, np.zeros(3, dtype=bool)),
    ):
        assert kernel.single(*arrays) == MEANINGLESS
        assert not arrays[1].any()
        assert not arrays[2].any()


def test_input_that_is_only_read(kernel: Kernel) -> None:
    """A read-only input is as good as any, and a read-only output is none."""
    m, flags = np.ones((2, 2)), np.zeros(4, dtype=bool)
    m.setflags(write=False)
    square = np.zeros((2, 2))

    assert kernel.single(m, square, flags) == 0
    assert square.tolist() == [[2, 2], [2, 2]]
    with pytest.raises(TypingError, match="expected arrays"):
        kernel.single(square, m, flags)


@pytest.mark.parametrize(
    ("m", "square", "flags"),
    [
        (np.float32, np.float64, np.bool_),
        (np.int64, np.float64, np.bool_),
        (np.float64, np.float32, np.bool_),
        (np.float64, np.float64, np.uint8),
        (np.float64, np.float64, np.float64),
        (np.float64, np.bool_, np.bool_),
    ],
)
def test_other_numbers_are_an_error(kernel: Kernel, m: Any, square: Any, flags: Any) -> None:
    """Arrays of other numbers would be read as what they are not."""
    with pytest.raises(TypingError, match="expected arrays"):
        kernel.single(np.ones((2, 2), m), np.ones((2, 2), square), np.ones(4, flags))


def test_other_arrays_are_an_error(kernel: Kernel) -> None:
    """So would arrays in another order, with other axes, too few of them, and what is no array."""
    m, square, flags = np.ones((2, 2)), np.zeros((2, 2)), np.zeros(4, dtype=bool)

    wrong: list[Any] = [np.asfortranarray(np.ones((3, 2)))[:2], m[0], 1.0]
    for arrays in [(m, square), *((one, square, flags) for one in wrong)]:
        with pytest.raises(TypingError, match="expected arrays"):
            kernel.single(*arrays)


def test_numba_keeps_no_address(kernel: Kernel) -> None:
    """Numba's own cache does not keep a loop with a kernel in it, whose address is another in the next process."""
    single = kernel.single

    @njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
    def loop(m: Any, square: Any, flags: Any) -> Any:
        return single(m, square, flags)

    with pytest.warns(NumbaWarning, match="Cannot cache compiled function"):
        assert loop(np.ones((2, 2)), np.zeros((2, 2)), np.zeros(4, dtype=np.bool_)) == 0
