"""Arms as URDF files.

The frame of link i stands where joint i does, on frame i-1 of the table, and moves with the link: there URDF wants
it. So joint i+1 stands at A_i with joint i at 0, whose rpy are alpha, 0 and theta as they are in the table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from armwright.arm.dh import turn
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Joint, Limits, Motor
from armwright.arm.urdf.robot import NO_LIMIT
from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import homogeneous


def urdf_text(arm: Arm, tilts: Sequence[float] | None = None) -> str:
    """Return an arm as the text of a URDF file.

    The links are ``base``, ``link_0`` (frame 0 of the table), ``link_1`` to ``link_n`` and ``tool``, the joints
    ``joint_1`` to ``joint_n`` and two fixed ones; links and joints that have names keep them. Where nothing is known of
    a limit, there stands 1e30: URDF wants a number. A joint that turns without end is of type continuous. Dry friction
    is one number in URDF: the mean of both ways.

    Args:
        arm: the arm; what of it URDF cannot hold, ``lost_in_urdf`` says.
        tilts: n turns about y behind the rows of the table, as Hayati has them between parallel axes [rad]; none when
            left out.

    Raises:
        InvalidValueError: its name has characters that XML cannot hold.
        ShapeError: there are not as many tilts as joints.
    """
    tilts = (0.0,) * arm.n if tilts is None else tilts
    if len(tilts) != arm.n:
        raise ShapeError(f"tilts: expected {arm.n} of them, one for each joint, got {len(tilts)}")
    parts = [*(joint.name for joint in arm.joints), *(link.name for link in arm.links)]
    for name in (arm.name, arm.base_link, arm.tool_link, *parts):
        if not all(_in_xml(character) for character in name):
            raise InvalidValueError(
                f"arm {arm.name!r}: XML cannot represent every character of this name: {name!r}; choose another"
            )
    return "\n".join(["<?xml version='1.0' encoding='utf-8'?>", *_robot(arm, tilts), ""])


def lost_in_urdf(arm: Arm) -> list[str]:
    """Say what of an arm URDF cannot hold, in sentences; none where nothing is lost."""
    lost = [sentence for i in range(arm.n) for sentence in _lost_of_joint(arm, i)]
    if not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        x, y, z = arm.gravity
        lost.append(f"gravity of ({x:g}, {y:g}, {z:g}) m/s² is not in the file: in URDF it points downwards along z")
    for name, value, unit in (("reach", arm.reach, "m"), ("hand speed", arm.tool_speed, "m/s")):
        if math.isfinite(value):
            lost.append(f"the {name} of {value:g} {unit} is not in the file")
    if arm.uncertainty is not None:
        lost.append("the uncertainty of its dimensions is not in the file")
    lost += [f"the {name} is not in the file" for name in ("title", "source") if getattr(arm, name)]
    return lost


def _lost_of_joint(arm: Arm, at: int) -> Iterator[str]:
    """Say what of one joint, from 0, and its link is lost."""
    called, joint, motor, link = arm.called(at), arm.joints[at], arm.motors[at], arm.links[at]
    units = joint.units
    if motor.inertia:
        yield f"{called}: the inertia of the drive, {motor.inertia:g} {units.inertia}, is not in the file"
    if motor.gear_ratio != 1:
        yield f"{called}: the gear ratio {motor.gear_ratio:g} is not in the file"
    if motor.coulomb_forward != motor.coulomb_backward:
        yield (
            f"{called}: Coulomb friction of {motor.coulomb_forward:g} {units.effort} forward and "
            f"{motor.coulomb_backward:g} {units.effort} backward is {_dry(motor):g} {units.effort} in both "
            "directions in the file"
        )
    if math.isfinite(joint.limits.acceleration):
        largest = f"{joint.limits.acceleration:g} {units.position}/s²"
        yield f"{called}: the maximum acceleration, {largest}, is not in the file"
    if link.unknown:
        yield f"link {at + 1}: its mass and inertia are unknown and not in the file: {link.unknown}"


def _robot(arm: Arm, tilts: Sequence[float]) -> Iterator[str]:
    yield f"<robot name={_quoted(arm.name)}>"
    given = [arm.base_link, "", *(link.name for link in arm.links), arm.tool_link]
    links = _names(given, ["base", *(f"link_{i}" for i in range(arm.n + 1)), "tool"])
    first, last = "base_to_link_0", f"link_{arm.n}_to_tool"
    _, *joints, _ = _names(
        ["", *(joint.name for joint in arm.joints), ""], [first, *(f"joint_{i}" for i in range(1, arm.n + 1)), last]
    )
    base, *moving, tool = links
    yield f"  <link name={_quoted(base)}/>"
    yield f"  <link name={_quoted(moving[0])}/>"
    yield from _weld(first, base, moving[0], _origin(to_rpy(arm.base[:3, :3]), arm.base[:3, 3]))
    X = np.eye(4)
    origin = _origin(np.zeros(3), np.zeros(3))
    for i, (joint, motor) in enumerate(zip(arm.joints, arm.motors, strict=True), 1):
        yield from _joint(joint, motor, origin, (joints[i - 1], moving[i - 1], moving[i]))
        X = homogeneous(turn(2, joint.theta), (0.0, 0.0, joint.d)) @ joint.behind
        origin = _origin(_rpy(joint, X), X[:3, 3])
        yield from _link(arm, i, X, moving[i])
        if tilts[i - 1]:
            X = X @ homogeneous(turn(1, tilts[i - 1]), np.zeros(3))
            origin = _origin(to_rpy(X[:3, :3]), X[:3, 3])
    X = X @ arm.tool
    yield f"  <link name={_quoted(tool)}/>"
    yield from _weld(last, moving[-1], tool, _origin(to_rpy(X[:3, :3]), X[:3, 3]))
    yield "</robot>"


def _names(given: Sequence[str], otherwise: Sequence[str]) -> list[str]:
    """Return names that differ: those that are given, and others where none is, or it is taken already."""
    taken: list[str] = []
    for name, other in zip(given, otherwise, strict=True):
        one = name if name and name not in taken else other
        while one in taken or (one != name and one in given):
            one += "_"
        taken.append(one)
    return taken


def _rpy(joint: Joint, X: Array) -> Array:
    """Return roll, pitch and yaw of a frame: as they stand in the table, where the row is four numbers."""
    return np.array((joint.alpha, 0.0, joint.theta)) if joint.fixed is None else to_rpy(X[:3, :3])


def _joint(joint: Joint, motor: Motor, origin: str, names: tuple[str, str, str]) -> Iterator[str]:
    kind = "prismatic" if not joint.revolute else "continuous" if _endless(joint.limits) else "revolute"
    name, parent, child = map(_quoted, names)
    yield f'  <joint name={name} type="{kind}">'
    yield f"    {origin}"
    yield f"    <parent link={parent}/>"
    yield f"    <child link={child}/>"
    yield '    <axis xyz="0 0 1"/>'
    limits = joint.limits
    stops = {} if kind == "continuous" else {"lower": limits.lower, "upper": limits.upper}
    largest = {"effort": limits.effort, "velocity": limits.speed}
    if stops or not all(map(math.isinf, largest.values())):
        yield f"    <limit {_attributes({**stops, **largest})}/>"
    if motor.viscous or _dry(motor):
        yield f"    <dynamics {_attributes({'damping': motor.viscous, 'friction': _dry(motor)})}/>"
    yield "  </joint>"


def _link(arm: Arm, i: int, X: Array, name: str) -> Iterator[str]:
    """Write the body of link i, whose frame in the table is at X in that of the file."""
    joint, link = arm.joints[i - 1], arm.links[i - 1]
    if not link.mass and not link.inertia.any():
        yield f"  <link name={_quoted(name)}/>"
        return
    I = link.inertia
    tensor = {"ixx": I[0, 0], "iyy": I[1, 1], "izz": I[2, 2], "ixy": I[0, 1], "ixz": I[0, 2], "iyz": I[1, 2]}
    yield f"  <link name={_quoted(name)}>"
    yield "    <inertial>"
    # The axes of the tensor stay those of the table.
    yield f"      {_origin(_rpy(joint, X), X[:3, :3] @ link.com + X[:3, 3])}"
    yield f"      <mass {_attributes({'value': link.mass})}/>"
    yield f"      <inertia {_attributes(tensor)}/>"
    yield "    </inertial>"
    yield "  </link>"


def _weld(name: str, parent: str, child: str, origin: str) -> Iterator[str]:
    yield f'  <joint name={_quoted(name)} type="fixed">'
    yield f"    {origin}"
    yield f"    <parent link={_quoted(parent)}/>"
    yield f"    <child link={_quoted(child)}/>"
    yield "  </joint>"


def _origin(rpy: Array, xyz: Array) -> str:
    return f'<origin xyz="{" ".join(map(_number, xyz))}" rpy="{" ".join(map(_number, rpy))}"/>'


def _attributes(numbers: dict[str, float]) -> str:
    return " ".join(f'{name}="{_number(number)}"' for name, number in numbers.items())


def _number(value: float) -> str:
    """Write a number so that it is read back to the last bit; one without bounds as the largest there is."""
    value = float(value) + 0.0
    return repr(math.copysign(NO_LIMIT, value) if math.isinf(value) else value)


def _endless(limits: Limits) -> bool:
    return math.isinf(limits.lower) and math.isinf(limits.upper)


def _dry(motor: Motor) -> float:
    return (motor.coulomb_forward + motor.coulomb_backward) / 2


def _quoted(name: str) -> str:
    return quoteattr(name, _LINE_ENDS)


def _in_xml(character: str) -> bool:
    code = ord(character)
    return code in {0x9, 0xA, 0xD} or 0x20 <= code <= 0xD7FF or 0xE000 <= code <= 0xFFFD or code >= 0x10000


_LINE_ENDS = {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
