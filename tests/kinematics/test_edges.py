"""The edges of inverse kinematics: right angles, singular configurations and their neighbours, limits, typed poses."""

import math

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.singularity_analysis import singularity_factors
from armwright.spatial.poses import homogeneous
from oracles.arms import random_configurations
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

RESIDUAL = 1e-12  # a pose met, in m and rad
SAME_CONFIGURATION = 1e-9  # two configurations are equal where the Jacobian is regular
REGULAR = 1e-3  # smallest singular value of a well-conditioned configuration [m]
ELBOW = math.atan2(0.433, -0.02)  # the PUMA's elbow is straight where tan q3 = d4 / a3
# With q3 a right angle the PUMA's wrist centre is above its shoulder where (a2 + d4)·c2 = a3·s2.
UPRIGHT = math.atan2(0.432 + 0.433, -0.02)


def _upright(arm: Arm, q: tuple[float, ...]) -> float:
    """The q2 at which the shoulder factor, A cos q2 + B sin q2, vanishes."""
    A, B = (singularity_factors(arm, (q[0], q2, *q[2:]))[0] for q2 in (0.0, math.pi / 2))
    return math.atan2(-A, B)


# The UR5's wrist is above the axis of joint 1, seen in the plane of the arm, where A cos q2 + B sin q2 = 0.
LEANING = (0.3, 0.0, 0.8, 0.6, 0.5, 0.7)
# Configurations in which one factor of the determinant vanishes, and the joint that leads away from there.
SINGULAR = {
    "PUMA wrist": ("puma560-seed", (0.3, 0.4, 0.5, 0.6, 0.0, 0.7), 5),
    "PUMA elbow stretched": ("puma560-seed", (0.3, 0.4, ELBOW, 0.6, 0.5, 0.7), 3),
    "PUMA elbow folded": ("puma560-seed", (0.3, 0.4, ELBOW - math.pi, 0.6, 0.5, 0.7), 3),
    "PUMA shoulder": ("puma560-seed", (0.3, UPRIGHT, math.pi / 2, 0.6, 0.5, 0.7), 2),
    "Stanford wrist": ("stanford", (0.3, 0.4, 0.5, 0.6, 0.0, 0.7), 5),
    "Stanford shoulder": ("stanford", (0.3, 0.0, 0.5, 0.6, 0.5, 0.7), 2),
    "Stanford boom drawn in": ("stanford", (0.3, 0.4, 0.0, 0.6, 0.5, 0.7), 3),
    "UR5 wrist": ("ur5", (0.3, -1.0, 0.8, 0.6, 0.0, 0.7), 5),
    "UR5 elbow stretched": ("ur5", (0.3, -1.0, 0.0, 0.6, 0.5, 0.7), 3),
    "UR5 elbow folded": ("ur5", (0.3, -1.0, math.pi, 0.6, 0.5, 0.7), 3),
    "UR5 shoulder": ("ur5", (0.3, _upright(load_arm("ur5"), LEANING), *LEANING[2:]), 2),
}


def _wide(name: str) -> Arm:
    """A catalogue arm with a whole turn for every joint and a boom that reaches through the shoulder."""
    arm = load_arm(name)
    wide = {True: Limits(lower=-np.pi, upper=np.pi), False: Limits(lower=-1.5, upper=1.5)}
    return attrs.evolve(arm, joints=[attrs.evolve(joint, limits=wide[joint.revolute]) for joint in arm.joints])


def _grid(arm: Arm) -> Array:
    """All configurations inside the limits whose angles are multiples of 45 degrees."""
    steps = [np.radians(np.arange(-180, 181, 45)) if joint.revolute else np.array((0.3, 1.0)) for joint in arm.joints]
    kept = [
        step[(step >= joint.limits.lower) & (step <= joint.limits.upper) & (np.abs(step) < np.pi)]
        for step, joint in zip(steps, arm.joints, strict=True)
    ]
    return np.stack(np.meshgrid(*kept, indexing="ij"), axis=-1).reshape(-1, arm.n)


