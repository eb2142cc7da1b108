"""Arms of four and five joints: how far a pose is turned from what their tools can be turned to."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solution import NoSolutionError, Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import homogeneous
from samples import Sample


@pytest.mark.share(0.05)
@pytest.mark.parametrize("name", ["cobra600", "hm-40a03w"])
def test_tilt_of_a_scara(name: str, sample: Sample) -> None:
    """The axis of the quill stays upright: a pose that is tilted is out of reach by its tilt, wherever it points."""
    arm = load_arm(name)
    for rng in sample.cases(40):
        q = rng.uniform(np.maximum(arm.limits.lower, -1.5), np.minimum(arm.limits.upper, 1.5))
        level, tilt, about = forward(arm, q), rng.uniform(0.05, 3.0), rng.uniform(-np.pi, np.pi)
        turn = Rotation.from_rotvec(tilt * np.array([math.cos(about), math.sin(about), 0])).as_matrix()

        solution = inverse(arm, homogeneous(turn @ level[:3, :3], level[:3, 3]))

        assert solution.outcome is Outcome.OUT_OF_REACH
        assert solution.distance < 1e-5
        assert solution.rotation_error == pytest.approx(tilt, abs=1e-5)
        with pytest.raises(NoSolutionError) as caught:
            _ = solution.best
        assert str(caught.value) == (
            f"'{name}', an arm of 4 joints, cannot turn its tool to the pose: at this position the nearest orientation "
            f"is {math.degrees(solution.rotation_error):.2f} deg away"
        )


@pytest.mark.filterwarnings("ignore::armwright.errors.UnitWarning")  # the minimizer turns joints as far as it likes
@pytest.mark.share(0.05)
def test_five_joints(sample: Sample) -> None:
    """Nothing that SciPy finds at the position is turned nearer to the pose."""
    arm = load_arm("m430ia-2f")
    for rng in sample.cases(20):
        q = rng.uniform(-1.5, 1.5, arm.n)
        X = forward(arm, q)
        X[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix() @ X[:3, :3]

        solution = inverse(arm, X)

        def turned(q: np.ndarray, X: np.ndarray = X) -> float:
            return float(Rotation.from_matrix(X[:3, :3] @ forward(arm, q)[:3, :3].T).magnitude())

        at_position = {"type": "eq", "fun": lambda q, X=X: forward(arm, q)[:3, 3] - X[:3, 3]}
        assert solution.distance < 1e-5
        for start in (q, q + rng.normal(scale=0.3, size=arm.n)):
            found = minimize(turned, start, constraints=[at_position], method="SLSQP")
            if found.success and np.linalg.norm(at_position["fun"](found.x)) < 1e-6:
                assert solution.rotation_error < found.fun + 1e-3


def test_too_far_away() -> None:
    """Where the position is out of reach too, the answer is in millimetres as ever."""
    arm = load_arm("cobra600")

    assert (
        inverse(arm, homogeneous(np.diag((1.0, -1.0, -1.0)), (3.0, 0, 0.2)))
        .explain()
        .startswith("the pose is 2400.0 mm")
    )
