"""Past several frames without a stop: how far off the straight legs, how fast, and how smoothly."""

from pathlib import Path as File
from typing import Literal

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import IncapableArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.chain import chain
from armwright.motion.continuity_report import continuity
from armwright.motion.efforts import slowing_for_efforts
from armwright.motion.plan import Manner, PlannedStage, StageError, StageGoal, plan
from armwright.motion.solver import solver_of
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from oracles.legs import beside_legs, turns_beside_legs
from samples import Sample

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

CORNER = 0.02
# What a corner may miss in orientation for each metre that it may miss in position [rad/m].
TURN = 5.0
MIDDLE = min(5e-4, CORNER / 10)
LENGTHS = (0.02, 0.6)
LOOKS = 4000
SEVEN = File(__file__).parents[2] / "examples" / "seven_joints.urdf"
# So many times as long a run past wider corners may take: what the grid of the timing leaves open.
NO_SLOWER = 1.002
DOWN = np.diag((1.0, -1.0, -1.0))
ROUNDING = 1e-9
# What a stage says to be off its legs is an upper bound, at most so much above what is seen.
TIGHT, HAIR = 1.5, CORNER / 1000


def by_via(arm: Arm, q: Array, X: Array, corner: float | None = CORNER, speed: float = 100.0) -> PlannedStage:
    return plan(arm, q, [StageGoal(kind="SPLINE", poses=X[1:], corner=corner)], Manner(speed=speed))[0]


def with_stops(arm: Arm, q: Array, X: Array, speed: float = 100.0) -> float:
    """How long the same legs take as straight lines, one by one [s]."""
    goals = [StageGoal(kind="LINE", poses=Y[None]) for Y in X[1:]]
    return sum(stage.trajectory.duration for stage in plan(arm, q, goals, Manner(speed=speed)))


def arm_called(name: str) -> Arm:
    """An arm of the catalogue, or the example of seven joints, with what its file does not say."""
    if name != "seven joints":
        return load_arm(name)
    arm = load_arm(SEVEN)
    joints = [attrs.evolve(j, limits=attrs.evolve(j.limits, acceleration=5.0)) for j in arm.joints]
    return attrs.evolve(arm, joints=joints, reach=1.0, tool_speed=1.0)


def reached(arm: Arm, q: Array, X: Array, Y: Array) -> bool:
    """Whether an arm at q, the pose X, has a configuration inside its limits at Y; of a redundant arm the nearest."""
    if arm.n <= 6:
        return bool(inverse(arm, Y).allowed)
    found, off = chain(solver_of(arm), np.stack([X, Y]), q)
    return off is None and bool(((found >= arm.limits.lower) & (found <= arm.limits.upper)).all())


def random_way(arm: Arm, rng: np.random.Generator) -> tuple[Array, Array]:
    """A configuration, and poses from there past 1 to 6 others; half of the paths rotate the tool."""
    vias, turning = int(rng.integers(1, 7)), bool(rng.integers(2))
    lower, upper = np.maximum(arm.limits.lower, -3.0), np.minimum(arm.limits.upper, 3.0)
    while True:
        q = rng.uniform(lower, upper)
        X = [forward(arm, q)]
        for _ in range(40 * vias):
            way = rng.normal(size=3)
            way *= np.exp(rng.uniform(*np.log(LENGTHS))) / np.linalg.norm(way)
            turn = rng.normal(size=3) * rng.choice((0.1, 0.5)) if turning else np.zeros(3)
            Y = homogeneous(X[-1][:3, :3] @ rotation_from_vector(turn), X[-1][:3, 3] + way)
            if reached(arm, q, X[0], Y):
                X.append(Y)
            if len(X) == vias + 2:
                return q, np.stack(X)


