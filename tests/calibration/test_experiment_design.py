"""Poses to measure: those proposed tell an arm's errors better than poses taken by chance."""

import contextlib
import math

import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, JointKind
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.cross_validation import cross_validate
from armwright.calibration.experiment_design import INDICES, observability, plan_poses
from armwright.calibration.fitting import calibrate_points
from armwright.calibration.readings import readings
from armwright.errors import ContradictionError, InvalidValueError, ShapeError, UnknownNameError
from calibration.simulated import configurations, random_errors, seen
from samples import Sample


@pytest.mark.parametrize("index", INDICES)
def test_better_than_random(index: str) -> None:
    """Whatever is asked to be large is larger than with as many poses by chance, and all lie inside the limits."""
    arm = load_arm("puma560")
    plan = plan_poses(arm, 20, index=index)  # type: ignore[arg-type]

    assert getattr(plan.observability, index) > getattr(plan.random, index)
    assert plan.q.shape == (20, 6)
    for joint, q in zip(arm.joints, plan.q.T, strict=True):
        assert np.all((q >= joint.limits.lower) & (q <= joint.limits.upper))


def test_indices_of_the_plan() -> None:
    """What the plan says of its poses is what its equations say."""
    arm = load_arm("ur5")
    plan = plan_poses(arm, 20)
    chain = kinematic_chain(arm)

    kept = [chain.names.index(name) for name in plan.names]
    np.testing.assert_allclose(plan.observability, observability(chain, plan.q, kept), rtol=1e-9)
    A = chain.forward(plan.q).position_jacobian[:, :, kept].reshape(-1, len(kept))
    assert pytest.approx(1 / np.linalg.cond(A), rel=1e-9) == plan.observability.O2


def test_planned_poses_leave_smaller_deviations() -> None:
    """With the poses proposed, the errors of an arm come out surer than with poses taken by chance, on average."""
    arm, rng = load_arm("puma560"), np.random.default_rng(4)
    chain = kinematic_chain(arm)
    errors = random_errors(rng, chain)
    plan = plan_poses(arm, 25)
    lower, upper = (np.array([getattr(j.limits, side) for j in arm.joints]) for side in ("lower", "upper"))

    def mean_deviation(q: np.ndarray) -> float:
        found = calibrate_points(arm, q, seen(chain, q, errors, 5e-5, rng), base=np.eye(4), only=plan.names)
        assert found.names == plan.names
        return float(np.log(found.standard_errors / found.noise.length).mean())

    chance = [mean_deviation(lower + (upper - lower) * rng.random((25, 6))) for _ in range(5)]
    assert mean_deviation(plan.q) < np.mean(chance)


def test_the_same_every_time() -> None:
    """A seed gives the same poses; another gives others."""
    arm = load_arm("ntu-3r")

    np.testing.assert_array_equal(plan_poses(arm, 12).q, plan_poses(arm, 12).q)
    assert not np.array_equal(plan_poses(arm, 12).q, plan_poses(arm, 12, seed=1).q)


def test_what_cannot_be_planned() -> None:
    """Too few poses, too few candidates and unknown indices are told."""
    arm = load_arm("ur5")
    with pytest.raises(InvalidValueError, match="poses or more, got 3"):
        plan_poses(arm, 3)
    with pytest.raises(InvalidValueError, match="candidates: expected 30 or more, got 10"):
        plan_poses(arm, 30, candidates=10)
    with pytest.raises(UnknownNameError, match="no index 'O9'"):
        plan_poses(arm, 30, index="O9")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "lower", "upper"),
    [
        ("prismatic", 1.2, 2.0),
        ("prismatic", -3.0, -1.5),
        ("prismatic", 0.0, 3.0),
        ("prismatic", 2.0, math.inf),
        ("revolute", 3.3, 6.0),
        ("revolute", -math.inf, -4.0),
        ("revolute", -6.0, 6.0),
    ],
)
def test_limits_anywhere(kind: JointKind, lower: float, upper: float) -> None:
    """Limits that are far from 0 hold as well; where one is missing, poses go some way from the other."""
    first = Joint(kind=kind, a=0.2, alpha=np.pi / 2, limits=Limits(lower=lower, upper=upper))
    turning = Joint(kind="revolute", a=0.3, alpha=np.pi / 2)
    arm = Arm(name="far", joints=[first, turning, turning])

    q = plan_poses(arm, 30).q[:, 0]

    assert lower <= q.min() < q.max() <= upper
    assert np.ptp(q) > min(upper - lower, 2.0) / 2


