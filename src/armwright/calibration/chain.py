"""An arm as a chain of elementary translations and rotations, each with an error that a calibration may estimate.

The errors of a link in the Denavit-Hartenberg convention are those of its four numbers. Where two axes that follow one
another are parallel or nearly so, its ``d`` and that of the next joint move the same point, and a small tilt makes the
common normal jump: there the link gets a fifth number, beta, a rotation about y, and keeps its ``d`` (Hayati).

Source:
    Hayati & Mirmirani (1985); Mooring, Roth, Driels (1991); spec of the calibration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, floats, joint_array
from armwright.errors import ShapeError
from armwright.spatial.poses import homogeneous

Kind: TypeAlias = Literal["translation", "rotation"]

# Axes whose angle has a smaller sine are taken for parallel.
PARALLEL = 0.1
_AXES = "xyz"


class Element(NamedTuple):
    """One translation along, or rotation about, an axis of the frame before it.

    Attributes:
        kind: translation or rotation.
        axis: 0, 1, 2 for x, y, z.
        value: nominal [m] or [rad].
        name: of the error that is added to it; empty where there is none.
        joint: number of the joint, from 0, whose position is added too; None where there is none.
    """

    kind: Kind
    axis: int
    value: float
    name: str = ""
    joint: int | None = None


class JointErrorModel(NamedTuple):
    """Deviation of a joint from where its encoder has it: compliance or transmission error.

    Attributes:
        name: of the error that is its coefficient.
        joint: number of the joint, from 0.
        law: deviation (m,) for a coefficient of 1 in configurations (m, n) with payloads (m, 4) [1].
        axis: of the frame of the joint, on the link before it: 2 for the axis of the joint itself, along which or about
            which it moves; 0 or 1 for a rotation about x or y.
    """

    name: str
    joint: int
    law: Callable[[Array, Array], Array]
    axis: int = 2


class ToolPoses(NamedTuple):
    """Poses of the tool in several configurations, and their derivatives by the errors.

    Attributes:
        position: (m, 3) [m].
        rotation: (m, 3, 3).
        position_jacobian: (m, 3, k) derivative of the position by each error.
        rotation_jacobian: (m, 3, k) small rotation, in the axes of the base, by each error.
    """

    position: Array
    rotation: Array
    position_jacobian: Array
    rotation_jacobian: Array


@attrs.frozen(kw_only=True, eq=False)
class Chain:
    """An arm with an error in every dimension.

    Attributes:
        arm: the nominal arm.
        elements: from the measuring frame to the tool.
        base: (4, 4) approximate pose of the arm's base frame in the measuring frame.
        target_rotation: (3, 3) approximate rotation of the measured target in the arm's tool frame.
        joint_errors: models of its joints.
    """

    arm: Arm
    elements: tuple[Element, ...]
    base: Array
    target_rotation: Array
    joint_errors: tuple[JointErrorModel, ...] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The errors, in order: those of the elements, then those of the joints."""
        parts: tuple[Element | JointErrorModel, ...] = (*self.elements, *self.joint_errors)
        return tuple(part.name for part in parts if part.name)

    @property
    def is_length(self) -> Array:
        """(k,) whether each error is a length, not an angle."""
        lengths = [element.kind == "translation" for element in self.elements if element.name]
        of_joints = [error.axis == 2 and not self.arm.joints[error.joint].revolute for error in self.joint_errors]
        return np.array([*lengths, *of_joints], dtype=np.bool_)

    def forward(self, q: ArrayLike, errors: ArrayLike | None = None, *, payload: ArrayLike | None = None) -> ToolPoses:
        """Return the poses of the tool, and their derivatives.

        Args:
            q: (m, n) joint positions [rad] or [m].
            errors: (k,) of the arm [m] or [rad]; zero when left out.
            payload: (4,) or (m, 4) mass and centre of mass in the frame of the tool [kg], [m]; none when left out.

        Raises:
            ShapeError: an array does not fit.
        """
        configurations = np.atleast_2d(joint_array(q, self.arm.n))
        count = len(self.names)
        x = np.zeros(count) if errors is None else np.asarray(errors, dtype=np.float64)
        if x.shape != (count,):
            raise ShapeError(f"errors: expected {count} of them, got shape {x.shape}")
        m = len(configurations)
        R = np.tile(self.base[:3, :3], (m, 1, 1))
        p = np.tile(self.base[:3, 3], (m, 1))
        directions, origins, rotates = np.zeros((count, m, 3)), np.zeros((count, m, 3)), np.zeros(count, dtype=bool)
        carried = np.zeros(4) if payload is None else floats(payload, "payload")
        if carried.shape not in {(4,), (m, 4)}:
            raise ShapeError(f"payload: expected shape (4,) or ({m}, 4), got {carried.shape}")
        carried = np.ascontiguousarray(np.broadcast_to(carried, (m, 4)))
        deviations = [error.law(configurations, carried) for error in self.joint_errors]
        first = count - len(self.joint_errors)
        number = 0
        for element in self.elements:
            value = np.full(m, element.value)
            if element.joint is not None:
                value += configurations[:, element.joint]
                # The axis of the joint itself is the last, for the lateral ones tilt it.
                of_joint = [i for i, error in enumerate(self.joint_errors) if error.joint == element.joint]
                for i in sorted(of_joint, key=lambda i: self.joint_errors[i].axis):
                    own, k = self.joint_errors[i].axis, first + i
                    directions[k], origins[k] = R[:, :, own], p
                    rotates[k] = own != 2 or element.kind == "rotation"
                    if own == 2:
                        value += x[k] * deviations[i]
                    else:
                        _rotate_about_own_axis(R, own, x[k] * deviations[i])
            axis = R[:, :, element.axis].copy()
            if element.name:
                value += x[number]
                directions[number], origins[number], rotates[number] = axis, p, element.kind == "rotation"
                number += 1
            if element.kind == "translation":
                p = p + axis * value[:, None]
            else:
                _rotate_about_own_axis(R, element.axis, value)
        levers = np.where(rotates[:, None, None], np.cross(directions, p - origins), directions)
        rotations = np.where(rotates[:, None, None], directions, 0.0)
        for i, deviation in enumerate(deviations, first):
            levers[i] *= deviation[:, None]
            rotations[i] *= deviation[:, None]
        return ToolPoses(p, R, np.moveaxis(levers, 0, -1), np.moveaxis(rotations, 0, -1))


