"""Couplings of drives: what they are, what they are not, and their files."""

import copy
import pickle
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arm import Arm, Coupling, Joint, Limits, load_arm, load_urdf, toml_text, urdf_text
from armwright.arm.description import tables
from armwright.arm.urdf.writer import lost_in_urdf
from armwright.errors import ArmwrightError, FileFormatError, InvalidValueError, KindError, ShapeError
from armwright.kinematics import forward, inverse
from armwright.kinematics.inverse_kinematics.solution import violations
from oracles.arms import coupled, random_arm, with_all_friction
from samples import Sample

WRIST = ((1, 0, 0), (0, 1, 0), (0, -1, 1))


def test_matrices() -> None:
    """Positions and efforts of drives and joints are those of the matrix and its inverse, whole numbers exact."""
    coupling = Coupling(matrix=WRIST)

    assert coupling.inverse.tolist() == [[1, 0, 0], [0, 1, 0], [0, 1, 1]]
    assert coupling.mixed == (1, 2)
    assert coupling.drives(np.array([1.0, 2.0, 3.0])).tolist() == [1, 2, 5]
    assert coupling.joints(np.array([1.0, 2.0, 5.0])).tolist() == [1, 2, 3]
    assert coupling.drive_efforts(np.array([1.0, 2.0, 3.0])).tolist() == [1, -1, 3]
    assert coupling.joint_efforts(np.array([1.0, -1.0, 3.0])).tolist() == [1, 2, 3]
    for other in (copy.deepcopy(coupling), pickle.loads(pickle.dumps(coupling)), Coupling(matrix=np.array(WRIST))):
        assert other == coupling
        assert hash(other) == hash(coupling)
        assert not other.matrix.flags.writeable


@pytest.mark.parametrize(
    ("values", "kind", "message"),
    [
        (
            {"matrix": [[1, 2], [2, 4]]},
            InvalidValueError,
            "is singular, so that some positions of the joints",
        ),
        ({"matrix": [[1, 1], [1, 1 + 1e-9]]}, InvalidValueError, "singular"),
        ({"matrix": [[1, 0], [0, 0]]}, InvalidValueError, "no drive moves joint 2: its row or column is 0"),
        ({"matrix": [[1, 0], [1, 0]]}, InvalidValueError, "drive 2 moves no joint: its row or column is 0"),
        ({"matrix": [[1, 0]]}, ShapeError, "expected a square matrix, a row for each joint, got shape (1, 2)"),
        ({"matrix": []}, ShapeError, "expected a square matrix"),
        ({"matrix": 3}, ShapeError, "expected a square matrix"),
        ({"matrix": [[1, np.nan], [0, 1]]}, InvalidValueError, "every number must be finite, got nan"),
        ({"matrix": [[1, np.inf], [0, 1]]}, InvalidValueError, "finite"),
        ({"matrix": [[1e200, 0], [0, 1]]}, InvalidValueError, "no larger than 1e+100"),
        ({"matrix": "eye"}, KindError, "coupling"),
        ({"matrix": WRIST, "limits": [Limits(speed=1)]}, ShapeError, "limits for all 3 drives or for none, got 1"),
        ({"matrix": WRIST, "limits": [1, 2, 3]}, KindError, "expected limits to be Limits, got 1 for drive 1"),
        ({"matrix": WRIST, "limits": 3}, KindError, "expected the limits of the drives as a list, got 3"),
        ({"matrix": np.eye(1), "limits": [Limits(speed=1)]}, InvalidValueError, "its limits are those of the joint"),
    ],
)
def test_hostile_couplings(values: dict[str, Any], kind: type[ArmwrightError], message: str) -> None:
    """What is no coupling is refused, with what is wrong."""
    with pytest.raises(kind) as caught:
        Coupling(**values)

    assert message in str(caught.value)


