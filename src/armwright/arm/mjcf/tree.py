"""The bodies and joints of a model of MuJoCo as a tree of links and joints.

Links are bodies, and sites, which are fixed to theirs. A body with several joints is one link for each, all but the
last without mass. MuJoCo's positions count from where the joints stand in the file only where ``ref`` is 0; the tree
has its joints at 0 of the positions.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arm.drive import Motor, Spring
from armwright.arm.limits import Limits
from armwright.arm.mjcf.couplings import couplings
from armwright.arm.mjcf.drives import limits_of, motor_of, spring_of
from armwright.arm.mjcf.solids import ellipsoids_of, pose_of, solids_of
from armwright.arm.model import Link
from armwright.arm.tree.kinematic_tree import check_lock, quoted
from armwright.arrays import Array
from armwright.errors import FileFormatError, one_of
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_quaternion, rotation_from_vector
from armwright.spatial.shapes import Solid

WORLD = "world"
_KINDS = ("free", "ball", "slide", "hinge")
_MOVING = ("slide", "hinge")


@attrs.frozen(kw_only=True, eq=False)
class MjcfJoint:
    """A joint of the tree.

    Attributes:
        path: the file.
        name: as in the file, or by its number.
        kind: ``hinge``, ``slide``, ``ball``, ``free``, or ``fixed``.
        parent: the link it hangs on.
        child: the link it carries.
        model: of MuJoCo.
        number: in the model; -1 of one that is not in it.
        before: (4, 4) pose of the child in the frame of the parent, the joint where it stands in the file.
        coupled: what else moves it, in words; empty where nothing does.
        locked: where it is held, of one that is locked [rad] or [m].
    """

    path: Path
    name: str
    kind: str
    parent: str
    child: str
    model: Any
    number: int = -1
    before: Array = attrs.field(factory=lambda: np.eye(4))
    coupled: str = ""
    locked: float | None = None

    @property
    def fixed(self) -> bool:
        """Whether it welds its links together."""
        return self.kind == "fixed" or self.locked is not None

    @property
    def prismatic(self) -> bool:
        """Whether it slides."""
        return self.kind == "slide"

    @property
    def axis(self) -> Array:
        """Unit vector (3,) in the frame of the child."""
        return np.array(self.model.jnt_axis[self.number])

    @property
    def anchor(self) -> Array:
        """A point (3,) of the axis in the frame of the child [m]."""
        return np.array(self.model.jnt_pos[self.number]) if self.kind == "hinge" else np.zeros(3)

    @property
    def origin(self) -> Array:
        """Pose (4, 4) of the child in the frame of the parent, the joint at 0, or where it is locked."""
        if self.kind not in _MOVING:
            return self.before
        way = (self.locked or 0.0) - float(self.model.qpos0[self.model.jnt_qposadr[self.number]])
        if way == 0:
            return self.before
        if self.prismatic:
            return self.before @ homogeneous(np.eye(3), self.axis * way)
        R = rotation_from_vector(self.axis * way)
        return self.before @ homogeneous(R, self.anchor - R @ self.anchor)

    def limits(self) -> tuple[Limits, list[str]]:
        """Return its limits, and sentences on what was not taken as it stands."""
        return limits_of(self.model, self.number, self.name)

    def motor(self) -> tuple[Motor, list[str]]:
        """Return its drive, and sentences on what an arm does not have."""
        return motor_of(self.model, self.number, self.name)

    def spring(self) -> tuple[Spring, list[str]]:
        """Return its spring, and sentences on what an arm does not have."""
        return spring_of(self.model, self.number, self.name)

    @property
    def mimic(self) -> None:
        """MJCF has no joints that follow others: see ``coupled``."""
        return

    @property
    def holdable(self) -> bool:
        """Whether it can be held at a position."""
        return self.kind in _MOVING and not self.coupled

    def held(self, position: float) -> MjcfJoint:
        """Return it as one that is held at a position [rad] or [m]."""
        return attrs.evolve(self, locked=position)

    def require_serial(self) -> None:
        """Refuse a joint that is no part of a serial arm.

        Raises:
            FileFormatError: it is a ball or a free joint, or something else moves it too.
        """
        if self.fixed:
            return
        if self.kind not in _MOVING:
            remedy = "choose a base behind it (--base)" if self.kind == "free" else "replace it by three hinges"
            raise self.error(f"an arm cannot have a {self.kind} joint; expected {' or '.join(_MOVING)}: {remedy}")
        if self.coupled:
            raise self.error(
                f"{self.coupled}; an arm can only have independent joints: remove that from the file, or lock the "
                f"joint (--lock {self.name})"
            )

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the joint."""
        return FileFormatError(self.path, None, f"joint '{self.name}'", message)


