"""The recognition of a five-bar: which body of a linkage is which of its links."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.clearance.linkage import GROUND, BodyPoint, Guide, Linkage
from armwright.errors import InvalidValueError


class Link(NamedTuple):
    """A body as a link of a five-bar.

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
    def angle(self) -> float:
        """Angle of the link from the axis of its body [rad]."""
        return math.atan2(*(self.end - self.start)[::-1])


class FiveBarLinks(NamedTuple):
    """The links of a five-bar.

    Attributes:
        motors: (2, 2) positions of the left and the right motor [m].
        links: 1 to 4: left crank, left rod, right rod, right crank.
    """

    motors: Array
    links: tuple[Link, ...]


def five_bar_links(linkage: Linkage) -> FiveBarLinks:
    """Return the links of the five-bar that a linkage is.

    Raises:
        InvalidValueError: it is no five-bar; the text states the reason.
    """
    slides = [joint.body for joint in linkage.joints if isinstance(joint, Guide)]
    if slides:
        raise _not_five_bar_error(linkage, f"body {slides[0]} slides along a guide")
    if len(linkage.bodies) != 4:
        raise _not_five_bar_error(linkage, f"it has {len(linkage.bodies)} bodies besides the ground, not 4")
    loop = _pin_loop(linkage)
    motors = linkage.point(loop[0]), linkage.point(loop[-1])
    if motors[0][0] > motors[1][0]:
        loop, motors = loop[::-1], motors[::-1]
    _check_motors(linkage, (loop[1].body, loop[8].body))
    tip, joined = linkage.tip, loop[4:6]
    at_tip = (end for end in joined if np.array_equal(linkage.point(tip), linkage.point(end)))
    if tip.body not in {end.body for end in at_tip}:
        raise _not_five_bar_error(linkage, f"its tip is {tip}, not {joined[0]}, where the rods are joined")
    # Each link starts at the pin nearer to its motor, so that those of the right arm run against the loop.
    ends = ((loop[1], loop[2]), (loop[3], loop[4]), (loop[6], loop[5]), (loop[8], loop[7]))
    links = tuple(Link(start.body, linkage.point(start), linkage.point(end)) for start, end in ends)
    for link in links:
        if link.length == 0:
            raise _not_five_bar_error(linkage, f"both pins of body {link.body} are at one point")
    return FiveBarLinks(np.stack(motors), links)


def five_bar_coordinates(linkage: Linkage, angles: ArrayLike) -> Array:
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
    parts, theta = five_bar_links(linkage), of_shape(angles, (4,), "angles θ1 to θ4")
    lead = theta.shape[:-1]
    values: dict[tuple[str, str], Array] = {}
    for motor, arm in ((parts.motors[0], (0, 1)), (parts.motors[1], (3, 2))):
        start = np.broadcast_to(motor, (*lead, 2))
        for number in arm:
            link, along = parts.links[number], theta[..., number] - math.pi / 2
            axis = along - link.angle
            centre = start + _rotate(linkage.body(link.body).centre - link.start, axis)
            values |= {(link.body, "x"): centre[..., 0], (link.body, "y"): centre[..., 1]}
            values[link.body, "angle"] = axis - linkage.zero
            start = start + _rotate(link.end - link.start, axis)
    return np.stack([values[coordinate] for coordinate in linkage.rigid_coordinates], axis=-1)


def _rotate(point: Array, angle: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * point[0] - s * point[1], s * point[0] + c * point[1]], axis=-1)


def _pin_loop(linkage: Linkage) -> list[BodyPoint]:
    """Return the ten ends of the pins, in order along the loop from the ground to the ground."""
    pins = [(BodyPoint(joint.body, joint.point), joint.on) for joint in linkage.joints if not isinstance(joint, Guide)]
    pins += [(pin.bearing, pin.journal) for pin in linkage.pins]
    if len(pins) != 5:
        raise _not_five_bar_error(linkage, f"it has {len(pins)} pins, not 5")
    for body in (GROUND, *(body.name for body in linkage.bodies)):
        count = sum(end.body == body for ends in pins for end in ends)
        if count != 2:
            name = "the ground" if body == GROUND else f"body {body}"
            raise _not_five_bar_error(linkage, f"{name} has {count} pins, not 2")
    loop: list[BodyPoint] = []
    body, remaining = GROUND, list(pins)
    while remaining:
        ends = next((ends for ends in remaining if body in (ends[0].body, ends[1].body)), None)
        if ends is None:
            raise _not_five_bar_error(linkage, "its bodies are not in one loop")
        remaining.remove(ends)
        loop += ends if ends[0].body == body else ends[::-1]
        body = loop[-1].body
    return loop


def _check_motors(linkage: Linkage, cranks: tuple[str, str]) -> None:
    """Refuse a linkage whose motors do not drive the bodies on the ground."""
    driven = [drive.body for drive in linkage.drives]
    if set(driven) != set(cranks):
        names = ", ".join(driven) or "nothing"
        why = f"its drives move {names}, not {cranks[0]} and {cranks[1]}, which are on the ground"
        raise _not_five_bar_error(linkage, why)
    for body in cranks:
        joint = linkage.joint(body)
        if joint is None or joint.on.body != GROUND:
            raise _not_five_bar_error(linkage, f"the drive of {body} does not act against the ground")


def _not_five_bar_error(linkage: Linkage, why: str) -> InvalidValueError:
    return InvalidValueError(f"{linkage.name} is no five-bar: {why}")