def test_as_many_as_asked_for() -> None:
    """More poses than there are usually candidates may be asked for."""
    assert len(plan_poses(load_arm("ntu-3r"), 450).q) == 450


@pytest.mark.share(0.02)
@pytest.mark.parametrize(
    ("name", "fewest"), [("puma560", 10), ("puma560-seed", 10), ("ur5", 12), ("stanford", 10), ("ntu-3r", 8)]
)
@pytest.mark.drawn(0.4)
def test_enough_to_calibrate(name: str, fewest: int, sample: Sample) -> None:
    """The fewest poses that are proposed are always enough for a calibration, and to judge it; one less is refused."""
    arm = load_arm(name)
    chain = kinematic_chain(arm)
    with pytest.raises(InvalidValueError, match=f"expected {fewest} poses or more, got {fewest - 1}"):
        plan_poses(arm, fewest - 1)
    plan = plan_poses(arm, fewest)

    for rng in sample.cases(100):
        points = seen(chain, plan.q, random_errors(rng, chain), 5e-5, rng)
        found = calibrate_points(arm, plan.q, points)

        assert found.degrees_of_freedom > 0
        # A part alone may leave what looks like another arm; what it leaves is never too little.
        with contextlib.suppress(ContradictionError):
            cross_validate(arm, readings(plan.q, points))


@pytest.mark.parametrize("count", [0, -1])
def test_no_poses(count: int) -> None:
    """Beside enough that were measured before, too, there is one pose to propose or more."""
    arm = load_arm("ntu-3r")
    before = configurations(np.random.default_rng(0), arm, 20)

    with pytest.raises(InvalidValueError, match=f"count: expected 1 pose or more, got {count}"):
        plan_poses(arm, count, measured=before)


def test_measured_before_by_another_arm() -> None:
    """Configurations that were measured before have as many joints as the arm."""
    with pytest.raises(ShapeError, match="measured: expected 6 numbers on the last axis"):
        plan_poses(load_arm("puma560"), 20, measured=np.zeros((3, 5)))


def test_next_poses_see_what_the_first_did_not() -> None:
    """After poses in which one joint stood still, the next ones tell its errors; poses by chance tell them worse."""
    arm = load_arm("ntu-3r")
    rng = np.random.default_rng(0)
    before = configurations(rng, arm, 20)
    before[:, 1] = 0.3

    plan = plan_poses(arm, 3, measured=before, index="O3")

    assert np.ptp(plan.q[:, 1]) > 0.5
    assert plan.observability.O3 > plan.random.O3
    chain = kinematic_chain(arm)
    kept = [chain.names.index(name) for name in plan.names]
    together = observability(chain, np.vstack([plan.q, before]), kept)
    np.testing.assert_allclose(together, plan.observability)
    assert observability(chain, before, kept).O3 < 0.2 * together.O3


def test_poses_with_turns() -> None:
    """Where turns are measured too, the turns of the tool frame are told, and half as many poses will do."""
    arm = load_arm("puma560")

    plan = plan_poses(arm, 8, rotations=True)

    assert {"tool.rx", "tool.ry", "tool.rz"} <= set(plan.names)
    with pytest.raises(InvalidValueError, match=r"one in 5 poses is held out .* expected 10 poses or more, got 9"):
        plan_poses(arm, 9)
