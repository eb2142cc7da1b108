"""Inverse kinematics in closed form: the catalogue's arms with a spherical wrist."""

import math

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.revolutions import equivalent_configurations
from armwright.kinematics.inverse_kinematics.solution import NoSolutionError, Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.poses import homogeneous
from oracles.arms import random_arm, random_configurations

ARMS = ("puma560-seed", "stanford", "stanford-jpl")
SAME_CONFIGURATION = 1e-9  # a configuration found again
RESIDUAL = 1e-12  # a pose met, in m and rad
DOWN = np.diag((1.0, -1.0, -1.0))


def _at(x: float, y: float, z: float) -> Array:
    return homogeneous(DOWN, (x, y, z))


@pytest.mark.parametrize("name", ARMS)
def test_finds_the_configuration_again(name: str, rng: np.random.Generator) -> None:
    """Of 5000 random configurations each is among the branches of its own pose.

    Where the Jacobian is nearly singular, rounding of the pose by 1e-16 moves the configuration by more than 1e-9:
    only a configuration with the same pose can be found, and those (a few in a hundred) are held to that alone.
    """
    arm = load_arm(name)
    q = random_configurations(arm, rng, 5000)
    regular = np.linalg.svd(jacobian(arm, q), compute_uv=False)[:, -1] > 1e-3

    found, _ = inverse_branches(arm, forward(arm, q), q)

    miss = np.abs(found - q[:, None]).max(axis=-1).min(axis=-1)
    assert regular.mean() > 0.95
    assert miss[regular].max() < SAME_CONFIGURATION


@pytest.mark.parametrize("name", ARMS)
def test_every_branch_meets_the_pose(name: str, rng: np.random.Generator) -> None:
    """All eight branches of a pose in reach put the hand there."""
    arm = load_arm(name)
    X = forward(arm, random_configurations(arm, rng, 2000))

    q, _ = inverse_branches(arm, X)

    np.testing.assert_allclose(forward(arm, q), np.broadcast_to(X[:, None], (2000, 8, 4, 4)), atol=RESIDUAL)


@pytest.mark.parametrize("name", ARMS)
def test_judged_solution(name: str, rng: np.random.Generator) -> None:
    """Asked for the branch nearest to the configuration, the solver returns that configuration, allowed and first."""
    arm = load_arm(name)
    for q in random_configurations(arm, rng, 200):
        if np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1] < 1e-3:
            continue
        solution = inverse(arm, forward(arm, q), q)

        assert solution.outcome is Outcome.SOLVED
        np.testing.assert_allclose(solution.best.q, q, atol=SAME_CONFIGURATION)
        assert all(branch.allowed for branch in solution.allowed)
        assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)


@pytest.mark.parametrize("name", ["puma560-seed", "stanford"])
@pytest.mark.drawn(0.34)
def test_grid_of_right_angles(name: str) -> None:
    """On a 45 degree grid of joint angles, full of aligned axes, every pose inside the limits is solved.

    No branch comes twice, and there are never more than eight.
    """
    arm = load_arm(name)
    steps = [np.arange(-135, 136, 45)] * 6
    if name == "stanford":
        steps[2] = np.degrees([0.3, 0.7, 1.0])  # the slide, back in metres below
    grid = np.radians(np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 6))
    inside = ((grid >= arm.limits.lower) & (grid <= arm.limits.upper)).all(axis=-1)
    for q in grid[inside][::97]:
        X = forward(arm, q)
        solution = inverse(arm, X, q)

        assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR), q
        np.testing.assert_allclose(forward(arm, solution.best.q), X, atol=RESIDUAL)
        assert len(solution.branches) <= 8
        configurations = np.array([branch.q for branch in solution])
        apart = np.abs(configurations[:, None] - configurations[None]).max(axis=-1) + np.eye(len(configurations))
        assert apart.min() > SAME_CONFIGURATION


def test_labels_say_how_the_arm_stands() -> None:
    """The PUMA reaching forward with the elbow above the line from shoulder to wrist is called up, below down."""
    arm = load_arm("puma560-seed")
    X = forward(arm, [0.3, -0.2, 0.4, 0.5, 0.6, 0.7])

    for branch in inverse(arm, X):
        frames = np.array([forward_of(arm, branch.q, i) for i in (2, 4)])
        elbow, wrist = frames[0, 2], frames[1, 2]
        # The elbow is above the chord from the shoulder (height 0) to the wrist.
        chord = wrist * np.hypot(*frames[0, :2]) / np.hypot(*frames[1, :2])
        assert ("up" in branch.label) == (elbow > chord), branch.label


def forward_of(arm: object, q: Array, frame: int) -> Array:
    from armwright.kinematics.forward_kinematics import link_poses

    return link_poses(arm, q)[frame, :3, 3]  # type: ignore[arg-type]


def test_wrist_singularity_keeps_joint_4() -> None:
    """With joint 5 straight, joints 4 and 6 are free together: joint 4 stays where it was, joint 6 makes up for it."""
    arm = load_arm("puma560-seed")
    X = forward(arm, np.radians([10, 20, 30, 40, 0, 50]))

    solution = inverse(arm, X, near=np.radians([10, 20, 30, 70, 0, 0]))

    assert solution.outcome is Outcome.SINGULAR
    assert solution.best.free == (4, 6)
    np.testing.assert_allclose(np.degrees(solution.best.q[3:]), (70, 0, 20), atol=1e-6)


