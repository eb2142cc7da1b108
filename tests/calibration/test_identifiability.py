"""What a measurement can tell of an arm, against what geometry says that it cannot."""

import attrs
import numpy as np
import pytest

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.identifiability import Identifiability, select_identifiable
from armwright.spatial.poses import homogeneous
from calibration.simulated import configurations, random_arm

# Noise so small that only geometry hides an error [m].
NONE = 1e-9
# Directions in which no point moves, as computed [m/rad].
STILL = 1e-12
# A part of the largest singular value that is not 0 but for rounding.
ZERO = 1e-10


def told(chain: Chain, q: Array, noise: float = NONE) -> Identifiability:
    """Return what points at configurations q tell, base and tool first."""
    first = [i for part in ("base.", "tool.") for i, name in enumerate(chain.names) if part in name]
    J = chain.forward(q).position_jacobian.reshape(-1, len(chain.names))
    return select_identifiable(chain.names, J, chain.is_length, noise, first=first)


def kept(found: Identifiability) -> set[str]:
    return {found.names[i] for i in found.fitted}


def skew(rng: np.random.Generator, n: int) -> Arm:
    """Return an arm of n turning joints none of which are parallel; base and tool are not turned."""
    arm = random_arm(rng, n)
    joints = [attrs.evolve(joint, alpha=rng.choice([-1, 1]) * rng.uniform(0.4, 1.4)) for joint in arm.joints]
    return attrs.evolve(arm, joints=joints, base=np.eye(4), tool=homogeneous(np.eye(3), (0.03, -0.02, 0.1)))


def planar(n: int = 3) -> Arm:
    return Arm(
        name="planar",
        joints=[Joint(kind="revolute", a=0.4 - 0.1 * i) for i in range(n)],
        tool=homogeneous(np.eye(3), (0.05, 0.02, 0.1)),
    )


def null_space(chain: Chain) -> Array:
    """Return (k, f) errors that no measured point tells, by geometry; for turning joints, base and tool unturned.

    Turning the base about the first axis is turning joint 1. A point in the last link has three numbers: what its joint
    is off by moves it like an error of the tool. Of two parallel axes, only the sum of the shifts along them is seen.
    """
    number = {name: i for i, name in enumerate(chain.names)}
    joints = chain.arm.joints
    last, name = joints[-1], f"joint{chain.arm.n}"
    axis = np.array((0.0, np.sin(last.alpha), np.cos(last.alpha)))  # of the last joint, in the frame of the last link
    place = chain.arm.tool[:3, 3]
    moves = {
        "theta": np.cross(axis, place + np.array((last.a, 0.0, 0.0))),
        "d": axis,
        "a": np.array((1.0, 0.0, 0.0)),
        "alpha": np.cross((1.0, 0.0, 0.0), place),
    }
    free: list[dict[str, float]] = [{f"tool.r{one}": 1.0} for one in "xyz"]
    free += [{"base.rz": 1.0, "joint1.theta": -1.0}, {"base.z": 1.0, "joint1.d": -1.0}]
    free += [
        {f"{name}.{error}": 1.0, **{f"tool.{one}": -by for one, by in zip("xyz", move, strict=True)}}
        for error, move in moves.items()
    ]
    free += [
        {f"joint{i}.d": 1.0, f"joint{i + 1}.d": -np.cos(joints[i - 1].alpha)}
        for i in range(1, len(joints))
        if f"joint{i}.beta" in number
    ]
    table = np.zeros((len(number), len(free)))
    for column, one in enumerate(free):
        for error, value in one.items():
            table[number[error], column] += value
    return table


@pytest.mark.parametrize("n", range(3, 8))
def test_skew_arm(n: int, rng: np.random.Generator) -> None:
    """Of n turning joints, a measured point tells 4 n + 3 mixtures of errors, and hides just what geometry says."""
    chain = kinematic_chain(skew(rng, n))
    q = configurations(rng, chain.arm, 60)
    J = chain.forward(q).position_jacobian.reshape(-1, len(chain.names))
    hidden = null_space(chain)

    found = told(chain, q)

    np.testing.assert_allclose(J @ hidden, 0.0, atol=STILL)
    assert np.linalg.matrix_rank(hidden) == len(chain.names) - (4 * n + 3)
    assert len(found.fitted) == 4 * n + 3
    assert np.count_nonzero(found.singular_values > ZERO * found.singular_values[0]) == 4 * n + 3


@pytest.mark.parametrize(("n", "parallel"), [(3, (1,)), (4, (2,)), (5, (1, 3)), (6, (2, 3)), (7, (2, 4, 5))])
def test_parallel_axes(n: int, parallel: tuple[int, ...], rng: np.random.Generator) -> None:
    """Parallel axes change nothing of the number: the turn about y comes for the shift, which is one with the next."""
    arm = skew(rng, n)
    joints = [attrs.evolve(joint, alpha=0.0) if i in parallel else joint for i, joint in enumerate(arm.joints, 1)]
    chain = kinematic_chain(attrs.evolve(arm, joints=joints))
    q = configurations(rng, chain.arm, 60)
    J = chain.forward(q).position_jacobian.reshape(-1, len(chain.names))
    hidden = null_space(chain)

    found = told(chain, q)

    np.testing.assert_allclose(J @ hidden, 0.0, atol=STILL)
    assert np.linalg.matrix_rank(hidden) == len(chain.names) - (4 * n + 3)
    assert len(found.fitted) == 4 * n + 3
    for i in parallel:
        assert f"joint{i}.beta" in kept(found)
        assert f"joint{i + 1}.d" not in kept(found)


