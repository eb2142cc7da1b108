"""Emitted kernels: accuracy of their elementary functions, agreement with the equations, same bits always."""

import math
import os
import signal
import threading
import time
import weakref

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics.newton_euler import inverse_dynamics, newton_euler
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.inverse_kinematics.builds import BRANCHES
from armwright.kinematics.inverse_kinematics.geometry import solve_elbow, solve_joint_1
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.tracing.door import ROWS_BETWEEN_SIGNALS
from armwright.tracing.emit import emit
from armwright.tracing.kernel import LANES, CalledOff, Kernel, _addresses, on_cores_for_long
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, sin
from oracles.arms import random_arm, random_configurations

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture(scope="module")
def circle() -> Kernel:
    """Sine and cosine of one input, and the angle of the point of both."""
    return Kernel(emitted=emit("circle", lambda x, y: [[sin(x[0]), cos(x[0]), atan2(y[0], x[0])]], {"x": 1, "y": 1}))


@pytest.fixture(scope="module")
def stanford() -> Kernel:
    """Inverse dynamics of the Stanford arm at JPL."""
    arm = load_arm("stanford-jpl")
    return Kernel(emitted=emit("inverse dynamics", lambda q, qd, qdd: [newton_euler(arm, q, qd, qdd)], _motion(6)))


def _motion(joints: int) -> dict[str, int]:
    return {"q": joints, "qd": joints, "qdd": joints}


def _ulps(value: np.ndarray, exact: np.ndarray) -> float:
    return float((np.abs(value - exact) / np.spacing(np.abs(exact))).max())


@pytest.mark.parametrize("reach", [1e-9, 1.0, 7.0, 1e3, 1e5])
def test_sine_and_cosine_to_two_units(circle: Kernel, reach: float, rng: np.random.Generator) -> None:
    """Sine and cosine are within 2 units in the last place of the machine's library, up to 1e5 rad."""
    x = np.concatenate([rng.uniform(-reach, reach, 100_000), reach * np.linspace(-1, 1, 1001)])

    values = circle(x[:, None], np.ones((len(x), 1)))

    exact = np.array([(math.sin(v), math.cos(v)) for v in x])
    assert _ulps(values[:, 0], exact[:, 0]) <= 2
    assert _ulps(values[:, 1], exact[:, 1]) <= 2


def test_near_the_quarter_turns(circle: Kernel) -> None:
    """Next to the multiples of a right angle, where digits cancel, the small one of the two keeps its digits."""
    x = np.array([k * math.pi / 2 * (1 + d) for k in range(-40, 41) for d in (-1e-12, -1e-16, 0, 1e-16, 1e-12)])

    values = circle(x[:, None], np.ones((len(x), 1)))

    exact = np.array([(math.sin(v), math.cos(v)) for v in x])
    np.testing.assert_allclose(values[:, :2], exact, rtol=1e-12, atol=1e-25)


def test_arc_tangent_to_two_units(circle: Kernel, rng: np.random.Generator) -> None:
    """The arc tangent is within 2 units in all quadrants, for lengths from 1e-150 to 1e100, and on the axes."""
    angle, size = rng.uniform(-np.pi, np.pi, 100_000), 10 ** rng.uniform(-150, 99, 100_000)
    y, x = size * np.sin(angle), size * np.cos(angle)
    direction = Kernel(emitted=emit("direction", lambda x, y: [[atan2(y[0], x[0])]], {"x": 1, "y": 1}))

    values = direction(x[:, None], y[:, None])

    assert _ulps(values[:, 0], np.array([math.atan2(b, a) for a, b in zip(x, y, strict=True)])) <= 2
    axes = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 0.0)])
    values = circle(axes[:, :1], axes[:, 1:])
    np.testing.assert_array_equal(values[:, 2], (0, math.pi / 2, math.pi, -math.pi / 2, 0))


