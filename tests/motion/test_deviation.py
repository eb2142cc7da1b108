"""Bounds of how the tool moves between samples: never passed, and attained where a motion uses them up."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.deviation import (
    ErrorBounds,
    ToolBounds,
    ToolSamples,
    curve_bounds,
    error_of,
    farthest_from_legs,
    half_angle_bound,
    half_sines,
)
from armwright.motion.solver import solver_of
from armwright.motion.trajectory import Trajectory
from oracles.arms import random_arm

QUARTER = np.pi / 2
STEP = 1e-4  # of differences [s]
DIFFERENCES = 1e-5  # what they are good to, in parts of the largest


def chain(*joints: Joint) -> Arm:
    return Arm(name="chain", joints=list(joints))


def turning(a: float = 0.0, alpha: float = 0.0) -> Joint:
    return Joint(kind="revolute", a=a, alpha=alpha)


def sliding(alpha: float = 0.0) -> Joint:
    return Joint(kind="prismatic", alpha=alpha)


def cubics(*intervals: tuple[float, list[list[float]]]) -> Trajectory:
    """Return a trajectory of intervals, each with its length and the coefficients of every power for all joints."""
    return Trajectory(
        times=np.append(0.0, np.cumsum([length for length, _ in intervals])),
        coefficients=np.array([terms for _, terms in intervals], dtype=float),
    )


def tool_motion(arm: Arm, trajectory: Trajectory, t: Array) -> tuple[Array, Array, Array]:
    """Return the magnitudes of acceleration, angular speed and angular acceleration at times, by differences."""
    before, at, behind = (forward(arm, trajectory(t + shift)) for shift in (-STEP, 0.0, STEP))
    acceleration = (before[:, :3, 3] - 2 * at[:, :3, 3] + behind[:, :3, 3]) / STEP**2
    R = at[:, :3, :3]
    back, on = (Rotation.from_matrix(X[:, :3, :3] @ np.swapaxes(R, -1, -2)).as_rotvec() for X in (before, behind))
    spin, change = (on - back) / (2 * STEP), (on + back) / STEP**2
    return tuple(np.linalg.norm(x, axis=-1) for x in (acceleration, spin, change))


@pytest.mark.parametrize("kind", [Arm, CompiledArm])
def test_joints_on_cubics(kind: type, rng: np.random.Generator) -> None:
    """The largest speeds and accelerations, and the positions where joints reverse, are those of many samples."""
    arm, m = random_arm(rng, 4), 8
    trajectory = cubics(*((rng.uniform(0.2, 2), rng.normal(size=(4, 4)).tolist()) for _ in range(m)))

    bounds = curve_bounds(solver_of(arm if kind is Arm else compile_arm(arm)), trajectory)

    for k, (start, end) in enumerate(zip(trajectory.times[:-1], trajectory.times[1:], strict=True)):
        t = np.linspace(0, end - start, 4001)
        q, qd, qdd = (
            np.stack([np.polynomial.Polynomial(joint).deriv(order)(t) for joint in trajectory.coefficients[k].T], -1)
            for order in (0, 1, 2)
        )
        np.testing.assert_allclose(bounds.speed[k], np.abs(qd).max(axis=0), rtol=1e-5)
        np.testing.assert_allclose(bounds.acceleration[k], np.abs(qdd).max(axis=0), rtol=1e-12)
        places = np.stack([q[0], q[-1], *bounds.turning[:, k]])
        np.testing.assert_allclose(places.min(axis=0), q.min(axis=0), atol=1e-5)
        np.testing.assert_allclose(places.max(axis=0), q.max(axis=0), atol=1e-5)


def test_no_tool_moves_more(rng: np.random.Generator) -> None:
    """On random arms with joints of both kinds no acceleration, angular speed or change of it is beyond its bound."""
    for _ in range(60):
        arm = random_arm(rng, int(rng.integers(1, 5)))
        trajectory = cubics(*((0.5, rng.normal(size=(4, arm.n)).tolist()),))
        tool = curve_bounds(solver_of(arm), trajectory).tool

        found = tool_motion(arm, trajectory, np.linspace(STEP, 0.5 - STEP, 41))

        for sampled, bound in zip(found, tool, strict=True):
            assert sampled.max() <= bound[0] * (1 + DIFFERENCES) + DIFFERENCES


SHORT = 1e-3
MOTIONS = {
    "gathers speed": (chain(turning(0.7)), [[0.0], [0.0], [1.5], [0.0]]),
    "turns evenly": (chain(turning(0.7)), [[0.0], [2.0], [0.0], [0.0]]),
    "stretched": (chain(turning(0.7), turning(0.4)), [[0.0, 0.0], [2.0, 3.0], [0.0, 0.0], [0.0, 0.0]]),
    "stretched, from rest": (chain(turning(0.7), turning(0.4)), [[0.0, 0.0], [0.0, 0.0], [2.0, 3.0], [0.0, 0.0]]),
    "three": (chain(turning(0.7), turning(0.4), turning(0.2)), [[0.0] * 3, [1.0, 2.0, 3.0], [0.0] * 3, [0.0] * 3]),
    "slides": (chain(sliding()), [[0.3], [0.0], [1.5], [0.0]]),
    "far out": (chain(turning(alpha=QUARTER), sliding()), [[0.0, -0.8], [2.0, 0.0], [0.0] * 2, [0.0] * 2]),
    "slides on what turns": (chain(turning(alpha=QUARTER), sliding()), [[0.0, 0.0], [2.0, 3.0], [0.0] * 2, [0.0] * 2]),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_a_tool_that_moves_as_much(name: str) -> None:
    """Where joints work together the tool accelerates as much as its bound says, and not a hundredth less."""
    arm, terms = MOTIONS[name]
    trajectory = cubics((SHORT, terms))

    acceleration = curve_bounds(solver_of(arm), trajectory).tool.acceleration[0]

    sampled = tool_motion(arm, trajectory, np.array([STEP, SHORT / 2, SHORT - STEP]))[0].max()
    assert 0.99 * acceleration <= sampled <= acceleration * (1 + 1e-4)


@pytest.mark.parametrize("alpha", [0.0, QUARTER])
def test_a_tool_that_turns_as_much(alpha: float) -> None:
    """Parallel joints add their speeds and accelerations, crossed ones turn each other's axes."""
    arm = chain(turning(alpha=alpha), turning())
    speeds = [[0.0, 0.0], [2.0, 3.0], [0.0, 0.0], [0.0, 0.0]]
    _, spin, change = curve_bounds(solver_of(arm), cubics((SHORT, speeds))).tool
    *_, gathered = curve_bounds(solver_of(arm), cubics((SHORT, [speeds[0], speeds[0], [0.5, 1.0], speeds[3]]))).tool

    assert (spin[0], change[0]) == (pytest.approx(5), pytest.approx(6))
    assert gathered[0] == pytest.approx(1 + 2, rel=1e-2)
    _, turned, changed = tool_motion(arm, cubics((SHORT, speeds)), np.array([SHORT / 2]))
    assert turned[0] == pytest.approx(5 if alpha == 0 else np.sqrt(13), rel=1e-4)
    assert changed[0] == pytest.approx(0 if alpha == 0 else 6, rel=1e-3, abs=1e-3)


