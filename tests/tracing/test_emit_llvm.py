"""LLVM IR of kernels: every width of rows and vectors gives the bits of exact arithmetic, and touches no other byte."""

import ctypes
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics.newton_euler import newton_euler
from armwright.tracing.emit import Emitted, emit, emit_lanes
from armwright.tracing.emit_llvm import MEANINGLESS, UNUSUAL, Target
from armwright.tracing.native import function_address
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, sin, sqrt
from oracles.graphs import evaluate_machine

TARGETS = [Target(lanes, fma) for lanes in (8, 4, 2, 1) for fma in (True, False)]
# Bytes before and behind an array, and what is in them.
FENCE, FILLED = 256, 0xA5


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile into a folder of the module's own; the modules behind it use the user's again."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


class Fenced:
    """An array with other bytes around it."""

    def __init__(self, shape: Sequence[int], kind: type = float) -> None:
        size = math.prod(shape) * np.dtype(kind).itemsize
        self._all = np.full(size + 2 * FENCE, FILLED, dtype=np.uint8)
        self.array = self._all[FENCE : FENCE + size].view(kind).reshape(shape)

    def is_whole(self) -> bool:
        """Whether nothing was written around it."""
        return bool(np.all(self._all[:FENCE] == FILLED) and np.all(self._all[len(self._all) - FENCE :] == FILLED))


def run(emitted: Emitted, target: Target, *inputs: np.ndarray, first: int = 0) -> tuple[int, list[np.ndarray]]:
    """Return the status and the outputs of rows ``first`` and behind, of one configuration if it has no rows."""
    lead = inputs[0].shape[: inputs[0].ndim - len(next(iter(emitted.inputs.values())))]
    kinds = [bool if i in emitted.flags else float for i in range(len(emitted.outputs))]
    outputs = [Fenced((*lead, *shape), kind) for shape, kind in zip(emitted.outputs, kinds, strict=True)]
    arrays = [*inputs, *(x.array for x in outputs)]
    before = [x.array[:first].tobytes() for x in outputs] if lead else []
    places = (ctypes.c_void_p * len(arrays))(*(x.ctypes.data for x in arrays))
    if lead:
        rows = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p)
        status = rows(function_address(emitted.rows_ir(target), "rows"))(first, lead[0], places)
    else:
        single = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)
        status = single(function_address(emitted.single_ir(target), "single"))(places)
    assert all(x.is_whole() for x in outputs)
    assert before == ([x.array[:first].tobytes() for x in outputs] if lead else [])
    return int(status), [x.array for x in outputs]


def exact(emitted: Emitted, target: Target, *inputs: np.ndarray) -> list[Any]:
    """The outputs of one configuration, all in one list."""
    flat = [float(x) for array in inputs for x in array.reshape(-1)]
    return evaluate_machine(emitted.code, emitted.code.outputs, flat, fma=target.has_fma)


def of_widths(a: int, b: int, sums: int, flags: int) -> Emitted:
    """A kernel with rows of some widths."""

    def equation(x: list[Scalar], y: list[Scalar]) -> list[list[Scalar]]:
        return [
            [x[k % a] * y[k % b] + x[(k + 1) % a] for k in range(sums)],
            [x[k % a] < y[(k + 2) % b] for k in range(flags)],
            [y[k % b] - x[k % a] for k in range(a)],
        ]

    return emit("widths", equation, {"x": a, "y": b}, flags=(1,))


# Each width from 1 to 20 once as that of an input, of sums and of flags.
WIDTHS = [(k, 1 + (7 * k) % 20, 1 + (11 * k) % 20, 1 + (3 * k) % 20) for k in range(1, 21)]


@pytest.mark.parametrize("widths", WIDTHS, ids=str)
@pytest.mark.drawn(0.3)
def test_widths_of_rows(widths: tuple[int, int, int, int], rng: np.random.Generator) -> None:
    """Rows of any width, and any number of rows, are read, computed and written to the last bit, and nothing else."""
    emitted = of_widths(*widths)
    a, b, sums, flags = widths
    k, columns = np.arange(sums), np.arange(flags)
    target = TARGETS[int(rng.integers(len(TARGETS)))]
    for rows in (0, 1, 2, 3, 5, 8, 9, 15, 17, 40):
        x, y = rng.standard_normal((rows, a)), rng.standard_normal((rows, b))
        first = int(rng.integers(min(rows, 3) + 1))

        status, (total, less, difference) = run(emitted, target, x, y, first=first)

        assert status == 0
        np.testing.assert_array_equal(less[first:], (x[:, columns % a] < y[:, (columns + 2) % b])[first:])
        np.testing.assert_array_equal(difference[first:], (y[:, np.arange(a) % b] - x)[first:])
        near = x[:, k % a] * y[:, k % b] + x[:, (k + 1) % a]
        np.testing.assert_allclose(total[first:], near[first:], rtol=0, atol=1e-15)
        for row in range(first, rows, 7):
            assert total[row].tolist() == exact(emitted, target, x[row], y[row])[:sums]


