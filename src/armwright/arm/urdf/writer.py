"""Arms as URDF files.

The frame of link i stands where joint i does, on frame i-1 of the table, and moves with the link: there URDF wants
it. So joint i+1 stands at A_i with joint i at 0, whose rpy are alpha, 0 and theta as they are in the table.
"""

import math
from collections.abc import Iterator, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from armwright.arm.dh import turn, twist
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Joint, Limits, Motor
from armwright.arm.urdf.robot import NO_LIMIT
from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import pose


def urdf_text(arm: Arm, tilts: Sequence[float] | None = None) -> str:
    """Return an arm as the text of a URDF file.

    The links are ``base``, ``link_0`` (frame 0 of the table), ``link_1`` to ``link_n`` and ``tool``, the joints
    ``joint_1`` to ``joint_n`` and two fixed ones. Where nothing is known of a limit, there stands 1e30: URDF wants a
    number. A joint that turns without end is of type continuous. Dry friction is one number in URDF: the mean of both
    ways.

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
    if not all(_in_xml(character) for character in arm.name):
        raise InvalidValueError(f"arm {arm.name!r}: XML cannot hold every character of this name; give it another")
    return "\n".join(["<?xml version='1.0' encoding='utf-8'?>", *_robot(arm, tilts), ""])


def lost_in_urdf(arm: Arm) -> list[str]:
    """Say what of an arm URDF cannot hold, in sentences; none where nothing is lost."""
    lost = []
    for i, (joint, motor) in enumerate(zip(arm.joints, arm.motors, strict=True), 1):
        dry = "N m" if joint.revolute else "N"
        if motor.inertia:
            unit = "kg m²" if joint.revolute else "kg"
            lost.append(f"joint {i}: the inertia of the drive, {motor.inertia:g} {unit}, is not in the file")
        if motor.gear_ratio != 1:
            lost.append(f"joint {i}: the gear ratio {motor.gear_ratio:g} is not in the file")
        if motor.coulomb_forward != motor.coulomb_backward:
            lost.append(
                f"joint {i}: dry friction of {motor.coulomb_forward:g} {dry} forward and "
                f"{motor.coulomb_backward:g} {dry} backward is {_dry(motor):g} {dry} either way in the file"
            )
        if math.isfinite(joint.limits.acceleration):
            unit = "rad/s²" if joint.revolute else "m/s²"
            lost.append(
                f"joint {i}: the largest acceleration, {joint.limits.acceleration:g} {unit}, is not in the file"
            )
    if not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        x, y, z = arm.gravity
        lost.append(f"gravity of ({x:g}, {y:g}, {z:g}) m/s² is not in the file: URDF has it pointing down the z axis")
    for name, value, unit in (("reach", arm.reach, "m"), ("hand speed", arm.tool_speed, "m/s")):
        if math.isfinite(value):
            lost.append(f"the {name} of {value:g} {unit} is not in the file")
    if arm.uncertainty is not None:
        lost.append("how well its dimensions are known is not in the file")
    lost += [f"the {name} is not in the file" for name in ("title", "source") if getattr(arm, name)]
    return lost


def _robot(arm: Arm, tilts: Sequence[float]) -> Iterator[str]:
    yield f"<robot name={quoteattr(arm.name, _LINE_ENDS)}>"
    yield '  <link name="base"/>'
    yield '  <link name="link_0"/>'
    yield from _weld("base_to_link_0", "base", "link_0", _origin(to_rpy(arm.base[:3, :3]), arm.base[:3, 3]))
    X = np.eye(4)
    origin = _origin(np.zeros(3), np.zeros(3))
    for i, (joint, motor) in enumerate(zip(arm.joints, arm.motors, strict=True), 1):
        yield from _joint(i, joint, motor, origin)
        X = pose(turn(2, joint.theta), (0.0, 0.0, joint.d)) @ twist(joint.alpha, joint.a)
        origin = _origin(np.array((joint.alpha, 0.0, joint.theta)), X[:3, 3])
        yield from _link(arm, i, X)
        if tilts[i - 1]:
            X = X @ pose(turn(1, tilts[i - 1]), np.zeros(3))
            origin = _origin(to_rpy(X[:3, :3]), X[:3, 3])
    X = X @ arm.tool
    yield '  <link name="tool"/>'
    yield from _weld(f"link_{arm.n}_to_tool", f"link_{arm.n}", "tool", _origin(to_rpy(X[:3, :3]), X[:3, 3]))
    yield "</robot>"


def _joint(i: int, joint: Joint, motor: Motor, origin: str) -> Iterator[str]:
    kind = "prismatic" if not joint.revolute else "continuous" if _endless(joint.limits) else "revolute"
    yield f'  <joint name="joint_{i}" type="{kind}">'
    yield f"    {origin}"
    yield f'    <parent link="link_{i - 1}"/>'
    yield f'    <child link="link_{i}"/>'
    yield '    <axis xyz="0 0 1"/>'
    limits = joint.limits
    stops = {} if kind == "continuous" else {"lower": limits.lower, "upper": limits.upper}
    largest = {"effort": limits.effort, "velocity": limits.speed}
    if stops or not all(map(math.isinf, largest.values())):
        yield f"    <limit {_attributes({**stops, **largest})}/>"
    if motor.viscous or _dry(motor):
        yield f"    <dynamics {_attributes({'damping': motor.viscous, 'friction': _dry(motor)})}/>"
    yield "  </joint>"


def _link(arm: Arm, i: int, X: Array) -> Iterator[str]:
    """Write the body of link i, whose frame in the table is at X in that of the file."""
    joint, link = arm.joints[i - 1], arm.links[i - 1]
    if not link.mass and not link.inertia.any():
        yield f'  <link name="link_{i}"/>'
        return
    I = link.inertia
    tensor = {"ixx": I[0, 0], "iyy": I[1, 1], "izz": I[2, 2], "ixy": I[0, 1], "ixz": I[0, 2], "iyz": I[1, 2]}
    yield f'  <link name="link_{i}">'
    yield "    <inertial>"
    # The axes of the tensor stay those of the table.
    yield f"      {_origin(np.array((joint.alpha, 0.0, joint.theta)), X[:3, :3] @ link.com + X[:3, 3])}"
    yield f"      <mass {_attributes({'value': link.mass})}/>"
    yield f"      <inertia {_attributes(tensor)}/>"
    yield "    </inertial>"
    yield "  </link>"


def _weld(name: str, parent: str, child: str, origin: str) -> Iterator[str]:
    yield f'  <joint name="{name}" type="fixed">'
    yield f"    {origin}"
    yield f'    <parent link="{parent}"/>'
    yield f'    <child link="{child}"/>'
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


def _in_xml(character: str) -> bool:
    code = ord(character)
    return code in {0x9, 0xA, 0xD} or 0x20 <= code <= 0xD7FF or 0xE000 <= code <= 0xFFFD or code >= 0x10000


_LINE_ENDS = {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
