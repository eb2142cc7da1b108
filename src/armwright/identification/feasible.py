"""Parameters of links that bodies can have, nearest to what was measured and to the drawing: a semidefinite program.

The moments of a body about the origin of its frame make a matrix, its pseudo-inertia, that is positive definite if and
only if its mass can be distributed in space. Base parameters are sums of moments, so there are many sets of bodies that
explain measurements equally well; of these the one is chosen that is nearest to the drawing as distributions of mass
are near each other.

Source:
    Wensing, Kim & Slotine (2018) for the pseudo-inertia; Lee, Wensing & Park (2020) for the distance, entropic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm, Link
from armwright.arrays import Array, read_only
from armwright.dynamics.bodies import Body, as_link, body_of
from armwright.dynamics.regressors import OF_LINK
from armwright.errors import ContradictionError
from armwright.extras import import_extra
from armwright.identification.fitting import Sums
from armwright.identification.model import DynamicModel
from armwright.identification.refinement import Refinement

# Entries of the upper triangle of a symmetric matrix, column by column, as Clarabel has them.
_UPPER4 = [(i, j) for j in range(4) for i in range(j + 1)]
_UPPER8 = [(i, j) for j in range(8) for i in range(j + 1)]
# Variables of a link beside its parameters: those of a triangle, and the logarithms of its diagonal.
_OWN = len(_UPPER4) + 4
# A link of which the drawing says nothing is taken for a ball of this mass [kg] and radius [m].
_UNKNOWN_MASS, _UNKNOWN_RADIUS = 1.0, 0.1
# No body is as thin as this part of its mean extent; no pseudo-inertia is smaller than that of such a body.
_THIN = 0.01
# Combinations of equations that are shorter than this part of the longest, squared, are rounding.
_ROUNDING = 1e-14
# The effect of a parameter that is smaller than this part of the largest is none.
_SHOWS = 1e-10
# A parameter that is smaller than this part of the drawing is rounding.
_NOTHING = 1e-12
# Terms of drives that cannot be negative.
_DISSIPATING = ("rotor", "viscous", "coulomb", "forward", "backward", "cube_root", "stribeck", "stiffness")


@attrs.frozen(kw_only=True, eq=False)
class Standard:
    """Parameters of all links and drives that bodies and drives can have.

    Attributes:
        values: (p,) parameters, as ``DynamicModel.names`` names them.
        base: (b,) base parameters that they make.
        weight: of the drawing, in equations: its distance counts as so many squared standard deviations.
        smallest: the least eigenvalue of any pseudo-inertia where that of the drawing is the identity; above 0.
    """

    values: Array = attrs.field(converter=read_only)
    base: Array = attrs.field(converter=read_only)
    weight: float
    smallest: float


def feasible(
    model: DynamicModel, sums: Sums, sigma: Array, *, weight: float = 1.0, is_refined: bool = True
) -> Standard:
    """Return the physically possible parameters that explain measurements best.

    Args:
        model: of the arm, whose own masses are the drawing.
        sums: of the measured equations.
        sigma: (n,) standard deviations of the residuals of each joint [N m] or [N].
        weight: of the drawing: its distance from the links counts as so many squared standard deviations; above 0.
        is_refined: whether what only the drawing tells is found to the last digit, too; efforts do not ask for that.

    Raises:
        MissingExtraError: Clarabel is not installed.
        ContradictionError: no set of bodies was found.
    """
    names = enumerate(model.names[OF_LINK * model.arm.n :], OF_LINK * model.arm.n)
    bounded = [k for k, name in names if name.rstrip("0123456789").removeprefix("coupled_") in _DISSIPATING]
    drawing = [_pseudo_inertia(body) for body in _drawing(model.arm)]
    measured = Measured(combinations=model.base.combinations, sums=sums, sigma=sigma)
    values, smallest = possible_bodies(measured, drawing, bounded, weight=weight, is_refined=is_refined)
    return Standard(values=values, base=model.base.combinations @ values, weight=weight, smallest=smallest)


class Measured(NamedTuple):
    """What measurements say of bodies and drives.

    Attributes:
        combinations: (b, p) parameters that were measured by those of the bodies, ten each, and of drives.
        sums: of the measured equations.
        sigma: (n,) standard deviations of the residuals of each joint.
    """

    combinations: Array
    sums: Sums
    sigma: Array


def possible_bodies(
    measured: Measured,
    drawing: Sequence[Array],
    bounded: Sequence[int],
    *,
    weight: float,
    is_refined: bool = True,
) -> tuple[Array, float]:
    """Return parameters (p,) that bodies and drives can have, and the least eigenvalue of any pseudo-inertia.

    Args:
        measured: what measurements say.
        drawing: pseudo-inertias (4, 4) of the bodies as drawn, positive definite.
        bounded: parameters that cannot be negative.
        weight: of the drawing.
        is_refined: whether the last digits are found, too.

    Raises:
        MissingExtraError: Clarabel is not installed.
        ContradictionError: no set of bodies was found.
    """
    clarabel = import_extra("clarabel", "a set of masses and inertias that bodies can have", "identification")
    from scipy import sparse  # noqa: PLC0415 - takes a tenth of a second to load
    from scipy.linalg import eigvalsh  # noqa: PLC0415

    scales = _scales(measured.combinations.shape[1], drawing)
    quadratic, linear = _objective(measured, scales, drawing, weight=weight)
    rows = _constraints(scales, drawing, bounded)
    cones = [
        clarabel.NonnegativeConeT(len(bounded)),
        *[clarabel.PSDTriangleConeT(8)] * len(drawing),
        *[clarabel.ExponentialConeT()] * (4 * len(drawing)),
    ]
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    A, right = rows.matrix(len(linear)), np.array(rows.right)
    # By the largest curvature the program is of the size that the solver likes best; rarely another helps.
    for scale in (1 / max(float(quadratic.diagonal().max()), 1.0), 1e-2, 1.0):
        P = sparse.csc_matrix(np.triu(scale * quadratic))
        solution = clarabel.DefaultSolver(P, scale * linear, A, right, cones, settings).solve()
        if str(solution.status) in ("Solved", "AlmostSolved"):
            break
    else:
        raise ContradictionError(
            f"no set of bodies explains the measurements: the semidefinite program ended with {solution.status}; are "
            "the units, the gains and the order of the joints right?"
        )
    # Scaled so that the drawing is the identity, as the program is.
    roots = [np.linalg.inv(np.linalg.cholesky(P0)) for P0 in drawing]
    units = np.array([_unfolded(unit) for unit in np.eye(OF_LINK)])
    of_bodies = scales[: OF_LINK * len(drawing)].reshape(-1, OF_LINK, 1, 1)
    columns, told = _whitened(measured, weight)
    columns = columns * scales
    refinement = Refinement(columns, told, of_bodies * np.array([L @ units @ L.T for L in roots]), bounded)
    # Of drives whose terms show nowhere nothing is known, and no solver can know.
    lengths = np.linalg.norm(columns, axis=0)
    shows = (lengths > _SHOWS * lengths.max()) | (np.arange(len(scales)) < OF_LINK * len(drawing))
    x = np.where(shows, solution.x[: len(scales)], 0.0)
    x = refinement.of(x) if is_refined else x
    values = np.where(shows & (np.abs(x) > _NOTHING), x, 0.0) * scales
    links = values[: OF_LINK * len(drawing)].reshape(-1, OF_LINK)
    return values, min(float(eigvalsh(_unfolded(own), P0)[0]) for own, P0 in zip(links, drawing, strict=True))


def _whitened(measured: Measured, weight: float) -> tuple[Array, Array]:
    """Return columns (r, p) and a right side (r,) of independent equations that say what measurements do.

    Their errors have as standard deviation the root of 1 / weight.
    """
    b = len(measured.combinations)
    N = np.einsum("n,nij->ij", 1 / measured.sigma**2, measured.sums.products) / weight
    lengths = np.sqrt(np.maximum(N.diagonal()[:b], np.finfo(float).tiny))
    sizes, vectors = np.linalg.eigh(N[:b, :b] / np.outer(lengths, lengths))
    told = sizes > _ROUNDING * sizes[-1]
    root, vectors = np.sqrt(sizes[told]), vectors[:, told]
    return ((vectors * root).T * lengths) @ measured.combinations, (vectors / root).T @ (N[:b, b] / lengths)


def arm_of(model: DynamicModel, values: Array, title: str = "") -> Arm:
    """Return the arm with identified links, drives and springs.

    Args:
        model: of the arm.
        values: (p,) its parameters, which bodies and drives can have. An arm with a coupling has the rotors and the
            friction of its coupled motors, and not those of their joints beside; another one those of its joints alone.
        title: what the source of the numbers is called.
    """
    arm = model.arm
    named = dict(zip(model.names, np.asarray(values).tolist(), strict=True))
    links = []
    for i, link in enumerate(arm.links):
        new = link_of(np.asarray(values[OF_LINK * i : OF_LINK * (i + 1)]))
        links.append(attrs.evolve(new, name=link.name, solids=link.solids))
    motors, joints = [], []
    for i, (motor, joint) in enumerate(zip(arm.motors, arm.joints, strict=True), 1):
        own = {term: named[f"{term}{i}"] for term in model.terms}
        if arm.coupling is not None and i - 1 in model.coupled_motors:
            own = {term: named.get(f"coupled_{term}{i}", 0.0) for term in model.terms}
        coulomb = own.get("coulomb", 0.0)
        motors.append(
            Motor(
                inertia=own.get("rotor", 0.0),
                viscous=own.get("viscous", 0.0),
                coulomb_forward=own.get("forward", coulomb),
                coulomb_backward=own.get("backward", coulomb),
                offset=own.get("offset", 0.0),
                stribeck=own.get("stribeck", 0.0),
                stribeck_speed=float(model.stribeck_speed[i - 1]) if own.get("stribeck") else 0.0,
                cube_root=own.get("cube_root", 0.0),
                gear_ratio=motor.gear_ratio,
            )
        )
        spring = attrs.evolve(joint.spring, stiffness=own.get("stiffness", 0.0), rest=0.0)
        joints.append(attrs.evolve(joint, spring=spring))
    return attrs.evolve(arm, links=links, motors=motors, joints=joints, source=title or arm.source)


def link_of(theta: Array) -> Link:
    """Return a body by its ten parameters, in the order of ``dynamics.dynamic_parameters``."""
    m, x, y, z, xx, xy, xz, yy, yz, zz = theta.tolist()
    body = Body(mass=m, moment=[x, y, z], tensor=[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return attrs.evolve(as_link(body), complete=True)


# ---- the program -----------------------------------------------------------------------------------------------------


def body_sizes(arm: Arm, count: int) -> Array:
    """Return how large parameters (count,) of such links may be as the drawing has them: 1 for those of drives."""
    return _scales(count, [_pseudo_inertia(body) for body in _drawing(arm)])


def ball(mass: float) -> Array:
    """Return the pseudo-inertia (4, 4) of a ball about its middle, of which nothing is known but its mass [kg]."""
    spread = mass * _UNKNOWN_RADIUS**2 / 5
    return np.diag([spread, spread, spread, mass])


def _drawing(arm: Arm) -> list[Body]:
    """Return the bodies of the drawing; a ball where it has none that has an extent."""
    unknown = Link(mass=_UNKNOWN_MASS, inertia=0.4 * _UNKNOWN_MASS * _UNKNOWN_RADIUS**2 * np.eye(3))
    return [body_of(link if link.mass > 0 and not link.unknown else unknown) for link in arm.links]


def _pseudo_inertia(body: Body) -> Array:
    """Return the pseudo-inertia (4, 4) of a body, made thicker where it has no extent in some direction."""
    tensor, h = np.array(body.tensor, dtype=np.float64), np.array(body.moment, dtype=np.float64)
    # About the centre of mass nothing is thinner than a part of the whole.
    central = np.trace(tensor) / 2 * np.eye(3) - tensor - np.outer(h, h) / body.mass
    sizes, axes = np.linalg.eigh((central + central.T) / 2)
    least = _THIN * max(float(sizes.max()), body.mass * _UNKNOWN_RADIUS**2 / 5 * _THIN)
    central = (axes * np.maximum(sizes, least)) @ axes.T
    return np.block([[central + np.outer(h, h) / body.mass, h[:, None]], [h[None], np.array([[body.mass]])]])


def _unfolded(theta: Array) -> Array:
    """Return the pseudo-inertia (4, 4) of the ten parameters of a link."""
    m, x, y, z, xx, xy, xz, yy, yz, zz = theta
    half = (xx + yy + zz) / 2
    return np.array(
        [[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, m]], dtype=np.float64
    )


def _scales(count: int, drawing: Sequence[Array]) -> Array:
    """Return the sizes of the parameters (count,): of those of bodies by their drawings, 1 of others."""
    of_bodies: list[float] = []
    for P in drawing:
        m, spread = P[3, 3], float(np.trace(P[:3, :3]))
        of_bodies += [m, *[np.sqrt(m * spread)] * 3, *[spread] * 6]
    return np.array([*of_bodies, *np.ones(count - len(of_bodies))])


class _Constraints:
    """Rows of A and b, with b - A x in cones."""

    def __init__(self) -> None:
        self._rows: list[int] = []
        self._columns: list[int] = []
        self._entries: list[float] = []
        self.right: list[float] = []

    def add(self, terms: Mapping[int, float], right: float = 0.0) -> None:
        """Add a row: ``right`` plus a sum of variables, by their numbers and factors."""
        self._rows += [len(self.right)] * len(terms)
        self._columns += terms
        self._entries += [-factor for factor in terms.values()]
        self.right.append(right)

    def matrix(self, columns: int) -> Any:
        """Return A, sparse."""
        from scipy import sparse  # noqa: PLC0415 - takes a tenth of a second to load

        return sparse.csc_matrix(
            (self._entries, (self._rows, self._columns)), shape=(len(self.right), columns), dtype=np.float64
        )


def _objective(measured: Measured, scales: Array, drawing: Sequence[Array], *, weight: float) -> tuple[Array, Array]:
    """Return P and q of the objective x P x / 2 + q x, of the scaled parameters and of the variables of each body."""
    p, b = len(scales), len(measured.combinations)
    N = np.einsum("n,nij->ij", 1 / measured.sigma**2, measured.sums.products)
    C = measured.combinations * scales
    quadratic, linear = np.zeros((p + _OWN * len(drawing),) * 2), np.zeros(p + _OWN * len(drawing))
    quadratic[:p, :p] = 2 * C.T @ N[:b, :b] @ C
    linear[:p] = -2 * C.T @ N[:b, b]
    for i, P0 in enumerate(drawing):
        own = slice(OF_LINK * i, OF_LINK * (i + 1))
        linear[own] += (
            weight * scales[own] * [np.trace(np.linalg.solve(P0, _unfolded(unit))) for unit in np.eye(OF_LINK)]
        )
        linear[p + _OWN * (i + 1) - 4 : p + _OWN * (i + 1)] -= weight
    return quadratic, linear


def _constraints(scales: Array, drawing: Sequence[Array], bounded: Sequence[int]) -> _Constraints:
    """Return that drives take energy, and that the pseudo-inertias S have the logarithms of their determinants.

    A body has ten variables, a lower triangle Z, and four more, logarithms. With D the diagonal of Z,
    [[S, Z], [Z', D]] is positive semidefinite only if log det S is no less than the sum of the logarithms of D.
    """
    rows, p = _Constraints(), len(scales)
    for k in bounded:
        rows.add({k: 1.0})
    for i, P0 in enumerate(drawing):
        # Scaled so that the drawing is the identity: then the program is as well conditioned as bodies are alike.
        L = np.linalg.inv(np.linalg.cholesky(P0))
        own = range(OF_LINK * i, OF_LINK * (i + 1))
        parts = {k: scales[k] * L @ _unfolded(unit) @ L.T for k, unit in zip(own, np.eye(OF_LINK), strict=True)}
        Z = {pair: p + _OWN * i + k for k, pair in enumerate(_UPPER4)}
        for row, column in _UPPER8:
            # Off the diagonal an entry stands for two.
            factor = 1.0 if row == column else math.sqrt(2.0)
            terms: dict[int, float] = {}
            if column < 4:
                terms = {k: factor * float(part[row, column]) for k, part in parts.items()}
            elif row >= 4:
                terms = {Z[row - 4, row - 4]: 1.0} if row == column else {}
            elif row >= column - 4:
                terms = {Z[column - 4, row]: factor}
            rows.add(terms)
    for i in range(len(drawing)):
        for k in range(4):
            # (log, 1, z): exp(log) <= z.
            rows.add({p + _OWN * i + 10 + k: 1.0})
            rows.add({}, 1.0)
            rows.add({p + _OWN * i + _UPPER4.index((k, k)): 1.0})
    return rows
