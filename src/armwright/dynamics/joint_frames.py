"""Links in the axes of their joints: behind the rotation of a joint and before its twist, where a link is constant.

The joint point of a joint that rotates is the origin of frame i-1; of one that slides it moves with the slide. The axes
of joint i rotate with it, and z is its own axis. From there to the axes of joint i+1 before it moves leads a constant
transform, ``Joint.behind``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armwright.arm.model import Arm, Joint, Link
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.tracing.scalar import Scalar, cos, sin
from armwright.tracing.scan import scan
from armwright.tracing.vectors import Matrix, Vector, add, apply, product, scale, transpose

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


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
    spread = [
        [(half if i == j else 0.0) - 0.5 * (I[i][j] + I[j][i]) + moment[i] * com[j] for j in range(3)] for i in range(3)
    ]
    return JointBody(mass=float(link.mass), moment=moment, spread=spread)


def lever_behind(joint: Joint) -> Vector:
    """Return the vector from the joint point to the origin of frame i, along the axes of the joint."""
    lever = joint.behind[:3, 3].tolist()
    return add(lever, [0.0, 0.0, joint.d]) if joint.revolute else list(lever)


class JointStep(NamedTuple):
    """The step from the joint before to a joint.

    Attributes:
        revolute: whether the joint rotates.
        fixed: (3, 3) constant rotation of the axes of the joint, before it moves, along those of the joint before.
        cosine: of the angle of the joint.
        sine: of it.
        lever: from joint point to joint point, along the axes of the joint before.
    """

    revolute: bool
    fixed: Sequence[Sequence[float]]
    cosine: Scalar
    sine: Scalar
    lever: Vector

    def inward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes of the joint, given along those of the joint before."""
        x, y, z = apply(transpose(self.fixed), v)
        c, s = self.cosine, self.sine
        return [c * x + s * y, c * y - s * x, z]

    def outward_axes(self, v: Vector) -> Vector:
        """Return a vector along the axes of the joint before, given along those of the joint."""
        c, s = self.cosine, self.sine
        return apply(self.fixed, [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]])

    def outward_matrix(self, A: Matrix) -> Matrix:
        """Return a tensor along the axes of the joint before, given along those of the joint."""
        columns = [self.outward_axes(column) for column in transpose(A)]
        return [self.outward_axes(row) for row in transpose(columns)]


def joint_steps(arm: Arm, q: Sequence[Scalar]) -> list[JointStep]:
    """Return the steps from the base to the last joint, over abstract scalars.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
    """
    at_rest: list[JointStep] = []
    fixed: Sequence[Sequence[float]] = _IDENTITY
    lever: Vector = [0.0, 0.0, 0.0]
    for joint in arm.joints:
        cosine, sine = exact_cosine(joint.theta), exact_sine(joint.theta)
        at_rest.append(JointStep(joint.revolute, fixed, cosine, sine, lever))
        fixed, lever = joint.behind[:3, :3].tolist(), lever_behind(joint)
    offsets = [joint.theta if joint.revolute else joint.d for joint in arm.joints]
    return scan(_moved, (), at_rest, offsets, q)[1]


def _moved(_: tuple[()], step: JointStep, offset: float, position: Scalar) -> tuple[tuple[()], JointStep]:
    """Return the step to a joint that has moved."""
    value = offset + position
    if step.revolute:
        return (), step._replace(cosine=cos(value), sine=sin(value))
    return (), step._replace(lever=add(step.lever, scale(value, [row[2] for row in step.fixed])))


def at_previous_joint(body: JointBody, step: JointStep) -> JointBody:
    """Return a body about a joint point about that of the joint before, along the axes of that.

    Source:
        Huygens and Steiner's theorem, for an origin that need not be the centre of mass.
    """
    p, moment, spread = step.lever, step.outward_axes(body.moment), step.outward_matrix(body.spread)
    shifted = add(moment, scale(body.mass, p))
    upper = [[spread[i][j] + p[i] * moment[j] + shifted[i] * p[j] for j in range(3)] for i in range(3)]
    return JointBody(body.mass, shifted, [[upper[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)])


def combined(a: JointBody, b: JointBody) -> JointBody:
    """Return two bodies about the same point as one."""
    spread = [add(x, y) for x, y in zip(a.spread, b.spread, strict=True)]
    return JointBody(a.mass + b.mass, add(a.moment, b.moment), spread)
