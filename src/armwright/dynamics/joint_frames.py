"""Links in the axes of their joints: behind the rotation of a joint and before its twist, where a link is constant.

The joint point of a joint that rotates is the origin of frame i-1; of one that slides it moves with the slide. The axes
of joint i rotate with it, and z is its own axis. From there to the axes of joint i+1 before it moves leads a constant
transform, ``Joint.behind``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from armwright.arm.model import Arm, Joint, Link
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.tracing.scalar import Scalar, cos, sin
from armwright.tracing.scan import scan
from armwright.tracing.vectors import Matrix, Vector, add, apply, mirrored, product, scale, transpose


class JointBody(NamedTuple):
    """A body about a joint point, along the axes of that joint, over abstract scalars.

    Attributes:
        mass: [kg].
        moment: mass times the centre of mass [kg m].
        spread: (3, 3) integral of r rᵀ over its mass, symmetric [kg m²]; its inertia is trace(spread) - spread.
    """

    mass: Scalar
    moment: Vector
    spread: Matrix


def joint_body(joint: Joint, link: Link) -> JointBody:
    """Return a link about its joint point, along the axes of its joint."""
    R = joint.behind[:3, :3].tolist()
    com = add(apply(R, link.com.tolist()), lever_behind(joint))
    I = product(product(R, link.inertia.tolist()), transpose(R))
    half = 0.5 * (I[0][0] + I[1][1] + I[2][2])
    moment = scale(link.mass, com)
    spread = [[(half if i == j else 0.0) - I[i][j] + moment[i] * com[j] for j in range(3)] for i in range(3)]
    return JointBody(mass=float(link.mass), moment=moment, spread=spread)


def lever_behind(joint: Joint) -> Vector:
    """Return the vector from the joint point to the origin of frame i, along the axes of the joint."""
    lever = joint.behind[:3, 3].tolist()
    return add(lever, [0.0, 0.0, joint.d]) if joint.revolute else list(lever)


class Rotation(NamedTuple):
    """A rotation about the first or the third axis, by its cosine and sine, over abstract scalars."""

    about_x: bool
    cosine: Scalar
    sine: Scalar

    def inward_axes(self, v: Vector) -> Vector:
        """Return a vector along the rotated axes, given along those before."""
        return self._replace(sine=-self.sine).outward_axes(v)

    def outward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes before, given along the rotated ones."""
        (x, y, z), c, s = v, self.cosine, self.sine
        return [x, c * y - s * z, s * y + c * z] if self.about_x else [c * x - s * y, s * x + c * y, z]

    def outward_matrix(self, A: Matrix) -> Matrix:
        """Return a tensor along the axes before, given along the rotated ones."""
        c, s = self.cosine, self.sine
        if isinstance(c, float) and isinstance(s, float) and c * s == 0:  # axes change places
            return _rows_and_columns(self.outward_axes, A)
        i, j, k = (1, 2, 0) if self.about_x else (0, 1, 2)
        # Of the four numbers in the plane of the rotation, two follow from what does not change: their sum and their
        # difference.
        more = c * (A[i][i] - A[j][j]) - s * (A[i][j] + A[j][i])
        B = [list(row) for row in A]
        B[i][i] = A[j][j] + c * more
        B[j][j] = A[i][i] + A[j][j] - B[i][i]
        B[i][j], B[j][i] = A[i][j] + s * more, A[j][i] + s * more
        B[i][k], B[j][k] = c * A[i][k] - s * A[j][k], s * A[i][k] + c * A[j][k]
        B[k][i], B[k][j] = c * A[k][i] - s * A[k][j], s * A[k][i] + c * A[k][j]
        return B


class FixedRotation(NamedTuple):
    """Any rotation, by its matrix."""

    matrix: Sequence[Sequence[float]]

    def inward_axes(self, v: Vector) -> Vector:
        """Return a vector along the rotated axes, given along those before."""
        return apply(transpose(self.matrix), v)

    def outward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes before, given along the rotated ones."""
        return apply(self.matrix, v)

    def outward_matrix(self, A: Matrix) -> Matrix:
        """Return a tensor along the axes before, given along the rotated ones."""
        return _rows_and_columns(self.outward_axes, A)


def _rows_and_columns(rotate: Callable[[Vector], Vector], A: Matrix) -> Matrix:
    columns = [rotate(column) for column in transpose(A)]
    return [rotate(row) for row in transpose(columns)]


class JointStep(NamedTuple):
    """The step from the joint before to a joint.

    Attributes:
        revolute: whether the joint rotates.
        fixed: constant rotation of the axes of the joint, before it moves, along those of the joint before.
        rotation: about the axis of the joint, as far as the joint has moved.
        lever: from joint point to joint point, along the axes of the joint before.
    """

    revolute: bool
    fixed: Rotation | FixedRotation
    rotation: Rotation
    lever: Vector

    def inward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes of the joint, given along those of the joint before."""
        return self.rotation.inward_axes(self.fixed.inward_axes(v))

    def outward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes of the joint before, given along those of the joint."""
        return self.fixed.outward_axes(self.rotation.outward_axes(v))

    def outward_matrix(self, A: Matrix) -> Matrix:
        """Return a tensor along the axes of the joint before, given along those of the joint."""
        return self.fixed.outward_matrix(self.rotation.outward_matrix(A))


def joint_steps(arm: Arm, q: Sequence[Scalar]) -> list[JointStep]:
    """Return the steps from the base to the last joint, over abstract scalars.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
    """
    at_rest: list[JointStep] = []
    fixed: Rotation | FixedRotation = Rotation(True, 1.0, 0.0)
    lever: Vector = [0.0, 0.0, 0.0]
    for joint in arm.joints:
        rotation = Rotation(False, exact_cosine(joint.theta), exact_sine(joint.theta))
        at_rest.append(JointStep(joint.revolute, fixed, rotation, lever))
        fixed, lever = _rotation_behind(joint), lever_behind(joint)
    offsets = [joint.theta if joint.revolute else joint.d for joint in arm.joints]
    return scan(_moved, (), at_rest, offsets, q)[1]


def _rotation_behind(joint: Joint) -> Rotation | FixedRotation:
    if joint.fixed is None:
        return Rotation(True, exact_cosine(joint.alpha), exact_sine(joint.alpha))
    return FixedRotation(joint.behind[:3, :3].tolist())


def _moved(_: tuple[()], step: JointStep, offset: float, position: Scalar) -> tuple[tuple[()], JointStep]:
    """Return the step to a joint that has moved."""
    value = offset + position
    if step.revolute:
        return (), step._replace(rotation=Rotation(False, cos(value), sin(value)))
    return (), step._replace(lever=add(step.lever, scale(value, step.fixed.outward_axes([0.0, 0.0, 1.0]))))


def at_previous_joint(body: JointBody, step: JointStep) -> JointBody:
    """Return a body about a joint point about that of the joint before, along the axes of that.

    Source:
        Huygens and Steiner's theorem, for an origin that need not be the centre of mass.
    """
    p, moment, spread = step.lever, step.outward_axes(body.moment), step.outward_matrix(body.spread)
    shifted = add(moment, scale(body.mass, p))
    upper = [[spread[i][j] + p[i] * moment[j] + shifted[i] * p[j] for j in range(3)] for i in range(3)]
    return JointBody(body.mass, shifted, mirrored(upper))


def combined(a: JointBody, b: JointBody) -> JointBody:
    """Return two bodies about the same point as one."""
    spread = [add(x, y) for x, y in zip(a.spread, b.spread, strict=True)]
    return JointBody(a.mass + b.mass, add(a.moment, b.moment), spread)
