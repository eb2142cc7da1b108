"""The corrected arm: an arm like any other, that is where the calibration says."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm import calibrated_arm
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.correction import (
    corrected_arm,
    corrected_tables,
    corrected_urdf,
    position_covariance,
    robot_files,
)
from armwright.calibration.cross_validation import cross_validate
from armwright.calibration.fitting import Calibration, calibrate_points
from armwright.calibration.readings import readings
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from calibration.simulated import configurations, random_arm, random_errors, random_pose, seen

# Products of ten poses [m].
ROUNDING = 1e-12
# Tables in millimetres and degrees, multiplied out [m].
EXACT = 1e-12


@pytest.mark.parametrize("n", [3, 5, 7])
def test_corrected_arm(n: int, rng: np.random.Generator) -> None:
    """The forward kinematics of the corrected arm are those of the calibration, in the frame of the measurements."""
    arm = random_arm(rng, n, slides=True)
    chain = kinematic_chain(arm, base=random_pose(rng, 0.5))
    q = configurations(rng, arm, 60)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), 5e-5, rng), without=("beta",))

    better = corrected_arm(found)

    np.testing.assert_allclose(forward(better, q)[:, :3, 3], found.predict(q), atol=ROUNDING)
    assert better.links == arm.links


def test_gravity_stays_where_it_was(rng: np.random.Generator) -> None:
    """A tracker that lies on its side turns the frame of the corrected arm, not the torques that hold the arm."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm, base=homogeneous(rotation_from_vector([np.pi / 2, 0.0, 0.0]), (1.0, 2.0, 3.0)))
    q, none = configurations(rng, arm, 60), np.zeros(len(chain.names))

    better = corrected_arm(calibrate_points(arm, q, seen(chain, q, none, 1e-7, rng), without=("beta",)))

    # Angles are known to a microradian.
    np.testing.assert_allclose(better.gravity, (0.0, STANDARD_GRAVITY, 0.0), atol=1e-4)
    np.testing.assert_allclose(gravity_efforts(better, q), gravity_efforts(arm, q), atol=1e-3)


def test_turns_about_y_do_not_fit_a_table(rng: np.random.Generator) -> None:
    """A turn about y between parallel axes has no place in a table, and the text says what to do."""
    arm = load_arm("ur5")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 60)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), 5e-5, rng))

    with pytest.raises(InvalidValueError, match=r'calibrate without=\("beta",\)'):
        corrected_arm(found)


