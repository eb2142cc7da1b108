"""Arms from MJCF files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.mjcf.compiled import compile_mjcf
from armwright.arm.mjcf.couplings import with_coupling
from armwright.arm.mjcf.elements import read_text
from armwright.arm.mjcf.tree import MjcfTree, tree_of
from armwright.arm.model import Arm
from armwright.arm.tree.kinematic_tree import Lock, locked_positions
from armwright.arm.tree.serial_arm import Reading, serial_arm
from armwright.errors import FileFormatError, InvalidValueError, KindError, ShapeError, shown
from armwright.files.inputs import file_path
from armwright.mujoco_library import load_mujoco


def load_mjcf(path: Path | str, *, base: str | None = None, tip: str | None = None, lock: Lock = ()) -> Arm:
    """Return the serial arm between two bodies of an MJCF file, the format of MuJoCo.

    Positions of the arm are those of the joints in the file; the base is the frame of the base body, the tool that of
    the tip, a body or a site. Gravity is that of the file.

    Args:
        path: the file; what is read of it is in docs/arms.md.
        base: name of the body that stands still; when left out the one in the world that carries the joints, or the
            world itself where that body moves.
        tip: name of the body or site that is the tool; when left out the only one at the end of moving joints, or the
            body that carries all of them.
        lock: names of joints that are held at 0, as if they were fixed, such as those of a gripper; or where joints
            are held by their names [rad] or [m]. Others beside the chain are held at 0, or in the middle if their
            limits exclude 0.

    Raises:
        KindError: ``path`` is no path, ``lock`` one text, or a position no number.
        InvalidValueError: a joint is to be held where its limits do not let it.
        MissingExtraError: MuJoCo cannot be loaded.
        UnknownNameError: there is no body or site, or no joint, of that name.
        FileFormatError: the file is missing, broken, or has no such arm; the text has file, line and key.
    """
    return read_mjcf(path, base=base, tip=tip, lock=lock).arm


def read_mjcf(path: Path | str, *, base: str | None = None, tip: str | None = None, lock: Lock = ()) -> Reading:
    """Return the serial arm between two bodies of an MJCF file, and what was not taken as it stands.

    Arguments and errors are those of ``load_mjcf``.
    """
    if not isinstance(path, str | Path):
        raise KindError(f"path: expected the path of an MJCF file, got {shown(path)}")
    path = file_path(path)
    return arm_in(read_tree(path, locked_positions(lock)), base, tip)


def read_tree(path: Path, lock: Mapping[str, float] | None = None) -> MjcfTree:
    """Return the bodies and joints of an MJCF file.

    Args:
        path: the file.
        lock: where joints are held by their names [rad] or [m], as if they were fixed.

    Raises:
        MissingExtraError: MuJoCo cannot be loaded.
        UnknownNameError: a joint to lock does not exist.
        InvalidValueError: a joint is to be held where its limits do not let it.
        FileFormatError: the file is missing, broken, or no MJCF.
    """
    text = read_text(path)
    return tree_of(path, text.name or path.stem, compile_mjcf(path, text), lock or {})


def arm_in(tree: MjcfTree, base: str | None = None, tip: str | None = None) -> Reading:
    """Return the arm between two links of a tree, and what was not taken as it stands.

    Raises:
        UnknownNameError: there is no link of that name.
        FileFormatError: there is no such arm.
    """
    mujoco = load_mujoco()
    model = tree.model
    gravity = model.opt.gravity * (not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    try:
        reading = serial_arm(tree, base, tip, np.array(gravity), "stated")
        numbers = {joint.name: joint.number for joint in tree.parent_joints.values() if joint.number >= 0}
        return attrs.evolve(reading, arm=with_coupling(model, reading.arm, numbers))
    except (InvalidValueError, ShapeError) as error:
        raise FileFormatError(tree.path, None, "", str(error)) from error