def _apart(solution: InverseSolution) -> float:
    """How far the two most similar of the branches are apart, but for whole turns."""
    q = np.array([branch.q for branch in solution])
    apart = np.abs(np.angle(np.exp(1j * (q[:, None] - q[None])))).max(axis=-1)
    return float((apart + 9 * np.eye(len(q))).min())


def _honest(solution: InverseSolution, X: Array) -> None:
    """Pinocchio finds the same residual of every branch."""
    model, data, tool = pinocchio_model(solution.arm)
    for branch in solution:
        pin.framesForwardKinematics(model, data, branch.q)
        miss = np.linalg.norm(data.oMf[tool].translation - X[:3, 3])
        turn = np.linalg.norm(pin.log3(X[:3, :3].T @ data.oMf[tool].rotation))
        assert branch.position_error == pytest.approx(miss, abs=1e-14)
        assert branch.rotation_error == pytest.approx(turn, abs=1e-7)  # its logarithm loses half the digits at 0


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
def test_every_well_conditioned_pose_of_the_grid(name: str) -> None:
    """On the whole 45 degree grid each well-conditioned configuration, also q2 = 90 degrees, is a branch of its pose.

    And every branch meets the pose; where the configuration is singular, some branch does.
    """
    arm = load_arm(name) if name != "ur5" else _wide("ur5")
    q = _grid(arm)
    q = q[:: max(1, len(q) // 20_000)]
    X = forward(arm, q)
    regular = np.linalg.svd(jacobian(arm, q), compute_uv=False)[:, -1] > REGULAR

    found, _ = inverse_branches(arm, X, q)

    assert regular.sum() > 2000
    assert (np.abs(q[regular, 1] - np.pi / 2) < 1e-12).sum() > 100
    assert np.abs(found - q[:, None]).max(axis=-1).min(axis=-1)[regular].max() < SAME_CONFIGURATION
    np.testing.assert_allclose(
        forward(arm, found), np.broadcast_to(X[:, None], (*found.shape[:2], 4, 4)), atol=RESIDUAL
    )


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
def test_verdict_on_the_grid(name: str) -> None:
    """Judged one by one, grid poses are solved or singular, none has more than eight branches, and none comes twice."""
    arm = load_arm(name) if name != "ur5" else _wide("ur5")
    q = _grid(arm)
    for configuration in q[:: len(q) // 60]:
        X = forward(arm, configuration)
        solution = inverse(arm, X, configuration)

        assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR), configuration
        assert 1 <= len(solution.branches) <= 8
        assert _apart(solution) > 1e-6
        assert np.abs(solution.best.q - configuration).max() < 1e-6
        _honest(solution, X)


@pytest.mark.parametrize("case", SINGULAR)
def test_exactly_singular(case: str) -> None:
    """At a singular configuration the pose is reached, no branch comes twice, and the configuration is among them."""
    name, q, _ = SINGULAR[case]
    arm = _wide(name)
    X = forward(arm, q)

    solution = inverse(arm, X, q)

    assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR)
    assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)
    assert _apart(solution) > 1e-6
    # At the edge of a reach half of the digits of the configuration are lost, and none of the pose.
    assert min(np.abs(branch.q - q).max() for branch in solution) < 1e-6
    _honest(solution, X)


