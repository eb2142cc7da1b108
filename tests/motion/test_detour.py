"""Ways round what stops a straight line."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.motion.detour import line_or_detour
from armwright.motion.obstruction import PathError
from armwright.motion.straight import straight_line
from armwright.spatial.poses import between, homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector
from armwright.study.puma_moves import study_poses


@pytest.fixture(scope="module")
def through_the_wrist() -> tuple[Array, Array]:
    """A line of the PUMA on which the tool turns about the axis that its nearly straight wrist cannot turn about."""
    arm = load_arm("puma560-seed")
    q = np.array([0.3, 1.0, 2.2, 0.4, 0.001, -0.3])
    J = jacobian(arm, q)
    axis = np.cross(J[3:, 3], J[3:, 4])
    poses = []
    for way in (-0.2, 0.2):
        X = forward(arm, q).copy()
        X[:3, :3] = rotation_from_vector(way * axis) @ X[:3, :3]
        X[:3, 3] += (0.0, 0.2 * way, 0.0)
        poses.append(X)
    return inverse(arm, poses[0], q).best.q, poses[1]


def test_the_line_names_the_cause(through_the_wrist: tuple[Array, Array]) -> None:
    """The line itself is refused, with the wrist as its cause and a place on the way."""
    q, X = through_the_wrist

    with pytest.raises(PathError, match=r"singular there \(wrist\), joint [46] would have to move") as stopped:
        straight_line(load_arm("puma560-seed"), q, X)

    assert stopped.value.cause == "singular"
    assert 0 < stopped.value.fraction < 1


def test_a_detour_without_memory_for_code(
    through_the_wrist: tuple[Array, Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the system refuses memory for code, a detour is found with the plain functions."""
    arm = load_arm("puma560-seed")
    compiled = line_or_detour(arm, *through_the_wrist, method="damped")
    monkeypatch.setattr("armwright.motion.detour.can_be_compiled", lambda: False)
    monkeypatch.setattr("armwright.motion.detour.compile_arm", None)

    plain = line_or_detour(arm, *through_the_wrist, method="damped")

    assert plain.method == "damped"
    assert plain.trajectory.duration == pytest.approx(compiled.trajectory.duration)


@pytest.mark.parametrize("by", ["via", "damped"])
def test_a_detour(through_the_wrist: tuple[Array, Array], by: str) -> None:
    """By a via pose and by damped rates the tool gets there, inside all limits, at a price that the report states."""
    arm = load_arm("puma560-seed")
    q, X = through_the_wrist

    way = line_or_detour(arm, q, X, method=by)  # type: ignore[arg-type]

    assert way.method == by
    assert way.obstacle is not None
    motion = way.trajectory
    np.testing.assert_allclose(motion(0.0), q, atol=1e-12)
    np.testing.assert_allclose(forward(arm, motion(motion.duration)), X, atol=1e-5)
    np.testing.assert_allclose(motion([0.0, motion.duration], 1), 0, atol=1e-6)
    assert (motion.peaks(1) <= arm.limits.speed * (1 + 1e-9)).all()
    assert (motion.peaks(2) <= arm.limits.acceleration * (1 + 1e-9)).all()
    lowest, highest = motion.extremes(0)
    assert (lowest >= arm.limits.lower).all()
    assert (highest <= arm.limits.upper).all()
    poses = forward(arm, motion(np.linspace(0, motion.duration, 3000)))
    places = poses[:, :3, 3]
    A, B = forward(arm, q)[:3, 3], X[:3, 3]
    s = np.clip((places - A) @ (B - A) / ((B - A) @ (B - A)), 0, 1)
    off = np.linalg.norm(places - A - s[:, None] * (B - A), axis=-1).max()
    allowed = 1e-3 if by == "via" else 0.0  # the legs keep their own lines to a millimetre
    assert off <= way.price.distance + allowed + 1e-9
    assert "mm off the line" in str(way.price)
    if by == "via":
        off_line = angle_between(between(forward(arm, q), X, s)[:, :3, :3], poses[:, :3, :3])
        assert off_line.max() <= way.price.rotation * 1.001 + 1e-6
        assert all(leg.certificate.holds for leg in way.legs)