def test_exponentials_to_two_units(rng: np.random.Generator) -> None:
    """The exponential function is within 2 units where it is a normal number, 0 below and infinite above."""
    power = Kernel(emitted=emit("power", lambda x: [[exp(x[0])]], {"x": 1}))
    x = np.concatenate(
        [rng.uniform(-707, 709, 100_000), rng.uniform(-1, 1, 100_000), -(10 ** rng.uniform(-30, 0, 1000))]
    )

    assert _ulps(power(x[:, None])[:, 0], np.array([math.exp(v) for v in x])) <= 2
    edges = power(np.array([[0.0], [-0.0], [-708.0], [-1e99], [709.8], [1e99]]))[:, 0]
    np.testing.assert_array_equal(edges, (1, 1, 0, 0, math.inf, math.inf))


def test_cube_roots_to_two_units(rng: np.random.Generator) -> None:
    """Cube roots are within 2 units for magnitudes from 1e-307 to 1e100, and have the sign of the number."""
    root = Kernel(emitted=emit("root", lambda x: [[cbrt(x[0])]], {"x": 1}))
    x = 10 ** rng.uniform(-307, 100, 100_000) * rng.choice([-1.0, 1.0], 100_000)

    assert _ulps(root(x[:, None])[:, 0], np.cbrt(x)) <= 2
    np.testing.assert_array_equal(root(np.array([[0.0], [8.0], [-27.0], [1.0]]))[:, 0], (0, 2, -3, 1))


def test_agrees_with_the_equation(stanford: Kernel, rng: np.random.Generator) -> None:
    """The kernel gives the efforts of the law of motion evaluated with the machine's own functions."""
    q, qd, qdd = rng.uniform(-3, 3, size=(3, 1000, 6))

    tau = stanford(q, qd, qdd)

    np.testing.assert_allclose(tau, inverse_dynamics(load_arm("stanford-jpl"), q, qd, qdd, drives=False), atol=1e-11)


