"""Two arms as a laser tracker saw them: the published points of Paul Jacobi, which are not part of this project.

They are looked for in the folder that ARMWRIGHT_DATA names, or in ``../shared/data`` beside the checkout.
"""

import os
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.calibration.fitting import calibrate_points
from armwright.calibration.measurements import Measurements, read_measurements
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.poses import homogeneous

FOLDER = Path(os.environ.get("ARMWRIGHT_DATA", Path(__file__).parents[3] / "shared" / "data"))
FOLDS = 5
# Lengths as printed in the arms' documents put the published targets where they are, to their rounding [m].
PRINTED_UR5, PRINTED_WAM = 1e-4, 5e-6


def read(name: str, arm: Arm) -> Measurements:
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(
            f"{name} of github.com/pauljac7700/serial_robots_datasets is not here; ARMWRIGHT_DATA names its folder"
        )
    return read_measurements(path, arm, units=("mm", "deg"))


def ur5() -> Arm:
    """Return the UR5 of the catalogue with the tracker's reflector on its flange."""
    return attrs.evolve(load_arm("ur5"), tool=homogeneous(np.eye(3), (0.0, 0.0, 0.031)))


def wam() -> Arm:
    """Return the seven joints of a Barrett WAM with the reflector on its flange."""
    right = np.pi / 2
    rows = (
        (0.0, 0.0, -right),
        (0.0, 0.0, right),
        (0.55, 0.045, -right),
        (0.0, -0.045, right),
        (0.3, 0.0, -right),
        (0.0, 0.0, right),
        (0.06, 0.0, 0.0),
    )
    joints = [Joint(kind="revolute", d=d, a=a, alpha=alpha) for d, a, alpha in rows]
    return Arm(name="wam", joints=joints, tool=homogeneous(np.eye(3), (0.0, 0.0, 0.044)))


def held_out(arm: Arm, measured: Measurements) -> Array:
    """Return (m,) by how much the corrected arm misses each point [m], fitted to the four fifths without it."""
    order = np.random.default_rng(0).permutation(len(measured.q))
    missed = np.empty(len(order))
    for fold in range(FOLDS):
        out = order[fold::FOLDS]
        rest = np.setdiff1d(order, out)
        found = calibrate_points(arm, measured.q[rest], measured.points[rest], base=np.eye(4))
        missed[out] = np.linalg.norm(found.predict(measured.q[out]) - measured.points[out], axis=1)
    return missed


def test_ur5() -> None:
    """A UR5 that is off by 2.6 mm is off by a tenth of a millimetre, in poses that it was not fitted to."""
    arm = ur5()
    measured = read("3D_UR5_uncalibrated_grid_cleaned.csv", arm)

    missed = held_out(arm, measured)

    assert measured.q.shape == (1000, 6)
    assert measured.warnings == ()
    raw = np.linalg.norm(forward(arm, measured.q)[:, :3, 3] - measured.points, axis=1)
    assert raw.mean() == pytest.approx(2.635e-3, abs=5e-6)
    assert missed.mean() <= 0.105e-3
    assert missed.max() < 0.3e-3


def test_ur5_errors() -> None:
    """What is fitted to a UR5 is known to a tenth of a millimetre, and a quarter of a milliradian but for one angle."""
    arm = ur5()
    measured = read("3D_UR5_uncalibrated_grid_cleaned.csv", arm)

    found = calibrate_points(arm, measured.q, measured.points, base=np.eye(4))

    lengths = found.chain.is_length[list(found.identifiability.fitted)]
    assert len(found.names) == 25
    assert found.standard_errors[lengths].max() < 1e-4
    assert found.standard_errors[~lengths].max() < 2.5e-4
    assert found.after.distance.mean() < 0.04 * found.before.distance.mean()


def test_wam() -> None:
    """A WAM on cables that is off by 17 mm is off by some 2 mm, which is what it repeats to."""
    arm = wam()
    measured = read("3D_WAM_uncalibrated_grid_cleaned.csv", arm)

    missed = held_out(arm, measured)

    assert measured.q.shape == (216, 7)
    raw = np.linalg.norm(forward(arm, measured.q)[:, :3, 3] - measured.points, axis=1)
    assert raw.mean() == pytest.approx(17.1e-3, abs=0.05e-3)
    assert missed.mean() <= 2.2e-3


@pytest.mark.parametrize(
    ("name", "arm", "printed"),
    [
        ("3D_UR5_uncalibrated_grid_cleaned.csv", ur5(), PRINTED_UR5),
        ("3D_WAM_uncalibrated_grid_cleaned.csv", wam(), PRINTED_WAM),
    ],
    ids=["ur5", "wam"],
)
def test_targets(name: str, arm: Arm, printed: float) -> None:
    """The published targets are where the arms' printed lengths have the tool."""
    measured = read(name, arm)
    table = np.genfromtxt(FOLDER / name, delimiter=",", names=True)
    targets = 1e-3 * np.stack([table[f"{axis}_t"] for axis in "xyz"], axis=1)

    np.testing.assert_allclose(forward(arm, measured.q)[:, :3, 3], targets, atol=printed)