def test_a_detour_near_the_joint_move() -> None:
    """Where the wrist has to be turned over on the way, two certified lines by a pose near the joint move do it.

    Seed 002 from B to C: joint 5 goes from 11.6 to -20.2 degrees; no pose beside the line helps.
    """
    fast = compile_arm(load_arm("puma560-seed"))
    B, C = study_poses()[1:]
    q = next(branch.q for branch in inverse(fast.arm, B).allowed if branch.label == "left, down, no-flip")

    way = line_or_detour(fast, q, C, method="via")

    assert way.method == "via"
    assert [leg.certificate.holds for leg in way.legs] == [True, True]
    np.testing.assert_allclose(fast.forward(way.trajectory(way.trajectory.duration)), C, atol=1e-6)
    lowest, highest = way.trajectory.extremes(0)
    assert (lowest >= fast.arm.limits.lower).all()
    assert (highest <= fast.arm.limits.upper).all()
    assert (way.trajectory.peaks(1) <= fast.arm.limits.speed * (1 + 1e-9)).all()


def test_damped_rates_keep_efforts(through_the_wrist: tuple[Array, Array]) -> None:
    """Where the motors are weak and nothing else binds, the way by damped rates is run as slowly as they ask for."""
    q, X = through_the_wrist
    strong = load_arm("puma560-seed")
    limits = [attrs.evolve(j.limits, acceleration=1e3, effort=0.15 * j.limits.effort) for j in strong.joints]
    joints = [attrs.evolve(j, limits=limit) for j, limit in zip(strong.joints, limits, strict=True)]
    weak = attrs.evolve(strong, joints=joints)

    motion = line_or_detour(weak, q, X, method="damped").trajectory

    t = np.linspace(0, motion.duration, 20_000)
    parts = np.abs(inverse_dynamics(weak, motion(t), motion(t, 1), motion(t, 2))) / weak.limits.effort
    assert parts.max() == pytest.approx(1, abs=1e-3)


def test_a_line_that_needs_none() -> None:
    """Where the line can be run it is, at no price but its own deviation."""
    arm = load_arm("puma560-seed")
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
    X = forward(arm, q).copy()
    X[:3, 3] += (0.1, -0.2, -0.1)

    way = line_or_detour(arm, q, X)

    assert way.method == "line"
    assert way.obstacle is None
    assert way.price.time == 0
    assert way.price.distance <= 1e-3


def test_no_detour() -> None:
    """Where the goal itself cannot be reached there is no way round, and the reason is that of the line."""
    arm = load_arm("puma560-seed")
    q = np.array([0.0, 0.3, 0.2, 0.0, 0.8, 0.0])
    far = forward(arm, q).copy()
    far[:3, 3] *= 3

    for by in ("via", "damped"):
        with pytest.raises(PathError, match="out of reach"):
            line_or_detour(arm, q, far, method=by)  # type: ignore[arg-type]


def test_unknown_way() -> None:
    """A misspelt way gets the nearest one."""
    with pytest.raises(UnknownNameError, match="Did you mean 'damped'"):
        line_or_detour(load_arm("puma560-seed"), np.zeros(6), np.eye(4), method="dampd")  # type: ignore[arg-type]


def test_no_crawling() -> None:
    """Lines past the wrist's singularity are run in seconds: the tool is slowed where it passes, and nowhere else.

    Slowed from end to end as the joints ask for beside the singularity, they would take a minute and more.
    """
    arm = attrs.evolve(load_arm("puma560-seed"), tool=homogeneous(np.eye(3), (0, 0, 0.12)))
    level = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    run = 0
    for aside in (0.003, 0.004, 0.006):  # metres below the line is the place where forearm and hand are in line
        X, Y = homogeneous(level, (0.55, -0.05, aside - 0.3125)), homogeneous(level, (0.55, 0.35, aside - 0.5125))
        q = next(branch.q for branch in inverse(arm, X).allowed if branch.q[3] > 0)
        try:
            line = straight_line(arm, q, Y, deviation=2e-3)
        except PathError:
            continue
        assert line.certificate.holds
        # At full speed from end to end the joint that turns beside the singularity would need as much longer.
        t = np.linspace(0, line.trajectory.duration, 5000)
        way = np.linalg.norm(np.diff(forward(arm, line.trajectory(t))[:, :3, 3], axis=0), axis=-1) / np.diff(t)
        crawls = line.trajectory.duration * way.max() / way[1000:-1000].min() > 60
        run += bool(crawls)
        for by in ("via", "damped"):
            motion = line_or_detour(arm, q, Y, method=by, deviation=2e-3).trajectory  # type: ignore[arg-type]
            assert motion.duration < 10
    assert run > 0
