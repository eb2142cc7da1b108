"""The equations of motion of a linkage with clearance, over abstract scalars: under drives, loads and contacts.

Source:
    Thesis eq. (3.22)-(3.35) with the corrections of docs/errata.md, in coordinates that need no Lagrange multipliers:
    ideal joints connect the bodies to trees, and pins with clearance are forces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
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
from armwright.clearance.linkage import GROUND, ClearancePin, Coordinate, Linkage
from armwright.clearance.placement import Placement, Point, Vec2
from armwright.tracing.scalar import Scalar, atan2, select, sqrt

SlipSpeed: TypeAlias = Literal["surface", "centre"]

SLIP_SPEEDS: tuple[SlipSpeed, ...] = ("surface", "centre")
# Works that are integrated along with the motion [J].
WORKS = ("driven", "impact loss", "friction loss")
# One more of linkages with elastic rods.
ROD_WORKS = ("damping loss",)
# A journal nearer to the middle of its bearing has no direction [m].
_TINY = 1e-12
# Time constant with which bristles without a force straighten [s].
_STRAIGHTENING = 1e-3
_SLIP: Mapping[str, Callable[[Scalar, Scalar], Scalar]] = {"linear": linear_slip, "tanh": smooth_slip}


@attrs.frozen(kw_only=True)
class FrictionModel:
    """The law of friction and its sliding speed.

    Attributes:
        law: ``linear`` or ``tanh`` in the sliding speed, or ``lugre``.
        velocity: the sliding speed: that of the ``surface``, as in nature, or of the ``centre``, as in the thesis.
    """

    law: FrictionLaw = "linear"
    velocity: SlipSpeed = "surface"


class Contact(NamedTuple):
    """The parameters of the contact law of one pin.

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
    """The part of a contact's state that passes from step to step.

    Attributes:
        touching: 1 where they touched at the start of the step, else 0.
        speed: impact speed [m/s].
        deflection: of the bristles of LuGre [m]; 0 for other laws.
    """

    touching: Scalar
    speed: Scalar
    deflection: Scalar = 0.0


class Wall(NamedTuple):
    """The worn wall of a pin where its journal is; see ``worn_walls``.

    Attributes:
        growth: how much farther than the clearance it is [m].
        slope: derivative by the direction of the gap in the bearing [m/rad].
        turning: derivative by the rotation of the journal in the bearing [m/rad].
    """

    growth: Scalar
    slope: Scalar
    turning: Scalar


class State(NamedTuple):
    """The state of a linkage with clearance.

    Attributes:
        q: (n) coordinates [rad, m].
        qd: (n) their speeds [rad/s, m/s].
        memories: of the contacts, one for each pin.
    """

    q: Sequence[Scalar]
    qd: Sequence[Scalar]
    memories: Sequence[ContactMemory]


class PinContact(NamedTuple):
    """One pin in one configuration.

    Attributes:
        gap: from the centre of the bearing to that of the journal [m].
        depth: δ, how far the journal is in the wall; below 0 where it flies [m].
        rate: δ̇ [m/s].
        normal: force with which they press on one another [N].
        memory: of the contact, for the next step.
        deflection_rate: of the bristles of LuGre [m/s]; 0 for other laws.
        forces: generalised forces, by coordinate.
        losses: power lost in the impact and in sliding [W].
        stored: energy of the indentation [J].
    """

    gap: Vec2
    depth: Scalar
    rate: Scalar
    normal: Scalar
    memory: ContactMemory
    deflection_rate: Scalar
    forces: dict[int, Scalar]
    losses: tuple[Scalar, Scalar]
    stored: Scalar


class Rates(NamedTuple):
    """The rates of a linkage with clearance, and the forces and energies that belong to them.

    Attributes:
        qdd: accelerations of its coordinates.
        efforts: of its drives [N m, N].
        powers: of ``WORKS``, and of ``ROD_WORKS`` where there are rods [W].
        pins: the contact in each.
        energy: kinetic energy, that of gravity and loads, and that in the contacts and rods [J].
    """

    qdd: list[Scalar]
    efforts: list[Scalar]
    powers: list[Scalar]
    pins: list[PinContact]
    energy: list[Scalar]


