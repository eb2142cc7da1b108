"""The fastest run along a path: closed forms, a pendulum's phase plane, toppra, and limits that hold in between."""

import sys
from typing import Any

import attrs
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import (
    ArmwrightError,
    InvalidValueError,
    KindError,
    MissingExtraError,
    ShapeError,
    UnknownNameError,
)
from armwright.motion.joint_path import through_knots
from armwright.motion.quintic_polynomials import quintic
from armwright.motion.time_optimal_path import time_optimal
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.motion.xspline_path import xspline
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

PUMA = load_arm("puma560-seed")
SPEED, ACCELERATION, EFFORT = PUMA.limits.speed, PUMA.limits.acceleration, PUMA.limits.effort
ROUNDING = 1e-9
# The part of the time that a grid of 300 intervals costs.
GRID = 7e-3
# Between samples efforts may be passed by this part of their limits.
SEEN = 1e-3


def slide(speed: float, acceleration: float) -> Arm:
    """One slide with limits."""
    return Arm(name="slide", joints=[Joint(kind="prismatic", limits=Limits(speed=speed, acceleration=acceleration))])


# A rod of 1 kg and 1 m on a level axis; at q = 0 it points sideways.
INERTIA, WEIGHT = 1 / 3, STANDARD_GRAVITY / 2
DOWN, ALOFT = -np.pi / 2, 1.2


def rod(effort: float, speed: float = np.inf, **motor: float) -> Arm:
    """The rod, with a limit of its torque."""
    return Arm(
        name="rod",
        joints=[Joint(kind="revolute", a=1.0, limits=Limits(effort=effort, speed=speed))],
        links=[Link(mass=1.0, com=(-0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))],
        motors=[Motor(**motor)],
        gravity=(0, -STANDARD_GRAVITY, 0),
    )


def shortest_swing(effort: float, **friction: float) -> float:
    """The time of the rod from DOWN to ALOFT, full torque forward and then full torque backward, by its phase plane."""

    def resistance(x: Any) -> Any:
        v, terms = (
            np.sqrt(np.maximum(x, 0)),
            {"viscous": 0.0, "coulomb": 0.0, "cube_root": 0.0, "stribeck": 0.0, **friction},
        )
        fades = terms["stribeck"] * np.exp(-((v / terms.get("stribeck_speed", 1.0)) ** 2))
        return terms["coulomb"] + fades + terms["viscous"] * v + terms["cube_root"] * np.cbrt(v)

    def slope(torque: float) -> Any:
        return lambda q, x: 2 / INERTIA * (torque - WEIGHT * np.cos(q) - resistance(x))

    exact = {"rtol": 1e-10, "atol": 1e-12, "dense_output": True}
    up = solve_ivp(slope(effort), (DOWN, ALOFT), [0.0], **exact).sol
    back = solve_ivp(slope(-effort), (ALOFT, DOWN), [0.0], **exact).sol
    turn = brentq(lambda q: up(q)[0] - back(q)[0], DOWN + 1e-3, ALOFT - 1e-3)
    # The speed rises and falls as a root: with its square as the variable the integrand is smooth.
    rise, _ = quad(lambda r: 2 * r / np.sqrt(up(DOWN + r * r)[0]), 1e-9, np.sqrt(turn - DOWN))
    fall, _ = quad(lambda r: 2 * r / np.sqrt(back(ALOFT - r * r)[0]), 1e-9, np.sqrt(ALOFT - turn))
    return rise + fall


def bend() -> Trajectory:
    """A path of two joints on which the second is 0.6 of the first, less a third of its square and 0.4 of its cube."""
    return Trajectory(times=(0.0, 1.0), coefficients=np.array([[[0.0, 0.0], [1.0, 0.6], [0.0, -1 / 3], [0.0, 0.4]]]))


def limits_hold(arm: Arm, run: Trajectory) -> bool:
    """Whether 20 000 samples pass no limit: efforts but for a thousandth.

    At the very ends, at rest, the sign of the speed is rounding, and so would dry friction be.
    """
    t = np.linspace(0, run.duration, 20001)[1:-1]
    tau = inverse_dynamics(arm, run(t), run(t, 1), run(t, 2))
    return bool(
        (np.abs(run(t, 1)) <= arm.limits.speed * (1 + ROUNDING)).all()
        and (np.abs(run(t, 2)) <= arm.limits.acceleration * (1 + ROUNDING)).all()
        and (np.abs(tau) <= arm.limits.effort * (1 + SEEN)).all()
    )