@pytest.mark.parametrize("ratio", [1e-30, 1e-8, 1e8, 1e16, 1e90])
def test_ratios_of_any_size_have_an_inverse(ratio: float) -> None:
    """A small number in the inverse is no rounding where nothing large is beside it."""
    coupling = Coupling(matrix=np.array(WRIST) * np.array([[1.0], [ratio], [ratio]]))
    q = np.array([0.3, 0.2 * ratio, -0.4 * ratio])

    np.testing.assert_allclose(coupling.drives(q), [0.3, 0.2, -0.2], rtol=1e-14)
    assert (coupling.inverse[[0, 0, 1, 1, 2], [1, 2, 0, 2, 0]] == 0).all()


def test_couplings_of_other_arms() -> None:
    """An arm takes a coupling of as many joints as it has, and nothing else."""
    joints = [Joint(kind="revolute")] * 2

    with pytest.raises(ShapeError, match="arm 'two': 2 joints but a coupling of 3; expected a row"):
        Arm(name="two", joints=joints, coupling=Coupling(matrix=WRIST))
    with pytest.raises(KindError, match="arm 'two': expected coupling to be a Coupling or None"):
        Arm(name="two", joints=joints, coupling=np.eye(2))  # type: ignore[arg-type]


def test_files_of_random_arms(sample: Sample, tmp_path: Path) -> None:
    """An arm file of an arm with coupled drives is the same arm again, to the last bit."""
    path = tmp_path / "arm.toml"
    for rng in sample.cases(60):
        arm = random_arm(rng, int(rng.integers(2, 8)))
        lower = rng.uniform(-2, -1, size=arm.n)
        limits = [Limits(lower=x, speed=rng.uniform(1, 2)) if rng.random() < 0.7 else Limits() for x in lower]
        arm = coupled(with_all_friction(arm, rng), rng, tuple(limits))
        path.write_text(toml_text(arm), encoding="utf-8")

        assert load_arm(path) == arm
    sample.record("arm files of arms with coupled drives", sample.count(60), 0)


FILE = """
[coupling]
matrix = [[1, 0], [-1, 1]]

[[joint]]
kind = "revolute"
a_m = 0.5
[joint.motor]
viscous_Nms = 2
inertia_kgm2 = 0.5

[[joint]]
kind = "revolute"
a_m = 0.4
[joint.motor.limits]
lower_deg = -90
upper_deg = 60
effort_Nm = 20
"""


@pytest.fixture
def belt(tmp_path: Path) -> Arm:
    path = tmp_path / "belt.toml"
    path.write_text(FILE)
    return load_arm(path)


def test_file(belt: Arm) -> None:
    """The matrix and the limits of the drives are those of the file; limits of joints and drives are told apart."""
    assert belt.coupling == Coupling(
        matrix=[[1, 0], [-1, 1]],
        limits=[Limits(), Limits(lower=-np.pi / 2, upper=np.deg2rad(60), effort=20.0)],
    )
    assert belt.limits.effort.tolist() == [np.inf, np.inf]
    assert belt.all_limits.effort.tolist() == [np.inf, np.inf, np.inf, 20.0]
    titles = [table.title.partition(":")[0] for table in tables(belt)]
    assert titles[-3:] == ["Drives, behind their gears", "Coupling", "Limits of the drives"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[[1, 0], [-1, 1]]", "[[1, 0], [1, 0]]", "belt.toml:3: coupling, matrix: drive 2 moves no joint"),
        ("[[1, 0], [-1, 1]]", "[[1, 2], [2, 4]]", "belt.toml:3: coupling, matrix: the matrix [[1.0, 2.0], [2.0, 4.0]]"),
        ("[[1, 0], [-1, 1]]", "[[1, 0]]", "belt.toml:3: coupling, matrix: expected 2 rows, one for each joint, got 1"),
        ("[[1, 0], [-1, 1]]", "[[1, 0], [1]]", "belt.toml:3: coupling, matrix 2: expected 2 numbers, got 1"),
        ("[[1, 0], [-1, 1]]", "[[1, nan], [-1, 1]]", "coupling, matrix 1 2: expected a finite number, got nan"),
        ("[[1, 0], [-1, 1]]", '"eye"', "coupling, matrix: expected a list of lists of 2 numbers"),
        ("[[1, 0], [-1, 1]]", "[[1, 0], [0, 1]]", "coupling, matrix: each drive moves its own joint alone"),
        ("matrix = [[1, 0], [-1, 1]]", "", "coupling, matrix: missing"),
        ("matrix =", "matrx =", "belt.toml:2: coupling, matrix: missing, expected a list of lists of 2 numbers; was"),
        (
            "[coupling]\nmatrix = [[1, 0], [-1, 1]]\n",
            "",
            "joint 2, motor, limits: the drive moves its joint alone; specify [joint.limits], or how the drives are",
        ),
        ("upper_deg = 60", "upper_deg = -100", "joint 2, motor, limits: the lower limit must be below the upper"),
        ("effort_Nm", "efort_Nm", "joint 2, motor, limits, efort_Nm: unknown key; did you mean 'effort_Nm'?"),
    ],
)
def test_mistakes_in_files(old: str, new: str, message: str, tmp_path: Path) -> None:
    """A mistake is reported with file, line and key."""
    path = tmp_path / "belt.toml"
    path.write_text(FILE.replace(old, new))

    with pytest.raises(FileFormatError) as caught:
        load_arm(path)

    assert message in str(caught.value)


