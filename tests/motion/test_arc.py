"""Arcs of the tool: the circle against a closed form of its own, the certificate against dense samples."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm import load_arm
from armwright.kinematics import forward
from armwright.motion.arc import FlatArcError, arc, certified_arc
from armwright.motion.obstruction import PathError
from armwright.motion.tolerance import tolerance
from armwright.spatial.poses import homogeneous
from samples import Sample

ARM = load_arm("puma560")
START = np.array([0.1, 0.3, -0.2, 0.2, 0.9, 0.1])


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return homogeneous(Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3))


def test_circle_through_three_positions(sample: Sample) -> None:
    """All points are as far from the centre as the three positions, in one plane, in their order."""
    failures = 0
    for rng in sample.cases(1000):
        A, V, B = (random_pose(rng) for _ in range(3))
        planned = arc(A, V, B)
        X = planned.at(np.linspace(0.0, 1.0, 50))
        p = X[:, :3, 3]
        # The sphere through three points whose centre is in their plane, by linear equations.
        a, v, b = (each[:3, 3] for each in (A, V, B))
        rows = np.stack([2 * (v - a), 2 * (b - a), np.cross(v - a, b - a)])
        centre = np.linalg.solve(rows, [v @ v - a @ a, b @ b - a @ a, rows[2] @ a])
        scale = np.linalg.norm(a - centre) + np.linalg.norm(centre)
        radii = np.linalg.norm(p - centre, axis=1)
        passed = planned.at(np.array(planned.through))[:3, 3]
        turns = Rotation.from_matrix(np.swapaxes(X[:-1, :3, :3], 1, 2) @ X[1:, :3, :3]).magnitude()
        right = (
            np.abs(radii - radii[0]).max() < 1e-9 * scale
            and np.abs(passed - v).max() < 1e-9 * scale
            and np.abs(X[-1] - B).max() < 1e-9 * scale
            and np.abs(X[0] - A).max() < 1e-9 * scale
            and np.ptp(turns) < 1e-6
            and 0 < planned.through < 1
            and planned.angle < 2 * np.pi
        )
        failures += not right
    sample.record("arcs through three random positions", sample.count(1000), failures)

    assert not failures


@pytest.mark.parametrize("through", [(0.5, 0.0004, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.001)])
def test_nearly_on_a_line(through: tuple[float, float, float]) -> None:
    """Positions on a line, or nearly so, are refused; a thousandth of the distance is enough to go on."""
    start, end = np.eye(4), homogeneous(np.eye(3), (1.0, 0.0, 0.0))

    with pytest.raises(FlatArcError, match="no arc"):
        arc(start, homogeneous(np.eye(3), through), end)
    assert arc(start, homogeneous(np.eye(3), (0.5, 0.002, 0.0)), end).radius > 50


def test_certified(sample: Sample) -> None:
    """The tool is as near to the arc as the certificate says, and the joints keep their limits, at random times."""
    X = forward(ARM, START)
    planned_ones, failures = 0, 0
    for rng in sample.cases(60):
        offsets = rng.uniform(-0.12, 0.12, (2, 3))
        turn = Rotation.from_rotvec(rng.normal(size=3) * 0.3).as_matrix()
        through = homogeneous(X[:3, :3], X[:3, 3] + offsets[0])
        end = homogeneous(X[:3, :3] @ turn, X[:3, 3] + offsets[1])
        try:
            planned = arc(X, through, end)
            motion = certified_arc(ARM, START, through, end, tolerance(1e-3), speed=rng.uniform(10, 120))
        except (FlatArcError, PathError):
            continue
        planned_ones += 1
        t = rng.uniform(0.0, motion.trajectory.duration, 300)
        p = forward(ARM, motion.trajectory(t))[:, :3, 3] - planned.centre
        normal = np.cross(*planned.axes) / planned.radius**2
        off = np.hypot(p @ normal, np.linalg.norm(p - np.outer(p @ normal, normal), axis=1) - planned.radius)
        limits = ARM.limits
        failures += not (
            off.max() <= motion.certificate.deviation <= 1e-3
            and (np.abs(motion.trajectory(t, 1)) <= limits.speed * (1 + 1e-9)).all()
            and (np.abs(motion.trajectory(t, 2)) <= limits.acceleration * (1 + 1e-9)).all()
        )
        np.testing.assert_allclose(forward(ARM, motion.trajectory(motion.trajectory.duration)), end, atol=1e-9)
    sample.record("arcs of a PUMA, deviation and limits at 300 random times", planned_ones, failures)

    assert planned_ones
    assert not failures
