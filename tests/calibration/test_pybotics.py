"""The same fit by pybotics, which is another program for calibration: four numbers per link, fitted by SciPy.

pybotics asks for NumPy 1 though it works with 2, so that it cannot stand among the requirements of the tests:
``pip install --no-deps pybotics``.
"""

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.fitting import calibrate_points
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.poses import homogeneous
from calibration.simulated import configurations, random_errors, seen

# Both fits end at the same minimum; pybotics' least squares has derivatives by differences [m].
SAME = 1e-6
NOISE = 5e-5
ROUNDING = 1e-12
# Skew axes, the last joint's frame unturned: Rx(alpha) Tx(a) Rz(theta) Tz(d) of pybotics are the same numbers, one on.
LINKS = ((0.3, 0.1, 1.2), (0.1, 0.35, -0.9), (0.15, 0.3, 1.4), (0.25, 0.08, -1.1), (0.2, 0.0, 0.0))


@pytest.fixture
def pybotics() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pytest.importorskip("pybotics", reason="pybotics is not installed: pip install --no-deps pybotics")
        import pybotics.robot
    return pybotics


def skew_arm() -> Arm:
    return Arm(
        name="skew",
        joints=[Joint(kind="revolute", d=d, a=a, alpha=alpha) for d, a, alpha in LINKS],
        tool=homogeneous(np.eye(3), (0.04, 0.02, 0.1)),
    )


def rows_of(arm: Arm) -> Array:
    """Return (n, 4) alpha, a, theta, d of each link in the modified convention."""
    before = [(0.0, 0.0), *((joint.alpha, joint.a) for joint in arm.joints[:-1])]
    return np.array([(*one, joint.theta, joint.d) for one, joint in zip(before, arm.joints, strict=True)])


def robot_of(pybotics: Any, arm: Arm) -> Any:
    robot = pybotics.robot.Robot.from_parameters(rows_of(arm).ravel())
    robot.tool.position = arm.tool[:3, 3]
    return robot


def test_the_same_arm(pybotics: Any, rng: np.random.Generator) -> None:
    """Both programs have the tool of an arm in the same place."""
    arm = skew_arm()
    robot = robot_of(pybotics, arm)
    q = configurations(rng, arm, 10)

    np.testing.assert_allclose([robot.fk(one) for one in q], forward(arm, q), atol=ROUNDING)


def test_the_same_fit(pybotics: Any, rng: np.random.Generator) -> None:
    """Fitted to the same points, both have the tool in the same place, in configurations that neither has seen.

    Numbers that a point does not tell are left out by hand for pybotics, which does not look for them: the frame before
    the first joint, and what the last joint does as the tool does.
    """
    arm = skew_arm()
    chain = kinematic_chain(arm)
    errors = random_errors(rng, chain)
    errors[[i for i, name in enumerate(chain.names) if name.startswith("base")]] = 0.0
    q, elsewhere = configurations(rng, arm, 60), configurations(rng, arm, 40)
    points = seen(chain, q, errors, NOISE, rng)
    ours = calibrate_points(
        arm, q, points, base=np.eye(4), robust=False, only=["joint1", "joint2", "joint3", "joint4", "tool"]
    )

    robot = robot_of(pybotics, arm)
    start = rows_of(arm)
    free = np.ones_like(start, dtype=bool)
    free[0, :2] = False
    free[-1, 2:] = False

    def missing(x: Array) -> Array:
        rows = start.copy()
        rows[free] = x[:-3]
        robot.kinematic_chain.vector = rows.ravel()
        robot.tool.position = x[-3:]
        return np.concatenate([robot.fk(one)[:3, 3] for one in q]) - points.ravel()

    theirs = least_squares(missing, np.concatenate([start[free], arm.tool[:3, 3]]), x_scale="jac")

    # theta and d of the last joint are not among those that both fit; the rest of the names are the same numbers.
    assert len(ours.names) == theirs.x.size
    missing(theirs.x)
    np.testing.assert_allclose([robot.fk(one)[:3, 3] for one in elsewhere], ours.predict(elsewhere), atol=SAME)
    assert (
        np.linalg.norm(ours.predict(elsewhere) - chain.forward(elsewhere, errors).position, axis=1).mean() < 3 * NOISE
    )
