"""Joint moves and Cartesian moves through poses."""

from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.errors import InvalidValueError, KindError, RotationWarning, ShapeError, UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion import detour
from armwright.motion.blends import blended
from armwright.motion.continuity_report import continuity
from armwright.motion.limit_utilization import limit_use, slowing_for_limits
from armwright.motion.moves import cartesian_move, exact_poses, joint_move, stopping_move
from armwright.motion.obstruction import PathError
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector
from samples import WHOLE, Sample

ROUNDING = 1e-9
# The three poses of the project on the PUMA's trajectories: joint positions [deg] and poses as printed [m].
SEED_Q = np.radians(
    [
        [-100.4577, 70.6108, 48.3997, 0.0, 60.9896, 29.2746],
        [-52.1158, -1.4358, 30.2060, 58.6166, 11.4781, 3.2859],
        [0.0955, 65.7969, 14.3196, 15.3377, -20.1730, 29.5160],
    ]
)
SEED_POSES = homogeneous(
    [
        [[0.64, 0.77, 0], [0.77, -0.64, 0], [0, 0, -1]],
        [[0.87, -0.1, 0.48], [0.29, 0.9, -0.34], [-0.4, 0.43, 0.81]],
        [[0.41, -0.29, 0.87], [0.69, 0.71, -0.09], [-0.6, 0.64, 0.49]],
    ],
    [[0.05, -0.55, -0.6], [0.5, -0.4, 0.4], [0.6, 0.15, -0.3]],
)
SEED_TIMES, SEED_BLEND = (0.0, 0.5, 1.0), 0.2


@pytest.fixture(scope="module")
def puma() -> CompiledArm:
    """The PUMA, compiled."""
    return compile_arm(load_arm("puma560-seed"))


def some_poses(arm: Arm, rng: np.random.Generator, count: int = 4) -> tuple[Array, Array]:
    """Return poses not far from each other, and joint positions at the first one."""
    lower, upper = arm.limits.lower, arm.limits.upper
    q = rng.uniform(0.7 * lower + 0.3 * upper, 0.3 * lower + 0.7 * upper)
    X = np.repeat(forward(arm, q)[None], count, axis=0)
    X[1:, :3, 3] += rng.normal(size=(count - 1, 3)) * 0.08
    X[1:, :3, :3] = X[1:, :3, :3] @ rotation_from_vector(rng.normal(size=(count - 1, 3)) * 0.2)
    return X, q


def test_the_seeds_configurations(puma: CompiledArm) -> None:
    """Through the seed's poses the configurations are the seed's, the wrist flipped at the last one as there."""
    move = joint_move(puma, forward(puma.arm, SEED_Q), SEED_TIMES, blend=SEED_BLEND, ends="running")

    np.testing.assert_allclose(move.configurations, SEED_Q, atol=ROUNDING)
    assert move.label == "left, down, no-flip -> left, down, no-flip -> left, down, flip"
    t = 0.002 * np.arange(501)
    np.testing.assert_allclose(
        move.trajectory(t), blended(SEED_TIMES, SEED_Q, SEED_BLEND, ends="running")(t), atol=ROUNDING
    )


def test_the_seeds_poses_as_printed(puma: CompiledArm) -> None:
    """Of printed rotations the nearest are taken, with a warning each; beside a singularity that is a degree."""
    with pytest.warns(
        RotationWarning, match=r"pose \d: its rotation matrix is not orthonormal \(error 0\.00\d+\); the nearest"
    ) as caught:
        move = joint_move(puma, SEED_POSES, SEED_TIMES, blend=SEED_BLEND, ends="running")

    assert [str(one.message)[5] for one in caught] == ["1", "2", "3"]
    assert caught[0].filename == __file__
    np.testing.assert_allclose(move.configurations, SEED_Q, atol=np.radians(1.0))


@pytest.mark.filterwarnings("ignore::armwright.errors.RotationWarning")
@pytest.mark.parametrize("orientation", ["geodesic", "zyz"])
def test_the_seeds_cartesian_move_has_no_branch(puma: CompiledArm, orientation: str) -> None:
    """The seed never solved its Cartesian move: the only branch inside the limits at A meets the wrist before C."""
    with pytest.raises(
        PathError,
        match=r"no single branch of the inverse kinematics can be followed to the last pose. left, down, no-flip: at",
    ) as stop:
        cartesian_move(puma, SEED_POSES, SEED_TIMES, blend=SEED_BLEND, ends="running", orientation=orientation)  # type: ignore[arg-type]

    assert stop.value.segment == 1
    assert stop.value.joint in {4, 6}
    assert 0.65 < stop.value.fraction < 0.8