@attrs.frozen(kw_only=True, eq=False)
class MjcfTree:
    """The links and joints of an MJCF file.

    Attributes:
        path: the file.
        name: of the model; that of the file where it has none.
        model: of MuJoCo.
        bodies: numbers of bodies by the names of links, None of links that are no bodies.
        parent_joints: by the name of a link: the joint that carries it.
        child_joints: by the name of a link: the joints that hang on it; of those of sites, only where nothing else
            hangs there, so that a site at the end is the tool.
        no_solids: names of geoms that are no solids of links.
    """

    path: Path
    name: str
    model: Any
    bodies: Mapping[str, int | None]
    parent_joints: Mapping[str, MjcfJoint]
    child_joints: Mapping[str, list[MjcfJoint]]
    no_solids: Container[str] = ()

    @property
    def function(self) -> str:
        """The function that reads such files, in messages."""
        return "load_mjcf"

    @property
    def links(self) -> Collection[str]:
        """Names, in the order of the file."""
        return self.bodies

    def default_base(self) -> str:
        """Return the body in the world that carries the only chain; the world itself where that body moves.

        Raises:
            FileFormatError: there are none, or several.
        """
        bases = {
            self._base_of(joint.child): None
            for joint in self.parent_joints.values()
            if joint.kind in _MOVING and not joint.fixed
        }
        if not bases:
            raise self.error("no body moves by a hinge or a slide")
        if len(bases) > 1:
            names = quoted(list(bases))
            raise self.error(f"the base is ambiguous: it could be {names}; specify one as base (--base)")
        return next(iter(bases))

    def _base_of(self, link: str) -> str:
        """Return the link from which a chain to another begins: the first below the world that stands, or the world."""
        path = [link]
        while path[-1] != WORLD:
            path.append(self.parent_joints[path[-1]].parent)
        standing = self.parent_joints[path[-2]].kind in {"fixed", "free"}
        return path[-2] if standing else WORLD

    def body(self, link: str) -> Link:
        """Return the body of a link, in its frame, with its solids."""
        number = self.bodies[link]
        if number is None:
            return Link()
        R = rotation_from_quaternion(self.model.body_iquat[number])
        return Link(
            mass=float(self.model.body_mass[number]),
            com=self.model.body_ipos[number],
            inertia=R @ np.diag(self.model.body_inertia[number]) @ R.T,
            complete=False,
            solids=self.solids(link),
        )

    def solids(self, link: str) -> tuple[Solid, ...]:
        """Return what of a link meets other bodies, in its frame."""
        number = self.bodies[link]
        return () if number is None else solids_of(self.model, number, self.no_solids)

    def left_out(self, links: Sequence[str]) -> list[str]:
        """Return sentences on what of links is not read."""
        notes = []
        for link in links:
            number = self.bodies[link]
            if number is not None and self.model.body_gravcomp[number]:
                notes.append(f"body '{link}': its gravity compensation is not read")
            if number is not None and ellipsoids_of(self.model, number):
                notes.append(f"body '{link}': ellipsoids are not read")
        return notes

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the whole file."""
        return FileFormatError(self.path, None, "", message)


class _Builder:
    """Puts a tree together, link after link."""

    def __init__(self, path: Path, model: Any, lock: Mapping[str, float]) -> None:
        self._path, self._model, self._lock = path, model, lock
        self._body_names = _names([model.body(i).name for i in range(model.nbody)], "body")
        self._joint_names = _names([model.joint(i).name for i in range(model.njnt)], "joint")
        for name in lock:
            one_of("joint", name, self._joint_names)
        self._coupled = couplings(model)
        self.bodies: dict[str, int | None] = {WORLD: 0, **dict.fromkeys(self._body_names[1:])}
        self.parent_joints: dict[str, MjcfJoint] = {}
        self.child_joints: dict[str, list[MjcfJoint]] = {link: [] for link in self.bodies}
        for number in range(1, model.nbody):
            self._add_body(number)
        leaves = {link for link, joints in self.child_joints.items() if not joints}
        for number in range(model.nsite):
            self._add_site(number, leaves)

    def _add_body(self, number: int) -> None:
        model, link = self._model, self._body_names[number]
        parent, before = self._body_names[model.body_parentid[number]], pose_of(model, "body", number)
        first, count = int(model.body_jntadr[number]), int(model.body_jntnum[number])
        self.bodies[link] = number
        for i in range(first, first + count):
            child = link if i == first + count - 1 else self._new_link(f"{link} behind {self._joint_names[i]}")
            self._add(self._joint(i, parent, child, before))
            parent, before = child, np.eye(4)
        if not count:
            self._add(self._weld(parent, link, before))

    def _add_site(self, number: int, leaves: Container[str]) -> None:
        name, parent = self._model.site(number).name, self._body_names[self._model.site_bodyid[number]]
        X = pose_of(self._model, "site", number)
        # One that is its body by name and pose is no other link.
        if name and not (name == parent and np.array_equal(X, np.eye(4))):
            self._add(self._weld(parent, self._new_link(name), X), hangs=parent in leaves)

    def _new_link(self, name: str) -> str:
        """Return a name for a link that is no body, such as the given one."""
        while name in self.bodies:
            name += "_"
        self.bodies[name] = None
        self.child_joints[name] = []
        return name

    def _weld(self, parent: str, child: str, before: Array) -> MjcfJoint:
        return MjcfJoint(
            path=self._path, name="", kind="fixed", parent=parent, child=child, model=self._model, before=before
        )

    def _joint(self, number: int, parent: str, child: str, before: Array) -> MjcfJoint:
        name = self._joint_names[number]
        joint = MjcfJoint(
            path=self._path,
            name=name,
            kind=_KINDS[self._model.jnt_type[number]],
            parent=parent,
            child=child,
            model=self._model,
            number=number,
            before=before,
            coupled=self._coupled.get(number, ""),
        )
        if name not in self._lock:
            return joint
        check_lock(name, joint.kind, self._lock[name], joint.limits()[0] if joint.kind in _MOVING else None)
        return joint.held(self._lock[name])

    def _add(self, joint: MjcfJoint, *, hangs: bool = True) -> None:
        self.parent_joints[joint.child] = joint
        if hangs:
            self.child_joints[joint.parent].append(joint)


def tree_of(path: Path, name: str, model: Any, lock: Mapping[str, float]) -> MjcfTree:
    """Return the tree of a model.

    Args:
        path: the file.
        name: of the model.
        model: of MuJoCo.
        lock: where joints are held by their names [rad] or [m], as if they were fixed.

    Raises:
        UnknownNameError: a joint to lock does not exist.
        InvalidValueError: a joint is to be held where its limits do not let it.
    """
    built = _Builder(path, model, lock)
    return MjcfTree(
        path=path,
        name=name,
        model=model,
        bodies=built.bodies,
        parent_joints=built.parent_joints,
        child_joints=built.child_joints,
    )


def _names(names: Sequence[str], kind: str) -> list[str]:
    """Return names of bodies or joints; of those that have none, their numbers."""
    result: list[str] = []
    for number, name in enumerate(names):
        own = name or f"{kind}{number}"
        while not name and own in names:
            own += "_"
        result.append(own)
    return result