def vector_part(w: Array, a: Array, t: Array) -> Rotation:
    """Return the rotations (k) at times of what turns with a speed w and an acceleration a at 0."""
    return Rotation.from_rotvec(t[:, None] * w + t[:, None] ** 2 / 2 * a)


def bent(relative: Rotation, tool: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    """Return the second derivative of the vector part of the rotation from an orientation to a tool, at 0."""
    t = np.array([-STEP, 0.0, STEP])
    q = (vector_part(*other, t).inv() * relative * vector_part(*tool, t)).as_quat()
    q *= np.sign(np.sum(q * q[1], axis=1))[:, None]
    return float(np.linalg.norm(q[0, :3] - 2 * q[1, :3] + q[2, :3]) / STEP**2)


def test_half_a_rotation_bends_no_more(rng: np.random.Generator) -> None:
    """The bound of the change of half a rotation holds for all directions, and each of its terms is needed."""
    x, y, none = np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.zeros(3)
    same, opposite = Rotation.identity(), Rotation.from_rotvec(np.pi * x)
    for _ in range(300):
        speeds, changes = rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
        found = bent(Rotation.random(rng=rng), (speeds[0], changes[0]), (speeds[1], changes[1]))
        sizes = [float(np.linalg.norm(each)) for each in (speeds[0], changes[0], changes[1], speeds[1])]
        assert found <= half_angle_bound(*sizes) * (1 + 1e-4)
    # The changes add; what turns about another axis turns the other's; half a turn away only the speeds count.
    assert bent(same, (none, 2 * x), (none, -3 * x)) == pytest.approx(half_angle_bound(0, 2, 3, 0), rel=1e-4)
    assert bent(same, (2 * x, none), (3 * y, none)) == pytest.approx(2 * 3 / 2, rel=1e-4)
    assert half_angle_bound(2, 0, 0, 3) == 2 * 3 / 2 + (2 + 3) ** 2 / 4
    assert bent(opposite, (2 * x, none), (-3 * x, none)) == pytest.approx((2 + 3) ** 2 / 4, rel=1e-4)


def test_between_two_samples() -> None:
    """An error that is 0 at two samples a time d apart, and bends by b, is b d²/8 in the middle; half an angle too."""
    d, b, c = 0.3, 2.0, 1.5
    poses = np.broadcast_to(np.eye(4), (1, 2, 4, 4))
    still = ToolBounds(*np.zeros((3, 1)))
    bounds = ErrorBounds(position=np.array([b]), orientation=np.array([c]))
    arm = solver_of(chain(turning()))
    samples = ToolSamples(np.array([[0.0, d]]), poses, np.array([d]), still, bounds, arm)

    error = error_of(samples, np.zeros((1, 2)), np.zeros(1))

    assert error.position[0] == pytest.approx(b * d**2 / 8, rel=1e-9)
    assert error.orientation[0] == pytest.approx(2 * np.arcsin(c * d**2 / 8), rel=1e-9)
    assert (error.sampled_position[0], error.sampled_orientation[0], error.samples) == (0, 0, 1)


def test_half_sines(rng: np.random.Generator) -> None:
    """The sine of half the angle between two rotations is right for all angles, the smallest to all digits."""
    A, axis = Rotation.random(9, rng=rng), rng.normal(size=(9, 3))
    angle = np.array([0.0, 1e-12, 1e-6, 0.1, 1.0, 2.0, 3.0, 3.1, np.pi - 1e-5])  # near pi half the digits are left
    turned = A * Rotation.from_rotvec(angle[:, None] * axis / np.linalg.norm(axis, axis=1)[:, None])

    found = half_sines(A.as_matrix(), turned.as_matrix())

    np.testing.assert_allclose(found[:-1], np.sin(angle[:-1] / 2), rtol=1e-9, atol=1e-15)
    assert found[-1] == pytest.approx(1, abs=1e-5)


def test_an_arc_beside_its_leg() -> None:
    """The farthest point of an arc from a leg, between two samples, is inside the bound, which is hardly larger."""
    arm, angle = chain(turning(1.0)), 1.0
    trajectory = cubics((1.0, [[0.0], [angle], [0.0], [0.0]]))
    for middle in np.linspace(0.4375, 0.5625, 5):
        away, along = (np.array([np.cos(x), np.sin(x), 0.0]) for x in (middle, middle + QUARTER))
        ends = np.stack([0.9 * away - 2 * along, 0.9 * away + 2 * along])

        found = farthest_from_legs(solver_of(arm), trajectory, ends, np.array([0.0, 1.0]))

        assert found.sampled <= 0.1 + 1e-12
        assert 0.1 <= found.bound <= 0.1 * 1.11 + 1e-9


def test_a_chord_past_a_corner(rng: np.random.Generator) -> None:
    """A straight way from one leg to the next is nowhere farther from the nearer of the two than is said."""
    arm = chain(sliding(alpha=-QUARTER), sliding())
    for _ in range(40):
        corners = np.array([[0.0, 0.0], [1.0, 0.0], rng.normal(size=2)])
        begin, end = (1 - x for x in rng.uniform(0.2, 0.6, 2))
        start = corners[0] + begin * (corners[1] - corners[0])
        stop = corners[2] + end * (corners[1] - corners[2])
        trajectory = cubics((1.0, [start.tolist(), (stop - start).tolist(), [0.0, 0.0], [0.0, 0.0]]))
        ends = forward(arm, corners)[:, :3, 3]

        found = farthest_from_legs(solver_of(arm), trajectory, ends, np.array([0.0, 0.5, 1.0]))

        p = forward(arm, trajectory(np.linspace(0, 1, 2001)))[:, :3, 3]
        distances = []
        for A, B in ((ends[0], ends[1]), (ends[1], ends[2])):
            part = np.clip((p - A) @ (B - A) / ((B - A) @ (B - A)), 0, 1)
            distances.append(np.linalg.norm(p - A - part[:, None] * (B - A), axis=1))
        farthest = np.minimum(*distances).max()
        assert farthest <= found.bound + 1e-12
        assert found.sampled <= 2 * farthest + 1e-12