def kinematic_chain(
    arm: Arm,
    *,
    base: Array | None = None,
    target_rotation: Array | None = None,
    joint_errors: tuple[JointErrorModel, ...] = (),
) -> Chain:
    """Return an arm with all errors that its geometry can have: base, links, tool.

    Args:
        arm: with n joints.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; the same frame when left
            out.
        target_rotation: (3, 3) rotation of the measured target in the arm's tool frame, roughly; none when left out.
        joint_errors: models of its joints, beside its geometry.
    """
    rotation = np.eye(3) if target_rotation is None else target_rotation
    return Chain(
        arm=arm,
        elements=tuple(_elements(arm, rotation)),
        base=np.eye(4) if base is None else base,
        target_rotation=rotation,
        joint_errors=joint_errors,
    )


def _elements(arm: Arm, target_rotation: Array) -> Iterator[Element]:
    yield from _error_elements("base")
    yield from _fixed_elements(arm.base)
    for i, joint in enumerate(arm.joints):
        name = f"joint{i + 1}"
        yield Element("rotation", 2, joint.theta, f"{name}.theta", i if joint.revolute else None)
        yield Element("translation", 2, joint.d, f"{name}.d", None if joint.revolute else i)
        if joint.fixed is not None:
            yield from _fixed_elements(joint.fixed)
        yield Element("translation", 0, joint.a, f"{name}.a")
        yield Element("rotation", 0, joint.alpha, f"{name}.alpha")
        if i + 1 < arm.n and np.linalg.norm(joint.behind[:2, 2]) < PARALLEL:
            yield Element("rotation", 1, 0.0, f"{name}.beta")
    yield from _fixed_elements(arm.tool)
    yield from _fixed_elements(homogeneous(target_rotation, np.zeros(3)))
    yield from _error_elements("tool")


def _error_elements(name: str) -> Iterator[Element]:
    """Give three translations and three rotations that are 0 but for their errors."""
    for axis in range(3):
        yield Element("translation", axis, 0.0, f"{name}.{_AXES[axis]}")
    for axis in range(3):
        yield Element("rotation", axis, 0.0, f"{name}.r{_AXES[axis]}")


def _fixed_elements(X: Array) -> Iterator[Element]:
    """Give a pose as translations along and rotations about x, y and z, one after the other."""
    for axis in range(3):
        if X[axis, 3]:
            yield Element("translation", axis, float(X[axis, 3]))
    R = X[:3, :3]
    # R = Rx(a) Ry(b) Rz(c).
    b = np.arcsin(np.clip(R[0, 2], -1.0, 1.0))
    if abs(R[0, 2]) < 1 - 1e-12:
        a, c = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(-R[0, 1], R[0, 0])
    else:
        a, c = np.arctan2(R[2, 1], R[1, 1]), 0.0
    for axis, angle in enumerate((a, b, c)):
        if angle:
            yield Element("rotation", axis, float(angle))


def _rotate_about_own_axis(R: Array, axis: int, angles: Array) -> None:
    """Rotate frames (m, 3, 3) about one of their own axes."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    first, second = R[:, :, u].copy(), R[:, :, v].copy()
    R[:, :, u] = c * first + s * second
    R[:, :, v] = c * second - s * first