def test_as_fast_as_the_limits_allow(puma: CompiledArm) -> None:
    """Without times a joint move keeps all limits and exhausts one; it begins and ends at rest."""
    move = joint_move(puma, forward(puma.arm, SEED_Q))

    uses = limit_use(puma, move.trajectory)
    assert max(use.max() for use in uses.values()) == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(move.trajectory([0, move.trajectory.duration], 1), 0, atol=ROUNDING)
    np.testing.assert_allclose(move.trajectory(move.trajectory.duration), SEED_Q[-1], atol=ROUNDING)
    assert move.passing_distances[1] > 0
    assert move.passing_distances[0] == move.passing_distances[2] == 0


def test_slowed_until_the_limits_hold(puma: CompiledArm) -> None:
    """The seed's second asks for 26 times the shoulder's acceleration; slowed as much as is said, it just keeps it."""
    move = joint_move(puma, forward(puma.arm, SEED_Q), SEED_TIMES, blend=SEED_BLEND)

    factor, because = slowing_for_limits(puma, move.trajectory)
    slow = move.slowed(factor)

    assert because == ("acceleration", 1)
    uses = limit_use(puma, slow.trajectory)
    assert uses["acceleration"][1] == pytest.approx(1.0)
    assert max(use.max() for use in uses.values()) <= 1 + ROUNDING
    np.testing.assert_allclose(slow.trajectory(slow.times), move.trajectory(move.times), atol=ROUNDING)


@pytest.mark.share(0.25)
@pytest.mark.parametrize("orientation", ["geodesic", "zyz"])
@pytest.mark.parametrize("ends", ["rest", "running"])
@pytest.mark.parametrize("name", ["puma560-seed", "ur5", *["stanford"] * WHOLE])
@pytest.mark.drawn(0.25)
def test_tool_follows_the_planned_path(name: str, ends: str, orientation: str, sample: Sample) -> None:
    """On random moves no sample, far denser than the certificate's, is out of bounds; the branch stays what it is."""
    arm = compile_arm(load_arm(name))
    run = 0
    for rng in sample.cases(30):
        X, q = some_poses(arm.arm, rng)
        deviation = 10 ** rng.uniform(-5, -3)
        try:
            move = cartesian_move(
                arm,
                X,
                [0, 1, 1.8, 3],
                near=q,
                ends=ends,  # type: ignore[arg-type]
                orientation=orientation,  # type: ignore[arg-type]
                deviation=deviation,
            )
        except PathError:
            continue
        run += 1
        t = np.linspace(0, 3, 20_000)
        assert move.tool_path is not None
        assert move.certificate is not None
        hand, planned = forward(arm.arm, move.trajectory(t)), move.tool_path(t)
        off = np.linalg.norm(hand[:, :3, 3] - planned[:, :3, 3], axis=-1).max()
        turn = angle_between(planned[:, :3, :3], hand[:, :3, :3]).max()
        certificate = move.certificate
        assert 0.99 * certificate.deviation_sampled - ROUNDING <= off <= certificate.deviation + ROUNDING
        assert certificate.deviation <= deviation
        # Angles near 0 are found to the root of the rounding.
        assert 0.99 * certificate.rotation_sampled - 1e-7 <= turn <= certificate.rotation + 1e-7
        assert certificate.rotation <= 5 * deviation
        assert np.linalg.norm(move.tool_path(certificate.worst_time)[:3, 3] - certificate.worst_position) < ROUNDING
        assert continuity(move.trajectory).order >= 2
        lowest, highest = move.trajectory.extremes(0)
        assert (lowest >= arm.arm.limits.lower - ROUNDING).all()
        assert (highest <= arm.arm.limits.upper + ROUNDING).all()
        for at in (0.4, 1.5, 2.9):
            labels = [b.label for b in inverse(arm.arm, move.tool_path(at), move.trajectory(at)).branches]
            assert move.label in labels
    sample.record(f"moves of the {name} with {ends} ends, {orientation}, at 20,000 samples", run, 0)
    assert run >= 6 or not sample.whole


def test_via_poses_are_missed_by_the_blend(puma: CompiledArm) -> None:
    """The hand passes a via pose at the distance that is told, 3/16 of blend times change of velocity at most."""
    X = np.repeat(forward(puma.arm, [0.6, 0.2, 0.6, 0.3, 0.9, 0.1])[None], 3, axis=0)
    X[1, :3, 3] += (0.0, -0.2, 0.0)
    X[2, :3, 3] += (0.0, -0.2, -0.2)

    move = cartesian_move(puma, X, [0, 2, 4], blend=0.5, ends="running", deviation=1e-5)

    hand = forward(puma.arm, move.trajectory(np.linspace(0, 4, 4001)))[:, :3, 3]
    nearest = np.linalg.norm(hand - X[1, :3, 3], axis=-1).min()
    assert nearest == pytest.approx(move.passing_distances[1], abs=2e-5)
    assert move.passing_distances[1] == pytest.approx(3 / 16 * 0.5 * 0.1 * np.sqrt(2))


