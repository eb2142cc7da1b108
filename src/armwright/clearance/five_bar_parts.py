"""Which body of a linkage is which link of a five-bar, if it is one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.linkage import GROUND, BodyPoint, Guide, Linkage
from armwright.errors import InvalidValueError, ShapeError


class Part(NamedTuple):
    """A body as a link.

    Attributes:
        body: its name.
        start: (2,) the pin nearer to its motor, in the axes of the body [m].
        end: (2,) the other pin [m].
    """

    body: str
    start: Array
    end: Array

    @property
    def length(self) -> float:
        """From pin to pin [m]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def turn(self) -> float:
        """Direction of the link from the axis of its body [rad]."""
        return math.atan2(*(self.end - self.start)[::-1])


@attrs.frozen(kw_only=True, eq=False)
class Parts:
    """The links of a five-bar.

    Attributes:
        motors: (2, 2) where the left and the right motor stand [m].
        links: 1 to 4: left crank, left rod, right rod, right crank.
    """

    motors: Array
    links: tuple[Part, ...]


def parts_of(linkage: Linkage) -> Parts:
    """Return the links of the five-bar that a linkage is.

    Raises:
        InvalidValueError: it is no five-bar; the text says why.
    """
    slides = [joint.body for joint in linkage.joints if isinstance(joint, Guide)]
    if slides:
        raise _no_five_bar(linkage, f"body {slides[0]} slides along a guide")
    if len(linkage.bodies) != 4:
        raise _no_five_bar(linkage, f"it has {len(linkage.bodies)} bodies besides the ground, not 4")
    way = _loop(linkage)
    motors = linkage.point(way[0]), linkage.point(way[-1])
    if motors[0][0] > motors[1][0]:
        way, motors = way[::-1], motors[::-1]
    bodies = [way[i].body for i in (1, 3, 5, 7)]
    _check_motors(linkage, bodies)
    joined = (way[4], way[5])
    if not any(
        linkage.tip.body == one.body and np.array_equal(linkage.point(linkage.tip), linkage.point(one))
        for one in joined
    ):
        raise _no_five_bar(linkage, f"its tip is {linkage.tip}, not {joined[0]}, where the rods are joined")
    # Each link from the pin nearer to its motor: the right arm is walked the other way.
    ends = ((way[1], way[2]), (way[3], way[4]), (way[6], way[5]), (way[8], way[7]))
    links = tuple(Part(start.body, linkage.point(start), linkage.point(end)) for start, end in ends)
    for link in links:
        if link.length == 0:
            raise _no_five_bar(linkage, f"both pins of body {link.body} are at one point")
    return Parts(motors=np.stack(motors), links=links)


def configuration(linkage: Linkage, angles: ArrayLike) -> Array:
    """Return the coordinates of a linkage that is a five-bar, with closed pins: a guess that chooses the mode.

    Args:
        linkage: the five-bar.
        angles: (..., 4) of its links from the downward vertical [rad].

    Returns:
        (..., n) coordinates.

    Raises:
        InvalidValueError: it is no five-bar.
        ShapeError: there are not four angles on the last axis.
    """
    parts, theta = parts_of(linkage), floats(angles, "angles")
    if theta.shape[-1:] != (4,):
        raise ShapeError(f"angles: expected four on the last axis, θ1 to θ4, got shape {theta.shape}")
    lead = theta.shape[:-1]
    values: dict[tuple[str, str], Array] = {}
    for motor, arm in ((parts.motors[0], (0, 1)), (parts.motors[1], (3, 2))):
        at = np.broadcast_to(motor, (*lead, 2))
        for number in arm:
            link, along = parts.links[number], theta[..., number] - math.pi / 2
            axis = along - link.turn
            centre = at + _turned(linkage.body(link.body).centre - link.start, axis)
            values |= {(link.body, "x"): centre[..., 0], (link.body, "y"): centre[..., 1]}
            values[link.body, "angle"] = axis - linkage.zero
            at = at + _turned(link.end - link.start, axis)
    return np.stack([values[one.body, one.kind] for one in linkage.coordinates], axis=-1)


def _turned(point: Array, angle: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * point[0] - s * point[1], s * point[0] + c * point[1]], axis=-1)


def _loop(linkage: Linkage) -> list[BodyPoint]:
    """Return the ten places where pins sit, in the order in which one comes to them from the ground to the ground."""
    pins = [(BodyPoint(joint.body, joint.point), joint.on) for joint in linkage.joints if not isinstance(joint, Guide)]
    pins += [(pin.bearing, pin.journal) for pin in linkage.pins]
    if len(pins) != 5:
        raise _no_five_bar(linkage, f"it has {len(pins)} pins, not 5")
    for body in (GROUND, *(body.name for body in linkage.bodies)):
        held = sum(place.body == body for ends in pins for place in ends)
        if held != 2:
            raise _no_five_bar(linkage, f"{_called(body)} has {held} pins, not 2")
    way: list[BodyPoint] = []
    here, left = GROUND, list(pins)
    while left:
        ends = next((ends for ends in left if here in (ends[0].body, ends[1].body)), None)
        if ends is None:
            raise _no_five_bar(linkage, "its bodies are not in one loop")
        left.remove(ends)
        way += ends if ends[0].body == here else ends[::-1]
        here = way[-1].body
    return way


def _check_motors(linkage: Linkage, bodies: Sequence[str]) -> None:
    """Refuse a linkage whose motors do not turn the bodies on the ground."""
    cranks = (bodies[0], bodies[3])
    driven = {drive.body for drive in linkage.drives}
    if driven != set(cranks):
        names = ", ".join(drive.body for drive in linkage.drives) or "nothing"
        raise _no_five_bar(
            linkage, f"its drives turn {names}, not {cranks[0]} and {cranks[1]}, which are on the ground"
        )
    for body in cranks:
        joint = linkage.joint(body)
        if joint is None or joint.on.body != GROUND:
            raise _no_five_bar(linkage, f"the drive of {body} does not turn it against the ground")


def _called(body: str) -> str:
    return "the ground" if body == GROUND else f"body {body}"


def _no_five_bar(linkage: Linkage, why: str) -> InvalidValueError:
    return InvalidValueError(f"{linkage.name} is no five-bar: {why}")