@pytest.mark.parametrize("by", ["armwright", "toppra"])
def test_full_acceleration_and_full_braking(by: Any) -> None:
    """Over 3 m at 2 m/s², half of the way faster and half of it slower: the root of 4 · 3 / 2 seconds."""
    if by == "toppra":
        pytest.importorskip("toppra")
    found = time_optimal(slide(np.inf, 2.0), [[0.0], [3.0]], method=by)

    assert found.trajectory.duration == pytest.approx(np.sqrt(4 * 3 / 2), rel=1e-5)
    assert found.share("acceleration") == pytest.approx(1)
    assert found.factor == pytest.approx(1, abs=1e-6)
    np.testing.assert_allclose(found.trajectory([0.0, found.trajectory.duration])[:, 0], [0, 3], atol=ROUNDING)
    np.testing.assert_allclose(found.trajectory([0.0, found.trajectory.duration], 1), 0, atol=1e-4)


def test_trapezoid_of_speed() -> None:
    """With a top speed v it is way / v + v / a, and the speed binds while it is held."""
    found = time_optimal(slide(1.5, 2.0), [[0.0], [3.0]])

    expected = 3 / 1.5 + 1.5 / 2
    assert found.trajectory.duration == pytest.approx(expected, rel=1e-3)
    assert found.share("speed") == pytest.approx((expected - 2 * 1.5 / 2) / expected, abs=0.02)
    assert found.share("acceleration") == pytest.approx(2 * 1.5 / 2 / expected, abs=0.02)


def test_the_joint_that_takes_longest() -> None:
    """On a straight line of six joints the slowest alone decides, and it is at its limit all the time."""
    way = np.array([1.0, 0.5, -1.0, 1.0, 1.0, 2.0])
    alone = np.where(
        np.abs(way) * ACCELERATION > SPEED**2,
        np.abs(way) / SPEED + SPEED / ACCELERATION,
        2 * np.sqrt(np.abs(way) / ACCELERATION),
    )

    found = time_optimal(PUMA, [np.zeros(6), way], efforts=False)

    assert found.trajectory.duration == pytest.approx(alone.max(), rel=1e-6)
    assert found.bindings[0].joint == alone.argmax()
    assert found.bindings[0].share > 0.99


@pytest.mark.parametrize(
    "friction",
    [
        {},
        {"coulomb": 1.0},
        {"viscous": 0.2},
        {"viscous": 1.0},
        {"cube_root": 1.0},
        {"stribeck": 0.8, "stribeck_speed": 0.5, "coulomb": 0.2},
        {"stribeck": 0.8, "stribeck_speed": 3.0, "cube_root": 0.5, "viscous": 0.2},
    ],
)
def test_a_rod_is_swung_up(friction: dict[str, float]) -> None:
    """The phase plane of one joint gives the shortest time under a limit of torque; the torque binds all the time."""
    motor = {name: number for name, number in friction.items() if name != "coulomb"}
    motor |= dict.fromkeys(("coulomb_forward", "coulomb_backward"), friction.get("coulomb", 0.0))

    found = time_optimal(rod(8.0, **motor), [[DOWN], [ALOFT]])

    assert found.trajectory.duration == pytest.approx(shortest_swing(8.0, **friction), rel=GRID)
    assert found.share("effort") > 0.95
    assert limits_hold(found.arm, found.trajectory)


def test_error_falls_with_the_grid() -> None:
    """The excess over the shortest time falls to less than half when the grid is twice as fine."""
    exact = shortest_swing(8.0)
    excess = [
        time_optimal(rod(8.0), [[DOWN], [ALOFT]], intervals=n).trajectory.duration / exact - 1 for n in (25, 50, 100)
    ]

    assert 0 < excess[2] < excess[1] / 2 < excess[0] / 4


def test_the_path_is_exactly_the_same() -> None:
    """Wherever the first joint is, the second is where the path has it, to rounding."""
    arm = attrs.evolve(PUMA, joints=PUMA.joints[:2], links=PUMA.links[:2], motors=PUMA.motors[:2])

    run = time_optimal(arm, bend()).trajectory

    q = run(np.linspace(0, run.duration, 5000))
    np.testing.assert_allclose(q[:, 1], 0.6 * q[:, 0] - q[:, 0] ** 2 / 3 + 0.4 * q[:, 0] ** 3, atol=1e-12)
    assert (np.diff(q[:, 0]) > 0).all()
    assert run.coefficients.shape[1] == 7
    assert limits_hold(arm, run)