def faults(arm: Arm, stage: PlannedStage, X: Array) -> list[str]:
    """What a path past frames does that it should not, by where the tool is seen alone."""
    run, found = stage.trajectory, []
    hand = forward(arm, run(np.linspace(0, run.duration, LOOKS)))
    places = beside_legs(hand, X, CORNER)
    turns = [leg for leg in turns_beside_legs(hand, X, TURN * CORNER) if leg is not None]
    for legs, unit, what in ((places, 1.0, "position"), (turns, TURN, "orientation")):
        for leg in legs:
            if leg.farthest > unit * CORNER:
                found.append(f"{what} off its leg by {leg.farthest:.4g}")
            if leg.middle > unit * MIDDLE:
                found.append(f"{what} off the middle of its leg by {leg.middle:.4g}")
            if max(leg.turns) > 1:
                found.append(f"distance in {what} turns {leg.turns} times")
    if max(leg.missed for leg in places) > CORNER:
        found.append("a frame is passed too far off")
    seen, said = max(leg.farthest for leg in places), stage.deviation or 0.0
    if not seen <= said <= TIGHT * seen + HAIR:
        found.append(f"the stage says {said:.6g} off, seen are {seen:.6g}")
    return found


@pytest.mark.share(0.02)
@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5", "seven joints"])
@pytest.mark.drawn(0.34)
def test_random_paths_are_smooth_and_never_slower(name: str, sample: Sample) -> None:
    """Beside each leg the tool swings out at its ends alone, and the path is no slower than the legs with stops."""
    arm = arm_called(name)
    count = failures = stops = 0
    slowest = middle = 0.0
    for rng in sample.cases(100):
        while True:
            q, X = random_way(arm, rng)
            try:
                lasting = with_stops(arm, q, X)
            except StageError:
                continue
            break
        stage = by_via(arm, q, X)
        count, stops = count + 1, stops + ("stop" in stage.slowed)
        found = faults(arm, stage, X) if "stop" not in stage.slowed else []
        run = stage.trajectory
        if run.duration > lasting * (1 + ROUNDING):
            found.append(f"slower than with stops: {run.duration:.3f} s, {lasting:.3f} s")
        if continuity(run).order < 2 and "stop" not in stage.slowed:
            found.append("the acceleration jumps")
        for name_of, order in (("speed", 1), ("acceleration", 2)):
            if (run.peaks(order) > getattr(arm.limits, name_of) * (1 + ROUNDING)).any():
                found.append(f"a limit of {name_of} is passed")
        slowest = max(slowest, run.duration / lasting)
        hand = forward(arm, run(np.linspace(0, run.duration, LOOKS)))
        middle = max([middle, *(leg.middle for leg in beside_legs(hand, X, CORNER))])
        failures += bool(found)
        assert not found, found
    what = f"paths of {arm.name} past 1 to 6 frames: off the legs, turning points, limits, slower than with stops"
    sample.record(what, count, failures, part_of_time_with_stops=slowest, off_the_middle_mm=middle * 1e3, stops=stops)
    assert stops <= 0.02 * count + 2


@pytest.mark.share(0.03)
@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
@pytest.mark.drawn(0.34)
def test_wider_corners_are_no_slower(name: str, sample: Sample) -> None:
    """The farther the tool may be from the frames, the sooner it is there."""
    arm, worst, count = load_arm(name), 0.0, 0
    for rng in sample.cases(40):
        q, X = random_way(arm, rng)
        try:
            runs = [by_via(arm, q, X, corner) for corner in (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 4e-2)]
        except StageError:
            continue
        lasting = np.array([stage.trajectory.duration for stage in runs])
        # A whole number of servo ticks each.
        slower = float(((lasting[1:] - 1e-3) / np.minimum.accumulate(lasting)[:-1]).max())
        worst, count = max(worst, slower), count + 1
        assert slower <= NO_SLOWER, lasting
    sample.record(f"paths of {arm.name} with corners of 1 to 40 mm: wider and slower", count, 0, most=worst)


