"""What stands in a URDF file: links and joints that make a tree, poses, bodies, limits and friction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.drive import Motor, Spring
from armwright.arm.limits import Limits
from armwright.arm.model import Link
from armwright.arm.tensors import impossible_moments, moments_message
from armwright.arm.tree.kinematic_tree import Mimic, check_lock, quoted
from armwright.arm.urdf.elements import Element, origin_of, read_elements
from armwright.arm.urdf.geometry import has_unread_shapes, solids_of
from armwright.arm.urdf.meshes import MeshFiles
from armwright.arrays import LARGEST_ANGLE, Array
from armwright.errors import FileFormatError, closest, one_of
from armwright.files.limits import limit, limit_message
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.spatial.shapes import LARGEST_SIZE, Solid

# URDF has numbers only: a limit of this size or more says that there is none. Our own writer puts it there.
NO_LIMIT = 1e30
_MOVING = ("revolute", "continuous", "prismatic")
_KINDS = ("fixed", *_MOVING, "planar", "floating")


@attrs.frozen(kw_only=True, eq=False)
class UrdfJoint:
    """A joint of the tree.

    Attributes:
        name: as in the file.
        kind: one of those URDF has; ``fixed`` also of one that is locked.
        locked: where it is held, of one that is locked [rad] or [m].
        parent: link it hangs on.
        child: link it carries.
        element: where it stands in the file.
        mimic: the joint that it follows; None of one that is free.
    """

    name: str
    kind: str
    parent: str
    child: str
    element: Element
    locked: float = 0.0
    mimic: Mimic | None = None

    @property
    def fixed(self) -> bool:
        """Whether the joint welds its links together."""
        return self.kind == "fixed"

    @property
    def prismatic(self) -> bool:
        """Whether the joint slides."""
        return self.kind == "prismatic"

    @property
    def anchor(self) -> Array:
        """A point (3,) of the axis in the frame of the child: its origin."""
        return np.zeros(3)

    @property
    def axis(self) -> Array:
        """Unit vector (3,) in the frame of the child; x where the file says nothing."""
        return axis_of(self)

    @property
    def origin(self) -> Array:
        """Pose (4, 4) of the child in the frame of the parent, the joint at 0, or where it is locked."""
        X = origin_of(self.element)
        if not self.locked:
            return X
        axis = axis_of(self) * self.locked
        if self.element.text("type") == "prismatic":
            return X @ homogeneous(np.eye(3), axis)
        return X @ homogeneous(rotation_from_vector(axis), np.zeros(3))

    def limits(self) -> tuple[Limits, list[str]]:
        """Return its limits, and sentences on what was taken for unknown."""
        return limits_of(self)

    def motor(self) -> tuple[Motor, list[str]]:
        """Return its friction."""
        return motor_of(self), []

    def spring(self) -> tuple[Spring, list[str]]:
        """Return that it has none: URDF has no springs."""
        return Spring(), []

    @property
    def holdable(self) -> bool:
        """Whether it can be held at a position."""
        return self.kind in _MOVING

    def held(self, position: float) -> UrdfJoint:
        """Return it as one that is held at a position [rad] or [m].

        Raises:
            FileFormatError: it cannot be that far away.
        """
        if not abs(position) <= LARGEST_ANGLE:
            raise self.error(f"it would be held at {position:g} (rad or m); expected at most {LARGEST_ANGLE:g}")
        return attrs.evolve(self, kind="fixed", locked=position)

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the joint."""
        return self.element.error("", message)

    def mimic_error(self, attribute: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of what the joint follows."""
        return self.element.require("mimic").error(attribute, message)

    def require_serial(self) -> None:
        """Refuse a joint that is no part of a serial arm.

        Raises:
            FileFormatError: it is planar, floating, or follows another joint.
        """
        if self.fixed:
            return
        if self.kind not in _MOVING:
            raise self.element.error("type", f"an arm cannot have a {self.kind} joint; expected {', '.join(_MOVING)}")
        if self.mimic is not None:
            leader = self.mimic.joint
            raise self.mimic_error(
                "",
                f"the joint mimics '{leader}'; an arm can only have independent joints: choose a tip before it, or "
                f"lock '{leader}', which holds this one where it follows to: lock=['{leader}'] (--lock {leader})",
            )


@attrs.frozen(kw_only=True, eq=False)
class Robot:
    """A URDF file.

    Attributes:
        path: the file.
        name: of the robot; that of the file where it has none.
        links: by name, in the order of the file.
        parent_joints: by the name of a link: the joint that carries it.
        child_joints: by the name of a link: the joints that hang on it.
        meshes: where the meshes of links are.
    """

    path: Path
    name: str
    links: dict[str, Element]
    parent_joints: dict[str, UrdfJoint]
    child_joints: dict[str, list[UrdfJoint]]
    meshes: MeshFiles

    @property
    def function(self) -> str:
        """The function that reads such files, in messages."""
        return "load_urdf"

    def default_base(self) -> str:
        """Return the link that hangs on nothing.

        Raises:
            FileFormatError: there are several.
        """
        roots = [name for name in self.links if name not in self.parent_joints]
        if len(roots) > 1:
            raise self.error(f"the base link is ambiguous: it could be {quoted(roots)}; specify one as base (--base)")
        return roots[0]

    def body(self, link: str) -> Link:
        """Return the body of a link, in its frame, with its solids."""
        return attrs.evolve(body_of(self.links[link]), solids=self.solids(link))

    def solids(self, link: str) -> tuple[Solid, ...]:
        """Return what of a link meets other bodies, in its frame."""
        return solids_of(self.links[link], self.meshes)

    def left_out(self, links: Sequence[str]) -> list[str]:
        """Return sentences on the shapes of links that are not read."""
        unread = [link for link in links if has_unread_shapes(self.links[link], self.meshes)]
        kinds = f"boxes, cylinders, spheres and capsules up to {LARGEST_SIZE:g} m"
        notes = [f"of shapes, {kinds} are read; links with others: {quoted(unread)}"] if unread else []
        return [*notes, *self.meshes.notes()]

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the whole file."""
        return FileFormatError(self.path, None, "", message)


def read_robot(
    path: Path, lock: Mapping[str, float] | None = None, packages: Mapping[str, Path | str] | None = None
) -> Robot:
    """Read a URDF file.

    Args:
        path: the file.
        lock: where joints are held by their names [rad] or [m], as if they were fixed.
        packages: folders of packages, by name, in which meshes are.

    Raises:
        MissingExtraError: the library that parses it is not installed.
        UnknownNameError: a joint to lock does not exist.
        InvalidValueError: a joint is to be held where its limits do not let it.
        FileFormatError: the file is missing, broken, or its links and joints make no tree.
    """
    root, lock = read_elements(path), lock or {}
    links: dict[str, Element] = {}
    for element in root.find_all("link"):
        if element.name in links:
            raise element.error("name", f"another link has this name, in line {links[element.name].line}")
        links[element.name] = element
    names: dict[str, UrdfJoint] = {}
    parent_joints: dict[str, UrdfJoint] = {}
    child_joints: dict[str, list[UrdfJoint]] = {name: [] for name in links}
    for element in root.find_all("joint"):
        joint = _joint(element, links, lock)
        if joint.name in names:
            raise element.error("name", f"another joint has this name, in line {names[joint.name].element.line}")
        if joint.child in parent_joints:
            other = parent_joints[joint.child].name
            raise element.error("child", f"link '{joint.child}' is already the child of joint '{other}'")
        names[joint.name] = parent_joints[joint.child] = joint
        child_joints[joint.parent].append(joint)
    for name in lock:
        one_of("joint", name, names)
    for joint in _followers(names, lock):
        parent_joints[joint.child] = joint
        child_joints[joint.parent] = [joint if each.name == joint.name else each for each in child_joints[joint.parent]]
    if not links:
        raise root.error("", "expected at least one <link> in <robot>")
    name = root.attributes.get("name") or path.stem
    meshes = MeshFiles(folder=path.parent, packages=packages or {})
    robot = Robot(
        path=path, name=name, links=links, parent_joints=parent_joints, child_joints=child_joints, meshes=meshes
    )
    _refuse_cycles(robot)
    return robot


def _joint(element: Element, links: dict[str, Element], lock: Mapping[str, float]) -> UrdfJoint:
    kind = element.text("type")
    if kind not in _KINDS:
        near = closest(kind, _KINDS)
        hint = f"; did you mean '{near}'?" if near else ""
        raise element.error("type", f"expected one of {', '.join(_KINDS)}, got '{kind}'{hint}")
    ends = []
    for tag in ("parent", "child"):
        end = element.require(tag)
        link = end.text("link")
        if link not in links:
            near = closest(link, links)
            hint = f"; did you mean '{near}'?" if near else ""
            raise end.error("link", f"there is no link '{link}'{hint}")
        ends.append(link)
    mimic = _mimic(element) if kind in _MOVING else None
    joint = UrdfJoint(name=element.name, kind=kind, parent=ends[0], child=ends[1], element=element, mimic=mimic)
    if joint.name not in lock:
        return joint
    position = lock[joint.name]
    check_lock(joint.name, kind, position, limits_of(joint)[0] if position and joint.holdable else None)
    return joint.held(position)


def _mimic(element: Element) -> Mimic | None:
    """Return the joint that a joint follows; None of one that is free."""
    mimic = element.find("mimic")
    if mimic is None:
        return None
    return Mimic(mimic.text("joint"), mimic.number("multiplier", 1.0), mimic.number("offset", 0.0))


def _followers(joints: Mapping[str, UrdfJoint], lock: Mapping[str, float]) -> Iterator[UrdfJoint]:
    """Give the joints that follow others, each as it follows one that follows none; held where that one is."""
    leaders: dict[str, list[str]] = {}
    for joint in joints.values():
        if joint.mimic is not None and joint.name not in lock:
            if joint.mimic.joint not in joints:
                near = closest(joint.mimic.joint, joints)
                hint = f"; did you mean '{near}'?" if near else ""
                raise joint.mimic_error("joint", f"there is no joint '{joint.mimic.joint}'{hint}")
            leaders[joint.name] = [joint.mimic.joint]
    try:
        order = list(TopologicalSorter(leaders).static_order())
    except CycleError as error:
        cycle = sorted(set(error.args[1]))
        raise joints[cycle[0]].mimic_error("joint", f"joints follow one another in a cycle: {quoted(cycle)}") from None
    whole: dict[str, Mimic] = {}
    for name in order:
        joint = joints[name]
        if name not in leaders or joint.mimic is None:
            continue
        leader, multiplier, offset = joint.mimic
        if (before := whole.get(leader)) is not None:
            leader, offset = before.joint, multiplier * before.offset + offset
            multiplier *= before.multiplier
        whole[name] = Mimic(leader, multiplier, offset)
        follower = attrs.evolve(joint, mimic=whole[name])
        yield follower.held(whole[name].position(lock[leader])) if leader in lock else follower


def _refuse_cycles(robot: Robot) -> None:
    """Refuse links that hang on one another in a cycle."""
    try:
        TopologicalSorter({child: [joint.parent] for child, joint in robot.parent_joints.items()}).prepare()
    except CycleError as error:
        cycle = sorted(set(error.args[1]))
        joint = robot.parent_joints[cycle[0]]
        raise joint.element.error("", f"links form a cycle: {', '.join(map(repr, cycle))}") from None


def axis_of(joint: UrdfJoint) -> Array:
    """Return the axis of a joint as a unit vector (3,) in the frame of its child.

    Raises:
        FileFormatError: it is no axis.
    """
    element = joint.element.find("axis")
    if element is None:
        return np.array((1.0, 0.0, 0.0))
    axis = element.vector("xyz", (1.0, 0.0, 0.0))
    largest = float(np.abs(axis).max())
    if largest == 0:
        raise element.error("xyz", "expected a direction, got the axis 0 0 0")
    axis = axis / largest  # an axis of any length has a direction, though its square may be no number
    return np.asarray(axis / np.linalg.norm(axis))


def body_of(link: Element) -> Link:
    """Return the body of a link in the frame of the link; one without mass where the file gives none.

    Where the moments are those of no body, nothing is known of it but its name and why.

    Raises:
        FileFormatError: mass or inertia are missing, or no numbers.
    """
    inertial = link.find("inertial")
    if inertial is None:
        return Link()
    X = origin_of(inertial)
    mass = inertial.require("mass").number("value", lower=0.0)
    element = inertial.require("inertia")
    xx, yy, zz, xy, xz, yz = (element.number(key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = impossible_moments(mass, X[:3, 3], tensor)
    if moments is not None:
        return Link(unknown=str(element.error("", moments_message(moments))))
    R = X[:3, :3]
    return Link(mass=mass, com=X[:3, 3], inertia=R @ tensor @ R.T, complete=False)


def limits_of(joint: UrdfJoint) -> tuple[Limits, list[str]]:
    """Return the limits of a joint, and sentences on what was taken for unknown.

    Raises:
        FileFormatError: there are none where the kind of joint needs them, or nothing can satisfy them.
    """
    element = joint.element.find("limit")
    if element is None:
        if joint.kind == "continuous":
            return Limits(), []
        message = f"a {joint.kind} joint needs <limit>; a joint without limits has the type continuous"
        raise joint.element.error("", message)
    largest, notes = {}, []
    for name, key in (("effort", "effort"), ("speed", "velocity")):
        value = element.number(key, math.inf, lower=0.0)
        if value == 0:
            notes.append(f"joint '{joint.name}': a maximum {key} of 0 is interpreted as unknown")
        largest[name] = value if 0 < value < NO_LIMIT else math.inf
    if joint.kind == "continuous":
        return Limits(**largest), notes
    lower, upper = element.number("lower", 0.0), element.number("upper", 0.0)
    if not lower < upper:
        still = ", one that does not move the type fixed" if lower == upper else ""
        raise element.error(
            "",
            f"the lower limit must be below the upper, got {lower:g} and {upper:g}, where an omitted one is 0; a "
            f"joint without limits has the type continuous{still}",
        )
    lower, upper = (value if abs(value) < NO_LIMIT else math.copysign(math.inf, value) for value in (lower, upper))
    most = limit("revolutions") * math.tau
    for key, value in (("lower", lower), ("upper", upper)):
        if joint.kind == "revolute" and most < abs(value) < math.inf:
            raise element.error(
                key,
                f"too far from zero: {limit_message('revolutions', f'{value:g} rad')}; "
                "a joint without limits has the type continuous",
            )
    return Limits(lower=lower, upper=upper, **largest), notes


def motor_of(joint: UrdfJoint) -> Motor:
    """Return the friction of a joint; the dry one is the same both ways.

    Raises:
        FileFormatError: it is negative.
    """
    element = joint.element.find("dynamics")
    if element is None:
        return Motor()
    dry = element.number("friction", 0.0, lower=0.0)
    viscous = element.number("damping", 0.0, lower=0.0)
    return Motor(viscous=viscous, coulomb_forward=dry, coulomb_backward=dry)
