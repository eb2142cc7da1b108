"""The motion of a linkage with play, over abstract scalars: what its bodies do under drives, loads and contacts.

Source:
    Thesis eq. (3.22)-(3.35) with the corrections of docs/errata.md, in coordinates that need no Lagrange multipliers:
    ideal joints hang the bodies in trees, and pins with play are forces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

import attrs

from armwright.clearance.contact import (
    SLOWEST_IMPACT,
    Bristles,
    FrictionLaw,
    elastic_force,
    linear_slip,
    normal_force,
    smooth_slip,
)
from armwright.clearance.linkage import Guide, Linkage, Pin, Play
from armwright.clearance.placement import Placement, Vec2
from armwright.tracing.scalar import Scalar, select, sqrt

SlipSpeed: TypeAlias = Literal["surface", "centre"]

SLIP_SPEEDS: tuple[SlipSpeed, ...] = ("surface", "centre")
# Works that are added up while a linkage moves [J].
WORKS = ("driven", "impact loss", "friction loss")
# A journal nearer to the middle of its bearing has no direction [m].
_TINY = 1e-12
# Bristles that nothing bends straighten in this time [s].
_STRAIGHTENING = 1e-3
_SLIP: Mapping[str, Callable[[Scalar, Scalar], Scalar]] = {"linear": linear_slip, "tanh": smooth_slip}


@attrs.frozen(kw_only=True)
class FrictionModel:
    """How friction is worked out.

    Attributes:
        law: ``linear`` or ``tanh`` in the sliding speed, or ``lugre``.
        velocity: which speed slides: of the ``surface``, as it is, or of the ``centre``, as the thesis has it.
    """

    law: FrictionLaw = "linear"
    velocity: SlipSpeed = "surface"


class Contact(NamedTuple):
    """What the law of a contact needs to know of one pin.

    Attributes:
        clearance: [m].
        stiffness: K [N/m^1.5].
        damping: χ.
        friction: coefficient.
        threshold: sliding speed below which friction fades [m/s].
    """

    clearance: Scalar
    stiffness: Scalar
    damping: Scalar
    friction: Scalar
    threshold: Scalar


class ContactMemory(NamedTuple):
    """What is kept of a contact from step to step.

    Attributes:
        touching: 1 where they touched at the start of the step, else 0.
        speed: with which they came [m/s].
        bend: of the bristles of LuGre [m]; 0 for other laws.
    """

    touching: Scalar
    speed: Scalar
    bend: Scalar = 0.0


class State(NamedTuple):
    """What a linkage with play is doing.

    Attributes:
        q: (n) coordinates [rad, m].
        qd: (n) their speeds [rad/s, m/s].
        touches: of each pin what is kept.
    """

    q: Sequence[Scalar]
    qd: Sequence[Scalar]
    touches: Sequence[ContactMemory]


class PinContact(NamedTuple):
    """One pin in one configuration.

    Attributes:
        gap: from the centre of the bearing to that of the journal [m].
        depth: δ, how far the journal is in the wall; below 0 where it flies [m].
        rate: δ̇ [m/s].
        normal: force with which they press on one another [N].
        sliding: speed of the surfaces on one another [m/s].
        touch: what to keep.
        bending: rate of the bristles of LuGre [m/s]; 0 for other laws.
        pushes: generalised forces, by coordinate.
        losses: power lost in the impact and in sliding [W].
        stored: energy of the indentation [J].
    """

    gap: Vec2
    depth: Scalar
    rate: Scalar
    normal: Scalar
    sliding: Scalar
    touch: ContactMemory
    bending: Scalar
    pushes: dict[int, Scalar]
    losses: tuple[Scalar, Scalar]
    stored: Scalar


class Rates(NamedTuple):
    """What a linkage with play does at one moment.

    Attributes:
        qdd: accelerations of its coordinates.
        efforts: of its drives [N m, N].
        powers: of ``WORKS`` [W].
        pins: what is going on in each.
        tip: where the tip is [m].
        energy: kinetic energy, that of gravity and loads, and that in the contacts [J].
    """

    qdd: list[Scalar]
    efforts: list[Scalar]
    powers: list[Scalar]
    pins: list[PinContact]
    tip: Vec2
    energy: list[Scalar]


def rates(
    linkage: Linkage, rubbing: FrictionModel, state: State, drives: Sequence[Scalar], contacts: Sequence[Contact]
) -> Rates:
    """Return what a linkage with play does.

    Args:
        linkage: with n coordinates.
        rubbing: how friction is worked out.
        state: what it is doing.
        drives: of each drive its effort [N m, N], or its acceleration where its motion is given.
        contacts: of each pin what its law needs.
    """
    placement = Placement(linkage, state.q, state.qd)
    force = free_forces(placement)
    pins, lost, rubbed, stored = [], 0.0, 0.0, 0.0
    for pin, contact, touch in zip(linkage.pins, contacts, state.touches, strict=True):
        pressed = _pressed(placement, rubbing, pin, contact, touch)
        for i, push in pressed.pushes.items():
            force[i] = force[i] + push
        pins.append(pressed)
        lost = lost + pressed.losses[0]
        rubbed = rubbed + pressed.losses[1]
        stored = stored + pressed.stored
    qdd, efforts = _driven(linkage, mass_matrix(placement), force, drives)
    driven = 0.0
    for drive, effort in zip(linkage.drives, efforts, strict=True):
        for i, weight in drive_weights(linkage, drive.body).items():
            driven = driven + effort * weight * state.qd[i]
    energy = [kinetic_energy(placement), potential_energy(placement), stored]
    return Rates(qdd, efforts, [driven, lost, rubbed], pins, placement.point(linkage.tip).at, energy)


# ---- bodies --------------------------------------------------------------------------------------------------------


def free_forces(placement: Placement) -> list[Scalar]:
    """Return the generalised forces of gravity, loads and speeds, without drives and contacts."""
    linkage = placement.linkage
    force: list[Scalar] = [0.0] * len(linkage.coordinates)
    gravity = Vec2(*map(float, linkage.gravity))
    for body in linkage.bodies:
        centre = placement.centre(body)
        push = gravity.minus(centre.bias).times(body.mass)
        for i, partial in centre.partials.items():
            force[i] += partial.dot(push)
    for load in linkage.loads:
        push = Vec2(*map(float, load.force))
        for i, partial in placement.point(load.at).partials.items():
            force[i] += partial.dot(push)
    return force


def mass_matrix(placement: Placement) -> dict[tuple[int, int], Scalar]:
    """Return the entries of the mass matrix that are not 0 whatever the configuration, row not above column."""
    entries: dict[tuple[int, int], Scalar] = {}
    for body in placement.linkage.bodies:
        partials, turns = placement.centre(body).partials, placement.frames[body.name].turns
        for i, one in partials.items():
            for j, other in partials.items():
                if i >= j:
                    entries[i, j] = entries.get((i, j), 0.0) + body.mass * one.dot(other)
        for i, weight in turns.items():
            for j, other_weight in turns.items():
                if i >= j:
                    entries[i, j] = entries.get((i, j), 0.0) + body.inertia * weight * other_weight
    return {place: entry for place, entry in entries.items() if not (isinstance(entry, float) and entry == 0)}


def kinetic_energy(placement: Placement) -> Scalar:
    """Return the kinetic energy of all bodies [J]."""
    energy = 0.0
    for body in placement.linkage.bodies:
        velocity, spin = placement.centre(body).velocity, placement.frames[body.name].spin
        energy = energy + 0.5 * body.mass * velocity.dot(velocity) + 0.5 * body.inertia * spin * spin
    return energy


def potential_energy(placement: Placement) -> Scalar:
    """Return the energy of gravity and of the constant loads [J]."""
    linkage, energy = placement.linkage, 0.0
    gravity = Vec2(*map(float, linkage.gravity))
    for body in linkage.bodies:
        energy = energy - body.mass * gravity.dot(placement.centre(body).at)
    for load in linkage.loads:
        energy = energy - Vec2(*map(float, load.force)).dot(placement.point(load.at).at)
    return energy


def drive_weights(linkage: Linkage, body: str) -> dict[int, float]:
    """Return how the effort of a drive acts on the coordinates: against the body that carries it, too."""
    numbers = {coordinate: i for i, coordinate in enumerate(linkage.coordinates)}
    joint = linkage.joint(body)
    own = next(i for one, i in numbers.items() if one.body == body)
    weights = {own: 1.0}
    if isinstance(joint, Pin):
        # What slides on a guide turns with the body that has it.
        carrier = joint.on.body
        while isinstance(guide := linkage.joint(carrier), Guide):
            carrier = guide.on.body
        turning = next((i for one, i in numbers.items() if one.body == carrier and one.kind == "angle"), None)
        if turning is not None:
            weights[turning] = -1.0
    return weights


def _driven(
    linkage: Linkage, M: Mapping[tuple[int, int], Scalar], force: list[Scalar], drives: Sequence[Scalar]
) -> tuple[list[Scalar], list[Scalar]]:
    """Return accelerations and efforts, of drives whose effort or whose motion is given."""
    given: dict[int, Scalar] = {}
    efforts: list[Scalar] = []
    for drive, number, value in zip(linkage.drives, linkage.driven, drives, strict=True):
        if drive.kind == "motion":
            given[number] = value
        else:
            for i, weight in drive_weights(linkage, drive.body).items():
                force[i] = force[i] + weight * value
        efforts.append(value)
    free = [i for i in range(len(force)) if i not in given]
    inner = {place: entry for place, entry in M.items() if not given.keys() & set(place)}
    right = {i: force[i] - sum(_entry(M, i, j) * given[j] for j in given if (max(i, j), min(i, j)) in M) for i in free}
    solved = solve({i: n for n, i in enumerate(free)}, inner, right)
    qdd = [given[i] if i in given else solved[i] for i in range(len(force))]
    # What is carried comes after what carries it, which takes its drive's counter-effort.
    moving = {i: k for k, i in enumerate(linkage.driven) if i in given}
    for number in sorted(moving, reverse=True):
        row = [_entry(M, number, j) * qdd[j] for j in range(len(qdd)) if (max(number, j), min(number, j)) in M]
        efforts[moving[number]] = effort = sum(row) - force[number]
        for i, weight in drive_weights(linkage, linkage.drives[moving[number]].body).items():
            if i != number:
                force[i] = force[i] + weight * effort
    return qdd, efforts


def _entry(M: Mapping[tuple[int, int], Scalar], i: int, j: int) -> Scalar:
    return M[max(i, j), min(i, j)]


def solve(
    order: Mapping[int, int], M: Mapping[tuple[int, int], Scalar], right: Mapping[int, Scalar]
) -> dict[int, Scalar]:
    """Solve a symmetric positive definite system by LDLᵀ, without touching what is 0.

    Args:
        order: the unknowns, in the order in which they are eliminated.
        M: entries on and below the diagonal.
        right: the right side.
    """
    names = sorted(order, key=lambda one: order[one])
    work = dict(M)
    x = dict(right)
    factors: dict[tuple[int, int], Scalar] = {}
    for a, i in enumerate(names):
        inverse = 1.0 / work[i, i]
        below = [j for j in names[a + 1 :] if (j, i) in work]
        for j in below:
            factors[j, i] = work[j, i] * inverse
        for j in below:
            for k in below:
                if j >= k:
                    product = factors[j, i] * work[k, i]
                    work[j, k] = work[j, k] - product if (j, k) in work else -product
            x[j] = x[j] - factors[j, i] * x[i]
        work[i, i] = inverse
    for a, i in reversed(list(enumerate(names))):
        x[i] = x[i] * work[i, i]
        for j in names[a + 1 :]:
            if (j, i) in factors:
                x[i] = x[i] - factors[j, i] * x[j]
    return x


# ---- contacts ------------------------------------------------------------------------------------------------------


def _pressed(
    placement: Placement, rubbing: FrictionModel, pin: Play, contact: Contact, touch: ContactMemory
) -> PinContact:
    """Return what is going on in a pin.

    Both bodies are pushed at one point, on the wall of the bearing, so that no couple is left over.
    """
    bearing, journal = placement.point(pin.bearing), placement.point(pin.journal)
    hole, shaft = placement.frames[pin.bearing.body], placement.frames[pin.journal.body]
    gap = journal.at.minus(bearing.at)
    distance = sqrt(gap.dot(gap))
    outward = gap.times(1.0 / select(distance > _TINY, distance, _TINY))
    along = outward.turned()
    velocity = journal.velocity.minus(bearing.velocity)
    depth, rate = distance - contact.clearance, velocity.dot(outward)
    wall = contact.clearance + pin.journal_radius
    inside = wall - distance
    centre_slip = velocity.dot(along)
    surface_slip = centre_slip + shaft.spin * inside - hole.spin * wall
    slip = surface_slip if rubbing.velocity == "surface" else centre_slip
    speed = select(touch.touching > 0.5, touch.speed, select(rate > SLOWEST_IMPACT, rate, SLOWEST_IMPACT))
    normal = normal_force(depth, rate, speed, contact.stiffness, contact.damping)
    bending = 0.0
    if rubbing.law == "lugre":
        coefficient, bending = Bristles.step(touch.bend, slip, contact.friction)
        # In flight nothing bends the bristles: they straighten.
        bending = select(depth > 0.0, bending, touch.bend * (-1.0 / _STRAIGHTENING))
    else:
        coefficient = contact.friction * _SLIP[rubbing.law](slip, contact.threshold)
    rub = coefficient * normal
    push = outward.times(normal).plus(along.times(rub))
    pushes: dict[int, Scalar] = {}
    for i, partial in hole.shifted(bearing, outward.times(wall)).partials.items():
        pushes[i] = partial.dot(push)
    for i, partial in shaft.shifted(journal, outward.times(inside)).partials.items():
        pushes[i] = pushes.get(i, 0.0) - partial.dot(push)
    touching = depth > 0.0
    pressed = select(touching, depth, 0.0)
    spring = elastic_force(pressed, contact.stiffness)
    return PinContact(
        gap=gap,
        depth=depth,
        rate=rate,
        normal=normal,
        sliding=surface_slip,
        touch=ContactMemory(select(touching, 1.0, 0.0), speed),
        bending=bending,
        pushes=pushes,
        losses=((normal - spring) * rate, rub * surface_slip),
        stored=0.4 * spring * pressed,
    )
