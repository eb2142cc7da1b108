"""Closed forms by decomposition: found from the axes of any arm, complete, exact, and what they say where they end."""

import re
from collections.abc import Callable

import attrs
import numpy as np
import pinocchio as pin
import pytest
from eaik.IK_HP import HPRobot

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Limits
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.axes import joint_axes
from armwright.kinematics.inverse_kinematics.closed_forms import _wristed, find_closed_form
from armwright.kinematics.inverse_kinematics.numeric import descend_from
from armwright.kinematics.inverse_kinematics.solution import NoSolutionError, Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
from armwright.kinematics.jacobians import jacobian
from armwright.motion.straight import straight_line
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from oracles.arms import random_configurations, random_pose
from oracles.published_arms import TURN, cobra600, iiwa14, jaco, panda, sixteen, wx250, xarm6
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

RIGHT = np.pi / 2
RESIDUAL = 1e-10  # a pose met, in m and rad
SAME = 1e-6  # two configurations are equal where the Jacobian is regular
SLIDE = Limits(lower=0.0, upper=0.5)


def _joint(d: float, a: float, alpha: float, theta: float = 0.3) -> Joint:
    return Joint(kind="revolute", theta=theta, d=d, a=a, alpha=alpha, limits=TURN)


# Three axes that meet at no right angle, and beyond them any frame.
WRIST = [_joint(0.35, 0.0, 0.7), _joint(0.0, 0.0, 1.1), _joint(0.1, 0.05, 0.3)]
ROLLS = [_joint(0.1, 0.0, 0.8), _joint(0.07, 0.03, 0.2)]
PAIRS = {
    "last parallel": [_joint(0.3, 0.1, 0.8), _joint(0.1, 0.4, 0.0), _joint(0.05, 0.03, 1.2)],
    "first parallel": [_joint(0.3, 0.4, np.pi), _joint(0.1, 0.3, 0.7), _joint(0.05, 0.03, 1.2)],
    "last meet": [_joint(0.3, 0.4, 0.6), _joint(0.1, 0.0, 0.7), _joint(0.0, 0.3, 1.2)],
    "first meet": [_joint(0.3, 0.0, 0.6), _joint(0.0, 0.3, 0.7), _joint(0.05, 0.3, 1.2)],
}
PARALLEL = [_joint(0.3, 0.1, 0.8), _joint(0.1, 0.4, np.pi), _joint(0.05, 0.33, 0.0), _joint(0.1, 0.06, 1.1)]
BACKWARDS = [
    *(_joint(0.3, 0.0, 0.8), _joint(0.0, 0.0, 0.9), _joint(0.35, 0.0825, RIGHT)),
    *(_joint(0.1, 0.0825, -RIGHT), _joint(0.384, 0.0, RIGHT), _joint(0.1, 0.1, 0.3)),
]


def _scara(order: str) -> list[Joint]:
    rows = [(0.3, 0.0), (0.25, np.pi), (0.2, 0.0), (0.0, 0.0)]
    return [
        Joint(kind="prismatic" if kind == "P" else "revolute", theta=0.3, d=0.1, a=a, alpha=alpha, limits=limits)
        for kind, (a, alpha), limits in zip(
            order, rows, [SLIDE if kind == "P" else TURN for kind in order], strict=True
        )
    ]


BUILDS: dict[str, tuple[str, list[Joint]]] = {
    **{f"{pair}, {k} more": ("Wristed", [*joints, *WRIST[:k]]) for pair, joints in PAIRS.items() for k in range(4)},
    **{f"three parallel, {k} more": ("ThreeParallel", [*PARALLEL, *ROLLS[:k]]) for k in (1, 2)},
    "backwards": ("Backwards", BACKWARDS),
    "backwards, 4 joints": ("Backwards", BACKWARDS[:4]),
    **{f"scara {order}": ("Scara", _scara(order)) for order in ("RRPR", "RRRP", "PRRR", "RPRR")},
    "swivelling": ("Swivelling", list(iiwa14().joints)),
    "held": ("Locked", list(panda().joints)),
    "on a rail": (
        "Locked",
        [Joint(kind="prismatic", theta=0.2, d=0.1, a=0.3, alpha=0.4, limits=SLIDE), *load_arm("puma560").joints],
    ),
}