@pytest.mark.share(0.5)
def test_limits_hold_between_the_grid_points(rng: np.random.Generator, sample: Sample) -> None:
    """On random paths of three kinds, grids coarse and fine: no limit is passed, and some limit is met."""
    for k in range(sample.count(12)):
        knots = rng.uniform(-0.8, 0.8, (5, 6))
        path: Any = (
            knots,
            xspline(np.cumsum([0, *rng.uniform(0.3, 2, 4)]), knots),
            join([quintic(*knots[i : i + 2], 1.0) for i in range(3)]),
        )[k % 3]

        found = time_optimal(PUMA, path, intervals=(30, 120)[k % 2])

        assert limits_hold(PUMA, found.trajectory)
        uses = [(peak / getattr(PUMA.limits, name)).max() for name, peak in found.peaks.items()]
        assert max(uses) == pytest.approx(1, abs=2e-3)
        assert found.factor < 1.02


def test_a_motion_from_rest_to_rest_as_the_path(rng: np.random.Generator) -> None:
    """A quintic stands at both ends whatever the speed along it; its straight way is run as the two places alone."""
    goal = rng.uniform(-1, 1, 6)
    alone = time_optimal(PUMA, [np.zeros(6), goal])

    found = time_optimal(PUMA, quintic(np.zeros(6), goal, 7.0))

    assert found.duration_before == 7.0
    assert found.trajectory.duration == pytest.approx(alone.trajectory.duration, rel=GRID)
    assert "instead of 7.000 s" in str(found)


def test_weak_motors_take_longer(rng: np.random.Generator) -> None:
    """A waist with a third less than the fastest run asks, beside its friction, is slower, and its effort binds."""
    knots = rng.uniform(-0.6, 0.6, (4, 6))
    knots[:, 0] = (-1.0, 1.0, -0.5, 1.0)
    strong = time_optimal(PUMA, knots)
    rubs = PUMA.motors[0].coulomb_forward
    waist = attrs.evolve(PUMA.joints[0].limits, effort=(2 * strong.peaks["effort"][0] + rubs) / 3)
    weak = attrs.evolve(PUMA, joints=(attrs.evolve(PUMA.joints[0], limits=waist), *PUMA.joints[1:]))

    slower, ignored = time_optimal(weak, knots), time_optimal(weak, knots, efforts=False)

    assert strong.share("effort") == 0
    assert ignored.trajectory.duration == pytest.approx(strong.trajectory.duration, rel=1e-3)
    assert slower.trajectory.duration > 1.01 * strong.trajectory.duration
    assert ("effort", 0) in {(binding.limit, binding.joint) for binding in slower.bindings}
    assert limits_hold(weak, slower.trajectory)


class Adapted:
    """A path as toppra wants it."""

    def __init__(self, path: Trajectory) -> None:
        self.path, self.path_interval, self.dof = path, np.array([0.0, path.duration]), path.coefficients.shape[2]

    def __call__(self, s: Array, order: int = 0) -> Array:
        """Positions or derivatives at parameters."""
        return self.path(s, order)


@pytest.mark.filterwarnings("default")
def test_toppra_needs_as_long(rng: np.random.Generator) -> None:
    """Toppra, with constraints and a grid of its own on the same path, finds the same time."""
    algorithm = pytest.importorskip("toppra.algorithm")
    constraint = pytest.importorskip("toppra.constraint")
    for _ in range(3):
        knots = rng.uniform(-0.8, 0.8, (5, 6))
        path = through_knots(PUMA, knots)
        bounds = [
            constraint.JointVelocityConstraint(np.stack([-SPEED, SPEED], axis=1)),
            constraint.JointAccelerationConstraint(np.stack([-ACCELERATION, ACCELERATION], axis=1)),
        ]
        s = np.linspace(0, path.duration, 3001)
        _, sd, _ = algorithm.TOPPRA(bounds, Adapted(path), s, solver_wrapper="seidel").compute_parameterization(0, 0)
        theirs = (2 * np.diff(s) / (sd[1:] + sd[:-1])).sum()

        ours = time_optimal(PUMA, knots, efforts=False, intervals=2000)

        assert ours.trajectory.duration == pytest.approx(theirs, rel=GRID)


def test_toppra_solves_the_same_problem(rng: np.random.Generator) -> None:
    """Asked to solve our bounds, efforts among them, toppra comes to the same times."""
    pytest.importorskip("toppra")
    for _ in range(4):
        goal = rng.uniform(-0.8, 0.8, 6)
        ours, theirs = (time_optimal(PUMA, [np.zeros(6), goal], method=by) for by in ("armwright", "toppra"))

        assert ours.trajectory.duration == pytest.approx(theirs.trajectory.duration, rel=1e-4)


