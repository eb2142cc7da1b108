"""Rigid bodies over abstract scalars: their combination, and their change of frames."""

from __future__ import annotations

from typing import NamedTuple

from armwright.arm.model import Link
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, apply, congruence, dot, scale


class Body(NamedTuple):
    """A rigid body, expressed in a frame.

    Attributes:
        mass: [kg].
        moment: mass times the centre of mass [kg m].
        tensor: 3 x 3 inertia about the origin of the frame [kg m²].
    """

    mass: Scalar
    moment: Vector
    tensor: Matrix


NOTHING = Body(mass=0.0, moment=[0.0, 0.0, 0.0], tensor=[[0.0, 0.0, 0.0] for _ in range(3)])


def body_of(link: Link) -> Body:
    """Return the body of a link, in the frame of the link."""
    about_com = Body(mass=link.mass, moment=[0.0, 0.0, 0.0], tensor=link.inertia.tolist())
    return shifted(about_com, link.com.tolist())


def shifted(body: Body, p: Vector) -> Body:
    """Return a body in a parallel frame, in which the origin of the present frame is at p.

    Source:
        Huygens and Steiner's theorem, for an origin that need not be the centre of mass.
    """
    moment = add(body.moment, scale(body.mass, p))
    spread = dot(p, add(body.moment, moment))
    tensor = [
        [body.tensor[i][j] + (spread if i == j else 0.0) - p[i] * moment[j] - body.moment[i] * p[j] for j in range(3)]
        for i in range(3)
    ]
    return Body(mass=body.mass, moment=moment, tensor=tensor)


def in_previous_frame(body: Body, R: Matrix, p: Vector) -> Body:
    """Return a body of frame i in frame i-1, by rotation and position of frame i in frame i-1."""
    rotated = Body(mass=body.mass, moment=apply(R, body.moment), tensor=congruence(R, body.tensor))
    return shifted(rotated, p)


def combined(a: Body, b: Body) -> Body:
    """Return two bodies in the same frame as one."""
    tensor = [add(x, y) for x, y in zip(a.tensor, b.tensor, strict=True)]
    return Body(mass=a.mass + b.mass, moment=add(a.moment, b.moment), tensor=tensor)


def as_link(body: Body) -> Link:
    """Return a body of floats as a link: centre of mass, and the tensor about it.

    The tensor is not checked to be possible: unknown moments of a part are unknown of the sum, and that of a point
    mass is rounding.
    """
    if body.mass == 0:
        return Link(inertia=body.tensor, complete=False)
    com = scale(1 / body.mass, body.moment)
    about_com = shifted(body, scale(-1.0, com))
    return Link(mass=body.mass, com=com, inertia=about_com.tensor, complete=False)