def test_antiparallel_axes(rng: np.random.Generator) -> None:
    """Axes that point against each other are parallel too; then it is the difference of the shifts that is seen."""
    arm = skew(rng, 4)
    joints = [attrs.evolve(joint, alpha=np.pi) if i == 2 else joint for i, joint in enumerate(arm.joints, 1)]
    chain = kinematic_chain(attrs.evolve(arm, joints=joints))

    fixed = {one.name: one for one in told(chain, configurations(rng, chain.arm, 60)).fixed}

    assert fixed["joint3.d"].reason == "redundant: it has the same effect as joint2.d"
    assert fixed["joint3.d"].collinear[0] == ("joint2.d", pytest.approx(-1.0))


def test_planar_arm(rng: np.random.Generator) -> None:
    """A planar 3R arm, too, tells 15 mixtures: 8 by what moves in the plane, 7 by what leaves it."""
    chain = kinematic_chain(planar())

    found = told(chain, configurations(rng, chain.arm, 40))

    assert len(found.fitted) == 15
    assert {"joint1.beta", "joint2.beta"} <= kept(found)
    assert not {"joint1.d", "joint2.d", "joint3.d"} & kept(found)


@pytest.mark.parametrize("seed", range(8))
def test_slides(seed: int) -> None:
    """A slide tells 2 instead of 4: only its direction matters, not where it is."""
    rng = np.random.default_rng(seed)
    arm = skew(rng, 5)
    joints = [
        attrs.evolve(joint, kind="prismatic") if i == 1 + seed % 3 else joint for i, joint in enumerate(arm.joints)
    ]
    chain = kinematic_chain(attrs.evolve(arm, joints=joints))

    found = told(chain, configurations(rng, chain.arm, 60))

    assert len(found.fitted) == 4 * 4 + 2 * 1 + 3


def test_what_does_the_same(rng: np.random.Generator) -> None:
    """What is fixed is named with what does the same, and with how much of it."""
    arm = skew(rng, 6)
    chain = kinematic_chain(arm)
    _, y, z = arm.tool[:3, 3]

    fixed = {one.name: one for one in told(chain, configurations(rng, arm, 60)).fixed}

    assert fixed["joint1.theta"] == (
        "joint1.theta",
        "redundant: it has the same effect as base.rz",
        (("base.rz", pytest.approx(1.0)),),
    )
    assert fixed["joint1.d"].reason == "redundant: it has the same effect as base.z"
    assert fixed["joint6.a"].reason == "redundant: it has the same effect as tool.x"
    assert dict(fixed["joint6.alpha"].collinear) == {"tool.y": pytest.approx(-z), "tool.z": pytest.approx(y)}
    assert fixed["joint6.alpha"].reason == "redundant: it has the same effect as a combination of tool.y and tool.z"
    for turned in "xyz":
        assert fixed[f"tool.r{turned}"].reason == "unobservable: it does not move the tool in any of the poses"


def test_tool_on_the_last_axis(rng: np.random.Generator) -> None:
    """The last joint does not move a point on its axis; that the point is not quite there is told all the same."""
    arm = skew(rng, 4)
    last = attrs.evolve(arm.joints[-1], a=0.0, alpha=0.0)
    arm = attrs.evolve(arm, joints=[*arm.joints[:-1], last], tool=homogeneous(np.eye(3), (0.0, 0.0, 0.1)))
    chain = kinematic_chain(arm)

    found = told(chain, configurations(rng, arm, 60))

    fixed = {one.name: one.reason for one in found.fixed}
    assert fixed["joint4.theta"] == "unobservable: it does not move the tool in any of the poses"
    assert fixed["joint4.d"] == "redundant: it has the same effect as tool.z"
    assert {"tool.x", "tool.y", "tool.z"} <= kept(found)


@pytest.mark.parametrize("still", [1, 3, 5])
def test_joint_that_never_moved(still: int, rng: np.random.Generator) -> None:
    """An arm of which one joint never moves tells as much as one with a joint less: both its links are one."""
    chain = kinematic_chain(skew(rng, 5))
    q = configurations(rng, chain.arm, 60)
    q[:, still - 1] = 0.4

    assert len(told(chain, q).fitted) == 4 * (5 - 1) + 3


def test_few_poses(rng: np.random.Generator) -> None:
    """Five points have 15 coordinates, and tell no more errors than that."""
    chain = kinematic_chain(skew(rng, 6))

    found = told(chain, configurations(rng, chain.arm, 5))

    assert len(found.fitted) <= 15
    assert len(found.fitted) + len(found.fixed) == len(chain.names)


def test_noise_hides(rng: np.random.Generator) -> None:
    """The more noise, the fewer errors are told; those that noise hides are named as such."""
    chain = kinematic_chain(skew(rng, 6))
    q = 0.1 * configurations(rng, chain.arm, 40)

    counts = [len(told(chain, q, noise).fitted) for noise in (NONE, 1e-5, 1e-4, 1e-3)]
    fixed = [one.reason for one in told(chain, q, 1e-4).fixed]

    assert counts[0] == 27
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < counts[0]
    assert any(reason.startswith("nearly collinear with ") for reason in fixed)


def test_allowed(rng: np.random.Generator) -> None:
    """What may not be fitted is neither fitted nor fixed for a reason of geometry."""
    chain = kinematic_chain(skew(rng, 4))
    q = configurations(rng, chain.arm, 40)
    J = chain.forward(q).position_jacobian.reshape(-1, len(chain.names))

    found = select_identifiable(chain.names, J, chain.is_length, NONE, allowed=range(6))

    assert kept(found) == {"base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz"}
    assert found.fixed == ()