@pytest.mark.parametrize("case", SINGULAR)
@pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9])
@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.drawn(0.3)
def test_next_to_a_singularity(case: str, distance: float, way: int) -> None:
    """From 1e-3 to 1e-9 beside it the pose is reached; the configuration is found as well as rounding allows.

    Rounding of the pose by 1e-16 moves the configuration by 1e-16 over the factor of the determinant that vanishes;
    nearer than 1e-7 the two branches that fall together at the edge of a reach are one.Where a second factor is small
    as well, as with the wrist centre at the shoulder, all that is drawn out once more by that one.
    """
    name, q, joint = SINGULAR[case]
    arm = _wide(name)
    beside = np.array(q)
    beside[joint - 1] += way * distance
    beside = (beside + np.pi) % (2 * np.pi) - np.pi
    X = forward(arm, beside)

    solution = inverse(arm, X, beside)

    assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR)
    assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)
    assert len(solution.branches) <= 8
    assert _apart(solution) > 1e-9
    found = min(np.abs(np.angle(np.exp(1j * (branch.q - beside)))).max() for branch in solution)
    least, second, _ = np.sort(np.abs(singularity_factors(arm, beside)))
    assert found < max(1e-14 / least, min(2e-7, 2 * least)) / min(second, 0.3)


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
def test_at_every_limit(name: str, rng: np.random.Generator) -> None:
    """A configuration with a joint exactly at its limit is inside the limits, and found."""
    arm = load_arm(name)
    for joint in range(6):
        for limit in (arm.joints[joint].limits.lower, arm.joints[joint].limits.upper):
            q = random_configurations(arm, rng, 1)[0]
            q[joint] = limit
            if np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1] < REGULAR:
                continue

            solution = inverse(arm, forward(arm, q), q)

            assert solution.outcome is Outcome.SOLVED
            np.testing.assert_allclose(solution.best.q, q, atol=SAME_CONFIGURATION)
            assert solution.best.allowed


@pytest.mark.parametrize("name", ["puma560-seed", "stanford"])
def test_just_beyond_a_limit(name: str, rng: np.random.Generator) -> None:
    """A millionth beyond its limit the same branch is not allowed, and the joint is named."""
    arm = load_arm(name)
    for joint in range(6):
        q = random_configurations(arm, rng, 1)[0]
        q[joint] = arm.joints[joint].limits.upper + 1e-6

        solution = inverse(arm, forward(arm, q), q)

        branch = min(solution.branches, key=lambda branch: float(np.abs(branch.q - q).max()))
        if np.abs(branch.q - q).max() < 1e-7:  # not where a whole turn brings the joint inside again
            assert [violation.joint for violation in branch.violations] == [joint + 1]
            assert branch.violations[0].excess == pytest.approx(1e-6, rel=1e-2)


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
@pytest.mark.parametrize(("digits", "off"), [(6, 2e-6), (4, 2e-4)])
def test_typed_poses(name: str, digits: int, off: float, rng: np.random.Generator) -> None:
    """Poses typed with six or four digits of a metre solve; the configuration is off by what the rounding asks of it.

    The rotation is made one first, and that pose is met to rounding.
    """
    arm = load_arm(name)
    for q in random_configurations(arm, rng, 60):
        smallest = np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1]
        if smallest < 0.02:
            continue
        solution = inverse(arm, np.round(forward(arm, q), digits), q)

        assert solution.outcome is Outcome.SOLVED or _at_a_limit(arm, q, off / smallest)
        nearest = min(solution, key=lambda branch: float(np.abs(branch.q - q).max()))
        assert np.abs(nearest.q - q).max() < off / smallest
        assert nearest.position_error < RESIDUAL
        assert nearest.rotation_error < RESIDUAL


def _at_a_limit(arm: Arm, q: Array, room: float) -> bool:
    return bool(np.minimum(q - arm.limits.lower, arm.limits.upper - q).min() < room)


