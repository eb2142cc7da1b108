"""Which wrong models the readings of a resting tip would contradict, and by how much the others shift the clearances.

A model that is wrong shifts the tip, as a little more play would. What of that shift some clearances make too is taken
for them, and nothing can tell; only what is left contradicts the model, once it is large beside the noise. So a payload
whose weight hardly turns the forces in the pins is never seen, and with three poses little is left to see anything by.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple, TypeAlias

import attrs
import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, f, ncf, ncx2

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.estimation.misfit import CONTRADICTION
from armwright.clearance.estimation.static import Estimate, matrix_at, posed
from armwright.clearance.ideal import closed
from armwright.clearance.linkage import Body, Linkage
from armwright.clearance.rest import at_rest
from armwright.clearance.settings import contact_stiffness
from armwright.errors import InvalidValueError, one_of

# So surely a wrong model is refused that is called seen.
POWER = 0.9
# By so much models are changed to see what that does to the tip: a part of a number, or an angle [rad].
_STEP = 1e-4
# What is left of a shift is none when it is a smaller part of it: rounding leaves some.
_NONE = 1e-6
# From how much on a fault is seen is put right until what is left there is this near to what is needed; a fault so many
# times as large as a small one would have to be is not seen, for it shifts the tip less and less.
_NEAR, _FAR, _MOST_ROUNDS = 0.01, 10.0, 20
# What shifts the tip by less, though it is wrong by all that it is, does not matter: the mass of a crank is held [m].
_NOTHING = 1e-9


class Fault(NamedTuple):
    """A way in which a model can be wrong.

    Attributes:
        name: what of it.
        unit: "1" for a part of a force or a mass, "m" for a length, "rad" or "m" for the zero of a drive.
        seen: from how much on readings contradict it in nine of ten cases; infinite where they never do.
        shifts: (p,) by how much the clearances come out wrong for a unit of it [m].
    """

    name: str
    unit: str
    seen: float
    shifts: Array


# A wrong model: the linkage, and by how much the zeros of its drives (d,) are off [rad, m].
_Changed: TypeAlias = tuple[Linkage, Array]


class _Kind(NamedTuple):
    """A kind of fault: its name, its unit, how much of that a change by 1 is, and the changed model."""

    name: str
    unit: str
    size: float
    changed: Callable[[float], _Changed]


def faults(linkage: Linkage, poses: ArrayLike, found: Estimate, *, noise_is_known: bool = True) -> tuple[Fault, ...]:
    """Return in which ways a model may be wrong that shift the resting tip, and from when readings there show it.

    Args:
        linkage: as it is modelled, with p pins.
        poses: (k, 2) that were commanded [m].
        found: the estimate from the readings there, one without leading axes.
        noise_is_known: where it is not, what is left is taken for noise, and nothing contradicts the model.
    """
    q = posed(linkage, poses)
    weights = np.sqrt(np.repeat(found.readings, 2))
    B = weights[:, None] * matrix_at(linkage, q).reshape(-1, len(found.names))
    Q, _ = np.linalg.qr(B)
    least = np.sqrt(_noncentrality(found.spare, found.freedom)) * found.noise if noise_is_known else np.inf
    right = _tips(linkage, linkage, q, np.zeros(len(linkage.drives)), found.values)

    def left(shift: Array) -> float:
        """Return how much of a weighted shift no clearances explain."""
        return float(np.linalg.norm(shift - Q @ (Q.T @ shift)))

    seen = []
    for name, unit, size, changed in _kinds(linkage):

        def shift(by: float, changed: Callable[[float], _Changed] = changed) -> Array:
            wrong, zeros = changed(by)
            return weights * (_tips(wrong, linkage, q, zeros, found.values) - right).ravel()

        by_one = (shift(_STEP) - shift(-_STEP)) / (2 * _STEP)
        whole = float(np.linalg.norm(by_one))
        if whole < _NOTHING:
            continue
        shows = np.isfinite(least) and left(by_one) > _NONE * whole
        from_here = size * _seen_from(lambda by: left(shift(by)), least / left(by_one), least) if shows else np.inf
        shifts = np.linalg.lstsq(B, by_one / size, rcond=None)[0]
        seen.append(Fault(name, unit, from_here, np.asarray(shifts, dtype=np.float64)))
    return tuple(seen)


def _seen_from(left: Callable[[float], float], small: float, least: float) -> float:
    """Return from how much on, one way or the other, a fault leaves as much as is needed to see it.

    Args:
        left: what a change leaves that no clearances explain [m]; a change of -1 takes all away.
        small: what is needed if that is proportional to the change.
        least: how much has to be left [m].
    """
    size = small
    for _ in range(_MOST_ROUNDS):
        try:
            found = min(left(by) for by in (size, -size) if by > -1)
        except InvalidValueError:
            # So wrong an arm cannot be put together, which nobody overlooks.
            return size
        if found > (1 - _NEAR) * least:
            return size
        size *= least / max(found, 0.5 * least)
        if size > _FAR * small:
            break
    return float(np.inf)


def wrong_offsets(linkage: Linkage, poses: ArrayLike, clearances: ArrayLike, name: str, by: float) -> Array:
    """Return (k, 2) by how much a resting tip is off where the arm is not as its model says [m].

    Args:
        linkage: as it is modelled, with p pins.
        poses: (k, 2) places of its tip by the model, without play [m].
        clearances: (p,) [m].
        name: what the model has wrong; see ``Fault``.
        by: how much more the arm has of it, in the unit of the fault.

    Raises:
        UnknownNameError: there is no such fault.
    """
    kinds = {one.name: one for one in _kinds(linkage)}
    kind = kinds[one_of("fault", name, kinds)]
    wrong, zeros = kind.changed(by / kind.size)
    places = floats(poses, "poses")
    q = posed(linkage, places)
    return np.asarray(_tips(wrong, linkage, q, zeros, floats(clearances, "clearances")) - places, dtype=np.float64)


def _noncentrality(spare: int, known: float) -> float:
    """Return how large a shift squared must be, in deviations, that it is refused with the probability ``POWER``."""
    if spare < 1:
        return np.inf
    bound = chi2.isf(CONTRADICTION, spare) if np.isinf(known) else f.isf(CONTRADICTION, spare, known)

    def lacking(size: float) -> float:
        power = ncx2.sf(bound, spare, size) if np.isinf(known) else ncf.sf(bound, spare, known, size)
        return float(power) - POWER

    upper = 16.0
    while lacking(upper) < 0:
        upper *= 2
    return float(brentq(lacking, 1e-3, upper))


def _tips(wrong: Linkage, nominal: Linkage, q: Array, zeros: Array, clearances: Array) -> Array:
    """Return (k, 2) where the tip of a wrong model rests with the drives where the right one has them, but for zeros.

    Args:
        wrong: the linkage.
        nominal: as it is modelled.
        q: (k, n) its coordinates without play.
        zeros: (d,) by how much the zeros of the drives are off [rad, m].
        clearances: (p,) [m].
    """
    there = closed(wrong, q, drives=q[:, list(nominal.driven)] + zeros)
    c = np.broadcast_to(clearances, (len(q), len(clearances)))
    return at_rest(wrong, there, c, contact_stiffness(wrong, c)).tip


def _kinds(linkage: Linkage) -> Iterator[_Kind]:
    """Give all that may be wrong."""
    for i, load in enumerate(linkage.loads):
        if np.any(load.force):
            yield _Kind(f"load at {load.at}", "1", 1.0, partial(_loaded, linkage, i))
    for i, body in enumerate(linkage.bodies):
        yield _Kind(f"mass of {body.name}", "1", 1.0, partial(_heavier, linkage, i))
        if _length(body) > 0:
            yield _Kind(f"length of {body.name}", "m", _length(body), partial(_longer, linkage, i))
    if _length(linkage.ground) > 0:
        yield _Kind("distances on the ground", "m", _length(linkage.ground), partial(_wider, linkage))
    for i, drive in enumerate(linkage.drives):
        unit = "rad" if linkage.coordinates[linkage.driven[i]].kind == "angle" else "m"
        yield _Kind(f"zero of {drive.body}", unit, 1.0, partial(_turned, linkage, i))


def _loaded(linkage: Linkage, number: int, by: float) -> _Changed:
    loads = list(linkage.loads)
    loads[number] = attrs.evolve(loads[number], force=loads[number].force * (1 + by))
    return attrs.evolve(linkage, loads=tuple(loads)), np.zeros(len(linkage.drives))


def _heavier(linkage: Linkage, number: int, by: float) -> _Changed:
    bodies = list(linkage.bodies)
    bodies[number] = attrs.evolve(bodies[number], mass=bodies[number].mass * (1 + by))
    return attrs.evolve(linkage, bodies=tuple(bodies)), np.zeros(len(linkage.drives))


def _longer(linkage: Linkage, number: int, by: float) -> _Changed:
    bodies = list(linkage.bodies)
    bodies[number] = _scaled(bodies[number], by)
    return attrs.evolve(linkage, bodies=tuple(bodies)), np.zeros(len(linkage.drives))


def _wider(linkage: Linkage, by: float) -> _Changed:
    return attrs.evolve(linkage, ground=_scaled(linkage.ground, by)), np.zeros(len(linkage.drives))


def _turned(linkage: Linkage, number: int, by: float) -> _Changed:
    return linkage, by * np.eye(len(linkage.drives))[number]


def _scaled(body: Body, by: float) -> Body:
    return attrs.evolve(body, points={name: point * (1 + by) for name, point in body.points.items()})


def _length(body: Body) -> float:
    """Return how far the two farthest points of a body are apart [m]."""
    points = np.array(list(body.points.values()))
    return float(np.linalg.norm(points[:, None] - points, axis=-1).max()) if len(points) > 1 else 0.0
