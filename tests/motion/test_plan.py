"""Paths in space and the stages of a move."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.obstruction import PathError
from armwright.motion.path import Path, closest_to_axis, place_knots, report_speed, report_step
from armwright.motion.plan import Manner, StageError, StageGoal, plan
from armwright.motion.straight import coarse_line
from armwright.motion.through import through
from armwright.motion.tolerance import ROTATION_PER_METRE
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector
from oracles.arms import random_configurations

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

DOWN = np.diag((1.0, -1.0, -1.0))
POSE = 1e-9  # how well a knot is met, in m and rad


def at(x: float, y: float, z: float, turn: float = 0.0) -> Array:
    return homogeneous(rotation_from_vector([0, 0, turn]) @ DOWN, (x, y, z))


@pytest.fixture
def stanford() -> Arm:
    return load_arm("stanford")


def start(arm: Arm, X: Array) -> Array:
    return inverse(arm, X).best.q


def distance_from_line(p: Array, a: Array, b: Array) -> Array:
    u = (b - a) / np.linalg.norm(b - a)
    return np.linalg.norm(np.cross(p - a, u), axis=-1)


def test_step_of_the_report(stanford: Arm) -> None:
    """A line that passes the axis at half a metre has R = 1 m: for 1 mm the step is sqrt(8 mm m) = 89.4 mm."""
    A, B = (0.5, -0.2, 0.1), (0.5, 0.2, 0.4)

    assert closest_to_axis(A, B) == pytest.approx(0.5)
    assert report_step(stanford, A, B, 1e-3) == pytest.approx(np.sqrt(8e-3))


def test_speed_of_the_report(stanford: Arm) -> None:
    """Speed 120 gives (r_min / R_MAX) V_MAX, 100 gives 100/120 of it."""
    A, B = (0.5, -0.2, 0.1), (0.5, 0.2, 0.4)

    assert report_speed(stanford, A, B, 120) == pytest.approx(0.5 / stanford.reach * stanford.tool_speed)
    assert report_speed(stanford, A, B, 100) == pytest.approx(report_speed(stanford, A, B, 120) * 100 / 120)


def test_half_steps_at_both_ends(stanford: Arm) -> None:
    """First and last step are half as long as the others; all take the same time."""
    path = Path(poses=[at(0.5, -0.2, 0.1), at(0.5, 0.2, 0.1)])

    knots = place_knots(stanford, path, deviation=1e-3, speed=100)

    steps = np.diff(path.at(0, knots.fractions)[:, 1, 3])
    np.testing.assert_allclose(steps / steps[1], [0.5, *[1.0] * (len(steps) - 2), 0.5])
    np.testing.assert_allclose(np.diff(knots.times), knots.times[1])
    assert steps[1] / knots.times[1] == pytest.approx(
        report_speed(stanford, path.poses[0, :3, 3], path.poses[1, :3, 3], 100)
    )


@pytest.mark.parametrize("name", ["stanford", "puma560-seed"])
@pytest.mark.parametrize("deviation", [2e-3, 1e-4])
@pytest.mark.drawn(0.4)
def test_lines_stay_within_the_deviation(name: str, deviation: float, rng: np.random.Generator) -> None:
    """On random lines 20 times denser samples find nothing worse than the planner says, or than was asked."""
    arm = load_arm(name)
    done = 0
    for q in random_configurations(arm, rng, 60):
        A = forward(arm, q)
        B = A @ homogeneous(rotation_from_vector(rng.normal(scale=0.3, size=3)), rng.normal(scale=0.1, size=3))
        try:
            found = coarse_line(arm, q, B, deviation=deviation, speed=100)
        except PathError:
            continue
        done += 1
        X = forward(arm, found.trajectory(np.linspace(0, found.trajectory.duration, found.certificate.knots * 320)))
        off = distance_from_line(X[:, :3, 3], A[:3, 3], B[:3, 3])
        assert off.max() <= found.certificate.deviation + POSE
        assert found.certificate.deviation <= deviation
        assert found.certificate.rotation <= ROTATION_PER_METRE * deviation
        assert (found.trajectory.peaks(1) <= arm.limits.speed * (1 + 1e-9)).all()
        assert (found.trajectory.peaks(2) <= arm.limits.acceleration * (1 + 1e-9)).all()
        np.testing.assert_allclose(X[0], A, atol=POSE)
        np.testing.assert_allclose(X[-1], B, atol=POSE)
    assert done > 20


@pytest.mark.parametrize("name", ["stanford", "puma560", "ur5"])
def test_coarser_lines_are_no_slower(name: str, rng: np.random.Generator) -> None:
    """Who allows more than a millimetre waits no longer for it, and the tool is turned by 25 mrad at most."""
    arm, done = load_arm(name), 0
    for q in random_configurations(arm, rng, 20):
        A = forward(arm, q)
        B = A @ homogeneous(np.eye(3), rng.normal(size=3) * 10 ** rng.uniform(-2, -0.7))
        try:
            runs = [coarse_line(arm, q, B, deviation=d, speed=100) for d in (1e-3, 2e-3, 3e-3, 5e-3, 1.0)]
        except PathError:
            continue
        assert (np.diff([run.trajectory.duration for run in runs]) <= 0).all()
        assert runs[-1].certificate.deviation <= 5e-3
        assert runs[-1].certificate.rotation <= 5e-3 * ROTATION_PER_METRE
        done += 1
        if done == 3:
            break
    assert done


def test_rotation_in_place(stanford: Arm) -> None:
    """A path without length turns the tool where it is, evenly about one axis."""
    A, B = at(0.5, 0.1, 0.2), at(0.5, 0.1, 0.2, turn=1.0)

    found = coarse_line(stanford, start(stanford, A), B, deviation=1e-3, speed=100)

    X = forward(stanford, found.trajectory(np.linspace(0, found.trajectory.duration, 400)))
    assert np.linalg.norm(X[:, :3, 3] - A[:3, 3], axis=-1).max() <= 1e-3
    assert angle_between(X[-1, :3, :3], B[:3, :3]) < POSE


@pytest.mark.parametrize("length", [0.0, 1e-12, 1e-9, 1e-6, 1e-4, 3e-3])
@pytest.mark.parametrize("turn", [0.0, 1e-3, np.pi / 2])
def test_very_short_paths(stanford: Arm, length: float, turn: float) -> None:
    """A line of next to no length, with or without a turn, is a short slow move and no singularity."""
    A, B = at(0.45, 0.1, 0.25), at(0.45, 0.1 + length, 0.25, turn)

    found = coarse_line(stanford, start(stanford, A), B, deviation=1e-3, speed=100)

    np.testing.assert_allclose(forward(stanford, found.trajectory(found.trajectory.duration)), B, atol=2e-9)
    assert found.trajectory.duration < 3
    assert (found.trajectory.peaks(2) <= stanford.limits.acceleration * (1 + 1e-9)).all()


def test_a_frame_met_twice_in_a_row(stanford: Arm) -> None:
    """A path may name the same pose twice, at its start, on its way and at its end: it is passed once."""
    a, b, c = at(0.45, 0.15, 0.1), at(0.5, 0.05, 0.2), at(0.45, -0.1, 0.1)
    q = start(stanford, a)

    once = through(stanford, Path(poses=[a, b, c]), q, deviation=1e-3, speed=100)
    twice = through(stanford, Path(poses=[a, a, b, b, c, c]), q, deviation=1e-3, speed=100)

    np.testing.assert_allclose(twice.trajectory.times, once.trajectory.times, rtol=1e-12)
    np.testing.assert_allclose(twice.trajectory.coefficients, once.trajectory.coefficients, atol=1e-9)


def test_turn_and_small_shift_together(stanford: Arm) -> None:
    """Half a turn over a millimetre keeps the place within the deviation and the turn about one axis."""
    A, B = at(0.5, 0.1, 0.2), at(0.501, 0.1, 0.2, turn=2.0)

    found = coarse_line(stanford, start(stanford, A), B, deviation=1e-3, speed=100)

    X = forward(stanford, found.trajectory(np.linspace(0, found.trajectory.duration, 500)))
    assert distance_from_line(X[:, :3, 3], A[:3, 3], B[:3, 3]).max() <= 1e-3
    assert np.abs(X[:, :3, 2] - A[:3, 2]).max() < 5e-3  # the axis of the turn is that of the tool


@pytest.mark.parametrize("x", [2000.0, 1e5, 1e9, 1e300])
def test_far_away_goals_fail_at_once(stanford: Arm, x: float) -> None:
    """A goal that is far out is refused by its own pose, whatever lies between, and not by the millionth knot."""
    q = start(stanford, at(0.45, 0, 0.25))

    with pytest.raises(StageError) as caught:
        plan(stanford, q, [StageGoal(kind="LINE", poses=np.array([at(x, 0, 0.05)]))], Manner())

    assert caught.value.obstacle.fraction == 1.0
    assert caught.value.obstacle.certain
    assert (caught.value.stage, caught.value.obstacle.pose) == (0, 0)


def test_through_frames_without_a_stop(stanford: Arm) -> None:
    """The hand passes every frame of a SPLINE exactly, moving, and rests only at the ends."""
    poses = [at(0.45, 0.15, 0.06), at(0.5, 0.05, 0.16), at(0.5, -0.05, 0.16), at(0.45, -0.15, 0.02)]
    path = Path(poses=poses)

    found = through(stanford, path, start(stanford, poses[0]), deviation=1e-3, speed=100)

    t = np.linspace(0, found.trajectory.duration, 20001)
    p = forward(stanford, found.trajectory(t))[:, :3, 3]
    speed = np.linalg.norm(np.gradient(p, t, axis=0), axis=-1)
    for frame in poses[1:-1]:
        k = np.linalg.norm(p - frame[:3, 3], axis=-1).argmin()
        assert np.linalg.norm(p[k] - frame[:3, 3]) < 1e-4
        assert speed[k] > 0.05
    np.testing.assert_allclose(found.trajectory([0, found.trajectory.duration], 1), 0, atol=1e-12)
    assert found.certificate.deviation <= 20e-3


def test_limit_on_the_way(stanford: Arm) -> None:
    """A line pulled straight towards the base folds the boom to its lower limit; joint 3 and the place are named."""
    A = homogeneous(rotation_from_vector([0, np.pi / 2, 0]), (0.9, 0.15367, 0.4125))
    B = homogeneous(A[:3, :3], (0.35, 0.15367, 0.4125))

    with pytest.raises(StageError, match=r"joint 3 would be at .* mm beyond its limit 140\.0 mm") as caught:
        plan(stanford, start(stanford, A), [StageGoal(kind="LINE", poses=B[None])], Manner())

    assert caught.value.obstacle.cause == "limits"
    assert caught.value.obstacle.fraction == 1.0  # the goal itself is beyond the limit


def test_line_past_a_singularity() -> None:
    """A line on which the straightened wrist passes a hair's breadth from its singularity is refused with the cause.

    Joint 4 would have to turn half round within millimetres; its limits are taken away here so that the singularity
    alone stands in the way. With the wrist flipped beforehand, or well beside the singularity, the line is easy.
    """
    arm = load_arm("puma560-seed")
    free = attrs.evolve(
        arm, joints=[attrs.evolve(j, limits=attrs.evolve(j.limits, lower=-7, upper=7)) for j in arm.joints]
    )
    aside = 0.1 * np.array([-np.sin(0.1), np.cos(0.1), 0])

    def line(q5: float) -> tuple[Array, Array]:
        X = forward(free, [0.1, -0.5, 0.8, 0, q5, 0])
        A, B = (homogeneous(X[:3, :3], X[:3, 3] + side * aside) for side in (-1, 1))
        return inverse(free, A, [0.1, -0.5, 0.8, 0, q5, 0]).best.q, B

    with pytest.raises(
        PathError, match=r"singular there \(wrist\), joint [46] would have to move \d+ times as fast as its limit"
    ) as caught:
        coarse_line(free, *line(5e-3), deviation=1e-4, speed=100)

    assert caught.value.cause == "singular"
    assert 0.4 < caught.value.fraction < 0.6
    assert coarse_line(free, *line(0.3), deviation=1e-4, speed=100).certificate.deviation <= 1e-4


def test_stages_join(stanford: Arm) -> None:
    """Every stage of a move begins in the configuration where the last one ended, and lasts whole servo periods."""
    q = start(stanford, at(0.45, 0, 0.25))
    goals = [
        StageGoal(kind="PTP", poses=np.array([at(0.4, 0.15, 0.15)])),
        StageGoal(kind="LINE", poses=np.array([at(0.4, 0.15, 0.05)])),
        StageGoal(kind="SPLINE", poses=np.array([at(0.5, 0.05, 0.16), at(0.45, -0.15, 0.1)])),
    ]

    stages = plan(stanford, q, goals, Manner(period=4e-3))

    for stage, goal in zip(stages, goals, strict=True):
        np.testing.assert_allclose(stage.trajectory(0.0), q, atol=1e-12)
        q = stage.trajectory(stage.trajectory.duration)
        np.testing.assert_allclose(forward(stanford, q), goal.poses[-1], atol=POSE)
        assert stage.trajectory.duration / 4e-3 == pytest.approx(round(stage.trajectory.duration / 4e-3), abs=1e-9)
    assert [stage.kind for stage in stages] == ["PTP", "LINE", "SPLINE"]
    assert stages[1].length == pytest.approx(0.1, abs=1e-9)


def test_another_configuration_is_tried(rng: np.random.Generator) -> None:
    """Where a line cannot go on from the nearest configuration, the move ends its first stage in another one.

    The case is searched for: a configuration whose line fails, with another one of the same pose whose line works.
    """
    arm = load_arm("puma560-seed")
    for q in random_configurations(arm, rng, 400):
        A = forward(arm, q)
        B = A @ homogeneous(np.eye(3), (0.0, 0.0, -0.25))
        outcomes = []
        for branch in inverse(arm, A, q).allowed:
            try:
                coarse_line(arm, branch.q, B, deviation=1e-3, speed=100)
                outcomes.append(True)
            except PathError:
                outcomes.append(False)
        if outcomes and not outcomes[0] and any(outcomes):
            break
    else:
        pytest.fail("no such case among the random configurations")

    goals = [StageGoal(kind="PTP", poses=A[None]), StageGoal(kind="LINE", poses=B[None])]
    _, line = plan(arm, q, goals, Manner())

    np.testing.assert_allclose(forward(arm, line.trajectory(line.trajectory.duration)), B, atol=POSE)


def test_unreachable_stage_is_named(stanford: Arm) -> None:
    """The error of a move says which stage and which of its poses cannot be had, and why."""
    q = start(stanford, at(0.45, 0, 0.25))
    goals = [
        StageGoal(kind="PTP", poses=np.array([at(0.4, 0.15, 0.15)])),
        StageGoal(kind="SPLINE", poses=np.array([at(0.5, 0.05, 0.16), at(3.0, 0.0, 0.1)])),
    ]

    with pytest.raises(StageError, match=r"beyond its limit 1117\.6 mm") as caught:
        plan(stanford, q, goals, Manner())

    stopped = caught.value.obstacle
    assert (caught.value.stage, stopped.pose, stopped.cause) == (1, 1, "limits")


def test_deviation_must_be_positive(stanford: Arm) -> None:
    """A line cannot be kept to nothing."""
    with pytest.raises(InvalidValueError, match="deviation: expected 1e-09 m or more"):
        place_knots(stanford, Path(poses=[at(0.5, 0, 0.1), at(0.5, 0.1, 0.1)]), deviation=0, speed=100)


def test_the_first_obstacle_of_the_nearest_configuration(stanford: Arm) -> None:
    """What stops a line is told with joint, fraction, length and place, and the place lies on the line."""
    q = start(stanford, at(0.3, 0.3, 0.1))

    with pytest.raises(StageError) as caught:
        plan(stanford, q, [StageGoal(kind="LINE", poses=at(-0.3, -0.3, 0.1)[None])], Manner())

    stopped = caught.value.obstacle
    assert (stopped.cause, stopped.joint, stopped.certain) == ("limits", 3, False)
    assert stopped.length == pytest.approx(np.hypot(0.6, 0.6))
    assert stopped.along == pytest.approx(stopped.fraction * np.hypot(0.6, 0.6))
    x = 0.3 - 0.6 * stopped.fraction
    np.testing.assert_allclose(stopped.place, (x, x, 0.1), atol=POSE)


def test_a_configuration_with_a_free_line_comes_before_a_detour(rng: np.random.Generator) -> None:
    """Where another configuration has the line free, it is run, without a detour although one was allowed."""
    arm = load_arm("puma560-seed")
    tried = 0
    for q in random_configurations(arm, rng, 400):
        A = forward(arm, q)
        B = A @ homogeneous(np.eye(3), (0.0, 0.0, -0.25))
        goals = [StageGoal(kind="PTP", poses=A[None]), StageGoal(kind="LINE", poses=B[None])]
        try:
            plan(arm, q, goals[1:], Manner())
        except StageError:
            pass
        else:
            continue
        try:
            plain = plan(arm, q, goals, Manner())
        except StageError:
            continue
        tried += 1
        asked = plan(arm, q, goals, Manner(around="via"))
        assert asked[1].detour is None
        for one, other in zip(plain, asked, strict=True):
            np.testing.assert_array_equal(one.trajectory.coefficients, other.trajectory.coefficients)
        if tried == 3:
            break
    assert tried == 3
