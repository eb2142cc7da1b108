"""A stroke of a linkage with worn pins, leaning: where the journals lie, how they slide, and where that puts the tip.

The drives follow their path, and every journal lies at the wall to which the motion presses it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.accuracy.pose import pose_repeatability
from armwright.arrays import Array, integer
from armwright.clearance.ideal import (
    IdealMotion,
    close_pins,
    ideal_motion,
    inverse_dynamics,
    tip_position,
)
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.plane_vectors import rotate
from armwright.clearance.scenario import assembly_guess, close_pins_along
from armwright.clearance.wear.contact_history import ContactHistory, leaning_slips, pin_angles
from armwright.clearance.wear.foundation import rest_positions
from armwright.clearance.wear.worn_surfaces import WearLaw, WornSurfaces, stroke_growth
from armwright.errors import InvalidValueError

# The direction of a force and the position of its journal depend a little on each other: so often they are found anew.
_ROUNDS = 3
# A force that is nothing has no direction [N].
_NOTHING = 1e-12
# ISO 9283 visits a pose thirty times; so many such tests tell how their results scatter.
_VISITS, _TESTS = 30, 10


class TipErrors(NamedTuple):
    """Where worn pins put the tip, of n poses and s moments of a stroke.

    Attributes:
        accuracy: (t, n) distance of the mean position from the commanded one, in t tests of thirty visits [m].
        repeatability: (t, n) RP of ISO 9283 in each test [m].
        path: (s,) distance of the tip from its path [m].
    """

    accuracy: Array
    repeatability: Array
    path: Array


@attrs.frozen(kw_only=True, eq=False)
class Stroke:
    """A motion of a linkage without clearance at some moments, and at rest at its goals.

    Attributes:
        linkage: with p new pins.
        name: of the path.
        time: (s,) [s].
        motion: (s) without clearance.
        rest: (n, c) coordinates at the goals.
        goals: (n,) times of these [s].
    """

    linkage: Linkage
    name: str
    time: Array
    motion: IdealMotion
    rest: Array
    goals: tuple[float, ...]

    @classmethod
    def of(cls, linkage: Linkage, path: Path, moments: int = 161) -> Stroke:
        """Return the stroke of a linkage along a path, at equally spaced moments.

        Raises:
            InvalidValueError: the path cannot be followed.
        """
        goals = tuple(sorted({0.0, *path.targets}))
        time = np.linspace(0.0, path.duration, integer(moments, "moments", least=3))
        by_tip = path.follower == "tip"
        state = path.evaluate(time)
        q = close_pins_along(linkage, state.position, assembly_guess(linkage), by_tip=by_tip)
        nearest = q[np.searchsorted(time, np.array(goals) - 1e-12).clip(0, len(q) - 1)]
        goal = path.evaluate(np.array(goals)).position
        return cls(
            linkage=linkage,
            name=path.name,
            time=time,
            motion=ideal_motion(linkage, q, state.velocity, state.acceleration, by_tip=by_tip),
            rest=close_pins(linkage, nearest, **{"tip" if by_tip else "drives": goal}),
            goals=goals,
        )


class Leaning(NamedTuple):
    """Journals at their walls, at s moments.

    Attributes:
        q: (s, n) coordinates of the linkage.
        history: of the contacts.
        shares: (s, p, m) part of each bin of the bearing in the force.
    """

    q: Array
    history: ContactHistory
    shares: Array


def lean(
    stroke: Stroke, law: WearLaw, surfaces: WornSurfaces, softening: Array | float = 0.0, rounds: int = _ROUNDS
) -> Leaning:
    """Return how the journals lie and slide over a stroke.

    Args:
        stroke: of the linkage.
        law: of pressure and wear.
        surfaces: worn.
        softening: (p,) compliance added to that of the foundations [m³/N].
        rounds: in which the forces and the positions that depend on them are found; of one, forces are those without
            clearance.
    """
    motion = stroke.motion
    rest = _rest(stroke.linkage, law, surfaces, (motion.q, motion.qd, motion.qdd), softening=softening, rounds=rounds)
    angles = pin_angles(stroke.linkage, rest.q, motion.qd)
    history = ContactHistory(
        time=stroke.time,
        forces=rotate(rest.reactions, -angles.bearing),
        slips=leaning_slips(stroke.linkage, stroke.time, rest.gaps, angles),
        rotations=angles.journal - angles.bearing,
    )
    return Leaning(rest.q, history, rest.shares)


def lean_new(stroke: Stroke, law: WearLaw) -> Leaning:
    """Return how the journals of new pins lie and slide over a stroke.

    Raises:
        InvalidValueError: nothing slides in a pin.
    """
    leaning = lean(stroke, law, WornSurfaces.new(len(stroke.linkage.pins), law.bins))
    if not np.all(leaning.history.work > 0):
        raise InvalidValueError(f"{stroke.linkage.name}: nothing slides in its pins on path {stroke.name}")
    return leaning


def leaning_growth(law: WearLaw, linkage: Linkage, leaning: Leaning) -> WornSurfaces:
    """Return what a stroke takes from the surfaces."""
    radii = np.array([pin.journal_radius for pin in linkage.pins])
    history = leaning.history
    return stroke_growth(law, radii, history.loads, leaning.shares, history.rotations)


def peak_pressures(law: WearLaw, linkage: Linkage, leaning: Leaning) -> Array:
    """Return (p,) the largest pressure in each pin [Pa]."""
    sizes = np.linalg.norm(leaning.history.forces, axis=-1) * leaning.shares.max(axis=-1)
    areas = [law.bin_area(pin.journal_radius) for pin in linkage.pins]
    return np.asarray(sizes.max(axis=0) / areas)


def tip_errors(stroke: Stroke, law: WearLaw, surfaces: WornSurfaces, *, seed: int = 0) -> TipErrors:
    """Return where worn pins put the tip, over the stroke and at its goals.

    At every visit of a goal friction holds each journal anywhere within its friction cone with the same probability.
    """
    linkage, q = stroke.linkage, stroke.rest
    leaning = lean(stroke, law, surfaces)
    path = np.linalg.norm(tip_position(linkage, leaning.q) - tip_position(linkage, stroke.motion.q), axis=-1)
    still = np.zeros_like(q)
    rest = _rest(linkage, law, surfaces, (q, still, still))
    cone = np.arctan(linkage.material.friction)
    shape = (_TESTS * _VISITS, len(linkage.pins))
    tilts = cone * np.random.default_rng(seed).uniform(-1.0, 1.0, shape)
    accuracy, repeatability = np.zeros((_TESTS, len(q))), np.zeros((_TESTS, len(q)))
    for k, goal in enumerate(tip_position(linkage, q)):
        visits = np.broadcast_to(rest.q[k], (len(tilts), q.shape[1]))
        angles = pin_angles(linkage, visits, np.zeros_like(visits))
        gaps = np.zeros((*tilts.shape, 2))
        for i in range(len(linkage.pins)):
            forces = rotate(np.broadcast_to(rest.reactions[k, i], (len(tilts), 2)), tilts[:, i] - angles.bearing[:, i])
            turned = angles.journal[:, i] - angles.bearing[:, i]
            e, _ = _press(linkage, law, surfaces, pin=i, forces=forces, turned=turned, softening=0.0)
            gaps[:, i] = rotate(e, angles.bearing[:, i])
        tips = tip_position(linkage, close_pins(linkage, visits, drives=q[k, list(linkage.driven)], gaps=gaps))
        for t, test in enumerate(tips.reshape(_TESTS, _VISITS, 2)):
            accuracy[t, k] = np.linalg.norm(test.mean(axis=0) - goal)
            flat = np.concatenate([test, np.zeros((_VISITS, 1))], axis=-1)
            repeatability[t, k] = pose_repeatability(flat).radius
    return TipErrors(accuracy, repeatability, path)


def resting_gaps(linkage: Linkage, law: WearLaw, surfaces: WornSurfaces, q: Array) -> Array:
    """Return (n, p, 2) from bearings to journals of worn pins at rest, in the ground's axes [m].

    Args:
        linkage: with p new pins.
        law: of pressure and wear.
        surfaces: worn.
        q: (n, c) coordinates with closed pins, at which the drives are locked.
    """
    still = np.zeros_like(q)
    return _rest(linkage, law, surfaces, (q, still, still)).gaps


def gaps_in_cones(
    linkage: Linkage, law: WearLaw, states: Sequence[WornSurfaces], motion: tuple[Array, Array, Array], tilts: Array
) -> Array:
    """Return (s, t, n, p, 2) from bearings to journals whose forces friction tilts, in the ground's axes [m].

    The forces are those of the linkage without clearance; that wear turns it a little makes no difference to them.

    Args:
        linkage: with p new pins.
        law: of pressure and wear.
        states: s worn surfaces.
        motion: coordinates with closed pins (n, c), their speeds and their accelerations.
        tilts: (t,) of the forces [rad].
    """
    q, qd, qdd = motion
    reactions = _with_direction(inverse_dynamics(linkage, q, qd, qdd)[1])
    angles = pin_angles(linkage, q, qd)
    gaps = np.zeros((len(states), len(tilts), *reactions.shape))
    for i in range(len(linkage.pins)):
        turned = angles.journal[:, i] - angles.bearing[:, i]
        walls = np.array([surfaces.walls(i, linkage.pins[i].clearance, turned) for surfaces in states])
        walls = np.broadcast_to(walls[:, None], (len(states), len(tilts), *walls.shape[1:]))
        forces = rotate(reactions[:, i], tilts[:, None] - angles.bearing[:, i])
        moduli = law.moduli(linkage, i, np.linalg.norm(forces, axis=-1).ravel()).reshape(forces.shape[:-1])
        shape = walls.shape[:-1]
        e, _ = rest_positions(
            np.broadcast_to(forces, (*shape, 2)).reshape(-1, 2),
            walls.reshape(-1, law.bins),
            np.broadcast_to(moduli * law.bin_area(linkage.pins[i].journal_radius), shape).ravel(),
        )
        gaps[:, :, :, i] = rotate(e.reshape(*shape, 2), angles.bearing[:, i])
    return gaps


class _Rest(NamedTuple):
    q: Array
    gaps: Array
    reactions: Array
    shares: Array


def _rest(
    linkage: Linkage,
    law: WearLaw,
    surfaces: WornSurfaces,
    motion: tuple[Array, Array, Array],
    *,
    softening: Array | float = 0.0,
    rounds: int = _ROUNDS,
) -> _Rest:
    """Return the journals at their walls under the reactions of a motion; gaps and reactions in the ground's axes."""
    q, qd, qdd = motion
    drives = q[:, list(linkage.driven)]
    compliance = np.broadcast_to(softening, len(linkage.pins))
    for _ in range(rounds):
        reactions = _with_direction(inverse_dynamics(linkage, q, qd, qdd)[1])
        angles = pin_angles(linkage, q, qd)
        gaps, shares = np.zeros_like(reactions), np.zeros((*reactions.shape[:2], law.bins))
        for i in range(len(linkage.pins)):
            forces = rotate(reactions[:, i], -angles.bearing[:, i])
            turned = angles.journal[:, i] - angles.bearing[:, i]
            soft = float(compliance[i])
            e, shares[:, i] = _press(linkage, law, surfaces, pin=i, forces=forces, turned=turned, softening=soft)
            gaps[:, i] = rotate(e, angles.bearing[:, i])
        q = close_pins(linkage, q, drives=drives, gaps=gaps)
    return _Rest(q, gaps, reactions, shares)


def _press(
    linkage: Linkage, law: WearLaw, surfaces: WornSurfaces, *, pin: int, forces: Array, turned: Array, softening: float
) -> tuple[Array, Array]:
    """Return positions and shares of the journal of a pin; see ``rest_positions``."""
    moduli = law.moduli(linkage, pin, np.linalg.norm(forces, axis=-1))
    moduli = 1 / (1 / moduli + softening)
    walls = surfaces.walls(pin, linkage.pins[pin].clearance, turned)
    return rest_positions(forces, walls, moduli * law.bin_area(linkage.pins[pin].journal_radius))


def _with_direction(forces: Array) -> Array:
    """Return forces (..., 2) of which none is 0."""
    nothing = np.linalg.norm(forces, axis=-1, keepdims=True) < _NOTHING
    return np.where(nothing, (_NOTHING, 0.0), forces)