def rates(
    linkage: Linkage,
    friction: FrictionModel,
    state: State,
    drives: Sequence[Scalar],
    contacts: Sequence[Contact],
    *,
    walls: Sequence[Wall] | None = None,
    payload: Scalar | None = None,
) -> Rates:
    """Return the accelerations, efforts, powers and energies of a linkage with clearance.

    Args:
        linkage: with n coordinates.
        friction: the friction model.
        state: of the linkage.
        drives: of each drive its effort [N m, N], or its acceleration where its motion is prescribed.
        contacts: parameters of the contact law of each pin.
        walls: of each pin, where they are worn.
        payload: mass at the tip, beside the loads of the linkage [kg].
    """
    placement = Placement(linkage, state.q, state.qd)
    force = free_forces(placement, payload)
    pins, impact_loss, friction_loss, stored = [], 0.0, 0.0, 0.0
    for i, parameters in enumerate(zip(linkage.pins, contacts, state.memories, strict=True)):
        pin = _pin_contact(placement, friction, *parameters, worn=walls[i] if walls else None)
        for k, push in pin.forces.items():
            force[k] = force[k] + push
        pins.append(pin)
        impact_loss = impact_loss + pin.losses[0]
        friction_loss = friction_loss + pin.losses[1]
        stored = stored + pin.stored
    qdd, efforts = _accelerations(placement, mass_matrix(placement, payload), force, drives)
    driven = 0.0
    for drive, effort in zip(linkage.drives, efforts, strict=True):
        for i, weight in drive_weights(linkage, drive.body).items():
            driven = driven + effort * weight * state.qd[i]
    powers = [driven, impact_loss, friction_loss]
    if placement.rods:
        powers.append(sum((c * state.qd[i] * state.qd[i] for i, _, c in rod_springs(placement)), 0.0))
    energy = [kinetic_energy(placement, payload), potential_energy(placement, payload)]
    energy.append(stored + strain_energy(placement))
    return Rates(qdd, efforts, powers, pins, energy)


# ---- bodies --------------------------------------------------------------------------------------------------------


def free_forces(placement: Placement, payload: Scalar | None = None) -> list[Scalar]:
    """Return the generalised forces of gravity, loads, payload, speeds and rods, without drives and contacts."""
    linkage = placement.linkage
    force: list[Scalar] = [0.0] * len(placement.q)
    gravity = Vec2(*map(float, linkage.gravity))
    for body in linkage.bodies:
        for mass, point in placement.masses(body):
            push = gravity.minus(point.bias).times(mass)
            for i, partial in point.partials.items():
                force[i] += partial.dot(push)
    for load in linkage.loads:
        push = Vec2(*map(float, load.force))
        for i, partial in placement.point(load.point).partials.items():
            force[i] += partial.dot(push)
    for i, k, c in rod_springs(placement):
        force[i] = force[i] - k * placement.q[i] - c * placement.qd[i]
    if payload is not None:
        tip = placement.point(linkage.tip)
        push = gravity.minus(tip.bias).times(payload)
        for i, partial in tip.partials.items():
            force[i] = force[i] + partial.dot(push)
    return force


def mass_matrix(placement: Placement, payload: Scalar | None = None) -> dict[tuple[int, int], Scalar]:
    """Return the entries on and below the diagonal of the mass matrix, but for those that are always 0."""
    entries: dict[tuple[int, int], Scalar] = {}
    for body in placement.linkage.bodies:
        inertia, rotations = placement.inertia(body), placement.frames[body.name].angle_partials
        for mass, point in placement.masses(body):
            _add_mass(entries, mass, point)
        for i, weight in rotations.items():
            for j, other_weight in rotations.items():
                if i >= j:
                    entries[i, j] = entries.get((i, j), 0.0) + inertia * weight * other_weight
    if payload is not None:
        _add_mass(entries, payload, placement.point(placement.linkage.tip))
    return {index: entry for index, entry in entries.items() if not (isinstance(entry, float) and entry == 0)}


def _add_mass(entries: dict[tuple[int, int], Scalar], mass: Scalar, point: Point) -> None:
    """Add a mass at a point to the mass matrix."""
    for i, partial in point.partials.items():
        for j, other in point.partials.items():
            if i >= j:
                entries[i, j] = entries.get((i, j), 0.0) + mass * partial.dot(other)


def kinetic_energy(placement: Placement, payload: Scalar | None = None) -> Scalar:
    """Return the kinetic energy of all bodies and of a payload at the tip [J]."""
    energy = 0.0
    for body in placement.linkage.bodies:
        spin = placement.frames[body.name].spin
        for mass, point in placement.masses(body):
            energy = energy + 0.5 * mass * point.velocity.dot(point.velocity)
        energy = energy + 0.5 * placement.inertia(body) * spin * spin
    if payload is not None:
        velocity = placement.point(placement.linkage.tip).velocity
        energy = energy + 0.5 * payload * velocity.dot(velocity)
    return energy


def potential_energy(placement: Placement, payload: Scalar | None = None) -> Scalar:
    """Return the energy of gravity, of the constant loads and of a payload at the tip [J]."""
    linkage, energy = placement.linkage, 0.0
    gravity = Vec2(*map(float, linkage.gravity))
    for body in linkage.bodies:
        for mass, point in placement.masses(body):
            energy = energy - mass * gravity.dot(point.position)
    for load in linkage.loads:
        energy = energy - Vec2(*map(float, load.force)).dot(placement.point(load.point).position)
    if payload is not None:
        energy = energy - payload * gravity.dot(placement.point(linkage.tip).position)
    return energy


