"""Forward dynamics in one sweep out, one in and one out again: the articulated-body algorithm.

Each link with all beyond it, their joints free to move, answers a force at its own joint like a body whose inertia
depends on the direction. That inertia, and the force it takes to keep such a body from accelerating, go inward from
the hand; accelerations come back outward. Accelerations here are those of material points, not spatial ones, so
linear speeds never appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.arguments import NO_WRENCH
from armwright.dynamics.bodies import body_of
from armwright.dynamics.newton_euler import felt_acceleration, reaction_at_hand
from armwright.kinematics.forward_kinematics import link_transform
from armwright.tracing.scalar import Scalar, reciprocal
from armwright.tracing.vectors import (
    Matrix,
    Vector,
    add,
    apply,
    congruence,
    cross,
    dot,
    product,
    scale,
    transpose,
)

_Place: TypeAlias = tuple[Matrix, Vector]


class Articulated(NamedTuple):
    """A link with all beyond it, seen from some frame: the wrench at the origin that accelerates it.

    Moment n = J w_dot + H v_dot + n0 and force f = Hᵀ w_dot + M v_dot + f0; J and M are symmetric.
    """

    J: Matrix
    H: Matrix
    M: Matrix
    n0: Vector
    f0: Vector


class Pivot(NamedTuple):
    """The inertia that a joint feels when all joints beyond it are free.

    Attributes:
        inertia: about or along the joint, rotor included.
        size: the same about or along all three axes together: what rounding is measured by.
    """

    inertia: Scalar
    size: Scalar


class Answer(NamedTuple):
    """What the way inward finds out about a joint, for the way outward.

    Attributes:
        n: moment that a unit acceleration of the joint takes.
        f: force that it takes.
        pivot: part of them along the joint, rotor included.
        effort: what is left of the effort to accelerate with.
        swing: acceleration that the speeds give the link where it meets the joint, angular; linear on a slide.
        whirl: centripetal acceleration of the origin of the link's frame about the joint.
    """

    n: Vector
    f: Vector
    pivot: Pivot
    effort: Scalar
    swing: Vector
    whirl: Vector


def articulated_body(
    arm: Arm,
    q: Sequence[Scalar],
    qd: Sequence[Scalar],
    tau: Sequence[Scalar],
    wrench: Sequence[Scalar] = NO_WRENCH,
) -> tuple[list[Scalar], list[Pivot]]:
    """Return the accelerations that efforts give, over abstract scalars, in time that grows with n only.

    Rotor inertia counts; friction does not: take it off ``tau`` before.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint speeds.
        tau: n efforts.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.

    Returns:
        n accelerations, and n pivots. Where a pivot is 0 the joint moves nothing that resists, and the
        accelerations mean nothing.

    Source:
        Featherstone (2008), section 7.3, with the accelerations of points as in Luh, Walker & Paul (1980).
    """
    places = [link_transform(joint, position) for joint, position in zip(arm.joints, q, strict=True)]
    spins = _spins(arm, places, qd)
    f, n = reaction_at_hand(arm, q, wrench)
    body = Articulated(J=_zeros(), H=_zeros(), M=_zeros(), n0=n, f0=f)
    answers: list[Answer] = []
    for i in reversed(range(arm.n)):
        joint, (before, at_joint, behind) = arm.joints[i], spins[i]
        body = _welded(_of_link(arm.links[i], behind), body)
        whirl = cross(at_joint, cross(at_joint, places[i][1]))
        body = _seen_from_before(body, places[i], whirl)
        swing = scale(1.0 if joint.revolute else 2.0, [before[1] * qd[i], -before[0] * qd[i], 0.0])
        answer = _answer(body, joint, arm.motors[i].inertia, tau[i], (swing, whirl))
        body = _let_go(body, joint, answer)
        answers.append(answer)
    answers.reverse()
    return _outward(arm, places, answers), [answer.pivot for answer in answers]


def _zeros() -> Matrix:
    return [[0.0, 0.0, 0.0] for _ in range(3)]


def _spins(arm: Arm, places: Sequence[_Place], qd: Sequence[Scalar]) -> list[tuple[Vector, Vector, Vector]]:
    """Return of each joint: angular speed before it and behind it, seen from frame i-1, and behind it from frame i."""
    w: Vector = [0.0, 0.0, 0.0]
    spins = []
    for joint, (R, _), speed in zip(arm.joints, places, qd, strict=True):
        at_joint = [w[0], w[1], w[2] + speed] if joint.revolute else w
        behind = apply(transpose(R), at_joint)
        spins.append((w, at_joint, behind))
        w = behind
    return spins


def _of_link(link: Link, w: Vector) -> Articulated:
    """Return a rigid link that turns with w, seen from its frame."""
    mass, (x, y, z), tensor = body_of(link)
    return Articulated(
        J=tensor,
        H=[[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]],
        M=[[mass if i == j else 0.0 for j in range(3)] for i in range(3)],
        n0=cross(w, apply(tensor, w)),
        f0=cross(w, cross(w, [x, y, z])),
    )


def _welded(a: Articulated, b: Articulated) -> Articulated:
    J, H, M = ([add(x, y) for x, y in zip(A, B, strict=True)] for A, B in ((a.J, b.J), (a.H, b.H), (a.M, b.M)))
    return Articulated(J=J, H=H, M=M, n0=add(a.n0, b.n0), f0=add(a.f0, b.f0))


def _seen_from_before(body: Articulated, place: _Place, whirl: Vector) -> Articulated:
    """Return a body of frame i seen from frame i-1, for accelerations of its point at the origin of frame i-1."""
    R, p = place
    J, M = congruence(R, body.J), congruence(R, body.M)
    H = product(product(R, body.H), transpose(R))
    f0 = add(apply(R, body.f0), apply(M, whirl))
    n0 = add(apply(R, body.n0), apply(H, whirl), cross(p, f0))
    # H and J about the origin of frame i-1: H + [p] M and J - H [p] + [p] (H + [p] M)ᵀ, row by row.
    shifted = [add(row, lever) for row, lever in zip(H, transpose([cross(p, row) for row in M]), strict=True)]
    there, back = [cross(p, row) for row in H], [cross(p, row) for row in shifted]
    upper = [[J[i][j] + there[i][j] + back[j][i] if j >= i else 0.0 for j in range(3)] for i in range(3)]
    J = [[upper[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)]
    return Articulated(J=J, H=shifted, M=M, n0=n0, f0=f0)


def _answer(body: Articulated, joint: Joint, rotor: float, tau: Scalar, rates: tuple[Vector, Vector]) -> Answer:
    """Ask a body, seen from frame i-1, what a unit acceleration of joint i takes: the joint is the z axis."""
    swing, whirl = rates
    if joint.revolute:
        n, f, own, hold = [row[2] for row in body.J], body.H[2], body.J, body.n0[2]
    else:
        n, f, own, hold = [row[2] for row in body.H], body.M[2], body.M, body.f0[2]
    pivot = Pivot(inertia=own[2][2] + rotor, size=own[0][0] + own[1][1] + own[2][2] + rotor)
    return Answer(n=n, f=f, pivot=pivot, effort=tau - hold, swing=swing, whirl=whirl)


def _let_go(body: Articulated, joint: Joint, answer: Answer) -> Articulated:
    """Return the body as felt through joint i, which is free to move."""
    ease = reciprocal(answer.pivot.inertia)
    n, f = scale(ease, answer.n), scale(ease, answer.f)
    J = [[body.J[i][j] - n[min(i, j)] * answer.n[max(i, j)] for j in range(3)] for i in range(3)]
    M = [[body.M[i][j] - f[min(i, j)] * answer.f[max(i, j)] for j in range(3)] for i in range(3)]
    H = [[body.H[i][j] - n[i] * answer.f[j] for j in range(3)] for i in range(3)]
    by_swing = (J, transpose(H)) if joint.revolute else (H, M)
    return Articulated(
        J=J,
        H=H,
        M=M,
        n0=add(body.n0, apply(by_swing[0], answer.swing), scale(answer.effort, n)),
        f0=add(body.f0, apply(by_swing[1], answer.swing), scale(answer.effort, f)),
    )


def _outward(arm: Arm, places: Sequence[_Place], answers: Sequence[Answer]) -> list[Scalar]:
    w_dot: Vector = [0.0, 0.0, 0.0]
    v_dot = felt_acceleration(arm)
    accelerations: list[Scalar] = []
    for joint, (R, p), answer in zip(arm.joints, places, answers, strict=True):
        if joint.revolute:
            w_dot = add(w_dot, answer.swing)
        else:
            v_dot = add(v_dot, answer.swing)
        rest = answer.effort - dot(answer.n, w_dot) - dot(answer.f, v_dot)
        acceleration = reciprocal(answer.pivot.inertia) * rest
        accelerations.append(acceleration)
        along = [0.0, 0.0, acceleration]
        if joint.revolute:
            w_dot = add(w_dot, along)
        else:
            v_dot = add(v_dot, along)
        v_dot = add(v_dot, cross(w_dot, p), answer.whirl)
        Rt = transpose(R)
        w_dot, v_dot = apply(Rt, w_dot), apply(Rt, v_dot)
    return accelerations
