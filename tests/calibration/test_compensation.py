"""A calibrated arm is sent where its tool comes right."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.compensation import inverse_calibrated
from armwright.calibration.fitting import calibrate_points
from armwright.calibration.joint_errors import compliances
from armwright.calibration.nongeometric import calibrate_nongeometric
from armwright.calibration.readings import readings
from armwright.errors import ShapeError
from armwright.spatial.rotations import rotation_vector
from calibration.simulated import configurations, random_errors, seen

NOISE = 2e-5
# What the steps end at.
MET = 1e-9


def bent(rng: np.random.Generator) -> tuple[Chain, Array]:
    """Return a PUMA whose dimensions are off and whose joints give."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm, joint_errors=compliances(arm))
    errors = random_errors(rng, chain)
    errors[-len(chain.joint_errors) :] = 1e-3
    return chain, errors


def test_places(rng: np.random.Generator) -> None:
    """Sent to compensated positions, the true arm is where it should be but for the noise; sent as said, it is not."""
    chain, errors = bent(rng)
    q = configurations(rng, chain.arm, 120)
    found = calibrate_nongeometric(chain.arm, readings(q, seen(chain, q, errors, NOISE, rng)), folds=3)
    near = configurations(rng, chain.arm, 10)
    goals = kinematic_chain(chain.arm).forward(near).position

    there = inverse_calibrated(found, goals, near)

    assert found.comparisons[1].accepted
    assert there.residual.max() < MET
    off = np.linalg.norm(chain.forward(there.q, errors).position - goals, axis=1)
    as_said = np.linalg.norm(chain.forward(near, errors).position - goals, axis=1)
    assert off.mean() < 2 * NOISE
    assert as_said.mean() > 30 * off.mean()


def test_poses(rng: np.random.Generator) -> None:
    """Poses are met in place and turn, with turns about y that no table holds."""
    arm = load_arm("ur5")
    chain = kinematic_chain(arm)
    errors, q = random_errors(rng, chain), configurations(rng, arm, 40)
    X = np.tile(np.eye(4), (40, 1, 1))
    reached = chain.forward(q, errors)
    X[:, :3, 3], X[:, :3, :3] = reached.position, reached.rotation
    found = calibrate_points(arm, q, X)

    there = inverse_calibrated(found, X[:5], q[:5] + 0.01)

    assert any(name.endswith(".beta") for name in found.names)
    assert there.residual.max() < MET
    again = chain.forward(there.q, errors)
    np.testing.assert_allclose(again.position, X[:5, :3, 3], atol=1e-7)
    np.testing.assert_allclose(again.rotation, X[:5, :3, :3], atol=1e-6)


def test_a_hand_the_other_way_round(rng: np.random.Generator) -> None:
    """A pose is not met by a hand at its place that is turned over: it turns, or says by how much it misses."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 40)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), NOISE, rng))
    near = np.array([0.3, -0.7, 0.4, 0.2, 0.9, 0.1])
    reached = found.chain.forward(near, found.arm_errors)
    goal = np.eye(4)
    goal[:3, 3], goal[:3, :3] = reached.position[0], reached.rotation[0] @ np.diag([-1.0, -1.0, 1.0])

    there = inverse_calibrated(found, goal, near)

    turned = found.chain.forward(there.q, found.arm_errors).rotation[0]
    assert there.residual[0] >= np.linalg.norm(rotation_vector(goal[:3, :3] @ turned.T)) - MET
    assert np.abs(there.q[0] - near).max() > 1.0


def test_out_of_reach(rng: np.random.Generator) -> None:
    """A goal that is out of reach is missed, and that is said."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 40)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), NOISE, rng))

    there = inverse_calibrated(found, (5.0, 0.0, 0.0), q[0])

    assert there.residual[0] > 3.0


def test_no_step_that_leads_away(rng: np.random.Generator) -> None:
    """Goals beyond the edge of what can be reached are missed by no more than from the nearest configuration passed."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 40)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), NOISE, rng))
    near = configurations(rng, arm, 60)
    shoulder = found.chain.base[:3, 3]
    goals = shoulder + (found.predict(near) - shoulder) * rng.uniform(1.3, 3.0, (60, 1))

    there = inverse_calibrated(found, goals, near)

    assert np.all(there.residual <= np.linalg.norm(goals - found.predict(near), axis=1))
    np.testing.assert_allclose(there.residual, np.linalg.norm(goals - found.predict(there.q), axis=1), atol=1e-12)


def test_limits(rng: np.random.Generator) -> None:
    """Positions beyond the limits are told."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = 0.3 * configurations(rng, arm, 40)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), NOISE, rng))
    beyond = arm.limits.upper + 0.05

    there = inverse_calibrated(found, found.predict(beyond), beyond)

    np.testing.assert_array_equal(there.within_limits, [False])


def test_as_many(rng: np.random.Generator) -> None:
    """As many joint positions as goals, or one for all."""
    arm = load_arm("puma560")
    q = configurations(rng, arm, 40)
    found = calibrate_points(
        arm, q, seen(kinematic_chain(arm), q, np.zeros(len(kinematic_chain(arm).names)), NOISE, rng)
    )

    assert inverse_calibrated(found, found.predict(q[:3]), q[0]).q.shape == (3, 6)
    with pytest.raises(ShapeError, match="near: expected 3 joint positions for as many goals, or one, got 2"):
        inverse_calibrated(found, np.zeros((3, 3)), q[:2])
    with pytest.raises(ShapeError, match=r"goals: expected \(m, 3\) positions or \(m, 4, 4\) poses, got \(3, 2\)"):
        inverse_calibrated(found, np.zeros((3, 2)), q[0])