def test_times_by_the_tool(puma: CompiledArm) -> None:
    """Without times the tool runs at the speed of the tool, or slower where a limit asks for it."""
    X = np.repeat(forward(puma.arm, [0.6, 0.2, 0.6, 0.3, 0.9, 0.1])[None], 2, axis=0)
    X[1, :3, 3] += (0.0, -0.3, 0.0)

    move = cartesian_move(puma, X)

    assert move.times[1] > 0.3 / puma.arm.tool_speed
    uses = limit_use(puma, move.trajectory)
    assert max(use.max() for use in uses.values()) == pytest.approx(1.0, abs=1e-6)
    assert move.tool_path is not None
    np.testing.assert_allclose(move.tool_path(move.times)[:, :3, 3], X[:, :3, 3], atol=ROUNDING)
    assert move.certificate is not None
    assert move.certificate.holds
    assert move.certificate.factor > 1
    assert "times slower than the tool speed requires, limited by the acceleration of joint" in str(move.certificate)


def test_a_certificate_that_does_not_hold(puma: CompiledArm) -> None:
    """Times that ask too much are kept, and the certificate says which limit is passed and by how much."""
    X = np.repeat(forward(puma.arm, [0.6, 0.2, 0.6, 0.3, 0.9, 0.1])[None], 2, axis=0)
    X[1, :3, 3] += (0.0, -0.3, 0.0)

    certificate = cartesian_move(puma, X, [0, 0.5]).certificate

    assert certificate is not None
    assert not certificate.holds
    assert str(certificate).startswith("DOES NOT HOLD: tool within 0.0")
    joint, part = certificate.use("acceleration")
    assert part > 10
    assert f"joint {joint + 1} uses {part:.0%} of its acceleration" in str(certificate)


def test_seven_joints() -> None:
    """An arm without a closed form follows the tool's path as well."""
    arm = load_arm(Path(__file__).parents[2] / "examples" / "seven_joints.urdf")
    q = np.array([0.1, 0.5, 0.2, 1.2, 0.3, 1.0, 0.2])
    X = np.repeat(forward(arm, q)[None], 3, axis=0)
    X[1, :3, 3] += (-0.05, 0.1, 0.0)
    X[2, :3, 3] += (-0.05, 0.1, -0.1)

    move = cartesian_move(arm, X, [0, 1, 2], near=q, deviation=1e-3)

    t = np.linspace(0, 2, 500)
    assert move.tool_path is not None
    assert np.abs(forward(arm, move.trajectory(t)) - move.tool_path(t))[:, :3, 3].max() <= 1e-3


@pytest.mark.parametrize("by", ["via", "damped"])
def test_stops_and_detours(puma: CompiledArm, by: str) -> None:
    """Where the blended move has no branch, stops and a way round lead to the last pose, inside the limits."""
    X = forward(puma.arm, SEED_Q[1:])

    move = stopping_move(puma, X, method=by)  # type: ignore[arg-type]

    np.testing.assert_allclose(forward(puma.arm, move.trajectory(move.times)), X, atol=1e-5)
    uses = limit_use(puma, move.trajectory)
    assert max(use.max() for use in uses.values()) <= 1 + 1e-6
    assert len(move.detours) == 1
    assert move.detours[0].method == by