@pytest.mark.parametrize("target", TARGETS, ids=str)
def test_bits_of_exact_arithmetic(target: Target, rng: np.random.Generator) -> None:
    """The efforts of an arm have the bits of its operations done one by one, alone and in vectors of any width.

    So vectors of all widths give the same bits where the processor rounds a product and a sum once.
    """
    arm = load_arm("stanford-jpl")
    emitted = emit("efforts", lambda q, qd, qdd: [newton_euler(arm, q, qd, qdd)], {"q": 6, "qd": 6, "qdd": 6})
    inputs = rng.uniform(-3, 3, (3, 11, 6))
    expected = [exact(emitted, target, *inputs[:, row]) for row in range(11)]

    assert run(emitted, target, *inputs)[1][0].tolist() == expected
    assert run(emitted, target, *inputs[:, 4])[1][0].tolist() == expected[4]


@pytest.mark.parametrize("target", [Target(8, has_fma=True), Target(2, has_fma=False)], ids=str)
def test_hostile_numbers(target: Target) -> None:
    """Zeros of either sign, the smallest and the largest numbers give the bits of exact arithmetic as well."""

    def equation(x: list[Scalar], y: list[Scalar]) -> list[list[Scalar]]:
        a, b = x[0], y[0]
        return [[atan2(a, b), sqrt(a), a * b + a, -a, abs(b), (a < b) + 1.0, sin(a) + cos(b), cbrt(a), exp(b)]]

    emitted = emit("hostile", equation, {"x": 1, "y": 1})
    numbers = [0.0, -0.0, 5e-324, -5e-324, 2.3e-308, -1e-310, 1.0, -1.0, math.pi / 2, 1e11, -1e11]
    x, y = (np.array(column)[:, None] for column in zip(*((a, b) for a in numbers for b in numbers), strict=True))

    _, (values,) = run(emitted, target, x, y)

    expected = [exact(emitted, target, a, b) for a, b in zip(x, y, strict=True)]
    assert values.tobytes() == np.array(expected).tobytes()


@pytest.mark.parametrize("lanes", [8, 4, 2, 1])
def test_status(lanes: int) -> None:
    """One configuration without meaning, or an unusual one, is reported from any place of any batch."""
    emitted = emit("status", lambda x: [[sin(x[0]) + x[1]]], {"x": 2}, bounds={"x": [5.0, 7.0]})
    target = Target(lanes, has_fma=True)
    for rows in (1, 2, 7, 8, 9, 17):
        for place in range(rows):
            for bad, status in ((math.nan, MEANINGLESS), (-math.inf, MEANINGLESS), (7.5, UNUSUAL)):
                x = np.ones((rows, 2))
                x[place, 1] = bad
                assert run(emitted, target, x)[0] == status
                x[(place + 1) % rows, 0] = math.nan
                assert run(emitted, target, x)[0] == MEANINGLESS
    for bad, status in ((math.nan, MEANINGLESS), (7.5, UNUSUAL), (0.0, 0)):
        assert run(emitted, target, np.array([0.0, bad]))[0] == status


def test_other_rows_are_not_looked_at() -> None:
    """What lies before and behind the rows in question does not matter."""
    emitted = emit("rows", lambda x: [[sin(x[0]) + x[1] + x[2]]], {"x": 3})
    for rows in range(12):
        surroundings = np.full((rows + 20, 3), np.nan)
        surroundings[10 : 10 + rows] = 1.0
        assert run(emitted, Target(8, has_fma=True), surroundings[: 10 + rows], first=10)[0] == 0


@pytest.mark.parametrize("lanes", [8, 4, 2, 1])
def test_side_by_side(lanes: int, rng: np.random.Generator) -> None:
    """Configurations whose numbers lie side by side give the bits of those in rows."""

    def equation(x: list[Scalar]) -> list[Scalar]:
        return [x[0] * x[1] + x[2], sin(x[2]), x[0]]

    target = Target(lanes, has_fma=True)
    code = emit_lanes(equation, 3, 16, target)
    x = Fenced((3, 16))
    y = Fenced((code.outputs, 16))
    x.array[:] = rng.standard_normal((3, 16))
    lanes_of = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)

    lanes_of(function_address(code.ir, "lanes"))(x.array.ctypes.data, y.array.ctypes.data)

    assert x.is_whole()
    assert y.is_whole()
    in_rows = emit("rows", lambda x: [equation(x)], {"x": 3})
    np.testing.assert_array_equal(y.array.T, run(in_rows, target, np.ascontiguousarray(x.array.T))[1][0])


def test_sine_without_fused_operations(rng: np.random.Generator) -> None:
    """On a processor that rounds every product, sine and cosine are within 2 units up to 1e6, in vectors of two."""
    emitted = emit("circle", lambda x: [[sin(x[0]), cos(x[0])]], {"x": 1})
    x = rng.uniform(-1e6, 1e6, (20_000, 1))

    _, (values,) = run(emitted, Target(2, has_fma=False), x)

    library = np.array([(math.sin(v), math.cos(v)) for v in x[:, 0]])
    assert (np.abs(values - library) / np.spacing(np.abs(library))).max() <= 2