def _build(name: str, rng: np.random.Generator) -> Arm:
    """An arm of a build, with joints that turn all round, at any place with any tool."""
    joints = [attrs.evolve(joint, limits=TURN) if joint.revolute else joint for joint in BUILDS[name][1]]
    return Arm(
        name=name.replace(" ", "-").replace(",", ""), joints=joints, base=random_pose(rng), tool=random_pose(rng)
    )


def _turned_apart(arm: Arm, q: Array, other: Array) -> Array:
    """The largest difference of configurations but for whole turns."""
    return np.asarray(np.abs(_wrapped(arm, np.asarray(q - other))).max(axis=-1))


def _wrapped(arm: Arm, q: Array) -> Array:
    """Angles between half a turn either way."""
    return np.asarray(np.where(arm.revolute, np.remainder(q + np.pi, 2 * np.pi) - np.pi, q))


def _regular(arm: Arm, q: Array) -> Array:
    return np.asarray(np.linalg.svd(jacobian(arm, q), compute_uv=False)[..., min(arm.n, 6) - 1] > 1e-3)


@pytest.mark.parametrize("name", BUILDS)
@pytest.mark.share(0.01)
def test_every_configuration_is_found_again(name: str, sample: Sample) -> None:
    """Any table of a class: each of 100,000 configurations is among the branches of its pose, which all meet it."""
    rng = next(sample.cases(1))
    arm, count = _build(name, rng), sample.count(100_000)
    form = find_closed_form(arm)
    assert type(form).__name__ == BUILDS[name][0]
    worst = lost = 0.0
    for part in np.array_split(random_configurations(arm, rng, count), max(1, count // 10_000)):
        X = forward(arm, part)
        found, _ = inverse_branches(arm, X, part)

        again = _turned_apart(arm, found, part[:, None]).min(axis=-1)
        # Where the position alone is at an edge, an arm of few joints has half of its digits from it.
        lost = max(lost, float((again[_regular(arm, part)] > (SAME if arm.n == 6 else 1e-4)).mean()))
        met = np.abs(forward(arm, found) - X[:, None]).max(axis=(-1, -2, -3))
        worst = max(worst, float(np.median(met)))
        assert (met > RESIDUAL).sum() <= (0 if arm.n >= 6 else max(3, 1e-3 * met.size))

    assert lost == 0
    assert worst < RESIDUAL
    sample.record(f"configurations found again, {name}", count, 0, median_residual=worst)


@pytest.mark.parametrize("name", [*(name for name in BUILDS if len(BUILDS[name][1]) < 7), "xarm6", "jaco", "sixteen"])
@pytest.mark.drawn(0.15)
def test_no_configuration_is_missed(name: str, sample: Sample) -> None:
    """What 400 descents from random starts find, whatever the limits, is among the branches, and no more than these."""
    published = {"xarm6": xarm6, "jaco": jaco, "sixteen": sixteen}
    found_here = found_there = 0
    for rng in sample.cases(10):
        arm = published[name]() if name in published else _build(name, rng)
        q = random_configurations(arm, rng, 1)[0]
        if not _regular(arm, q):
            continue
        X = forward(arm, q)
        starts = random_configurations(arm, rng, 400)

        rows = np.array([branch.q for branch in inverse(arm, X)])

        ends = _wrapped(arm, descend_from(arm, np.broadcast_to(X, (400, 4, 4)), starts))
        ends = ends[np.abs(forward(arm, ends) - X).max(axis=(-1, -2)) < 1e-9]
        ends = ends[_regular(arm, ends)]
        assert (_turned_apart(arm, ends[:, None], rows).min(axis=-1) < 1e-5).all()
        distinct = _turned_apart(arm, rows[:, None], ends).min(axis=-1) < 1e-5
        found_here, found_there = found_here + len(rows), found_there + int(distinct.sum())
        assert np.abs(forward(arm, rows) - X).max() < RESIDUAL
    assert found_there <= found_here
    sample.record(f"configurations, of which descents find a part, {name}", found_here, 0, by_descents=found_there)


@pytest.mark.parametrize("make", [xarm6, jaco, wx250, cobra600, iiwa14, panda])
def test_poses_are_those_of_pinocchio(make: Callable[[], Arm], rng: np.random.Generator) -> None:
    """The branches of an arm put the tool where Pinocchio says, to ten digits."""
    arm = make()
    model, data, tool = pinocchio_model(arm)
    for q in random_configurations(arm, rng, 3):
        X = forward(arm, q)
        for branch in inverse(arm, X, q):
            pin.framesForwardKinematics(model, data, branch.q)
            np.testing.assert_allclose(data.oMf[tool].homogeneous, X, atol=RESIDUAL)


@pytest.mark.parametrize("size", [1e-7, 1e-3])
def test_an_arm_that_is_nearly_of_a_build(size: float, rng: np.random.Generator) -> None:
    """A PUMA with small errors in all its numbers has as many configurations as without, each near one of those."""
    puma = load_arm("puma560")
    names = ("theta", "d", "a", "alpha")
    moved = np.random.default_rng(0).normal(scale=size, size=(6, 4))
    joints = [
        attrs.evolve(joint, **{name: getattr(joint, name) + x for name, x in zip(names, row, strict=True)})
        for joint, row in zip(puma.joints, moved, strict=True)
    ]
    for q in random_configurations(puma, rng, 2):
        nominal = np.array([branch.q for branch in inverse(puma, forward(puma, q))])

        found = np.array([branch.q for branch in inverse(attrs.evolve(puma, joints=joints), forward(puma, q))])

        assert len(found) == len(nominal)
        assert _turned_apart(puma, found[:, None], nominal).min(axis=-1).max() < 1e3 * size


def test_offset_wrists_are_named_by_shoulder_and_elbow() -> None:
    """What continuation finds of an arm with an offset wrist has the names of other arms, and a number."""
    arm = xarm6()
    labels = [branch.label for branch in inverse(arm, forward(arm, [0.1, 0.2, -0.3, 0.2, 0.4, 0.5]))]

    assert len(set(labels)) == len(labels)
    assert all(re.fullmatch(r"shoulder (left|right), elbow (up|down), wrist \d+", label) for label in labels)
    assert {"shoulder left, elbow up, wrist 1", "shoulder right, elbow up, wrist 1"} <= set(labels)


def test_sixteen_real_configurations() -> None:
    """The arm of Manseur and Doty has a pose with sixteen real configurations, as many as six joints can have."""
    arm = sixteen()
    rng = np.random.default_rng(1)

    most = max(len(inverse(arm, forward(arm, q)).branches) for q in random_configurations(arm, rng, 12))

    assert most == 16


def test_configurations_beside_a_wrist_that_is_nearly_spherical() -> None:
    """With axes that miss one another by 0.4 mm some configurations exist only beside a straight wrist, within 1e-3."""
    arm = load_arm("gen3-6dof")
    q = np.radians([120.0, -90.0, -90.0, 120.0, 180.0, -180.0])

    solution = inverse(arm, forward(arm, q))

    found = np.array([branch.q for branch in solution])
    assert len(found) == 12
    assert max(max(branch.position_error, branch.rotation_error) for branch in solution) < RESIDUAL
    beside = [(120, -90, -90, 120, 180, -180), (119.95, -90, -90, 60.28, 180, 120.23)]
    beside += [(-59.72, 90, 90, -60.28, 180, 180), (-59.77, 90, 90, -120, 180, 120.23)]
    for each in np.radians(beside):
        assert _turned_apart(arm, found, each).min() < 1e-4


@pytest.mark.parametrize("name", ["last parallel, 3 more", "three parallel, 2 more", "backwards"])
def test_against_eaik(name: str, rng: np.random.Generator) -> None:
    """EAIK knows spherical ends and three parallel axes too: as many configurations, the same ones."""
    arm = attrs.evolve(_build(name, rng), base=np.eye(4))
    axes = joint_axes(arm)
    steps = np.diff(axes.points, axis=0, prepend=np.zeros((1, 3)))
    links = np.concatenate([steps, [axes.X_BT[:3, 3] - axes.points[-1]]])
    peer = HPRobot(axes.directions, links)
    for q in random_configurations(arm, rng, 20):
        X = forward(arm, q)
        # Its tool has the axes of the base while all joints are at 0.
        theirs = np.array(peer.IK(homogeneous(X[:3, :3] @ axes.X_BT[:3, :3].T, X[:3, 3])).Q)
        theirs = theirs[np.abs(forward(arm, theirs) - X).max(axis=(-1, -2)) < 1e-6]

        ours = np.array([branch.q for branch in inverse(arm, X)])

        assert (_turned_apart(arm, theirs[:, None], ours).min(axis=-1) < 1e-4).all()


def test_scara_by_the_textbook(rng: np.random.Generator) -> None:
    """Joint 2 of a SCARA by the cosine rule, joint 1 by two arc tangents, the rest by subtraction: the same numbers."""
    arm = cobra600()
    first, second = 0.325, 0.275
    for q in random_configurations(arm, rng, 50):
        X = forward(arm, q)
        x, y, z = X[:3, 3]
        yaw = np.arctan2(X[1, 0], X[0, 0])
        cosine = (x**2 + y**2 - first**2 - second**2) / (2 * first * second)
        expected = []
        for bend in (np.arccos(cosine), -np.arccos(cosine)):
            q1 = np.arctan2(y, x) - np.arctan2(second * np.sin(bend), first + second * np.cos(bend))
            expected.append((q1, bend, 0.387 - z, q1 + bend - yaw))

        found, singular = inverse_branches(arm, X)

        assert not singular.any()
        for row in expected:
            assert _turned_apart(arm, found, np.array(row)).min() < 1e-9


def test_scara_names_its_elbow() -> None:
    """Seen from above, joint 2 turned to the left leaves the elbow on the right."""
    arm = cobra600()
    labels = {branch.label: branch.q[1] for branch in inverse(arm, forward(arm, [0.2, 0.8, 0.1, 0.3]))}

    assert set(labels) == {"elbow left", "elbow right"}
    assert labels["elbow right"] == pytest.approx(0.8)
    assert labels["elbow left"] == pytest.approx(-0.8)


@pytest.mark.parametrize("name", ["last parallel, 2 more", "last parallel, 3 more", "three parallel, 2 more"])
def test_names_say_how_the_arm_stands(name: str, rng: np.random.Generator) -> None:
    """Every branch has a name of its own, and the elbow called up is above the line from joint 2 to the forearm's end.

    Left and right are those of the PUMA: with its axes at right angles an arm has the same names by either closed form.
    """
    arm = _build(name, rng)
    for q in random_configurations(arm, rng, 10):
        labels = [branch.label for branch in inverse(arm, forward(arm, q))]
        assert len(set(labels)) == len(labels)
    puma = load_arm("puma560")
    axes = joint_axes(puma)
    form = next(_wristed(axes))
    for q in random_configurations(puma, rng, 10):
        for branch in inverse(puma, forward(puma, q)):
            arm_side, elbow, _ = branch.label.split(", ")
            assert form.label(0, branch.q).startswith(f"shoulder {arm_side}, elbow {elbow}, wrist ")


def test_a_pose_that_a_scara_cannot_turn_to() -> None:
    """Tilted by 10 degrees a pose is refused by that angle; the nearest keeps position and yaw."""
    arm = cobra600()
    q = np.array([0.2, 0.8, 0.1, 0.3])
    upright = forward(arm, q)
    tilted = upright.copy()
    tilted[:3, :3] = rotation_from_vector(np.radians(10) * np.array((0.6, 0.8, 0.0))) @ upright[:3, :3]

    solution = inverse(arm, tilted)

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == 0
    assert np.degrees(solution.rotation_error) == pytest.approx(10)
    np.testing.assert_allclose(solution.nearest_pose, upright, atol=1e-12)
    with pytest.raises(
        NoSolutionError, match=r"'cobra600'.* cannot turn its tool .* nearest orientation is 10\.00 deg away"
    ):
        _ = solution.best


def test_a_pose_beyond_a_scara() -> None:
    """250 mm beyond the stretched arm is 250 mm out of reach, stretched is nearest, and there both elbows are one."""
    arm = cobra600()
    stretched = forward(arm, [0.2, 0.0, 0.1, 0.3])
    beyond = stretched.copy()
    beyond[:2, 3] *= 0.85 / 0.6

    solution = inverse(arm, beyond)

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(0.25)
    np.testing.assert_allclose(solution.nearest_pose, stretched, atol=1e-12)
    (only,) = inverse(arm, stretched)
    np.testing.assert_allclose(only.q, [0.2, 0.0, 0.1, 0.3], atol=1e-7)


def test_five_joints_come_to_a_position_that_they_cannot_turn_to() -> None:
    """A hand turned 20 degrees aside of the plane of the arm is refused by no more than that; the position is kept."""
    arm = wx250()
    X = forward(arm, [0.3, 0.2, 0.3, 0.4, 0.5])
    assert {branch.label for branch in inverse(arm, X)} >= {"shoulder left, elbow up"}
    aside = X.copy()
    aside[:3, :3] = rotation_from_vector(np.radians(20) * np.array((0.0, 0.0, 1.0))) @ X[:3, :3]

    solution = inverse(arm, aside)

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance < 1e-6
    assert 0 < np.degrees(solution.rotation_error) <= 20
    assert "cannot turn its tool" in solution.explain()


@pytest.mark.parametrize("turn", [1e-3, 1e-5, 4e-6])
def test_what_is_out_of_reach_by_little_is_told(turn: float) -> None:
    """A hand turned aside by less than the digits of the message: it says more of them, not 0.00 deg."""
    arm = wx250()
    X = forward(arm, [0.3, 0.2, 0.3, 0.4, 0.5])
    X[:3, :3] = rotation_from_vector(np.array((0.0, 0.0, turn))) @ X[:3, :3]

    solution = inverse(arm, X)

    told = re.search(r"cannot turn its tool .* orientation is (\S+) deg away$", solution.explain())
    assert told is not None
    assert float(told[1]) == pytest.approx(np.degrees(solution.rotation_error), rel=0.5)
    assert 0 < solution.rotation_error <= turn * 1.001


@pytest.mark.parametrize("make", [cobra600, wx250])
def test_typed_poses(make: Callable[[], Arm], rng: np.random.Generator) -> None:
    """A pose typed with six digits is none of the few that such an arm has, by less than counts, and is solved."""
    arm = make()
    for q in random_configurations(arm, rng, 10):
        solution = inverse(arm, np.round(forward(arm, q), 6))

        assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR)
        assert min(np.abs(branch.q - q).max() for branch in solution) < 1e-3


def test_straight_wrist_is_flagged(rng: np.random.Generator) -> None:
    """Where axes 4 and 6 of a bent wrist fall together joint 4 stays and 6 makes up: both are said to be free."""
    joints = [*PAIRS["last parallel"], _joint(0.35, 0.0, 0.7), _joint(0.0, 0.0, 0.7, theta=np.pi), WRIST[2]]
    arm = Arm(name="bent", joints=joints)
    q = random_configurations(arm, rng, 1)[0]
    q[4] = 0.0
    X = forward(arm, q)
    near = q + np.array((0, 0, 0, 0.4, 0, 0))

    rows, singular = inverse_branches(arm, X, near)
    solution = inverse(arm, X, near)

    assert singular[np.abs(rows[:, :3] - q[:3]).max(axis=1).argmin()]
    free = [branch for branch in solution if branch.free]
    assert {branch.free for branch in free} == {(4, 6)}
    assert min(abs(branch.q[3] - near[3]) for branch in free) < 1e-9
    assert np.abs(forward(arm, rows) - X).max() < RESIDUAL


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-8, 1e-9, 1e-11])
@pytest.mark.parametrize("name", ["last parallel, 3 more", "three parallel, 2 more", "backwards"])
def test_beside_a_singularity(name: str, gap: float, rng: np.random.Generator) -> None:
    """However near the singularity of the two last turns of a class is, the branches meet their pose."""
    arm = _build(name, rng)
    for q in random_configurations(arm, rng, 5):
        for joint in range(1, 5):
            moved = q.copy()
            moved[joint] = gap
            X = forward(arm, moved)
            rows, _ = inverse_branches(arm, X, moved)
            assert np.abs(forward(arm, rows) - X).max() < RESIDUAL