def test_position_limits_of_drives(belt: Arm) -> None:
    """A configuration whose joints are inside their limits, and a drive is not, violates that limit, by its name."""
    (fault,) = violations(belt, np.deg2rad([80.0, 5.0]))

    assert str(fault) == "the drive of joint 2 would be at 85.0 deg, 25.0 deg beyond its limit 60.0 deg"
    assert not violations(belt, np.deg2rad([80.0, -25.0]))


def test_branches_beyond_limits_of_drives() -> None:
    """The inverse kinematics leaves out the branches in which a drive would pass its limits."""
    arm = load_arm("puma560")
    C = np.eye(6)
    C[2, 1] = -1.0
    q = np.array([0.3, -0.8, 1.9, 0.4, 0.5, 0.6])
    limits = [Limits()] * 2 + [Limits(lower=1.0, upper=1.2)] + [Limits()] * 3
    pose = forward(arm, q)

    free, limited = inverse(arm, pose), inverse(attrs.evolve(arm, coupling=Coupling(matrix=C, limits=limits)), pose)

    inside = [branch.q for branch in free.branches if branch.allowed and 1.0 <= branch.q[1] + branch.q[2] <= 1.2]
    assert 0 < len(inside) < sum(branch.allowed for branch in free.branches)
    np.testing.assert_allclose(sorted(b.q.tolist() for b in limited.branches if b.allowed), sorted(map(list, inside)))


def test_a_whole_turn_that_a_drive_asks_for() -> None:
    """Of the turns that the limits of the last joint leave, the one is taken in which no drive passes its limits."""
    arm, C = load_arm("puma560"), np.eye(6)
    C[5, 4] = -1.0
    limits = [*[Limits()] * 5, Limits(lower=-3.5, upper=3.5)]
    coupled = attrs.evolve(arm, coupling=Coupling(matrix=C, limits=limits))
    q = np.array([-1.7, 0.1, 1.9, 0.4, 1.4, -3.8])

    solution = inverse(coupled, forward(coupled, q), near=[0, 0, 0, 0, 0, 3.0])

    assert not any(violations(coupled, branch.q) for branch in solution.allowed)
    assert min(np.abs(branch.q - q).max() for branch in solution.allowed) < 1e-9
    freely = inverse(arm, forward(arm, q), near=[0, 0, 0, 0, 0, 3.0])
    assert min(np.abs(branch.q - q).max() for branch in freely.allowed) > 1.0


def test_urdf_names_what_it_loses(belt: Arm, tmp_path: Path) -> None:
    """In URDF joints of coupled drives have no friction, since it is none of theirs; what is lost is said."""
    path = tmp_path / "belt.urdf"
    path.write_text(urdf_text(belt))

    assert lost_in_urdf(belt) == [
        "joint 1: the inertia of the drive, 0.5 kg m², is not in the file",
        (
            "the coupling of the drives 1, 2 and their friction are not in the file: the joints 1, 2 have no friction "
            "there"
        ),
        "the limits of the drives are not in the file, only those of the joints",
    ]
    again = load_urdf(path)
    assert again.coupling is None
    assert not again.motor_values("viscous").any()