def corner_of_ur5() -> tuple[Arm, Array, Array]:
    """The corner at which the report's spline swings, before a straight 300 mm."""
    arm = load_arm("ur5")
    X = np.stack([homogeneous(DOWN, p) for p in ((0.45, -0.3, 0.25), (0.45, -0.15, 0.45), (0.45, 0.15, 0.45))])
    return arm, inverse(arm, X[0]).best.q, X


def test_the_spline_of_the_report_swings() -> None:
    """The X-spline through the same frames swings to both sides of the straight 300 mm behind the corner."""
    arm, q, X = corner_of_ur5()

    found = faults(arm, by_via(arm, q, X, corner=None), X)

    assert any("off the middle" in fault for fault in found)
    assert any("turns" in fault for fault in found)
    assert not faults(arm, by_via(arm, q, X), X)


def test_a_leg_that_comes_back_does_not_count() -> None:
    """Where a later leg ends inside a corner, the distance at the corner is that from the legs which meet there."""
    arm, q, X = corner_of_ur5()
    inside = homogeneous(DOWN, X[1, :3, 3] + 0.012 * np.array([0.0, 0.447, -0.894]))
    X = np.concatenate([X, inside[None]])

    stage = by_via(arm, q, X)

    corner = X[1, :3, 3]
    hand = forward(arm, stage.trajectory(np.linspace(0, stage.trajectory.duration, LOOKS)))
    passed = np.linalg.norm(hand[: LOOKS // 2, :3, 3] - corner, axis=-1).min()
    assert stage.deviation is not None
    assert stage.deviation > 0.8 * passed > 0.008
    assert not faults(arm, stage, X)


def test_speed_is_even_behind_a_corner() -> None:
    """On the straight 300 mm behind the corner the tool gathers speed once and loses it once."""
    arm, q, X = corner_of_ur5()
    run = by_via(arm, q, X).trajectory
    t = np.linspace(0, run.duration, LOOKS)
    places = forward(arm, run(t))[:, :3, 3]
    speed = np.linalg.norm(np.gradient(places, t, axis=0), axis=-1)[places[:, 1] > -0.1]

    rising = np.diff(speed)[np.abs(np.diff(speed)) > 1e-4 * speed.max()] > 0
    assert (np.diff(rising.astype(int)) != 0).sum() <= 1


def test_a_path_there_and_back() -> None:
    """A way that turns straight round comes no nearer to its frame than allowed, without a corner in time."""
    arm, _, X = corner_of_ur5()
    X = X[[0, 1, 0]]
    q = inverse(arm, X[0]).best.q

    stage = by_via(arm, q, X)

    assert continuity(stage.trajectory).order >= 2
    assert stage.trajectory.duration <= with_stops(arm, q, X)
    hand = forward(arm, stage.trajectory(np.linspace(0, stage.trajectory.duration, LOOKS)))[:, :3, 3]
    assert np.linalg.norm(hand - X[1, :3, 3], axis=-1).min() <= CORNER


def test_tiny_legs_beside_long_ones() -> None:
    """A leg of a millimetre between long ones takes no longer without a stop, and neither do equal frames."""
    arm, q, X = corner_of_ur5()
    for shift in (0.0, 1e-10, 1e-6, 1e-4, 3e-4, 1e-3, 5e-3):
        Y = np.stack([X[0], X[1], homogeneous(DOWN, X[1, :3, 3] + (shift, 0, 0)), X[2]])
        stage = by_via(arm, q, Y)

        assert stage.trajectory.duration <= with_stops(arm, q, Y)
        assert stage.deviation is not None
        assert stage.deviation <= CORNER
        assert continuity(stage.trajectory).order >= 2
        np.testing.assert_allclose(forward(arm, stage.trajectory(stage.trajectory.duration)), Y[-1], atol=1e-8)


def test_very_different_turns() -> None:
    """Legs that turn the tool by half a turn, a leg on the spot and legs that do not turn go into one another."""
    arm, q, X = corner_of_ur5()
    turned = [
        homogeneous(rotation_from_vector([0, 0, a]) @ DOWN, p)
        for a, p in zip((0, 0, 2.0, 2.0), X[[0, 1, 1, 2], :3, 3], strict=True)
    ]
    Y = np.stack(turned)

    stage = by_via(arm, q, Y)

    assert not faults(arm, stage, Y)
    assert stage.trajectory.duration <= with_stops(arm, q, Y)
    assert continuity(stage.trajectory).order >= 2


def test_speed_changes_the_timing_alone() -> None:
    """At a tenth of the speed the joints pass the same places, ten times as late or somewhat less."""
    arm, q, X = corner_of_ur5()
    fast, slow = by_via(arm, q, X).trajectory, by_via(arm, q, X, speed=10.0).trajectory

    assert 3 < slow.duration / fast.duration < 10.5
    there = forward(arm, fast(np.linspace(0, fast.duration, 400)))[:, :3, 3]
    dense = forward(arm, slow(np.linspace(0, slow.duration, 20_000)))[:, :3, 3]
    assert max(np.linalg.norm(dense - p, axis=-1).min() for p in there) < 1e-4


@pytest.mark.parametrize("corner", [1e-4, 1e-3, 5e-3, 0.1])
def test_the_corner_is_what_was_asked(corner: float) -> None:
    """Whatever is allowed, the tool passes the frame within it, and takes no longer than with a stop there."""
    arm, q, X = corner_of_ur5()
    stage = by_via(arm, q, X, corner=corner)

    hand = forward(arm, stage.trajectory(np.linspace(0, stage.trajectory.duration, 5 * LOOKS + 1)))
    missed = np.linalg.norm(hand[:, :3, 3] - X[1, :3, 3], axis=-1).min()
    farthest = max(leg.farthest for leg in beside_legs(hand, X, corner))
    assert stage.deviation is not None
    assert missed <= corner + ROUNDING
    assert farthest <= stage.deviation <= min(TIGHT * farthest, corner + ROUNDING)
    assert stage.trajectory.duration <= with_stops(arm, q, X)


def test_report_of_a_corner_after_a_rotation_in_place() -> None:
    """Beside a leg on which the tool hardly moves, as it rotates, rates along the other leg are no distance from it."""
    arm, q, X = corner_of_ur5()
    turned = homogeneous(rotation_from_vector([0, 0, 0.6]) @ DOWN, X[1, :3, 3] + 0.25 * (X[1, :3, 3] - X[0, :3, 3]))
    Y = np.stack([X[0], X[1], turned])

    stage = by_via(arm, q, Y)

    assert stage.deviation is not None
    assert stage.deviation < HAIR


@pytest.mark.parametrize("tiny", [1e-4, 1e-5, 1e-7])
@pytest.mark.parametrize("kind", ["SPLINE", "BLEND"])
def test_tiny_corners_take_no_more_knots(kind: Literal["SPLINE", "BLEND"], tiny: float) -> None:
    """However tight the corners, knots are put there and not on all of the legs, and the bound stays true."""
    arm, q, X = corner_of_ur5()
    by_corner, by_blend = (max(tiny, 1e-5), None) if kind == "SPLINE" else (None, tiny)
    goal = StageGoal(kind=kind, poses=X[1:], corner=by_corner, blend=by_blend)

    stage = plan(arm, q, [goal], Manner(deviation=1e-3 if kind == "BLEND" else max(tiny / 20, 1e-6)))[0]

    assert "stop" not in stage.slowed
    assert stage.certificate is not None
    assert stage.certificate.knots < 250
    hand = forward(arm, stage.trajectory(np.linspace(0, stage.trajectory.duration, 5 * LOOKS + 1)))
    assert stage.deviation is not None
    assert max(leg.farthest for leg in beside_legs(hand, X, tiny)) <= stage.deviation
    assert continuity(stage.trajectory).order >= 2


def test_without_limits_of_acceleration() -> None:
    """An arm whose joints have no limit of acceleration gathers its speed smoothly all the same."""
    arm, q, X = corner_of_ur5()
    free = attrs.evolve(
        arm, joints=[attrs.evolve(j, limits=attrs.evolve(j.limits, acceleration=np.inf)) for j in arm.joints]
    )

    assert continuity(by_via(free, q, X).trajectory).order >= 2


def puma_beside_its_wrist(off: float) -> tuple[Arm, Array, Array]:
    """A way of a PUMA down and aside; the leg down passes a straight wrist at a distance."""
    arm = load_arm("puma560-seed")
    level = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    y = 0.149 + off
    X = np.stack([homogeneous(level, p) for p in ((0.48, y, -0.27), (0.48, y, -0.47), (0.48, y + 0.1, -0.47))])
    return arm, inverse(arm, X[0], np.zeros(6)).best.q, X


def test_a_start_beside_a_singularity() -> None:
    """Where a joint is fast beside a singularity the tool is slowed there, and does not stop at every frame for it."""
    arm = load_arm("ur5")
    q = np.radians([20.0, -60.0, 80.0, -20.0, 0.2, 30.0])
    X = [forward(arm, q)]
    for way in ((0.0, 0.1, -0.05), (0.1, 0.0, 0.05)):
        X.append(homogeneous(X[-1][:3, :3], X[-1][:3, 3] + way))

    stage = by_via(arm, q, np.stack(X))

    assert stage.obstacle is None
    assert "stop" not in stage.slowed
    assert not faults(arm, stage, np.stack(X))


def test_what_cannot_be_rounded_is_told() -> None:
    """Where corners cannot be rounded, the arm stops at every frame, and the stage tells on which leg and why."""
    arm, q, X = puma_beside_its_wrist(3e-4)

    stage = by_via(arm, q, X)

    assert stage.slowed == "with a stop at every frame: the arm cannot follow rounded corners"
    assert stage.obstacle is not None
    assert (stage.obstacle.pose, stage.obstacle.cause) == (0, "singular")
    assert "wrist" in stage.obstacle.reason


def weaker(arm: Arm, part: float) -> Arm:
    """The arm with motors that give so much less."""
    joints = [attrs.evolve(j, limits=attrs.evolve(j.limits, effort=part * j.limits.effort)) for j in arm.joints]
    return attrs.evolve(arm, joints=joints)


@pytest.mark.parametrize("kind", ["SPLINE", "BLEND"])
def test_efforts_slow_it(kind: str) -> None:
    """A way past frames is slowed for the motors where that helps, and a SPLINE is never slower than with stops."""
    arm, q, X = corner_of_ur5()
    goal = StageGoal(
        kind="SPLINE" if kind == "SPLINE" else "BLEND",
        poses=X[1:],
        corner=CORNER if kind == "SPLINE" else None,
        blend=None if kind == "SPLINE" else 0.04,
    )
    weak = weaker(arm, 0.4)
    free, slowed = (plan(one, q, [goal], Manner())[0].trajectory for one in (arm, weak))

    before, after = (slowing_for_efforts(weak, run).factor for run in (free, slowed))
    assert before > 1
    assert after < before
    assert slowed.duration > free.duration
    if kind == "SPLINE":
        assert slowed.duration <= with_stops(weak, q, X)


def test_too_weak_to_stand() -> None:
    """Where weight alone is too much for a motor no slowing helps: a SPLINE is planned as it is, as its legs are."""
    arm, q, X = corner_of_ur5()

    free, weak = (by_via(one, q, X) for one in (arm, weaker(arm, 0.01)))

    assert weak.trajectory.duration == free.trajectory.duration
    with pytest.raises(IncapableArmError, match="a slower motion is infeasible too"):
        plan(weaker(arm, 0.01), q, [StageGoal(kind="BLEND", poses=X[1:], blend=0.04)], Manner())