@pytest.mark.filterwarnings("ignore::armwright.errors.RotationWarning")
def test_no_detour(puma: CompiledArm, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no way round is found either, both poses of the way are named with what stops it."""
    # Poses beside the line alone do not help from B to C.
    monkeypatch.setattr(detour, "_ON_THE_WAY", ())
    monkeypatch.setattr(detour, "_SCATTER", ())
    with pytest.raises(PathError, match=r"^from pose 2 to pose 3: on the line near \(.*\) mm from the base joint 4"):
        stopping_move(puma, SEED_POSES)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_one_branch_where_there_is_one(seed: int) -> None:
    """A joint move through poses of one branch keeps to one branch, or finds a shorter one that also does."""
    arm = load_arm("puma560-seed")
    rng = np.random.default_rng(seed)
    lower, upper = arm.limits.lower, arm.limits.upper
    Q = rng.uniform(0.6 * lower + 0.4 * upper, 0.4 * lower + 0.6 * upper, (3, 6))
    labels = {inverse(arm, forward(arm, q), q).best.label for q in Q}

    move = joint_move(arm, forward(arm, Q), [0, 2, 4])

    if len(labels) == 1:
        assert "->" not in move.label
    for X, q in zip(move.poses, move.configurations, strict=True):
        np.testing.assert_allclose(forward(arm, q), X, atol=1e-8)
        assert ((lower <= q) & (q <= upper)).all()


def test_poses_that_are_none(puma: CompiledArm) -> None:
    """Each wrong pose is named by its number."""
    X = forward(puma.arm, SEED_Q).copy()
    with pytest.raises(ShapeError, match=r"poses: expected two or more poses, shape \(k, 4, 4\), got \(1, 4, 4\)"):
        joint_move(puma, X[:1])
    with pytest.raises(ShapeError, match=r"poses: .*got \(4, 4\)"):
        joint_move(puma, X[0])
    with pytest.raises(KindError, match="poses: expected numbers, got 'here'"):
        joint_move(puma, "here")
    wrong = X.copy()
    wrong[1, 0, 0] += 0.1
    with pytest.raises(InvalidValueError, match=r"pose 2: expected a rotation, orthonormal to 0\.02, .* of 0\.18"):
        exact_poses(wrong)
    wrong = X.copy()
    wrong[2, 3] = (0, 0, 0, 2)
    with pytest.raises(InvalidValueError, match=r"pose 3: expected 0 0 0 1 as the last row"):
        exact_poses(wrong)
    wrong = X.copy()
    wrong[1, 0, 3] = np.nan
    with pytest.raises(InvalidValueError, match="poses: every number must be finite"):
        exact_poses(wrong)
    far = X.copy()
    far[1, 0, 3] = 3.0
    with pytest.raises(PathError, match=r"pose 2: .*reach") as stopped:
        joint_move(puma, far)
    assert (stopped.value.cause, stopped.value.segment, stopped.value.fraction) == ("reach", 0, 1.0)


def test_times_and_blends_that_are_none(puma: CompiledArm) -> None:
    """Times must rise, blends must fit between them, and whatever else is asked for must exist."""
    X = forward(puma.arm, SEED_Q)
    with pytest.raises(InvalidValueError, match=r"times must increase, got 1 s and then 0\.5 s at point 2"):
        joint_move(puma, X, [0, 1, 0.5])
    with pytest.raises(ShapeError, match=r"times: expected 3, one per pose, got shape \(2,\)"):
        joint_move(puma, X, [0, 1])
    with pytest.raises(InvalidValueError, match="blends overlap on the segment from point 1 to point 2"):
        cartesian_move(puma, X, [0, 0.5, 1], blend=0.4)
    with pytest.raises(ShapeError, match=r"blend: expected one number, or 3, one per pose"):
        joint_move(puma, X, [0, 0.5, 1], blend=[0.1, 0.1])
    with pytest.raises(InvalidValueError, match="blend: allowed only with times"):
        joint_move(puma, X, blend=0.1)
    with pytest.raises(UnknownNameError, match="orientation"):
        cartesian_move(puma, X, [0, 1, 2], orientation="euler")  # type: ignore[arg-type]
    with pytest.raises(
        InvalidValueError, match="deviation: expected 1e-09 m or more, the closest that can be certified, got"
    ):
        cartesian_move(puma, X, [0, 1, 2], deviation=0.0)
    with pytest.raises(InvalidValueError, match=r"poses 1 and 2 coincide; omit one, or specify times"):
        cartesian_move(puma, X[[0, 0, 1]])


def test_whole_turns_that_fit(puma: CompiledArm) -> None:
    """A joint that would run over its limit starts a whole turn earlier, where its range has room for that."""
    limits = attrs.evolve(puma.arm.joints[5].limits, lower=-6.0, upper=6.0)
    joints = [*puma.arm.joints[:5], attrs.evolve(puma.arm.joints[5], limits=limits)]
    arm = attrs.evolve(puma.arm, joints=joints)
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 5.5])
    X = np.repeat(forward(arm, q)[None], 2, axis=0)
    X[1, :3, :3] = X[1, :3, :3] @ rotation_from_vector([0, 0, 2.0])

    move = cartesian_move(arm, X, [0, 2], near=q)

    assert move.configurations[0, 5] == pytest.approx(5.5 - 2 * np.pi)
    assert move.configurations[1, 5] == pytest.approx(7.5 - 2 * np.pi)


def test_a_move_of_a_day(puma: CompiledArm) -> None:
    """However long a move lasts, knots are put by what the path asks for, and the certificate holds."""
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
    X = forward(puma.arm, [q, q])
    X[1, :3, 3] += (0.1, -0.2, -0.1)

    move = cartesian_move(puma, X, [0.0, 86_400.0], near=q)

    assert move.trajectory.duration == 86_400
    assert len(move.trajectory.times) < 5000
    assert move.certificate is not None
    assert move.certificate.holds


def test_stops_at_one_and_the_same_place(puma: CompiledArm) -> None:
    """Poses that are all the same leave no way on which to stop."""
    X = forward(puma.arm, [[0.6, 0.2, 0.6, 0.3, 0.9, 0.1]] * 3)

    with pytest.raises(InvalidValueError, match="all of them coincide, so there is no path"):
        stopping_move(puma, X)
