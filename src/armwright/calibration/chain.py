"""An arm as a chain of single shifts and turns, each with an error that a calibration may find.

The errors of a link in the Denavit-Hartenberg convention are those of its four numbers. Where two axes that follow one
another are parallel or nearly so, its ``d`` and that of the next joint move the same point, and a small tilt makes the
common normal jump: there the link gets a fifth number, a turn about y, and keeps its ``d``.

Source:
    Hayati & Mirmirani (1985); Mooring, Roth, Driels (1991); spec of the calibration.
"""

from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.errors import ShapeError
from armwright.spatial.poses import pose

Kind: TypeAlias = Literal["shift", "turn"]

# Axes whose angle has a smaller sine are taken for parallel.
PARALLEL = 0.1
_AXES = "xyz"


class Element(NamedTuple):
    """One shift along, or turn about, an axis of the frame it stands in.

    Attributes:
        kind: shift or turn.
        axis: 0, 1, 2 for x, y, z.
        value: as the arm has it [m] or [rad].
        name: of the error that is added to it; empty where there is none.
        joint: number of the joint, from 0, whose position is added too; None where there is none.
    """

    kind: Kind
    axis: int
    value: float
    name: str = ""
    joint: int | None = None


class JointErrorModel(NamedTuple):
    """Something that moves a joint away from where its encoder has it, by a law of the posture.

    Attributes:
        name: of the error that it is counted by.
        joint: number of the joint, from 0.
        law: how much of the error there is in each of (m, n) postures, (m,) [1].
    """

    name: str
    joint: int
    law: Callable[[Array], Array]


class ToolPoses(NamedTuple):
    """Where tools are, and how that depends on the errors.

    Attributes:
        position: (m, 3) [m].
        rotation: (m, 3, 3).
        by_position: (m, 3, k) derivative of the position by each error.
        by_turn: (m, 3, k) small turn, in the axes of the base, by each error.
    """

    position: Array
    rotation: Array
    by_position: Array
    by_turn: Array


