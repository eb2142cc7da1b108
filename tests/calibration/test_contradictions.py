"""What makes a calibration doubtful: a coupled joint, and errors beyond belief; and regions that are held out."""

import numpy as np

from armwright.arm.load import load_arm
from armwright.calibration.contradictions import find_contradictions
from armwright.calibration.cross_validation import cross_validate, workspace_regions
from armwright.calibration.fitting import calibrate_points
from armwright.calibration.readings import readings
from armwright.kinematics.forward_kinematics import forward


def configurations(rng: np.random.Generator, count: int) -> np.ndarray:
    """Joint configurations of the ur5 all over its workspace."""
    return rng.uniform(-1.2, 1.2, (count, 6)) + np.array((0.0, -1.0, 0.8, 0.0, 0.6, 0.0))


def test_coupled_joint(rng: np.random.Generator) -> None:
    """Where joint 3 follows joint 2 in a third of the readings, these are outliers, and it is said what they share."""
    arm = load_arm("ur5")
    q = configurations(rng, 90)
    # Two thirds are measured with joint 2 held.
    q[:60, 1] = -1.0
    true = q.copy()
    true[:, 2] += 0.5 * (q[:, 1] + 1.0)
    points = forward(arm, true)[:, :3, 3] + rng.normal(0.0, 5e-5, (90, 3))

    said = list(find_contradictions(calibrate_points(arm, q, points), readings(q, points)))

    assert len(said) >= 1
    assert "in the position of joint 2, so that the residuals of the others" in said[0]
    assert "coupled to another (q3 = a2 q2 + q3" in said[0]


def test_nothing_to_doubt(rng: np.random.Generator) -> None:
    """An arm that is a little off, with noise and some outliers anywhere, is not doubted."""
    arm = load_arm("ur5")
    q = configurations(rng, 60)
    points = forward(arm, q + 2e-3)[:, :3, 3] + rng.normal(0.0, 5e-5, (60, 3))
    points[[3, 17, 40]] += 5e-3

    assert list(find_contradictions(calibrate_points(arm, q, points), readings(q, points))) == []


def test_errors_beyond_belief(rng: np.random.Generator) -> None:
    """A joint that is told 590 mrad from where it is, is no error of a link, and it is said what to check."""
    arm = load_arm("ur5")
    q = configurations(rng, 60)
    points = forward(arm, q + np.array((0.0, 0.0, 0.59, 0.0, 0.0, 0.0)))[:, :3, 3] + rng.normal(0.0, 5e-5, (60, 3))

    said = " ".join(find_contradictions(calibrate_points(arm, q, points), readings(q, points)))

    assert "joint3.theta" in said
    assert "larger than any manufacturing error of a link" in said


def test_regions(rng: np.random.Generator) -> None:
    """Five regions hold every configuration once, lie apart, and lose more shared information than random parts."""
    arm = load_arm("ur5")
    q = configurations(rng, 80)
    parts = workspace_regions(arm, q, 5)
    places = forward(arm, q)[:, :3, 3]

    np.testing.assert_array_equal(np.sum(parts, axis=0), 1)
    assert max(part.sum() for part in parts) - min(part.sum() for part in parts) <= 2
    within = np.mean([np.ptp(places[part], axis=0).prod() for part in parts])
    assert within < 0.5 * np.ptp(places, axis=0).prod()
    points = forward(arm, q + 1e-2 * np.sin(q))[:, :3, 3]
    near, far = (cross_validate(arm, readings(q, points), regions=one).distance.mean() for one in (False, True))
    assert far > near
