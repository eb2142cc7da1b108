"""How far the resting tip of a linkage moves when a clearance, a dimension, a mass or a load is a little other.

At rest the drives are locked and every journal is pressed against its bearing by the force that it carries. Balance of
forces, contact in the pins and locked drives are as many equations as there are coordinates, efforts and reactions.
They are differentiated implicitly. In a configuration positions are linear in the coordinates of points, and in the
cosine and sine of the angles of guides; so are their derivatives. Differences over a step of 1 m, or of a right angle
to either side, are therefore exact, and so are second derivatives from accelerations at constant speeds.

Source:
    Spec of the clearance, 4.3; spec of the life, 2.
"""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.dimensions import (
    Change,
    Dimension,
    DimensionKind,
    dimensions_of,
    guide_changes,
    length_changes,
    point_changes,
    zero_shifts,
)
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.equations import drive_weights
from armwright.clearance.ideal import gap_derivatives, inverse_dynamics, place_bodies, point_derivatives
from armwright.clearance.linkage import Linkage
from armwright.clearance.placement import Placement, Point, Vec2
from armwright.clearance.static_equilibrium import find_static_equilibrium, force_magnitudes
from armwright.errors import InvalidValueError, one_of


@attrs.frozen(kw_only=True, eq=False)
class RestSensitivities:
    """The resting tip of a linkage, and its derivatives by all dimensions.

    Attributes:
        dimensions: k of them.
        tip: (..., 2) where it rests [m].
        jacobian: (..., 2, k) derivatives of the tip, in metres per unit of each dimension.
    """

    dimensions: tuple[Dimension, ...]
    tip: Array
    jacobian: Array

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the dimensions."""
        return tuple(dimension.name for dimension in self.dimensions)

    def of(self, kind: DimensionKind) -> Array:
        """Return (..., 2, m) the columns of the m dimensions of a kind, in order."""
        return self.jacobian[..., [i for i, each in enumerate(self.dimensions) if each.kind == kind]]

    def column(self, name: str) -> Array:
        """Return (..., 2) the derivative by one dimension.

        Raises:
            UnknownNameError: there is none of that name; the nearest is named.
        """
        return self.jacobian[..., self.names.index(one_of("dimension", name, self.names))]


def rest_sensitivities(
    linkage: Linkage, ideal: ArrayLike, clearances: ArrayLike | None = None, stiffness: ArrayLike | None = None
) -> RestSensitivities:
    """Return how the resting tip depends on all dimensions, with the drives locked at coordinates without clearance.

    Directions of contact forces turn with every change, which counts. Without clearance the columns of clearances are
    the matrix B of ``rest_matrix``, and masses and loads have no effect.

    Args:
        linkage: with n coordinates and p pins.
        ideal: (..., n) coordinates with closed pins, at which the drives are locked; see ``closed_at_tips``.
        clearances: (..., p) about which the tip is linear [m]; those of the linkage when left out.
        stiffness: (..., p) of the contacts [N/m^1.5], the same for all clearances; rigid ones when left out.

    Raises:
        InvalidValueError: a pin carries no force, so that its journal may lie anywhere, the linkage is singular, or a
            body is elastic.
        ShapeError: an array does not fit.

    Source:
        Spec of the life, 2.
    """
    refuse_rods("sensitivities of the tip", linkage.rods)
    rest = find_static_equilibrium(linkage, ideal, clearances, stiffness)
    still = np.zeros_like(rest.q)
    _, reactions = inverse_dynamics(linkage, rest.q, still, still)
    size = force_magnitudes(linkage, reactions)
    c = linkage.clearance_array(clearances)
    K = np.inf if stiffness is None else floats(stiffness, "stiffness")
    A = _equations(linkage, rest.q, reactions, c, (size / K) ** (2 / 3))
    known, own = _right_sides(linkage, rest.q, reactions, reactions / size[..., None])
    try:
        moved = np.linalg.solve(A, -known)
    except np.linalg.LinAlgError as error:
        raise InvalidValueError(
            f"{linkage.name} is in a singular configuration, where its tip may go anywhere"
        ) from error
    tip = point_derivatives(place_bodies(linkage, rest.q), linkage.tip)
    return RestSensitivities(
        dimensions=dimensions_of(linkage),
        tip=rest.tip,
        jacobian=np.asarray(tip @ moved[..., : rest.q.shape[-1], :] + own),
    )


# ---- the equations of rest -----------------------------------------------------------------------------------------


def _pushed(placement: Placement, reactions: Array) -> Iterator[tuple[Point, Vec2]]:
    """Give the points on which forces act, with these: weights, loads, and the reactions (..., p, 2) in the pins."""
    linkage = placement.linkage
    gravity = Vec2(*map(float, linkage.gravity))
    for body in linkage.bodies:
        yield placement.centre(body), gravity.times(body.mass)
    for load in linkage.loads:
        yield placement.point(load.point), Vec2(*map(float, load.force))
    for k, pin in enumerate(linkage.pins):
        force = Vec2(reactions[..., k, 0], reactions[..., k, 1])
        yield placement.point(pin.bearing), force
        yield placement.point(pin.journal), force.times(-1.0)


def _equations(linkage: Linkage, q: Array, reactions: Array, clearances: Array, depths: Array) -> Array:
    """Return (..., m, m) the derivatives of the equations of rest by coordinates, efforts and reactions.

    The equations are the balance of the generalised forces, the gaps less those that the reactions cause, and the
    driven coordinates.
    """
    n, p, d = len(linkage.coordinates), len(linkage.pins), len(linkage.drives)
    gaps = gap_derivatives(place_bodies(linkage, q))
    A = np.zeros((*q.shape[:-1], n + 2 * p + d, n + d + 2 * p))
    A[..., :n, :n] = _force_slopes(linkage, q, reactions)
    for k, drive in enumerate(linkage.drives):
        for i, weight in drive_weights(linkage, drive.body).items():
            A[..., i, n + k] = weight
    A[..., n : n + 2 * p, :n] = gaps
    A[..., :n, n + d :] = -np.swapaxes(gaps, -1, -2)
    for k in range(p):
        rows, columns = slice(n + 2 * k, n + 2 * k + 2), slice(n + d + 2 * k, n + d + 2 * k + 2)
        force = np.linalg.norm(reactions[..., k, :], axis=-1)[..., None, None]
        direction = reactions[..., k, :, None] / force
        along = direction * np.swapaxes(direction, -1, -2)
        depth = depths[..., k, None, None]
        # Hertz: the depth grows with the power 2/3 of the force.
        A[..., rows, columns] = -(
            (clearances[..., k, None, None] + depth) / force * (np.eye(2) - along) + 2 / 3 * depth / force * along
        )
    A[..., range(n + 2 * p, n + 2 * p + d), linkage.driven] = 1.0
    return A


def _force_slopes(linkage: Linkage, q: Array, reactions: Array) -> Array:
    """Return (..., n, n) the derivatives of the generalised forces by the coordinates, while forces stay as they are.

    The acceleration of a point at constant speeds is the quadratic form of its second derivatives: of the sum of two
    unit speeds it has twice the mixed one in it.
    """
    n = q.shape[-1]
    first, second = np.triu_indices(n)
    speeds = np.eye(n)[first] + np.where(first != second, 1.0, 0.0)[:, None] * np.eye(n)[second]
    lead = q.shape[:-1]
    speeds = speeds.reshape(len(first), *[1] * len(lead), n)
    forms = np.zeros((len(first), *lead))
    for point, force in _pushed(place_bodies(linkage, q[None], speeds), reactions[None]):
        forms += point.bias.dot(force)
    slopes = np.zeros((*lead, n, n))
    for form, i, j in zip(forms, first, second, strict=True):
        slopes[..., i, j] = slopes[..., j, i] = form
    squares = np.diagonal(slopes, axis1=-2, axis2=-1).copy()
    mixed = (slopes - squares[..., :, None] - squares[..., None, :]) / 2
    return np.asarray(np.where(np.eye(n, dtype=bool), slopes, mixed))


def _right_sides(linkage: Linkage, q: Array, reactions: Array, directions: Array) -> tuple[Array, Array]:
    """Return the derivatives by the dimensions, at fixed coordinates, of the equations (..., m, k), and of the tip."""
    n, p, d = len(linkage.coordinates), len(linkage.pins), len(linkage.drives)
    lead, placement = q.shape[:-1], place_bodies(linkage, q)
    columns: list[tuple[Array, Array]] = []

    def new() -> tuple[Array, Array]:
        columns.append((np.zeros((*lead, n + 2 * p + d)), np.zeros((*lead, 2))))
        return columns[-1]

    for k in range(p):
        new()[0][..., n + 2 * k : n + 2 * k + 2] = -directions[..., k, :]
    columns += [_geometry_slope(linkage, change, q, reactions) for change in length_changes(linkage)]
    for shift in zero_shifts(linkage).T:
        new()[0][..., n + 2 * p :] = -shift
    axis = placement.frames[linkage.tip.body].axis
    for way in (axis, axis.perpendicular()):
        _, own = new()
        own[..., 0], own[..., 1] = way
    changes = (*point_changes(linkage), *guide_changes(linkage))
    columns += [_geometry_slope(linkage, change, q, reactions) for change in changes]
    gravity = Vec2(*map(float, linkage.gravity))
    pushes = [(placement.centre(body), gravity) for body in linkage.bodies]
    pushes += [(placement.point(load.point), Vec2(*way)) for load in linkage.loads for way in np.eye(2).tolist()]
    for point, push in pushes:
        equations, _ = new()
        for i, partial in point.partials.items():
            equations[..., i] += partial.dot(push)
    return np.stack([each[0] for each in columns], axis=-1), np.stack([each[1] for each in columns], axis=-1)


def _geometry_slope(linkage: Linkage, change: Change, q: Array, reactions: Array) -> tuple[Array, Array]:
    """Return the derivatives of the equations (..., m) and of the tip (..., 2) by a dimension of the geometry."""
    after, before = (_geometry(change.apply(linkage, by), q, reactions) for by in (change.step, -change.step))
    slopes = (after - before) / 2
    return slopes[..., :-2], slopes[..., -2:]


def _geometry(linkage: Linkage, q: Array, reactions: Array) -> Array:
    """Return the generalised forces, the gaps and zeros for the drives in the order of the equations, and the tip."""
    n, p, d = len(linkage.coordinates), len(linkage.pins), len(linkage.drives)
    placement = place_bodies(linkage, q)
    values = np.zeros((*q.shape[:-1], n + 2 * p + d + 2))
    for point, force in _pushed(placement, reactions):
        for i, partial in point.partials.items():
            values[..., i] += partial.dot(force)
    for k, pin in enumerate(linkage.pins):
        gap = placement.point(pin.journal).position.minus(placement.point(pin.bearing).position)
        values[..., n + 2 * k], values[..., n + 2 * k + 1] = gap
    values[..., -2], values[..., -1] = placement.point(linkage.tip).position
    return values