def rod_springs(placement: Placement) -> Iterator[tuple[int, float, float]]:
    """Give the number of each coordinate of a rod, its stiffness [N/m] and its damping [N s/m]."""
    for rod in placement.rods.values():
        yield from zip(rod.numbers, rod.rod.stiffness, rod.rod.damping, strict=True)


def strain_energy(placement: Placement) -> Scalar:
    """Return the energy with which rods are bent and stretched [J]."""
    return sum((0.5 * k * placement.q[i] * placement.q[i] for i, k, _ in rod_springs(placement)), 0.0)


def drive_weights(linkage: Linkage, body: str) -> dict[int, float]:
    """Return the weights of a drive's effort on the coordinates, also on those of the body that carries it."""
    coordinates, joint = linkage.coordinates, linkage.joint(body)
    weights = {next(i for i, coordinate in enumerate(coordinates) if coordinate.body == body): 1.0}
    carrier_angle = Coordinate(linkage.rotation_carrier(body) or GROUND, "angle")
    if carrier_angle in coordinates:
        weights[coordinates.index(carrier_angle)] = -1.0
    if joint is not None and joint.on.body in (rods := linkage.rods):
        first = coordinates.index(Coordinate(joint.on.body, "bend1"))
        slopes = rods[joint.on.body].section_at(linkage.point(joint.on)).slopes
        weights |= {first + i: -slope for i, slope in enumerate(slopes)}
    return weights


def _accelerations(
    placement: Placement, M: Mapping[tuple[int, int], Scalar], force: list[Scalar], drives: Sequence[Scalar]
) -> tuple[list[Scalar], list[Scalar]]:
    """Return the accelerations of the coordinates and the efforts of the drives."""
    linkage = placement.linkage
    prescribed: dict[int, Scalar] = {}
    efforts: list[Scalar] = []
    for drive, number, value in zip(linkage.drives, linkage.driven, drives, strict=True):
        if drive.kind == "motion":
            prescribed[number] = value
        else:
            for i, weight in drive_weights(linkage, drive.body).items():
                force[i] = force[i] + weight * value
        efforts.append(value)
    free = [i for i in range(len(force)) if i not in prescribed]
    inner = {index: entry for index, entry in M.items() if not prescribed.keys() & set(index)}
    right = {
        i: force[i] - sum(_entry(M, i, j) * prescribed[j] for j in prescribed if (max(i, j), min(i, j)) in M)
        for i in free
    }
    solved = solve(inner, right)
    qdd = [prescribed[i] if i in prescribed else solved[i] for i in range(len(force))]
    # A carried body comes after its carrier, on which its drive's counter-effort acts.
    moving = {i: k for k, i in enumerate(linkage.driven) if i in prescribed}
    for number in sorted(moving, reverse=True):
        row = [_entry(M, number, j) * qdd[j] for j in range(len(qdd)) if (max(number, j), min(number, j)) in M]
        efforts[moving[number]] = effort = sum(row) - force[number]
        for i, weight in drive_weights(linkage, linkage.drives[moving[number]].body).items():
            if i != number:
                force[i] = force[i] + weight * effort
    return qdd, efforts


def _entry(M: Mapping[tuple[int, int], Scalar], i: int, j: int) -> Scalar:
    return M[max(i, j), min(i, j)]


def solve(M: Mapping[tuple[int, int], Scalar], right: Mapping[int, Scalar]) -> dict[int, Scalar]:
    """Solve a symmetric positive definite system by LDLᵀ, skipping the entries that are 0.

    Args:
        M: entries on and below the diagonal.
        right: the right side; its unknowns are eliminated in their order.
    """
    names, work, x = list(right), dict(M), dict(right)
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


class _Touch(NamedTuple):
    """Where a journal is from the wall of its bearing, and where they would touch.

    Attributes:
        depth: δ [m].
        rate: δ̇ [m/s].
        outward: normal of the wall.
        steepness: length of the gradient of the depth; the surfaces press harder by it.
        wall: distance of the place of contact from the centre of the bearing, along the normal [m].
        inside: its distance from the centre of the journal [m].
        arm: from the centre of the bearing to it [m].
        couple: of a force of 1 N; a worn journal is not pressed through its middle [m].
    """

    depth: Scalar
    rate: Scalar
    outward: Vec2
    steepness: Scalar
    wall: Scalar
    inside: Scalar
    arm: Vec2
    couple: Scalar


