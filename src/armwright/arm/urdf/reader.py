"""Arms from URDF files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arm.tree.kinematic_tree import Lock, locked_positions
from armwright.arm.tree.serial_arm import Reading, serial_arm
from armwright.arm.urdf.robot import read_robot
from armwright.errors import KindError, shown
from armwright.files.inputs import file_path


def load_urdf(
    path: Path | str,
    *,
    base: str | None = None,
    tip: str | None = None,
    lock: Lock = (),
    packages: Mapping[str, Path | str] | None = None,
) -> Arm:
    """Return the serial arm between two links of a URDF file.

    Positions of the arm are those of the joints in the file; the base is the frame of the base link, the tool that of
    the tip link. Fixed joints weld links together. Gravity points down in the root link of the file.

    Args:
        path: the file; what is read of it is in docs/arms.md.
        base: name of the link that stands still; the one that hangs on nothing when left out.
        tip: name of the link that is the tool; when left out the only one at the end of moving joints, or the link
            that carries all of them.
        lock: names of joints that are held at 0, as if they were fixed, such as those of a gripper; or where joints
            are held by their names [rad] or [m]. Others beside the chain are held at 0, or in the middle if their
            limits exclude 0, or where they follow to.
        packages: folders of packages, by name, in which the meshes are that the file names as ``package://NAME/...``;
            others are looked for below the folder of the file.

    Raises:
        KindError: ``path`` is no path, ``packages`` no mapping, ``lock`` one text, or a position no number.
        InvalidValueError: a joint is to be held where its limits do not let it.
        MissingExtraError: lxml is not installed.
        UnknownNameError: there is no link, or no joint, of that name.
        FileFormatError: the file is missing, broken, or has no such arm; the text has file, line and key.
    """
    return read_urdf(path, base=base, tip=tip, lock=lock, packages=packages).arm


def read_urdf(
    path: Path | str,
    *,
    base: str | None = None,
    tip: str | None = None,
    lock: Lock = (),
    packages: Mapping[str, Path | str] | None = None,
) -> Reading:
    """Return the serial arm between two links of a URDF file, and what was not taken as it stands.

    Arguments and errors are those of ``load_urdf``.
    """
    if not isinstance(path, str | Path):
        raise KindError(f"path: expected the path of a URDF file, got {shown(path)}")
    if packages is not None and not isinstance(packages, Mapping):
        raise KindError(f"packages: expected folders by the names of packages, got {shown(packages)}")
    for name, folder in (packages or {}).items():
        if not isinstance(name, str) or not isinstance(folder, str | Path):
            raise KindError(f"packages: expected the path of a folder for {shown(name)}, got {shown(folder)}")
    robot = read_robot(file_path(path), locked_positions(lock), packages)
    return serial_arm(robot, base, tip, UPRIGHT_GRAVITY)