@pytest.mark.parametrize(("digits", "beyond"), [(6, 1e-6), (4, 1e-4)])
def test_typed_poses_at_the_edge_of_the_reach(digits: int, beyond: float) -> None:
    """Stretched out, a rounded pose may be out of reach by its rounding: six digits still count as reached.

    With four the answer is out of reach, by less than a tenth of a millimetre, and the nearest pose is given.
    """
    arm = _wide("puma560-seed")
    answers = set()
    for q1 in np.linspace(-3, 3, 30):
        X = np.round(forward(arm, (q1, 0.4, ELBOW, 0.6, 0.5, 0.7)), digits)
        solution = inverse(arm, X)
        answers.add(solution.outcome)

        assert solution.distance < beyond
        if solution.outcome is Outcome.OUT_OF_REACH:
            assert inverse(arm, solution.nearest_pose).outcome is not Outcome.OUT_OF_REACH
        else:
            assert solution.best.position_error < 2e-6
    assert answers == ({Outcome.SOLVED} if digits == 6 else {Outcome.SOLVED, Outcome.OUT_OF_REACH})


def test_verdicts_of_the_puma_by_hand(rng: np.random.Generator) -> None:
    """In reach is where the wrist centre is beside the axis by d3 at least and in the shell about the shoulder.

    Its radii are those of the two links, 432 and |(20, 433)| mm, at d3 = 149 mm beside the shoulder.
    """
    arm = load_arm("puma560-seed")
    fore, side = math.hypot(0.02, 0.433), 0.149
    counts = dict.fromkeys(Outcome, 0)
    for _ in range(300):
        X = forward(arm, random_configurations(arm, rng, 1)[0])
        X[:3, 3] = rng.uniform(-0.95, 0.95, size=3) * rng.choice((1.0, 0.2))
        along = math.sqrt(max(X[:3, 3] @ X[:3, 3] - side**2, 0.0))
        reached = np.hypot(X[0, 3], X[1, 3]) >= side and abs(0.432 - fore) <= along <= 0.432 + fore

        solution = inverse(arm, X)

        assert (solution.outcome is not Outcome.OUT_OF_REACH) == reached
        counts[solution.outcome] += 1
        if solution.outcome is Outcome.OUT_OF_LIMITS:
            # By brute force: no configuration of the eight is inside by whole turns of any joint.
            q, _ = inverse_branches(arm, X)
            turns = q[..., None] + 2 * np.pi * np.arange(-2, 3)
            lower, upper = arm.limits.lower[:, None], arm.limits.upper[:, None]
            assert not ((turns >= lower) & (turns <= upper)).any(axis=-1).all(axis=-1).any()
    assert counts[Outcome.SOLVED] > 20
    assert counts[Outcome.OUT_OF_REACH] > 20
    assert counts[Outcome.OUT_OF_LIMITS] > 2


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
def test_right_angle_of_joint_2(name: str, rng: np.random.Generator) -> None:
    """With joint 2 at exactly 90 degrees and all others anywhere the configuration is found, and none comes twice."""
    arm = load_arm(name)
    for q in random_configurations(arm, rng, 40):
        q[1] = np.pi / 2
        if np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1] < REGULAR:
            continue
        solution = inverse(arm, forward(arm, q), q)

        assert solution.outcome is Outcome.SOLVED
        assert np.abs(solution.best.q - q).max() < SAME_CONFIGURATION
        assert _apart(solution) > 1e-6


@pytest.mark.parametrize("name", ["puma560-seed", "ur5"])
def test_whole_turns(name: str, rng: np.random.Generator) -> None:
    """An arm that stands beyond half a turn, where its limits have room for it, is told to stay there."""
    arm = load_arm(name)
    beyond = [q for q in random_configurations(arm, rng, 400) if (np.abs(q) > np.pi).any()][:40]
    assert len(beyond) == 40
    for q in beyond:
        if np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1] > REGULAR:
            assert np.abs(inverse(arm, forward(arm, q), q).best.q - q).max() < SAME_CONFIGURATION