def test_held_out_points_tell_the_noise(rng: np.random.Generator) -> None:
    """Held-out points are as far off as the noise of three coordinates makes them, and a little more."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q, noise = configurations(rng, arm, 120), 1e-4
    off = cross_validate(arm, readings(q, seen(chain, q, random_errors(rng, chain), noise, rng)))

    usual = noise * np.sqrt(8 / np.pi)
    assert 0.95 * usual < off.distance.mean() < 1.35 * usual
    assert np.all(np.isnan(off.angle))


@pytest.mark.parametrize("folds", [1, 7])
def test_folds(folds: int) -> None:
    """There are two folds or more, and a point in each."""
    with pytest.raises(InvalidValueError, match="folds: expected 2 to 6"):
        cross_validate(load_arm("ntu-3r"), readings(np.arange(18.0).reshape(6, 3), np.zeros((6, 3))), folds=folds)


# ---- forms ---------------------------------------------------------------------------------------------------------


def product(text: str, convention: str, q: Array) -> Array:
    """Return the tool pose (4, 4) of a table as CSV, by the formula of its convention."""
    rows = list(csv.DictReader(text.splitlines()))
    X = six(rows[0])
    for row, position in zip(rows[1:-1], q, strict=True):
        theta, alpha = np.radians(float(row["theta_deg"])), np.radians(float(row["alpha_deg"]))
        d, a = float(row["d_mm"]) * 1e-3, float(row["a_mm"]) * 1e-3
        turned = row["kind"] == "revolute"
        joint = about("z", theta + turned * position) @ shift(z=d + (not turned) * position)
        twist = shift(x=a) @ about("x", alpha)
        X = X @ (twist @ joint if convention == "modified" else joint @ twist)
        if convention == "hayati":
            X = X @ about("y", np.radians(float(row["beta_deg"])))
    return X @ six(rows[-1])


def about(axis: str, angle: float) -> Array:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return X


def shift(x: float = 0.0, z: float = 0.0) -> Array:
    X = np.eye(4)
    X[:3, 3] = (x, 0.0, z)
    return X


def six(row: dict[str, str]) -> Array:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler(
        "xyz", [float(row[f"{a}_deg"]) for a in ("roll", "pitch", "yaw")], degrees=True
    ).as_matrix()
    X[:3, 3] = [float(row[f"{a}_mm"]) * 1e-3 for a in "xyz"]
    return X


def tilted(rng: np.random.Generator) -> Calibration:
    """Return a calibration of a UR5 with all errors, turns about y among them."""
    arm = load_arm("ur5")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 80)
    return calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), 2e-5, rng))


def test_tables_by_their_formulas(rng: np.random.Generator) -> None:
    """A table, multiplied out by the formula of its convention, has the tool where the corrected arm has it."""
    arm = random_arm(rng, 6, slides=True)
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 80)
    found = calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), 2e-5, rng), without=("beta",))

    tables = corrected_tables(found)

    assert set(tables) == {"standard", "modified"}
    for convention, text in tables.items():
        np.testing.assert_allclose(product(text, convention, q[0])[:3, 3], found.predict(q[0])[0], atol=EXACT)


def test_table_with_turns_about_y(rng: np.random.Generator) -> None:
    """With turns about y, the table of Hayati alone holds the arm."""
    found = tilted(rng)
    q = configurations(rng, found.chain.arm, 1)[0]

    tables = corrected_tables(found)

    assert set(tables) == {"hayati"}
    np.testing.assert_allclose(product(tables["hayati"], "hayati", q)[:3, 3], found.predict(q)[0], atol=EXACT)


def test_urdf_with_turns_about_y(rng: np.random.Generator) -> None:
    """Pinocchio reads the corrected arm from URDF, turns about y and all, and has the tool where it should be."""
    found = tilted(rng)
    model = pinocchio.buildModelFromXML(corrected_urdf(found))
    data = model.createData()

    for q in configurations(rng, found.chain.arm, 5):
        pinocchio.framesForwardKinematics(model, data, _configuration(model, q))
        place = data.oMf[model.getFrameId("tool")].translation
        np.testing.assert_allclose(place, found.predict(q)[0], atol=EXACT)


def _configuration(model: Any, q: Array) -> Array:
    """Return q as Pinocchio wants it, where joints without limits are cosine and sine."""
    parts = [
        [np.cos(x), np.sin(x)] if joint.nq == 2 else [x] for joint, x in zip(list(model.joints)[1:], q, strict=True)
    ]
    return np.concatenate(parts)


def test_how_well_it_is_known(rng: np.random.Generator) -> None:
    """The corrected arm tells how well its tool is known as the calibration does, from its file too."""
    arm = random_arm(rng, 5)
    chain = kinematic_chain(arm)
    q, elsewhere = configurations(rng, arm, 60), configurations(rng, arm, 20)
    points = seen(chain, q, random_errors(rng, chain), 5e-5, rng) @ rotation_from_vector([0.3, -0.5, 1.0]).T + 2.0
    found = calibrate_points(arm, q, points, without=("beta",))
    better = corrected_arm(found)

    np.testing.assert_allclose(
        position_covariance(better, elsewhere), found.uncertainty(elsewhere), rtol=1e-6, atol=1e-16
    )
    assert better.uncertainty is not None
    assert better.uncertainty.noise == found.noise.length


def test_known_in_the_file(rng: np.random.Generator, tmp_path: Path) -> None:
    """What an arm file says of its own errors is read back to the last bit."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 60)
    better = corrected_arm(
        calibrate_points(arm, q, seen(chain, q, random_errors(rng, chain), 5e-5, rng), without=("beta",))
    )
    path = tmp_path / "arm.toml"
    path.write_text(toml_text(better), encoding="utf-8")

    assert load_arm(path) == better


def test_nothing_known() -> None:
    """An arm of the catalogue does not say how well it is known."""
    with pytest.raises(InvalidValueError, match="puma560: its dimensions have no covariance; calibrate"):
        position_covariance(load_arm("puma560"), np.zeros(6))


def test_files_of_robots(tmp_path: Path, rng: np.random.Generator) -> None:
    """What was identified of a UR5, tilts of parallel axes included, moves its last link as in URDF."""
    arm = load_arm("ur5")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 60)
    errors = np.where(chain.is_length, 5e-4, 2e-3) * rng.standard_normal(len(chain.names))
    found = calibrate_points(arm, q, seen(chain, q, errors, 1e-5, rng))
    assert any(name.endswith(".beta") for name in found.names)
    (tmp_path / "arm.urdf").write_text(corrected_urdf(found), encoding="utf-8")
    description = pinocchio.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    data, links = description.createData(), [description.getFrameId(f"link_{i}") for i in (0, 6)]

    def last_link(positions: Array) -> Array:
        pinocchio.framesForwardKinematics(description, data, positions)
        first, last = (data.oMf[link] for link in links)
        return np.asarray((first.inverse() * last).homogeneous)

    for name, text in robot_files(found).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        one, notes = calibrated_arm(arm, tmp_path / name)
        assert notes == []
        # Frames of the last link may differ by a constant pose, those of the base by what lies along the first axis.
        behind = [np.linalg.inv(last_link(x)) @ np.linalg.inv(one.base) @ forward(one, x) for x in q]
        np.testing.assert_allclose(behind, np.broadcast_to(behind[0], (len(q), 4, 4)), rtol=0, atol=1e-9)


def test_files_of_other_robots(rng: np.random.Generator) -> None:
    """A PUMA has no such files."""
    arm = load_arm("puma560")
    chain = kinematic_chain(arm)
    q = configurations(rng, arm, 60)

    assert robot_files(calibrate_points(arm, q, seen(chain, q, np.zeros(len(chain.names)), 1e-5, rng))) == {}
