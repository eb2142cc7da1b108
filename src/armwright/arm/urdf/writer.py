"""Arms as URDF files.

The frame of link i stands where joint i does, on frame i-1 of the table, and moves with the link: there URDF wants
it. So joint i+1 stands at A_i with joint i at 0, whose rpy are alpha, 0 and theta as they are in the table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import attrs
import numpy as np

from armwright.arm.collision_pairs import CollisionPairs
from armwright.arm.coupling import Coupling
from armwright.arm.drive import Motor
from armwright.arm.limits import Limits
from armwright.arm.losses import lost_beside_joints, lost_of_joint, mean_dry_friction
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Link
from armwright.arm.names import distinct_names, refuse_names_beyond_xml
from armwright.arm.positions import known_arm
from armwright.arm.urdf.geometry import primitives
from armwright.arm.urdf.robot import NO_LIMIT
from armwright.arrays import Array
from armwright.errors import ShapeError
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import elementary_rotation
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere


def urdf_text(arm: Arm, tilts: Sequence[float] | None = None) -> str:
    """Return an arm as the text of a URDF file.

    The links are ``base``, ``link_0`` (frame 0 of the table), ``link_1`` to ``link_n`` and ``tool``, the joints
    ``joint_1`` to ``joint_n`` and two fixed ones; links and joints that have names keep them. Where nothing is known of
    a limit, there stands 1e30: URDF wants a number. A joint that turns without end is of type continuous. Dry friction
    is one number in URDF: the mean of both ways.

    Args:
        arm: the arm; what of it URDF cannot hold, ``lost_in_urdf`` says.
        tilts: n rotations about y behind the rows of the table, as Hayati has them between parallel axes [rad]; none
            when left out.

    Raises:
        KindError: it is no arm.
        InvalidValueError: its name has characters that XML cannot hold.
        ShapeError: there are not as many tilts as joints.
    """
    tilts = (0.0,) * known_arm(arm).n if tilts is None else tilts
    if len(tilts) != arm.n:
        raise ShapeError(f"tilts: expected {arm.n} of them, one for each joint, got {len(tilts)}")
    refuse_names_beyond_xml(arm)
    root = _robot(_without_coupled_friction(arm), tilts)
    indent(root)
    return f"<?xml version='1.0' encoding='utf-8'?>\n{tostring(root, encoding='unicode')}\n"


def lost_in_urdf(arm: Arm) -> list[str]:
    """Say what of an arm URDF cannot hold, in sentences; none where nothing is lost."""
    own = _without_coupled_friction(arm)
    lost = [sentence for i in range(arm.n) for sentence in _lost_of_joint(own, i)]
    if arm.coupling is not None:
        lost += _lost_of_coupling(arm.coupling)
    lost += _lost_solids("base", arm.base_solids)
    if arm.collisions != CollisionPairs():
        lost.append("the pairs of bodies that are checked for collisions, or not, are not in the file")
    if not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        x, y, z = arm.gravity
        lost.append(f"gravity of ({x:g}, {y:g}, {z:g}) m/s² is not in the file: in URDF it points downwards along z")
    return [*lost, *lost_beside_joints(arm)]


def _lost_of_joint(arm: Arm, index: int) -> Iterator[str]:
    """Say what of one joint, from 0, and its link is lost."""
    motor, link, joint, label = arm.motors[index], arm.links[index], arm.joints[index], arm.joint_label(index)
    units = joint.units
    if joint.spring.stiffness:
        yield f"{label}: its spring of {joint.spring.stiffness:g} {units.stiffness} is not in the file"
    if motor.inertia:
        yield f"{label}: the inertia of the drive, {motor.inertia:g} {units.inertia}, is not in the file"
    yield from lost_of_joint(arm, index)
    yield from _lost_solids(f"link {index + 1}", link.solids)
    if link.unknown:
        yield f"link {index + 1}: its mass and inertia are unknown and not in the file: {link.unknown}"


def _without_coupled_friction(arm: Arm) -> Arm:
    """Return an arm without the friction of drives that do not move one joint alone: it is no friction of a joint."""
    if arm.coupling is None:
        return arm
    motors = list(arm.motors)
    for i in arm.coupling.mixed:
        motors[i] = Motor(inertia=motors[i].inertia, gear_ratio=motors[i].gear_ratio)
    return attrs.evolve(arm, motors=motors)


def _lost_of_coupling(coupling: Coupling) -> Iterator[str]:
    """Say what of coupled drives is lost: URDF has a drive for each joint."""
    if coupling.mixed:
        numbers = ", ".join(str(i + 1) for i in coupling.mixed)
        yield (
            f"the coupling of the drives {numbers} and their friction are not in the file: the joints {numbers} have "
            "no friction there"
        )
    if coupling.limits:
        yield "the limits of the drives are not in the file, only those of the joints"


def _lost_solids(body: str, solids: Sequence[Solid]) -> Iterator[str]:
    """Say what of the solids of a body is lost."""
    kinds = [type(solid.shape) for solid in solids]
    if Capsule in kinds:
        yield f"{body}: its capsules are cylinders with two spheres in the file"
    if Mesh in kinds:
        yield f"{body}: its meshes are not in the file"
    if any(solid.guessed for solid in solids):
        yield f"{body}: that its solids are guesses is not in the file"


def _robot(arm: Arm, tilts: Sequence[float]) -> Element:
    root = Element("robot", name=arm.name)
    own = [arm.base_link, "", *(link.name for link in arm.links), arm.tool_link]
    base, *moving, tool = distinct_names(own, ["base", *(f"link_{i}" for i in range(arm.n + 1)), "tool"])
    first, last = "base_to_link_0", f"link_{arm.n}_to_tool"
    own = ["", *(joint.name for joint in arm.joints), ""]
    _, *joints, _ = distinct_names(own, [first, *(f"joint_{i}" for i in range(1, arm.n + 1)), last])
    _shapes(SubElement(root, "link", name=base), arm.base_solids, np.eye(4))
    SubElement(root, "link", name=moving[0])
    _joint(root, (first, "fixed", base, moving[0]), to_rpy(arm.base[:3, :3]), arm.base[:3, 3])
    X, rpy = np.eye(4), np.zeros(3)
    for i, (joint, link, motor, tilt) in enumerate(zip(arm.joints, arm.links, arm.motors, tilts, strict=True)):
        endless = math.isinf(joint.limits.lower) and math.isinf(joint.limits.upper)
        kind = "prismatic" if not joint.revolute else "continuous" if endless else "revolute"
        element = _joint(root, (joints[i], kind, moving[i], moving[i + 1]), rpy, X[:3, 3])
        _limits_and_friction(element, joint.limits, motor)
        X = homogeneous(elementary_rotation(2, joint.theta), (0.0, 0.0, joint.d)) @ joint.behind
        # Where the row is four numbers the angles are those of the table.
        rpy = np.array((joint.alpha, 0.0, joint.theta)) if joint.fixed is None else to_rpy(X[:3, :3])
        body = SubElement(root, "link", name=moving[i + 1])
        _body(body, link, rpy, X)
        _shapes(body, link.solids, X)
        if tilt:
            X = X @ homogeneous(elementary_rotation(1, tilt), np.zeros(3))
            rpy = to_rpy(X[:3, :3])
    X = X @ arm.tool
    SubElement(root, "link", name=tool)
    _joint(root, (last, "fixed", moving[-1], tool), to_rpy(X[:3, :3]), X[:3, 3])
    return root


def _joint(root: Element, names: tuple[str, str, str, str], rpy: Array, xyz: Array) -> Element:
    """Append a joint, by its name, its type, its parent and its child."""
    name, kind, parent, child = names
    element = SubElement(root, "joint", name=name, type=kind)
    _origin(element, rpy, xyz)
    SubElement(element, "parent", link=parent)
    SubElement(element, "child", link=child)
    return element


def _limits_and_friction(joint: Element, limits: Limits, motor: Motor) -> None:
    SubElement(joint, "axis", xyz="0 0 1")
    stops = {} if joint.get("type") == "continuous" else {"lower": limits.lower, "upper": limits.upper}
    largest = {"effort": limits.effort, "velocity": limits.speed}
    if stops or not all(map(math.isinf, largest.values())):
        _numbers(joint, "limit", **stops, **largest)
    if motor.viscous or mean_dry_friction(motor):
        _numbers(joint, "dynamics", damping=motor.viscous, friction=mean_dry_friction(motor))


def _body(element: Element, link: Link, rpy: Array, X: Array) -> None:
    """Write the body of a link, whose frame in the table is at X in that of the file, if it has any."""
    if not link.mass and not link.inertia.any():
        return
    I, inertial = link.inertia, SubElement(element, "inertial")
    # The axes of the tensor stay those of the table.
    _origin(inertial, rpy, X[:3, :3] @ link.com + X[:3, 3])
    _numbers(inertial, "mass", value=link.mass)
    _numbers(inertial, "inertia", ixx=I[0, 0], iyy=I[1, 1], izz=I[2, 2], ixy=I[0, 1], ixz=I[0, 2], iyz=I[1, 2])


def _shapes(element: Element, solids: Sequence[Solid], X: Array) -> None:
    """Write the solids of a link, whose frame in the table is at X in that of the file: they are seen, and collide."""
    for tag in ("visual", "collision"):
        for solid in (primitive for each in solids for primitive in primitives(each)):
            shape, pose = SubElement(element, tag), X @ solid.pose
            _origin(shape, to_rpy(pose[:3, :3]), pose[:3, 3])
            geometry = SubElement(shape, "geometry")
            match solid.shape:
                case Box(size=size):
                    SubElement(geometry, "box", size=" ".join(map(_number, size)))
                case Cylinder(radius=radius, length=length):
                    _numbers(geometry, "cylinder", radius=radius, length=length)
                case Sphere(radius=radius):
                    _numbers(geometry, "sphere", radius=radius)


def _origin(element: Element, rpy: Array, xyz: Array) -> None:
    SubElement(element, "origin", xyz=" ".join(map(_number, xyz)), rpy=" ".join(map(_number, rpy)))


def _numbers(element: Element, tag: str, **numbers: float) -> None:
    SubElement(element, tag, {name: _number(number) for name, number in numbers.items()})


def _number(value: float) -> str:
    """Write a number so that it is read back to the last bit; one without bounds as the largest there is."""
    value = float(value) + 0.0
    return repr(math.copysign(NO_LIMIT, value) if math.isinf(value) else value)