@pytest.mark.parametrize("rows", [1, 2, LANES - 1, LANES, LANES + 1, 20_000])
def test_same_bits_alone_and_in_company(stanford: Kernel, rows: int, rng: np.random.Generator) -> None:
    """A configuration has the same bits alone, at any place of any batch, and on any number of threads."""
    q, qd, qdd = rng.uniform(-3, 3, size=(3, rows, 6))

    together = stanford(q, qd, qdd)

    for threads in (2, 3):
        np.testing.assert_array_equal(stanford(q, qd, qdd, threads=threads), together)
    for k in {0, rows // 2, rows - 1}:
        np.testing.assert_array_equal(stanford(q[k], qd[k], qdd[k]), together[k])
    order = rng.permutation(rows)
    np.testing.assert_array_equal(stanford(q[order], qd[order], qdd[order]), together[order])


def test_shapes(stanford: Kernel) -> None:
    """Leading axes come back unchanged, are broadcast, and may be empty; read-only input is fine."""
    still = np.zeros(6)
    still.setflags(write=False)

    assert stanford(np.zeros((2, 5, 6)), still, still).shape == (2, 5, 6)
    assert stanford(still, still, still).shape == (6,)
    assert stanford(np.zeros((0, 6)), still, still).shape == (0, 6)


def test_bad_input(stanford: Kernel) -> None:
    """Wrong widths, counts, leading axes and NaN are refused as by the plain function."""
    with pytest.raises(ShapeError, match=r"expected 3 arrays \(q, qd, qdd\), got 2"):
        stanford(np.zeros(6), np.zeros(6))
    with pytest.raises(ShapeError, match=r"qd: expected shape \(6,\) on the last axes, got shape \(5,\)"):
        stanford(np.zeros(6), np.zeros(5), np.zeros(6))
    with pytest.raises(ShapeError, match=r"leading axes must broadcast together, got \(2, 6\), \(3, 6\), \(6,\)"):
        stanford(np.zeros((2, 6)), np.zeros((3, 6)), np.zeros(6))
    with pytest.raises(InvalidValueError, match="threads: expected an integer above 0"):
        stanford(np.zeros(6), np.zeros(6), np.zeros(6), threads=0)
    with pytest.raises(InvalidValueError, match="finite"):
        stanford(np.full(6, np.nan), np.zeros(6), np.zeros(6))


def test_choices_and_arc_tangents(rng: np.random.Generator) -> None:
    """A kernel of the PUMA's first three joints, full of arc tangents, puts the wrist where the equation does."""
    arm = load_arm("puma560")
    geometry = find_geometry(arm)
    assert geometry is not None
    side, elbow, _ = BRANCHES[2]

    def first_three(p: list[Scalar]) -> list[Scalar]:
        theta_1, X = solve_joint_1(geometry, p, side, 0.0)
        return [theta_1, *solve_elbow(geometry, X, p[2], elbow, 0.0)]

    kernel = Kernel(emitted=emit("shoulder", lambda p: [first_three(p)], {"p": 3}))
    points = rng.uniform(-0.5, 0.5, size=(500, 3))

    found = kernel(points)

    expected = np.array([first_three(p.tolist()) for p in points])
    difference = np.angle(np.exp(1j * (found - expected)))
    assert np.abs(difference).max() < 1e-7  # next to the edge of the reach a root loses half of the digits
    assert np.median(np.abs(difference)) < 1e-15


def test_random_arm(rng: np.random.Generator) -> None:
    """A general arm with prismatic joints compiles and agrees too."""
    arm = random_arm(rng, 4)
    kernel = Kernel(emitted=emit("random", lambda q, qd, qdd: [newton_euler(arm, q, qd, qdd)], _motion(4)))
    q, qd, qdd = random_configurations(arm, rng, 90).reshape(3, 30, 4)

    np.testing.assert_allclose(kernel(q, qd, qdd), inverse_dynamics(arm, q, qd, qdd, drives=False), atol=1e-11)


@pytest.mark.parametrize("threads", [1, 2])
def test_long_work_is_called_off(threads: int) -> None:
    """A signal is heard while compiled code works, and no thread of it goes on afterwards."""
    ended: list[int] = []

    def work(first: int, _last: int, called_off: CalledOff) -> None:
        until = time.monotonic() + 20
        while not called_off[0] and time.monotonic() < until:
            time.sleep(0.01)
        if called_off[0]:
            ended.append(first)

    # Whoever started the tests may have made them deaf, as a shell does in the background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            on_cores_for_long(work, threads * LANES, threads)
    finally:
        signal.signal(signal.SIGINT, before)

    assert sorted(ended) == [i * LANES for i in range(threads)]


@pytest.mark.parametrize("shape", [(1,), (3, 1)])
def test_plain_arrays_need_no_checks(shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Once compiled, a function goes from plain arrays straight to its kernel, for one configuration and for many."""
    square = Kernel(emitted=emit("square", lambda x: [[x[0] * x[0]]], {"x": 1})).function("square")
    square(np.ones(shape))
    monkeypatch.setattr(Kernel, "_careful", None)

    np.testing.assert_array_equal(square(np.full(shape, 3.0)), np.full(shape, 9.0))


@pytest.mark.parametrize("threads", [1, 2])
def test_no_row_of_many_is_overlooked(circle: Kernel, threads: int) -> None:
    """What is wrong with one row is said wherever it is, whichever part of the work meets it."""
    x, y = np.ones((2, 2 * ROWS_BETWEEN_SIGNALS + 5, 1))
    function = circle.function("circle")

    for row in (0, ROWS_BETWEEN_SIGNALS, len(x) - 1):
        y[row] = np.nan
        with pytest.raises(InvalidValueError, match="y: every number must be finite"):
            function(x, y, threads=threads)
        y[row] = 1.0
    function(x, y, threads=threads)


def test_addresses_keep_what_they_point_to() -> None:
    """A copy that is made for one call is there until the kernel has read it."""
    copies = [np.zeros(3), np.zeros((4, 4))]
    still_there = [weakref.ref(one) for one in copies]

    addresses = _addresses(copies)
    del copies

    assert [one() is not None for one in still_there] == [True, True]
    del addresses
    assert [one() for one in still_there] == [None, None]