@pytest.mark.parametrize("name", ["puma560-seed", "stanford"])
def test_made_outside_the_limits(name: str, rng: np.random.Generator) -> None:
    """A pose made outside the limits has its configuration among the branches, allowed if a revolution helps.

    It is called out of limits where no branch is inside by any whole turns, and solved where one is.
    """
    arm = load_arm(name)
    turn = 2 * np.pi * np.array([joint.revolute for joint in arm.joints])[:, None] * np.arange(-2, 3)
    lower, upper = arm.limits.lower[:, None], arm.limits.upper[:, None]
    answers = dict.fromkeys(Outcome, 0)
    for q in random_configurations(_wide(name), rng, 100):
        X = forward(arm, q)
        solution = inverse(arm, X)
        images = inverse_branches(arm, X)[0][..., None] + turn
        allowed = ((images >= lower) & (images <= upper)).any(axis=-1).all(axis=-1)

        assert solution.outcome is (Outcome.SOLVED if allowed.any() else Outcome.OUT_OF_LIMITS)
        assert any(np.abs(np.angle(np.exp(1j * (branch.q - q)))).max() < 1e-6 for branch in solution)
        answers[solution.outcome] += 1
    assert min(answers[Outcome.SOLVED], answers[Outcome.OUT_OF_LIMITS]) > 5


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
@pytest.mark.parametrize("short", [1e-5, 1e-3, 0.05])
def test_too_near_to_the_first_axis(name: str, short: float, rng: np.random.Generator) -> None:
    """A wrist that would be nearer to the axis than the plane of the arm is out of reach by just what it is nearer.

    The nearest pose has the same orientation, and is reached.
    """
    side, height, hand = {
        "puma560-seed": (0.149, 0.0, 0.0),
        "stanford": (0.15367, 0.4125, 0.26289),
        "ur5": (0.10915, 0.089159, 0.0823),
    }[name]
    arm = _wide(name)
    for R in (forward(arm, q)[:3, :3] for q in random_configurations(arm, rng, 5)):
        turn, rho = rng.uniform(-np.pi, np.pi), side - short
        # On the ring of the wrist's reach in every arm: half a metre up.
        wrist = np.array((rho * np.cos(turn), rho * np.sin(turn), height + 0.5))
        X = homogeneous(R, wrist + hand * R[:, 2])

        solution = inverse(arm, X)

        assert solution.outcome is Outcome.OUT_OF_REACH
        assert solution.allowed == ()
        assert solution.distance == pytest.approx(short, abs=1e-9)
        assert solution.rotation_error < RESIDUAL
        np.testing.assert_allclose(solution.nearest_pose[:3, :3], R, atol=RESIDUAL)
        assert inverse(arm, solution.nearest_pose).outcome is not Outcome.OUT_OF_REACH


@pytest.mark.parametrize("name", ["puma560-seed", "stanford", "ur5"])
@pytest.mark.parametrize("room", [0.1, 1e-2, 1e-4, 1e-6])
def test_free_joint_with_little_room(name: str, room: float, rng: np.random.Generator) -> None:
    """With joint 5 straight and joint 6 held to a hair's breadth, the one configuration in a free family is found.

    Joints 4 and 6 are free together, or all of 2, 3, 4 and 6; that joint 6 has room for a part of the family only,
    and next to none, does not put the pose out of limits.
    """
    wide = _wide(name)
    for q in random_configurations(wide, rng, 5):
        q[4] = 0.0
        held = Limits(lower=q[5] - 0.3 * room, upper=q[5] + 0.7 * room)
        arm = attrs.evolve(wide, joints=[*wide.joints[:5], attrs.evolve(wide.joints[5], limits=held)])
        X = forward(arm, q)

        solution = inverse(arm, X)

        assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR)
        assert any(branch.free and branch.allowed for branch in solution)
        assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)


