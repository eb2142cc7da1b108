"""Which errors of a model readings of a resting tip would contradict, and how the others bias the clearances.

An error of the model shifts the tip, as a little more clearance would. The part of that shift that some clearances
explain is attributed to them and cannot be detected; only the remainder contradicts the model, once it is large beside
the noise. So a payload whose weight hardly rotates the forces in the pins is never detected, and with three poses the
remainder is small for every error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import attrs
import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, f, ncf, ncx2

from armwright.arrays import Array, ArrayLike
from armwright.clearance.estimation.misfit import CONTRADICTION
from armwright.clearance.estimation.static_estimate import Estimate, rest_matrix, whitening
from armwright.clearance.ideal import close_pins
from armwright.clearance.linkage import Body, Linkage
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError

# The probability with which readings contradict a detected model error.
POWER = 0.9
# The change of a model in the difference quotient of the tip: a part of a number, or an angle [rad].
_STEP = 1e-4
# A remainder that is a smaller part of its shift is rounding.
_NEGLIGIBLE = 1e-6
# The detection limit is iterated until the remainder is this near to what is needed; an error many times as large as
# its linear estimate is not detected, since it shifts the tip less and less.
_TOLERANCE, _MAX_GROWTH, _MAX_ROUNDS = 0.01, 10.0, 20
# A model error whose full size shifts the tip by less has no effect, such as the mass of a locked crank [m].
_NO_SHIFT = 1e-9


class ModelError(NamedTuple):
    """A possible error of a model.

    Attributes:
        name: of the quantity.
        unit: "1" for a part of a force or a mass, "m" for a length, "rad" or "m" for the zero of a drive.
        detectable_from: size from which readings contradict it in nine of ten cases; infinite where they never do.
        shifts: (p,) bias of the clearances per unit [m].
    """

    name: str
    unit: str
    detectable_from: float
    shifts: Array


class ErrorKind(NamedTuple):
    """A kind of model error.

    Attributes:
        name: of the quantity.
        unit: of its size.
        size: in that unit, for a change by 1.
        changed: the model after a change.
        zeros: (d,) errors of the zeros of the drives for a change by 1 [rad, m].
    """

    name: str
    unit: str
    size: float
    changed: Callable[[float], Linkage]
    zeros: Array


def model_errors(
    linkage: Linkage, poses: ArrayLike, estimate: Estimate, *, noise_is_known: bool = True
) -> tuple[ModelError, ...]:
    """Return the possible errors of a model that shift the resting tip, and their detection limits.

    Args:
        linkage: the nominal model, with p pins.
        poses: (k, 2) commanded positions of the tip [m].
        estimate: from the readings there, without leading axes.
        noise_is_known: otherwise the residuals are taken for noise, and nothing contradicts the model.
    """
    q = closed_at_tips(linkage, poses)
    white = whitening(estimate.scatter)
    B = (white @ rest_matrix(linkage, q)).reshape(-1, len(estimate.names))
    Q, _ = np.linalg.qr(B)
    noncentrality = _noncentrality(estimate.degrees_of_freedom, estimate.scatter_freedom) if noise_is_known else np.inf
    least = float(np.sqrt(noncentrality))
    nominal = resting_tips(linkage, linkage, q, np.zeros(len(linkage.drives)), estimate.values)

    def remainder(shift: Array) -> float:
        """Return the norm of the part of a shift, in standard deviations, that no clearances explain."""
        return float(np.linalg.norm(shift - Q @ (Q.T @ shift)))

    errors = []
    for kind in error_kinds(linkage):

        def shift(change: float, kind: ErrorKind = kind) -> Array:
            tips = resting_tips(kind.changed(change), linkage, q, change * kind.zeros, estimate.values)
            return np.asarray(white @ (tips - nominal)[..., None], dtype=np.float64).ravel()

        slope = (shift(_STEP) - shift(-_STEP)) / (2 * _STEP)
        full = float(np.linalg.norm(slope))
        if full * estimate.noise < _NO_SHIFT:
            continue
        limit = np.inf
        if np.isfinite(least) and remainder(slope) > _NEGLIGIBLE * full:
            linear = least / remainder(slope)
            limit = kind.size * _detection_limit(lambda change: remainder(shift(change)), linear, least)
        shifts = np.linalg.lstsq(B, slope / kind.size, rcond=None)[0]
        errors.append(ModelError(kind.name, kind.unit, limit, np.asarray(shifts, dtype=np.float64)))
    return tuple(errors)


def _detection_limit(remainder: Callable[[float], float], linear: float, least: float) -> float:
    """Return the change from which on, of either sign, a model error leaves the remainder needed to detect it.

    Args:
        remainder: of the shift by a change, in standard deviations, which no clearances explain; a change of -1 removes
            the quantity.
        linear: the limit if the remainder is proportional to the change.
        least: remainder needed, in standard deviations.
    """
    size = linear
    for _ in range(_MAX_ROUNDS):
        try:
            smaller = min(remainder(change) for change in (size, -size) if change > -1)
        except InvalidValueError:
            # The wrong linkage cannot be assembled, which nobody overlooks.
            return size
        if smaller > (1 - _TOLERANCE) * least:
            return size
        size *= least / max(smaller, 0.5 * least)
        if size > _MAX_GROWTH * linear:
            break
    return float(np.inf)


def _noncentrality(freedom: int, noise_freedom: float) -> float:
    """Return the noncentrality of chi-square, or of F, at which the model is refused with the probability ``POWER``."""
    if freedom < 1:
        return np.inf
    known = np.isinf(noise_freedom)
    bound = chi2.isf(CONTRADICTION, freedom) if known else f.isf(CONTRADICTION, freedom, noise_freedom)

    def excess(size: float) -> float:
        power = ncx2.sf(bound, freedom, size) if known else ncf.sf(bound, freedom, noise_freedom, size)
        return float(power) - POWER

    upper = 16.0
    while excess(upper) < 0:
        upper *= 2
    return float(brentq(excess, 1e-3, upper))


def resting_tips(wrong: Linkage, nominal: Linkage, q: Array, zeros: Array, clearances: Array) -> Array:
    """Return (k, 2) the resting positions of the tip of a wrong model, its drives at those of the nominal model.

    Args:
        wrong: the linkage.
        nominal: the nominal model.
        q: (k, n) coordinates of the nominal model without clearance.
        zeros: (d,) errors of the zeros of the drives [rad, m].
        clearances: (p,) [m].
    """
    start = close_pins(wrong, q, drives=q[:, list(nominal.driven)] + zeros)
    c = np.broadcast_to(clearances, (len(q), len(clearances)))
    return find_static_equilibrium(wrong, start, c, contact_stiffness(wrong, c)).tip


def error_kinds(linkage: Linkage) -> Iterator[ErrorKind]:
    """Give all kinds of errors that a model may have."""
    exact = np.zeros(len(linkage.drives))

    def part_error(name: str, field: str, number: int, attribute: str) -> ErrorKind:
        return ErrorKind(name, "1", 1.0, partial(_scale_part, linkage, field, number, attribute), exact)

    for i, load in enumerate(linkage.loads):
        if np.any(load.force):
            yield part_error(f"load at {load.point}", "loads", i, "force")
    for i, body in enumerate(linkage.bodies):
        yield part_error(f"mass of {body.name}", "bodies", i, "mass")
        if (length := _body_length(body)) > 0:
            yield part_error(f"length of {body.name}", "bodies", i, "points")._replace(unit="m", size=length)
    if (length := _body_length(linkage.ground)) > 0:
        yield ErrorKind("distances on the ground", "m", length, partial(_scale_ground, linkage), exact)
    for drive, number, zeros in zip(linkage.drives, linkage.driven, np.eye(len(exact)), strict=True):
        unit = "rad" if linkage.coordinates[number].kind == "angle" else "m"
        yield ErrorKind(f"zero of {drive.body}", unit, 1.0, lambda _: linkage, zeros)


def _scale_part(linkage: Linkage, field: str, number: int, attribute: str, change: float) -> Linkage:
    """Return a linkage with the force of a load, or the mass or the points of a body, larger by a part of it."""
    parts: dict[str, Any] = {field: list(getattr(linkage, field))}
    parts[field][number] = _scaled(parts[field][number], attribute, change)
    return attrs.evolve(linkage, **parts)


def _scale_ground(linkage: Linkage, change: float) -> Linkage:
    """Return a linkage with the distances of the points on the ground larger by a part of them."""
    return attrs.evolve(linkage, ground=_scaled(linkage.ground, "points", change))


def _scaled(part: Any, attribute: str, change: float) -> Any:
    value = getattr(part, attribute)
    if attribute == "points":
        return attrs.evolve(part, points={name: point * (1 + change) for name, point in value.items()})
    return attrs.evolve(part, **{attribute: value * (1 + change)})


def _body_length(body: Body) -> float:
    """Return the largest distance between two points of a body [m]."""
    points = np.array(list(body.points.values()))
    return float(np.linalg.norm(points[:, None] - points, axis=-1).max()) if len(points) > 1 else 0.0
