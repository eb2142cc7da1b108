"""Poses to measure: those proposed tell an arm's errors better than poses taken by chance."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.chain import chain_of
from armwright.calibration.fitting import calibrate
from armwright.calibration.planning import INDICES, observability, plan_poses
from armwright.errors import InvalidValueError, UnknownNameError
from calibration.simulated import postures, random_errors, seen


@pytest.mark.parametrize("index", INDICES)
def test_better_than_by_chance(index: str) -> None:
    """Whatever is asked to be large is larger than with as many poses by chance, and all lie inside the limits."""
    arm = load_arm("puma560")
    plan = plan_poses(arm, 20, index=index)  # type: ignore[arg-type]

    assert getattr(plan.observability, index) > getattr(plan.by_chance, index)
    assert plan.q.shape == (20, 6)
    for joint, q in zip(arm.joints, plan.q.T, strict=True):
        assert np.all((q >= joint.limits.lower) & (q <= joint.limits.upper))


def test_indices_of_the_plan() -> None:
    """What the plan says of its poses is what its equations say."""
    arm = load_arm("ur5")
    plan = plan_poses(arm, 20)
    chain = chain_of(arm)

    kept = [chain.names.index(name) for name in plan.names]
    np.testing.assert_allclose(plan.observability, observability(chain, plan.q, kept), rtol=1e-9)
    A = chain.reach(plan.q).by_position[:, :, kept].reshape(-1, len(kept))
    assert pytest.approx(1 / np.linalg.cond(A), rel=1e-9) == plan.observability.O2


def test_planned_poses_leave_smaller_deviations() -> None:
    """With the poses proposed, the errors of an arm come out surer than with poses taken by chance, on average."""
    arm, rng = load_arm("puma560"), np.random.default_rng(4)
    chain = chain_of(arm)
    errors = random_errors(rng, chain)
    plan = plan_poses(arm, 25)
    lower, upper = (np.array([getattr(j.limits, side) for j in arm.joints]) for side in ("lower", "upper"))

    def mean_deviation(q: np.ndarray) -> float:
        found = calibrate(arm, q, seen(chain, q, errors, 5e-5, rng), base=np.eye(4), only=plan.names)
        assert found.names == plan.names
        return float(np.log(found.deviations / found.noise.length).mean())

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


def test_next_poses_see_what_the_first_did_not() -> None:
    """After poses in which one joint stood still, the next ones tell its errors; poses by chance tell them worse."""
    arm = load_arm("ntu-3r")
    rng = np.random.default_rng(0)
    before = postures(rng, arm, 20)
    before[:, 1] = 0.3

    plan = plan_poses(arm, 3, measured=before, index="O3")

    assert np.ptp(plan.q[:, 1]) > 0.5
    assert plan.observability.O3 > plan.by_chance.O3
    chain = chain_of(arm)
    kept = [chain.names.index(name) for name in plan.names]
    together = observability(chain, np.vstack([plan.q, before]), kept)
    np.testing.assert_allclose(together, plan.observability)
    assert observability(chain, before, kept).O3 < 0.2 * together.O3


def test_poses_with_turns() -> None:
    """Where turns are measured too, the turns of the tool frame are told, and half as many poses will do."""
    arm = load_arm("puma560")

    plan = plan_poses(arm, 5, turns=True)

    assert {"tool.rx", "tool.ry", "tool.rz"} <= set(plan.names)
    with pytest.raises(InvalidValueError, match=r"errors that points can tell; expected \d+ poses or more, got 5"):
        plan_poses(arm, 5)