@pytest.mark.parametrize("name", ["puma560", "stanford"])
def test_least_turn_of_a_straight_wrist(name: str, sample: Sample) -> None:
    """With the wrist straight, joints 4 and 6 turn against each other as little as brings both inside, or none does.

    Held against 20,000 members of the family, for random limits of both joints, also far narrower than a turn.
    """
    arm, found = load_arm(name), 0
    for rng in sample.cases(400):
        joints = list(arm.joints)
        for i in (3, 5):
            middle, half = rng.uniform(-3, 3), 10 ** rng.uniform(-2, 0.7)
            limits = attrs.evolve(joints[i].limits, lower=middle - half, upper=middle + half)
            joints[i] = attrs.evolve(joints[i], limits=limits)
        narrow = attrs.evolve(arm, joints=tuple(joints))
        lower, upper = narrow.limits.lower, narrow.limits.upper
        near = rng.uniform(lower, upper)
        q = rng.uniform(0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper)
        q[4] = 0.0
        # Whole turns of joint 6 lead to the same pose, and positions beyond one are taken for degrees.
        q[5] = math.remainder(q[5] + rng.choice((0.0, rng.uniform(-3, 3))), 2 * math.pi)
        X = forward(narrow, q)

        solution = inverse(narrow, X, near)

        places = np.linspace(max(lower[3], near[3] - 2 * np.pi), min(upper[3], near[3] + 2 * np.pi), 20_001)
        others = np.remainder(q[3] + q[5] - places - (lower[5] + upper[5]) / 2 + np.pi, 2 * np.pi) - np.pi
        inside = places[np.abs(others) <= (upper[5] - lower[5]) / 2]
        free = [branch for branch in solution.allowed if branch.free == (4, 6)]
        if inside.size:
            found += 1
            assert free, solution
            nearest = np.abs(inside - near[3]).min()
            moved = min(abs(branch.q[3] - near[3]) for branch in free)
            assert moved <= nearest + 1e-9
        for branch in free:
            np.testing.assert_allclose(forward(narrow, branch.q), X, atol=1e-9)
    sample.record(f"straight wrists of the {name} with random limits", found, 0)


@pytest.mark.parametrize(("limit", "start"), [(60, -170), (60, -121), (20, -175), (1, 175)])
def test_straight_wrist_far_from_where_it_is(limit: float, start: float) -> None:
    """The member inside the limits is found more than half a turn away, where its image nearer by is outside."""
    arm, end = load_arm("stanford"), math.radians(limit)
    joints = list(arm.joints)
    joints[5] = attrs.evolve(joints[5], limits=attrs.evolve(joints[5].limits, lower=-end, upper=end))
    arm = attrs.evolve(arm, joints=tuple(joints))
    q, near = np.array((0.3, 1.0, 0.5, math.pi / 2, 0.0, 0.0)), (0.3, 1.0, 0.5, math.radians(start), 0.0, 0.0)

    found = inverse(arm, forward(arm, q), near=near)

    assert any(abs(branch.q[3] + branch.q[5] - math.pi / 2) < 1e-9 for branch in found.allowed)


@pytest.mark.parametrize("case", [case for case in SINGULAR if "wrist" in case or "drawn" in case])
def test_a_free_family_is_free(case: str) -> None:
    """The free joints of a branch are those that the idle motion moves, and the hand stays while they move far."""
    name, q, _ = SINGULAR[case]
    arm = _wide(name)
    X = forward(arm, q)
    chooser = 2 if "drawn" in case else 6 if name == "ur5" else 4
    families = []
    for way in (0.0, 0.4, 0.8):
        near = np.array(q) + way * np.eye(6)[chooser - 1]
        branch = inverse(arm, X, near).best
        idle = np.linalg.svd(jacobian(arm, branch.q))[2][-1]

        assert max(branch.position_error, branch.rotation_error) < RESIDUAL
        assert set(np.flatnonzero(np.abs(idle) > 1e-6) + 1) == set(branch.free)
        assert branch.q[chooser - 1] == pytest.approx(near[chooser - 1])
        families.append(branch.q)
    moved = np.abs(families[2] - families[0]) > 1e-3
    assert set(np.flatnonzero(moved) + 1) == set(branch.free)