@pytest.mark.parametrize("name", ["first meet, 3 more", "scara RRPR", "last parallel, 2 more", "swivelling", "held"])
@pytest.mark.drawn(0.4)
def test_compiled_branches_are_the_plain_ones(name: str, rng: np.random.Generator) -> None:
    """Compiled, with as many branches and joints as the arm has, the equations give what they give plainly."""
    arm = _build(name, rng)
    q = random_configurations(arm, rng, 100)
    X, near = forward(arm, q), q + rng.normal(scale=0.1, size=q.shape) * (arm.n < 7)

    found, singular = compile_arm(arm, quickly=True).inverse_branches(X, near)

    expected, expected_singular = inverse_branches(arm, X, near)
    assert found.shape == expected.shape
    np.testing.assert_array_equal(singular, expected_singular)
    np.testing.assert_allclose(forward(arm, found), forward(arm, expected), atol=1e-9)


def test_a_line_of_five_joints_keeps_its_branch() -> None:
    """A WidowX moves its hand along a line in the plane of the arm, by its closed form and with its name."""
    arm = wx250()
    q = np.array([0.3, 0.1, 0.2, 0.3, 0.5])
    ahead = forward(arm, q)
    ahead[:3, 3] += 0.05 * np.array((np.cos(0.3), np.sin(0.3), 0.4))
    speeds = [attrs.evolve(j, limits=attrs.evolve(j.limits, speed=2.0, acceleration=5.0)) for j in arm.joints]

    move = straight_line(attrs.evolve(arm, joints=speeds, reach=0.65, tool_speed=1.0), q, ahead, deviation=1e-3)

    assert move.certificate.holds
    end = move.trajectory(move.trajectory.duration)
    np.testing.assert_allclose(forward(arm, end), ahead, atol=1e-6)


def test_a_joint_that_every_pose_leaves_open_is_no_closed_form(rng: np.random.Generator) -> None:
    """Three axes that meet, and two more that do not: the first joint is no answer to where they meet, which stays."""
    rows = [(0.3, 0.0, 0.8), (0.0, 0.0, 0.9), (0.35, 0.08, 1.2), (0.1, 0.0, 0.7), (0.2, 0.1, 0.3)]
    arm = Arm(name="shoulder", joints=[_joint(*row) for row in rows])
    assert find_closed_form(arm) is None
    for q in random_configurations(arm, rng, 5):
        solution = inverse(arm, forward(arm, q))
        assert solution.outcome is Outcome.SOLVED
        assert min(_turned_apart(arm, branch.q, q) for branch in solution) < 1e-4


def test_words_of_a_swivel_are_for_seven_joints() -> None:
    """An arm of six joints has no swivel, and says so."""
    arm = load_arm("ur5")
    with pytest.raises(UnsupportedArmError, match="'ur5' has no swivel"):
        inverse(arm, homogeneous(np.eye(3), (0.3, 0.2, 0.3)), swivel=0.2)
