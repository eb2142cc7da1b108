"""Logs from recordings of robots: the joint states of MCAP files and of bags of ROS 2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import ArrayLike
from armwright.errors import FileFormatError, InvalidValueError, UnknownNameError, listed
from armwright.files.logs.joint_log import JointLog, JointStates, read_joint_log
from armwright.identification.log import Log, with_gains
from armwright.motion.joint_tracking import is_planned

_SUFFIXES = (".mcap", ".db3")
_MAX_NAMED = 12


def is_recording(path: Path) -> bool:
    """Whether a path is that of an MCAP file, a database of ROS 2, or a folder, which may be a bag."""
    return path.suffix.lower() in _SUFFIXES or path.is_dir()


def read_recording(
    path: Path,
    arm: Arm,
    *,
    gains: ArrayLike | None = None,
    topic: str | None = None,
    renamed: Mapping[str, str] | None = None,
    joint_names: Sequence[str] = (),
) -> Log:
    """Read the log of an arm from a recording.

    Joints are found by their names, or by their order where the arm and the recording have no name in common. Messages
    that do not have them all, such as those of a gripper, are left out.

    Args:
        path: an MCAP file, a database ``.db3``, or the folder of a bag.
        arm: that moved, with n joints.
        gains: (n,) effort at the joint per current, where the efforts of the recording are currents.
        topic: of its joint states; the only one with efforts that is no plan when left out.
        renamed: names of joints, ``joint_1`` for the first, by those in the recording.
        joint_names: (n,) of an arm whose joints have none of their own.

    Raises:
        FileFormatError: the recording is missing or damaged, or has no efforts of such joints.
        UnknownNameError: there is no such topic.
        InvalidValueError: several topics may be meant.
        MissingExtraError: what reads it is not installed.
    """
    states = _topic(read_joint_log(path), arm, topic)
    names = [joint.name or known for joint, known in zip(arm.joints, joint_names or [""] * arm.n, strict=True)]
    found = _columns(path, states, names, renamed or {})
    ordered = f"{path.name}: its joints are taken in their order: {listed(list(states.names), _MAX_NAMED)}"
    states, notes = (states, (ordered,)) if found is None else (states.of_joints(found), ())
    # Drivers that know of no effort often send zeros.
    for what, there in (("positions", np.isfinite(states.q)), ("efforts", np.nan_to_num(states.tau) != 0)):
        if not there.any():
            raise FileFormatError(path, None, states.topic, f"expected positions and efforts, and it has no {what}")
    complete = np.isfinite(states.q).all(axis=1) & np.isfinite(states.tau).all(axis=1)
    measured = complete & np.isfinite(states.qd).all(axis=1)
    # Velocities that some messages have and others do not are no use.
    has_velocities = complete.any() and bool((measured == complete).all()) and bool(states.qd[complete].any())
    try:
        log = Log.of_readings(
            path.name,
            states.t[complete],
            states.q[complete],
            states.tau[complete],
            states.qd[complete] if has_velocities else None,
        )
    except InvalidValueError as error:
        raise FileFormatError(path, None, states.topic, str(error)) from error
    log = attrs.evolve(log, notes=(*notes, *log.notes))
    return log if gains is None else with_gains(log, gains)


def _topic(recording: JointLog, arm: Arm, topic: str | None) -> JointStates:
    """Return the joint states that are meant."""
    topics = recording.topics
    if topic is not None:
        if topic not in topics:
            raise UnknownNameError("topic", topic, topics)
        return topics[topic]
    measured = [name for name in topics if not is_planned(name)] or list(topics)
    meant = [
        name for name in measured if np.isfinite(topics[name].tau).any() and len(topics[name].names) >= arm.n
    ] or measured
    if len(meant) > 1:
        raise InvalidValueError(
            f"{recording.path}: several topics have joint states: {listed(meant, _MAX_NAMED)}; --topic names the one "
            f"of {arm.name}"
        )
    return topics[meant[0]]


def _columns(path: Path, states: JointStates, joints: Sequence[str], renamed: Mapping[str, str]) -> list[str] | None:
    """Return the names that the joints of an arm have in a recording; None where it knows none of them."""
    own: dict[str, str] = {}
    for name in states.names:
        # Names may stand behind that of the robot: ``ur/shoulder_pan_joint``.
        own |= {name.rpartition("/")[2]: name, renamed.get(name, name): name}
    found = [own.get(name) or own.get(f"joint_{i}") for i, name in enumerate(joints, 1)]
    names = [name for name in found if name is not None]
    if not names and len(states.names) == len(joints):
        return None
    if len(set(names)) < len(joints):
        missing = [name or f"joint_{i}" for i, (name, got) in enumerate(zip(joints, found, strict=True), 1) if not got]
        raise FileFormatError(
            path,
            None,
            states.topic,
            f"no joint {listed(missing, _MAX_NAMED)}, only {listed(list(states.names), _MAX_NAMED)}; --columns "
            "NAME=joint_1,... says which is which",
        )
    return names