@pytest.mark.parametrize("q5", [1e-7, 1e-9, 1e-12])
def test_near_the_wrist_singularity(q5: float) -> None:
    """A hair's breadth from the singularity the branches still meet the pose and none comes twice."""
    arm = load_arm("puma560-seed")
    X = forward(arm, [0.1, 0.2, 0.3, 0.4, q5, 0.5])

    solution = inverse(arm, X)

    assert 1 <= len(solution.branches) <= 8
    assert all(max(b.position_error, b.rotation_error) < 1e-9 for b in solution)


def test_typed_poses_solve(rng: np.random.Generator) -> None:
    """A pose typed with six digits is solved, and met to those digits."""
    arm = load_arm("stanford")
    for q in random_configurations(arm, rng, 100):
        solution = inverse(arm, np.round(forward(arm, q), 6))

        assert solution.branches[0].position_error < 2e-6
        assert solution.outcome is not Outcome.OUT_OF_REACH


def test_out_of_reach_says_how_far() -> None:
    """The wrist of the PUMA reaches sqrt((a2 + |a3, d4|)² + d3²) from its shoulder; a metre farther is a metre out."""
    arm = load_arm("puma560-seed")
    farthest = find_geometry(arm).max_reach  # type: ignore[union-attr]
    assert farthest == pytest.approx(math.hypot(0.432 + math.hypot(0.02, 0.433), 0.149))

    solution = inverse(arm, _at(farthest + 1.0, 0, 0))

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(1.0, abs=1e-9)
    assert solution.allowed == ()
    np.testing.assert_allclose(solution.nearest_pose[:3, 3], (farthest, 0, 0), atol=1e-9)
    with pytest.raises(NoSolutionError, match=r"1000\.0 mm out of reach of 'puma560-seed'"):
        _ = solution.best


def test_nearest_pose_is_nearest(rng: np.random.Generator) -> None:
    """No wrist place that random configurations reach is nearer to the asked one than the nearest pose said to be."""
    arm = load_arm("puma560-seed")
    reached = forward(arm, rng.uniform(-np.pi, np.pi, size=(20000, 6)))[:, :3, 3]  # no hand: the wrist centre
    for target in [(0.0, 0.05, 0.3), (0.01, 0.0, 0.0), (0.9, 0.9, 0.9), (0.05, 0.05, 1.2)]:
        solution = inverse(arm, _at(*target))

        assert solution.outcome is Outcome.OUT_OF_REACH
        assert solution.distance <= np.linalg.norm(reached - target, axis=-1).min() + 1e-9
        assert inverse(arm, solution.nearest_pose).outcome is not Outcome.OUT_OF_REACH


def test_out_of_limits_says_which_joint() -> None:
    """The boom of the Stanford arm ends at 1117.6 mm; a hand 3 m out would need it 1.88 m longer."""
    solution = inverse(load_arm("stanford"), _at(3.0, 0, 0.2))

    assert solution.outcome is Outcome.OUT_OF_LIMITS
    with pytest.raises(
        NoSolutionError, match=r"joint 3 would be at 2996\.5 mm, 1878\.9 mm beyond its limit 1117\.6 mm"
    ):
        _ = solution.best


def test_images_by_whole_turns() -> None:
    """Joint 6 of the PUMA turns through 520 degrees: 150 and -210 degrees are one pose and two positions."""
    arm = load_arm("puma560-seed")

    q = equivalent_configurations(arm, np.radians([0, 0, 0, 0, 30, 150]))

    assert sorted(np.degrees(q[:, 5]).round(6)) == [-210, 150]


def test_nearest_equivalent_is_taken() -> None:
    """From -200 degrees joint 6 goes to -210 and not to 150."""
    arm = load_arm("puma560-seed")
    X = forward(arm, np.radians([0, 0, 0, 0, 30, 150]))

    best = inverse(arm, X, near=np.radians([0, 0, 0, 0, 30, -200])).best

    assert math.degrees(best.q[5]) == pytest.approx(-210)


def test_base_and_tool_count(rng: np.random.Generator) -> None:
    """An arm on a turned base with a long tool is solved for the tip of the tool."""
    import attrs

    from oracles.arms import random_pose

    arm = attrs.evolve(load_arm("puma560-seed"), base=random_pose(rng), tool=random_pose(rng))
    q = random_configurations(arm, rng, 50)

    found, _ = inverse_branches(arm, forward(arm, q), q)

    assert np.median(np.abs(found - q[:, None]).max(axis=-1).min(axis=-1)) < SAME_CONFIGURATION


def test_other_arms_are_refused() -> None:
    """An arm of another build has no branches in closed form and is told so."""
    with pytest.raises(UnsupportedArmError, match=r"'random': no closed-form inverse kinematics"):
        inverse_branches(random_arm(np.random.default_rng(0), 6), np.eye(4))


def test_shapes_that_do_not_fit() -> None:
    """Two poses and three starting points are refused, and so are two starting points for one judged pose."""
    arm = load_arm("puma560-seed")
    with pytest.raises(ShapeError, match=r"pose, near: leading axes must broadcast together, got \(2, 4, 4\), \(3, 6"):
        inverse_branches(arm, np.tile(np.eye(4), (2, 1, 1)), np.zeros((3, 6)))
    with pytest.raises(ShapeError, match=r"near: expected shape \(6,\), got \(2, 6\)"):
        inverse(arm, np.eye(4), np.zeros((2, 6)))


def test_not_a_rotation() -> None:
    """A pose whose rotation part is no rotation is refused."""
    with pytest.raises(InvalidValueError, match="orthonormal"):
        inverse(load_arm("puma560-seed"), np.diag((1.0, 2.0, 1.0, 1.0)))