def test_corners_and_rests() -> None:
    """At a corner the arm stops, and the two lines take their times; a rest on the path is left out."""
    corner = Trajectory(
        times=(0.0, 1.0, 2.0), coefficients=np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 2.0]]])
    )
    arm = attrs.evolve(
        slide(np.inf, 4.0), joints=slide(np.inf, 4.0).joints * 2, links=[Link()] * 2, motors=[Motor()] * 2
    )
    there, back = quintic([0.0], [1.0], 1.0), quintic([1.0], [0.0], 2.0)

    turned = time_optimal(arm, corner)
    rested = time_optimal(slide(np.inf, 4.0), join([there, hold([1.0], 5.0), back]), intervals=1000)

    assert (turned.stops, rested.stops) == (1, 1)
    assert turned.trajectory.duration == pytest.approx(2 * np.sqrt(1 / 4) + 2 * np.sqrt(2 / 4), rel=1e-3)
    np.testing.assert_allclose(turned.trajectory(2 * np.sqrt(1 / 4), 1), 0, atol=0.01)
    assert rested.trajectory.duration == pytest.approx(2 * 2 * np.sqrt(1 / 4), rel=GRID)


def test_nowhere_takes_no_time() -> None:
    """A path that stays where it is has no duration."""
    found = time_optimal(PUMA, hold(np.ones(6) / 2, 3.0))

    assert found.trajectory.duration == 0
    np.testing.assert_array_equal(found.trajectory(0.0), np.ones(6) / 2)
    assert found.bindings == ()


WEAK = rod(4.0)
FAST = Arm(name="fast", joints=[Joint(kind="revolute", limits=Limits(speed=1.0))])


@pytest.mark.parametrize(
    ("arm", "path", "options", "kind", "said"),
    [
        (PUMA, "line", {}, KindError, "path: expected numbers, got 'line'"),
        (PUMA, [np.zeros(6)], {}, ShapeError, r"path: expected a Trajectory, or \(k, 6\) knots .* got \(1, 6\)"),
        (PUMA, np.zeros((3, 5)), {}, ShapeError, "path: expected 6 numbers"),
        (PUMA, np.zeros((3, 6)), {}, InvalidValueError, "path: knots 1 and 2 coincide"),
        (PUMA, quintic([0], [1], 1.0), {}, ShapeError, "path: expected one of 6 joints"),
        (PUMA, [np.zeros(6), np.full(6, 2.5)], {}, InvalidValueError, r"path: joint 2 would be at 143\.2 deg"),
        (PUMA, [np.zeros(6), np.ones(6)], {"intervals": 3}, InvalidValueError, "intervals: expected 10 to 20000"),
        (PUMA, [np.zeros(6), np.ones(6)], {"intervals": 30.5}, KindError, "intervals: expected an integer"),
        (PUMA, [np.zeros(6), np.ones(6)], {"method": "topra"}, UnknownNameError, "Did you mean 'toppra'"),
        (FAST, [[0.0], [1.0]], {}, InvalidValueError, "joint 1 moves and has no limit of acceleration or effort"),
        (WEAK, [[DOWN], [ALOFT]], {}, InvalidValueError,
         r"between knots 1 and 2 gravity and Coulomb friction alone require 4\.9\d* N m of joint 1, 4 N m are allowed"),
        (WEAK, quintic([DOWN], [ALOFT], 1.0), {}, InvalidValueError, r"at 0\.\d{3} s of the original motion"),
        (PUMA, Trajectory(times=(0, 1, 2), coefficients=[[[0] * 6, [1] * 6], [[0] * 6, [1] * 6]]), {},
         InvalidValueError, "path: joint 1 jumps by 1 at 1 s"),
        ("puma560-seed", [np.zeros(6), np.ones(6)], {}, KindError, "arm: expected an Arm"),
    ],
)  # fmt: skip
def test_bad_input(arm: Any, path: Any, options: dict[str, Any], kind: type[ArmwrightError], said: str) -> None:
    """What has no meaning is refused, with the place, the number found and the number allowed."""
    with pytest.raises(kind, match=said):
        time_optimal(arm, path, **options)


def test_without_toppra(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who asks for toppra where it is missing is told what to install; without it all else goes on."""
    monkeypatch.setitem(sys.modules, "toppra", None)
    monkeypatch.setitem(sys.modules, "toppra.algorithm", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armwright\[optimal\]'"):
        time_optimal(slide(1.0, 1.0), [[0.0], [1.0]], method="toppra")

    assert time_optimal(slide(1.0, 1.0), [[0.0], [1.0]]).trajectory.duration == pytest.approx(2, rel=1e-3)
