"""The way from Python into a kernel: any array gives the right answer or an error, and nothing leaks or outlives."""

import copy
import gc
import os
import pickle
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armwright
from armwright.errors import ArmwrightError, InvalidValueError, ShapeError
from armwright.tracing import kernel as kernels
from armwright.tracing.door import layout_is_known
from armwright.tracing.emit import emit
from armwright.tracing.kernel import LANES, Kernel
from armwright.tracing.scalar import Scalar, sin


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile into a folder of the module's own; the modules behind it use the user's again."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def two_results(x: list[Scalar], m: list[Scalar]) -> list[list[Scalar]]:
    return [[x[0] * m[0] + x[1], x[1] - m[3], x[2] + m[1] * m[2]], [x[0] < m[0], x[1] < m[3]]]


def expected(x: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What ``both`` gives for whole numbers, which are exact."""
    columns = [x[..., 0] * m[..., 0, 0] + x[..., 1], x[..., 1] - m[..., 1, 1], x[..., 2] + m[..., 0, 1] * m[..., 1, 0]]
    return np.stack(columns, axis=-1), np.stack([x[..., 0] < m[..., 0, 0], x[..., 1] < m[..., 1, 1]], axis=-1)


def new_kernel() -> Kernel:
    return Kernel(emitted=emit("two results", two_results, {"x": 3, "m": (2, 2)}, flags=(1,)))


@pytest.fixture(scope="module")
def both() -> Callable[..., Any]:
    """A function of two arrays with two results, which was called before for one and for many."""
    function = new_kernel().function("both", "Return two results.")
    function(np.zeros(3), np.zeros((2, 2)))
    function(np.zeros((2, 3)), np.zeros((2, 2, 2)))
    return function


@pytest.fixture(scope="module")
def double() -> Callable[..., Any]:
    """A function with one result of the shape of its input."""
    function = Kernel(emitted=emit("double", lambda x: [[2.0 * value for value in x]], {"x": 3})).function("double")
    function(np.zeros(3))
    function(np.zeros((2, 3)))
    return function


def integers(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return rng.integers(-9, 10, shape).astype(float)


def test_objects_lie_where_they_are_read() -> None:
    """With this Python and this NumPy calls need no line of Python."""
    assert layout_is_known()


# ---- arrays of every kind ----


def unaligned(array: np.ndarray) -> np.ndarray:
    copied = np.frombuffer(bytearray(array.nbytes + 3), dtype=float, count=array.size, offset=3).reshape(array.shape)
    copied[...] = array
    assert not copied.flags.aligned
    return copied


def read_only(array: np.ndarray) -> np.ndarray:
    array = array.copy()
    array.setflags(write=False)
    return array


LAYOUTS: dict[str, Callable[[np.ndarray], Any]] = {
    "plain": np.ndarray.copy,
    "Fortran": np.asfortranarray,
    "backwards": lambda x: np.ascontiguousarray(x[..., ::-1])[..., ::-1],
    "every other": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "unaligned": unaligned,
    "other bytes": lambda x: x.astype(">f8"),
    "read-only": read_only,
    "single": lambda x: x.astype(np.float32),
    "integers": lambda x: x.astype(np.int16),
    "objects": lambda x: x.astype(object),
    "subclass": lambda x: x.view(np.recarray),
    "nothing masked": np.ma.array,
    "lists": np.ndarray.tolist,
}


@pytest.mark.parametrize("lead", [(), (1,), (7,), (300,), (9000,), (2, 3)], ids=str)
def test_arrays_of_any_layout(both: Callable[..., Any], lead: tuple[int, ...], rng: np.random.Generator) -> None:
    """Numbers count, not how they lie in memory."""
    x, m = integers(rng, *lead, 3), integers(rng, *lead, 2, 2)
    wanted = expected(x, m)
    some = list(LAYOUTS.values())
    for i, layout in enumerate(some):
        for arguments in ((layout(x), m), (x, layout(m)), (layout(x), some[i - 1](m))):
            for got, right in zip(both(*arguments), wanted, strict=True):
                assert (type(got), got.dtype) == (np.ndarray, right.dtype)
                np.testing.assert_array_equal(got, right)


@pytest.mark.parametrize("rows", [*range(41), 255, 256, 257, 4095, 4097, 8191, 8192, 8193, 12289])
def test_any_number_of_rows(double: Callable[..., Any], rows: int, rng: np.random.Generator) -> None:
    """Any number of rows, from none, on any number of threads."""
    x = rng.standard_normal((rows, 3))

    for threads in (None, 1, 2, 3, 10**9, np.int64(2), 10**30):
        np.testing.assert_array_equal(double(x, threads=threads), 2 * x)


def test_names_of_arguments(both: Callable[..., Any], rng: np.random.Generator) -> None:
    """Inputs may be named and options come in any order; wrong names and counts are the errors of any function."""
    x, m = integers(rng, 5, 3), integers(rng, 5, 2, 2)
    wanted = expected(x, m)
    out = np.empty((5, 3)), np.empty((5, 2), dtype=bool)
    strange = b"threads".decode()  # the same text, another object

    calls: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
        ((), {"m": m, "x": x}),
        ((x,), {"m": m, "out": out, "threads": 1}),
        ((x, m), {"threads": 1, "out": out}),
        ((x, m), {"out": None, strange: None}),
    ]
    for arguments, named in calls:
        for got, right in zip(both(*arguments, **named), wanted, strict=True):
            np.testing.assert_array_equal(got, right)
    wrong: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
        ((), {}), ((x,), {}), ((x, m, m), {}), ((x, m), {"thread": 1}), ((x, m), {"m": m}), ((x, m, 1, out), {}),
        ((x, m), {"out": out, "thread": 1, "threads": 1}), ((x, m), {"threads": 1, "axis": 0, "out": out}),
    ]  # fmt: skip
    for arguments, named in wrong:
        with pytest.raises(TypeError, match="argument"):
            both(*arguments, **named)


@pytest.mark.parametrize("threads", [True, False, 0, -1, np.int64(0), 1.0, "2", [1]])
def test_threads_that_are_none(double: Callable[..., Any], threads: Any) -> None:
    """A number of threads is an integer above 0."""
    for x in (np.zeros(3), np.zeros((9, 3)), np.zeros((9000, 3))):
        with pytest.raises(InvalidValueError, match="threads: expected an integer above 0"):
            double(x, threads=threads)


# ---- arrays to fill ----


@pytest.mark.parametrize("lead", [(), (1,), (6,), (300,), (9000,), (2, 3)], ids=str)
def test_arrays_to_fill(both: Callable[..., Any], lead: tuple[int, ...], rng: np.random.Generator) -> None:
    """Results are in the arrays that were given, and nowhere else."""
    x, m = integers(rng, *lead, 3), integers(rng, *lead, 2, 2)
    out = np.full((*lead, 3), np.nan), np.full((*lead, 2), fill_value=True)

    got = both(x, m, out=out)

    assert [a is b for a, b in zip(got, out, strict=True)] == [True, True]
    for filled, right in zip(out, expected(x, m), strict=True):
        np.testing.assert_array_equal(filled, right)


def test_arrays_that_cannot_be_filled(both: Callable[..., Any], double: Callable[..., Any]) -> None:
    """What is no writable array in C order, of the right kind, is refused, with what it is."""
    x, m = np.zeros((4, 3)), np.zeros((4, 2, 2))
    flags = np.empty((4, 2), dtype=bool)
    bad: dict[str, Any] = {
        r"\(4, 3\) float64 read-only": read_only(x),
        r"\(4, 3\) float64 not in C order": np.asfortranarray(x),
        r"\(4, 3\) float64 not aligned": unaligned(x),
        r"\(4, 3\) >f8": x.astype(">f8"),
        r"\(4, 3\) float32": x.astype(np.float32),
        r"\(4, 2\) float64": x[:, :2].copy(),
        r"\(3,\) float64": np.empty(3),
        r"\[\[1\], \[1, 2\]\]": [[1], [1, 2]],
        r"\(4, 3\) float64 masked": np.ma.array(x),
        "5": 5,
        "none": (),
    }
    for got, array in bad.items():
        with pytest.raises(
            ShapeError, match=rf"^out: expected writable arrays in C order, \(4, 3\) float64; got {got}"
        ):
            double(x, out=array)
        with pytest.raises(ShapeError, match=r"^out: "):
            both(x, m, out=(array, flags))
    for out in ([x.copy(), flags], (x.copy(),), (x.copy(), flags, flags), (flags, x.copy()), x.copy()):
        with pytest.raises(ShapeError, match=r"^out: "):
            both(x, m, out=out)


@pytest.mark.parametrize("rows", [0, 2, 4, 5, 300])
def test_rows_of_two_numbers(both: Callable[..., Any], rows: int) -> None:
    """Arrays of different numbers of rows do not fit, be they read or filled."""
    x, m = np.zeros((3, 3)), np.zeros((rows, 2, 2))

    with pytest.raises(ShapeError, match="leading axes must broadcast"):
        both(x, m)
    for filled in ((rows, 3), (3, rows)):
        out = np.full((filled[0], 3), 7.0), np.ones((filled[1], 2), dtype=bool)
        with pytest.raises(ShapeError, match=r"^out: "):
            both(x, np.zeros((3, 2, 2)), out=out)
        assert (out[0] == 7).all()
        assert out[1].all()


@pytest.mark.parametrize("shift", range(-4, 5))
@pytest.mark.parametrize("rows", [0, 1, 9])
def test_filled_over_the_input(double: Callable[..., Any], shift: int, rows: int, rng: np.random.Generator) -> None:
    """An array to fill may share memory with an input in any way."""
    buffer = rng.standard_normal(8 + 3 * max(rows, 1))
    shape = (rows, 3) if rows else (3,)
    x, out = (buffer[i : i + int(np.prod(shape))].reshape(shape) for i in (4, 4 + shift))
    wanted = 2 * x

    np.testing.assert_array_equal(double(x, out=out), wanted)


def test_filled_over_each_other() -> None:
    """Two arrays to fill must be apart: one would be wrong."""
    twins = Kernel(emitted=emit("twins", lambda x: [[x[0], x[1]], [x[1], x[0]]], {"x": 2})).function("twins")
    buffer = np.zeros(11)
    for _ in range(2):  # not compiled, and compiled
        for shift in (0, 1):
            with pytest.raises(ShapeError, match="out: expected arrays apart from each other"):
                twins(np.array([1.0, 2.0]), out=(buffer[:2], buffer[shift : shift + 2]))
        side_by_side = twins(np.array([1.0, 2.0]), out=(buffer[:2], buffer[2:4]))
        np.testing.assert_array_equal(side_by_side, [[1, 2], [2, 1]])
    triplets = Kernel(emitted=emit("triplets", lambda x: [[x[0]], [x[1]], [x[0]]], {"x": 2})).function("triplets")
    a, b = np.zeros((2, 1))
    for out in ((a, a, b), (a, b, a), (b, a, a)):
        with pytest.raises(ShapeError, match="out: expected arrays apart from each other"):
            triplets(np.array([1.0, 2.0]), out=out)


# ---- errors ----


@pytest.mark.parametrize("rows", [1, 8, 9, 300, 9000])
def test_one_bad_number_anywhere(double: Callable[..., Any], rows: int, rng: np.random.Generator) -> None:
    """A number that is none is found at any place of a batch, and named with its index."""
    for place in {0, rows // 2, rows - 1}:
        for bad, message in ((np.nan, "finite"), (np.inf, "finite"), (1e101, "no larger than")):
            x = rng.standard_normal((rows, 3))
            x[place, 2] = bad
            for options in ({}, {"threads": 1}, {"out": np.empty_like(x)}):
                with pytest.raises(InvalidValueError, match=rf"x: .*{message}.* at \({place}, 2\)"):
                    double(x, **options)


def test_names_that_are_taken() -> None:
    """An input cannot be called as an option of every kernel is, and there is one at least."""
    for name in ("threads", "out", "not a name", "class"):
        with pytest.raises(InvalidValueError, match="inputs: expected names such as 'qd', got"):
            emit("taken", lambda x: [x], {name: 1})
    with pytest.raises(InvalidValueError, match="inputs: expected at least one"):
        emit("nothing", lambda: [[1.0]], {})


# ---- lives ----


def test_references_are_given_back(both: Callable[..., Any]) -> None:
    """Calls, and errors in them, leave the counts of references as they were."""
    x, m, rows, out = np.zeros(3), np.zeros((2, 2)), np.zeros((300, 3)), (np.zeros(3), np.zeros(2, dtype=bool))
    kind, answers = np.dtype(bool), (np.empty((300, 3)), np.empty((300, 2), dtype=bool))
    bad = np.full(3, np.nan)
    held: list[Any] = [x, m, rows, out, *out, answers, *answers, kind, np.empty, np.ndarray, 1, "out", both]

    def calls() -> None:
        for _ in range(50):
            both(x, m), both(x, m, out=out), both(rows, np.zeros((300, 2, 2)), out=answers)
            both(rows, m, threads=1)
            for wrong in (bad, None, m):
                with pytest.raises(ArmwrightError):
                    both(wrong, m)
                with pytest.raises(ArmwrightError):
                    both(x, m, out=(wrong, wrong))

    calls()
    gc.collect()
    before = [sys.getrefcount(one) for one in held]
    calls()
    gc.collect()
    assert max(abs(sys.getrefcount(one) - count) for one, count in zip(held, before, strict=True)) < 40
    first, second = both(x, m)
    assert [sys.getrefcount(first), sys.getrefcount(second)] == [2, 2]


def test_a_function_keeps_its_kernel_and_no_longer() -> None:
    """A function works without its kernel at hand, and when it is gone so is the kernel."""
    kernel = new_kernel()
    function, gone = kernel.function("both", "Return."), weakref.ref(kernel)
    copies = [copy.copy(function), copy.deepcopy(function)]
    del kernel
    gc.collect()

    for one in (function, *copies):
        np.testing.assert_array_equal(one(np.ones(3), np.ones((2, 2)))[0], (2, 0, 2))
    assert (function.__name__, function.__doc__) == ("both", "Return.")
    with pytest.raises(TypeError, match="cannot be pickled"):
        pickle.dumps(function)
    del function, copies, one
    gc.collect()
    assert gone() is None


def test_called_from_many_threads(rng: np.random.Generator) -> None:
    """Threads that call a function before it is compiled, and while it is, all get right answers."""
    function = Kernel(emitted=emit("at once", lambda x: [[x[0] * 3.0 + x[1]]], {"x": 2})).function("at once")
    x = integers(rng, 20_000, 2)
    wrong: list[int] = []
    begin = threading.Barrier(6)

    def work() -> None:
        begin.wait()
        for rows in (1, 300, 20_000, 7, 9000):
            right = 3 * x[:rows, 0] + x[:rows, 1]
            wrong.append(int(np.sum(function(x[:rows])[:, 0] != right)))

    threads = [threading.Thread(target=work) for _ in range(6)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert wrong == [0] * 30


def test_a_signal_ends_a_call_and_its_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """When a call ends early no thread works on its arrays any more, and parts not begun are left out."""
    kernel = Kernel(emitted=emit("ends", lambda x: [[x[0]]], {"x": 1}))
    begun, ended = threading.Event(), []
    monkeypatch.setattr(kernels, "ROWS_BETWEEN_SIGNALS", LANES)

    def rows(first: int, _last: int, _arrays: Any) -> int:
        if not first:
            begun.wait(20)
            raise KeyboardInterrupt
        begun.set()
        while_interrupted.wait(0.2)
        ended.append(first)
        return 0

    while_interrupted = threading.Event()
    kernel.__dict__["_rows"] = rows
    with pytest.raises(KeyboardInterrupt):
        kernel(np.zeros((10_000, 1)), threads=2)

    so_far = len(ended)
    assert 1 <= so_far < 10
    while_interrupted.wait(0.5)
    assert len(ended) == so_far


def test_no_more_threads(double: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Where the system gives one thread and then none, the work is done without."""
    pool, given = kernels._pool(), []

    class Limited:
        def submit(self, *work: Any) -> Any:
            if given:
                raise RuntimeError("can't start new thread")
            given.append(pool.submit(*work))
            return given[0]

    monkeypatch.setattr(kernels, "_pool", Limited)
    x = rng.standard_normal((20_000, 3))

    np.testing.assert_array_equal(double(x, threads=3), 2 * x)
    assert given[0].done()


_FORKED = """
import os, signal, sys, threading
import numpy as np
from armwright.tracing import native
from armwright.tracing.emit import emit
from armwright.tracing.kernel import Kernel
double = Kernel(emitted=emit("double", lambda x: [[2.0 * x[0]]], {"x": 1})).function("double")
x = np.arange(20_000.0)[:, None]
double(x, threads=4)
ready, done = threading.Event(), threading.Event()
def compile_slowly():
    with native._COMPILING:
        ready.set()
        done.wait(0.2)
threading.Thread(target=compile_slowly).start()
ready.wait()
child = os.fork()
if not child:
    signal.alarm(30)
    again = Kernel(emitted=emit("triple", lambda x: [[3.0 * x[0]]], {"x": 1})).function("triple")
    os._exit(0 if np.array_equal(double(x, threads=4), 2 * x) and np.array_equal(again(x), 3 * x) else 3)
sys.exit(os.waitpid(child, 0)[1])
"""


def test_after_a_fork(tmp_path: Path) -> None:
    """A forked process has threads of its own, and waits for no thread of its parent that compiles."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(armwright.__file__).parents[1]),
        "ARMWRIGHT_CACHE": str(tmp_path),
    }
    done = subprocess.run([sys.executable, "-c", _FORKED], env=environment, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_sine_far_out(rng: np.random.Generator) -> None:
    """Angles up to 1e12 have a sine; those beyond are refused, also where many together only look too large."""
    wave = Kernel(emitted=emit("wave", lambda x: [[sin(value) for value in x]], {"x": 8})).function("wave")
    largest = np.full((20, 8), 0.9e12)

    np.testing.assert_allclose(wave(largest), np.sin(largest), atol=1e-9)
    largest[rng.integers(20), 3] = 1.1e12
    with pytest.raises(InvalidValueError, match=r"no larger than 1e\+12"):
        wave(largest)