def pin_place(placement: Placement, pin: ClearancePin) -> tuple[Scalar, Scalar]:
    """Return the direction of the gap of a pin in the axes of its bearing, and the rotation of its journal [rad]."""
    own, other = placement.frames[pin.bearing.body].axis, placement.frames[pin.journal.body].axis
    gap = placement.point(pin.journal).position.minus(placement.point(pin.bearing).position)
    across = own.perpendicular()
    return atan2(across.dot(gap), own.dot(gap)), atan2(across.dot(other), own.dot(other))


def _touch(placement: Placement, pin: ClearancePin, clearance: Scalar, worn: Wall | None) -> _Touch:
    """Return where the journal of a pin is from its wall, round or worn."""
    bearing, journal = placement.point(pin.bearing), placement.point(pin.journal)
    gap = journal.position.minus(bearing.position)
    distance = sqrt(gap.dot(gap))
    inverse = 1.0 / select(distance > _TINY, distance, _TINY)
    radial = gap.times(inverse)
    velocity = journal.velocity.minus(bearing.velocity)
    if worn is None:
        wall = clearance + pin.journal_radius
        touch = wall, wall - distance, radial.times(wall)
        return _Touch(distance - clearance, velocity.dot(radial), radial, 1.0, *touch, 0.0)
    hole, shaft = placement.section(pin.bearing).spin, placement.section(pin.journal).spin
    gradient = radial.minus(radial.perpendicular().times(worn.slope * inverse))
    # The wall turns with the bearing, and what the journal has lost turns with the journal.
    rate = velocity.dot(gradient) + worn.slope * hole - worn.turning * (shaft - hole)
    steepness = sqrt(gradient.dot(gradient))
    outward = gradient.times(1.0 / select(steepness > _TINY, steepness, 1.0))
    depth = distance - (clearance + worn.growth)
    inside = pin.journal_radius - depth
    touch = gap.dot(outward) + inside, inside, gap.plus(outward.times(inside))
    return _Touch(depth, rate, outward, steepness, *touch, worn.turning)


def _pin_contact(
    placement: Placement,
    friction: FrictionModel,
    pin: ClearancePin,
    contact: Contact,
    memory: ContactMemory,
    *,
    worn: Wall | None,
) -> PinContact:
    """Return the contact in a pin.

    The forces on both bodies act at one point, on the wall of the bearing, so that no net couple remains.
    """
    bearing, journal = placement.point(pin.bearing), placement.point(pin.journal)
    hole, shaft = placement.section(pin.bearing), placement.section(pin.journal)
    touch = _touch(placement, pin, contact.clearance, worn)
    outward, depth, rate = touch.outward, touch.depth, touch.rate
    along = outward.perpendicular()
    centre_slip = journal.velocity.minus(bearing.velocity).dot(along)
    surface_slip = centre_slip + shaft.spin * touch.inside - hole.spin * touch.wall
    slip = surface_slip if friction.velocity == "surface" else centre_slip
    speed = select(memory.touching > 0.5, memory.speed, select(rate > SLOWEST_IMPACT, rate, SLOWEST_IMPACT))
    pressing = normal_force(depth, rate, speed, contact.stiffness, contact.damping)
    normal = pressing * touch.steepness
    deflection_rate = 0.0
    if friction.law == "lugre":
        coefficient, deflection_rate = Bristles.step(memory.deflection, slip, contact.friction)
        # In free flight no force acts on the bristles: they straighten.
        deflection_rate = select(depth > 0.0, deflection_rate, memory.deflection * (-1.0 / _STRAIGHTENING))
    else:
        coefficient = contact.friction * _SLIP[friction.law](slip, contact.threshold)
    tangential = coefficient * normal
    push = outward.times(normal).plus(along.times(tangential))
    forces: dict[int, Scalar] = {}
    for i, partial in hole.shifted(bearing, touch.arm).partials.items():
        forces[i] = partial.dot(push)
    for i, partial in shaft.shifted(journal, outward.times(touch.inside)).partials.items():
        forces[i] = forces.get(i, 0.0) - partial.dot(push)
    if worn is not None:
        couple = pressing * touch.couple
        for frame, sign in ((hole, -1.0), (shaft, 1.0)):
            for i, weight in frame.angle_partials.items():
                forces[i] = forces.get(i, 0.0) + sign * weight * couple
    touching = depth > 0.0
    indentation = select(touching, depth, 0.0)
    spring = elastic_force(indentation, contact.stiffness)
    return PinContact(
        gap=journal.position.minus(bearing.position),
        depth=depth,
        rate=rate,
        normal=normal,
        memory=ContactMemory(select(touching, 1.0, 0.0), speed),
        deflection_rate=deflection_rate,
        forces=forces,
        losses=((pressing - spring) * rate, tangential * surface_slip),
        stored=0.4 * spring * indentation,
    )
