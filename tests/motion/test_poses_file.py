"""Files of poses."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import FileFormatError
from armwright.motion.poses_file import PosesFile, read_poses

EXAMPLES = Path(__file__).parents[2] / "examples"
TWO = "[[pose]]\nxyz_mm = [1, 2, 3]\n[[pose]]\nxyz_cm = [1, 2, 3]\n"
TIMED = "[[pose]]\ntime_s = 0\n[[pose]]\ntime_s = 1\n"


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], PosesFile]:
    """Read a text as a file of poses."""

    def reading(text: str) -> PosesFile:
        path = tmp_path / "poses.toml"
        path.write_text(text, encoding="utf-8")
        return read_poses(path)

    return reading


def test_the_example() -> None:
    """The example has the three poses of the PUMA project, with times and blends, and notes on typed rotations."""
    file = read_poses(EXAMPLES / "puma_poses.toml")

    assert file.names == ("A", "B", "C")
    np.testing.assert_allclose(file.poses[:, :3, 3], [[0.05, -0.55, -0.6], [0.5, -0.4, 0.4], [0.6, 0.15, -0.3]])
    R = file.poses[:, :3, :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-12)
    assert file.times is not None
    assert file.times.tolist() == [0.0, 0.5, 1.0]
    assert file.blend is not None
    assert file.blend.tolist() == [0.2, 0.2, 0.2]
    assert [note.split(":")[0] for note in file.notes] == [f"line {line}" for line in file.lines]


def test_units_and_defaults(read: Callable[[str], PosesFile]) -> None:
    """Lengths come by their unit; names are numbers, times and blends none, where nothing is said."""
    file = read(TWO)

    np.testing.assert_allclose(file.poses[:, :3, 3], [[0.001, 0.002, 0.003], [0.01, 0.02, 0.03]])
    np.testing.assert_array_equal(file.poses[:, :3, :3], np.broadcast_to(np.eye(3), (2, 3, 3)))
    assert (file.names, file.times, file.blend, file.lines, file.notes) == (("1", "2"), None, None, (1, 3), ())


def test_four_turns() -> None:
    """The four poses round the post see it: their approach vectors, times 250 mm, end in one place."""
    file = read_poses(EXAMPLES / "round_the_post.toml")

    ends = file.poses[:, :3, 3] + 0.25 * file.poses[:, :3, 2]

    np.testing.assert_allclose(ends, np.broadcast_to([0.65, -0.2, -0.2], (4, 3)), atol=1e-4)
    np.testing.assert_allclose(file.poses[0], file.poses[3], atol=1e-7)


MISTAKES = {
    "one pose": ("[[pose]]\nxyz_mm = [1, 2, 3]\n", "1: pose: expected two poses or more, got 1"),
    "no pose": ('title = "none"\n', "pose: missing, expected one or more tables [[pose]]"),
    "no unit": (TWO.replace("xyz_cm", "xyz"), "4: pose 2, xyz: the key must contain the unit: xyz_m, xyz_cm or xyz_mm"),
    "angles without one": (
        TWO + "rpy = [0, 0, 90]\n",
        "5: pose 2, rpy: the key must contain the unit: rpy_deg or rpy_rad",
    ),
    "a wrong rotation": (
        TWO + "rotation = [[1, 0, 0], [0, 1, 0], [0, 0.1, 1]]\n",
        "5: pose 2, rotation: expected the rows of a rotation matrix, got an orthonormality error of 0.1",
    ),
    "two turns": (
        TWO + "rpy_deg = [0, 0, 0]\nquaternion_wxyz = [1, 0, 0, 0]\n",
        "6: pose 2, quaternion_wxyz: the rotation is specified twice, as rpy and as quaternion_wxyz",
    ),
    "a late start": (
        TIMED.replace("= 0", "= 0.1"),
        "2: pose 1, time_s: the first pose is passed at 0 s, got 0.1",
    ),
    "back in time": (
        TIMED + "[[pose]]\ntime_s = 1\n",
        "6: pose 3, time_s: expected more than the 1 s of the previous pose, got 1",
    ),
    "a time missing": (TIMED + "[[pose]]\n", "5: pose 3, time_s: missing, expected a number"),
    "a time too many": (
        TWO + "time_s = 1\n",
        "5: pose 2, time_s: the first pose has none; specify it for all poses or for none",
    ),
    "a blend without times": (
        "blend_s = 0.1\n" + TWO,
        "2: pose 1: blends are allowed only for poses with times; specify time_s",
    ),
    "a blend of none": (TIMED + "blend_s = 0\n", "5: pose 2, blend_s: expected a number above 0, got 0"),
    "one blend missing": (
        TIMED + "blend_s = 0.1\n",
        "1: pose 1, blend_s: missing; other poses have one: specify it for all poses, or once at the top level",
    ),
    "a name twice": (
        '[[pose]]\nname = "A"\n[[pose]]\nname = "A"\n',
        "4: pose 2, name: 'A' is already the name of an earlier pose",
    ),
    "a misspelt key": (TWO + "tiem_s = 1\n", "5: pose 2, tiem_s: unknown key; did you mean 'time_s'?"),
    "not a number": (TWO.replace("3]", "nan]"), "2: pose 1, xyz_mm 3: expected a finite number, got nan"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes(case: str, read: Callable[[str], PosesFile]) -> None:
    """A mistake is told with line, pose and key, with what was expected and what was got."""
    text, said = MISTAKES[case]

    with pytest.raises(FileFormatError) as caught:
        read(text)

    assert str(caught.value).partition("poses.toml:")[2].strip().startswith(said)