@attrs.frozen(kw_only=True, eq=False)
class Chain:
    """An arm whose every dimension may be off.

    Attributes:
        arm: as it is said to be.
        elements: from the measuring frame to the tool.
        base: (4, 4) the arm's base frame in the measuring frame, roughly.
        hand: (3, 3) how what is measured is turned in the arm's tool frame, roughly.
        bends: of its joints.
    """

    arm: Arm
    elements: tuple[Element, ...]
    base: Array
    hand: Array
    bends: tuple[JointErrorModel, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The errors, in order: those of the elements, then those of the bends."""
        return (*(one.name for one in self.elements if one.name), *(bend.name for bend in self.bends))

    @property
    def is_length(self) -> Array:
        """(k,) whether each error is a length, not an angle."""
        shifts = [element.kind == "shift" for element in self.elements if element.name]
        slides = [not self.arm.joints[bend.joint].revolute for bend in self.bends]
        return np.array([*shifts, *slides], dtype=np.bool_)

    def reach(self, q: ArrayLike, errors: ArrayLike | None = None) -> ToolPoses:
        """Return where the tool is, and the derivatives.

        Args:
            q: (m, n) joint positions [rad] or [m].
            errors: (k,) of the arm [m] or [rad]; none when left out.

        Raises:
            ShapeError: an array does not fit.
        """
        places = np.atleast_2d(joint_array(q, self.arm.n))
        count = len(self.names)
        off = np.zeros(count) if errors is None else np.asarray(errors, dtype=np.float64)
        if off.shape != (count,):
            raise ShapeError(f"errors: expected {count} of them, got shape {off.shape}")
        m = len(places)
        R = np.tile(self.base[:3, :3], (m, 1, 1))
        p = np.tile(self.base[:3, 3], (m, 1))
        directions, origins, turning = np.zeros((count, m, 3)), np.zeros((count, m, 3)), np.zeros(count, dtype=bool)
        parts = [bend.law(places) for bend in self.bends]
        first = count - len(self.bends)
        moving: dict[int, int] = {}  # number of the error of a joint's own position
        number = 0
        for element in self.elements:
            by = np.full(m, element.value)
            if element.joint is not None:
                by += places[:, element.joint]
                for i, (bend, part) in enumerate(zip(self.bends, parts, strict=True), first):
                    if bend.joint == element.joint:
                        by += off[i] * part
                moving[element.joint] = number
            axis = R[:, :, element.axis].copy()
            if element.name:
                by += off[number]
                directions[number], origins[number], turning[number] = axis, p, element.kind == "turn"
                number += 1
            if element.kind == "shift":
                p = p + axis * by[:, None]
            else:
                _turn(R, element.axis, by)
        levers = np.where(turning[:, None, None], np.cross(directions, p - origins), directions)
        turns = np.where(turning[:, None, None], directions, 0.0)
        for i, (bend, part) in enumerate(zip(self.bends, parts, strict=True), first):
            levers[i] = levers[moving[bend.joint]] * part[:, None]
            turns[i] = turns[moving[bend.joint]] * part[:, None]
        return ToolPoses(p, R, np.moveaxis(levers, 0, -1), np.moveaxis(turns, 0, -1))


def chain_of(
    arm: Arm, *, base: Array | None = None, hand: Array | None = None, bends: tuple[JointErrorModel, ...] = ()
) -> Chain:
    """Return an arm with all errors that its geometry can have: base, links, tool.

    Args:
        arm: with n joints.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; the same frame when left
            out.
        hand: (3, 3) how what is measured is turned in the arm's tool frame, roughly; not at all when left out.
        bends: of its joints, beside its geometry.
    """
    turned = np.eye(3) if hand is None else hand
    return Chain(
        arm=arm,
        elements=tuple(_elements(arm, turned)),
        base=np.eye(4) if base is None else base,
        hand=turned,
        bends=bends,
    )


def _elements(arm: Arm, hand: Array) -> Iterator[Element]:
    yield from _errors("base")
    yield from _fixed(arm.base)
    for i, joint in enumerate(arm.joints):
        name = f"joint{i + 1}"
        yield Element("turn", 2, joint.theta, f"{name}.theta", i if joint.revolute else None)
        yield Element("shift", 2, joint.d, f"{name}.d", None if joint.revolute else i)
        if joint.fixed is not None:
            yield from _fixed(joint.fixed)
        yield Element("shift", 0, joint.a, f"{name}.a")
        yield Element("turn", 0, joint.alpha, f"{name}.alpha")
        if i + 1 < arm.n and np.linalg.norm(joint.behind[:2, 2]) < PARALLEL:
            yield Element("turn", 1, 0.0, f"{name}.beta")
    yield from _fixed(arm.tool)
    yield from _fixed(pose(hand, np.zeros(3)))
    yield from _errors("tool")


def _errors(name: str) -> Iterator[Element]:
    """Give three shifts and three turns that are 0 but for their errors."""
    for axis in range(3):
        yield Element("shift", axis, 0.0, f"{name}.{_AXES[axis]}")
    for axis in range(3):
        yield Element("turn", axis, 0.0, f"{name}.r{_AXES[axis]}")


def _fixed(X: Array) -> Iterator[Element]:
    """Give a pose as shifts and turns about x, y and z, one after the other."""
    for axis in range(3):
        if X[axis, 3]:
            yield Element("shift", axis, float(X[axis, 3]))
    R = X[:3, :3]
    # R = Rx(a) Ry(b) Rz(c).
    b = np.arcsin(np.clip(R[0, 2], -1.0, 1.0))
    if abs(R[0, 2]) < 1 - 1e-12:
        a, c = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(-R[0, 1], R[0, 0])
    else:
        a, c = np.arctan2(R[2, 1], R[1, 1]), 0.0
    for axis, angle in enumerate((a, b, c)):
        if angle:
            yield Element("turn", axis, float(angle))


def _turn(R: Array, axis: int, by: Array) -> None:
    """Turn frames (m, 3, 3) about one of their own axes."""
    c, s = np.cos(by)[:, None], np.sin(by)[:, None]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    first, second = R[:, :, u].copy(), R[:, :, v].copy()
    R[:, :, u] = c * first + s * second
    R[:, :, v] = c * second - s * first
