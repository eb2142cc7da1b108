"""Elastic rods: bodies of a linkage that bend and stretch between two of their points.

A rod is a uniform beam of Euler and Bernoulli, with a point mass in each end; together they have the mass, the centre
and the inertia of the body. What is seen from the frame of the body is a displacement across the line between the
ends, a sum of shapes, and one along it: a uniform stretch, less the length that bending takes. That length is what
stiffens a rod under tension and lets it buckle under pressure.

    x(s) = s + stretch s / L - ½ ∫ w'² ds,    w(s) = Σ bend_i φ_i(s)

The frame of a rod that only pins hold goes through both ends, and its shapes are the sines of a rod on two pins. The
frame of a driven body stays with the section at its drive, and its shapes combine the lowest modes of a beam that is
clamped there and the cubic to which a force at its tip bends it.

Source:
    Kane, T. R., Ryan, R. R., Banerjee, A. K., "Dynamics of a cantilever beam attached to a moving base", Journal of
    Guidance, Control, and Dynamics 10 (1987), on the length that bending takes; Shabana, A. A., "Dynamics of Multibody
    Systems", on floating frames.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import attrs
import numpy as np
from numpy.polynomial import Legendre, Polynomial

from armwright.arrays import Array, number, positive
from armwright.errors import InvalidValueError, one_of

MAX_MODES = 6
# A body whose inertia is below that of a uniform rod has end masses below 0, as far as drawings are rounded.
_ROUNDED = 0.01
# So far from the line between the ends a point or centre may lie, by the length.
_STRAIGHT = 1e-6
# A mass below this part of the body's is none but for rounding.
_NO_MASS = 1e-12
# Rods and sections that are kept, for linkages ask for them again and again.
_KEPT = 1024
# Stations at which the largest deflection is looked for, nodes of integrals, and polynomials that make modes.
_STATIONS, _FINE, _POLYNOMIALS = 41, 40, 12

_Functions: TypeAlias = Callable[[Array], Array]


class _Shapes(NamedTuple):
    """Shapes of bending, with their slopes and curvatures: each (m, k) at k places."""

    bends: _Functions
    slopes: _Functions
    curvatures: _Functions


@attrs.frozen(kw_only=True)
class Elasticity:
    """What makes a body elastic.

    Attributes:
        ends: the names of the two points between which it is a beam.
        area: of its section [m²].
        second_moment: of area of its section, for bending in the plane [m⁴].
        young: modulus of elasticity [Pa].
        modes: number of shapes of bending, 1 to 6.
        damping: of each shape, as a part of critical damping.
    """

    ends: tuple[str, str]
    area: float
    second_moment: float
    young: float = 207e9
    modes: int = 3
    damping: float = 0.01

    def __attrs_post_init__(self) -> None:
        """Check the ranges."""
        for what in ("area", "second_moment", "young"):
            positive(getattr(self, what), what)
        if self.modes not in range(1, MAX_MODES + 1):
            raise InvalidValueError(f"modes: expected 1 to {MAX_MODES}, got {self.modes}")
        if not 0 <= number(self.damping, "damping") < 1:
            raise InvalidValueError(f"damping: expected a part of critical damping from 0 to 1, got {self.damping:g}")
        if len(self.ends) != 2 or self.ends[0] == self.ends[1]:
            raise InvalidValueError(f"ends: expected the names of two points, got {', '.join(self.ends) or 'none'}")

    @property
    def kinds(self) -> tuple[str, ...]:
        """The names of the coordinates of the rod: displacements of its shapes, and its stretch [m]."""
        return (*(f"bend{i + 1}" for i in range(self.modes)), "stretch")


class Section(NamedTuple):
    """How a section of a rod moves with the coordinates of the rod.

    Attributes:
        along: of the frame, from the first end [m].
        bends: displacement across the frame by each shape.
        slopes: rotation by each shape [1/m].
        shortening: half of these, times two shapes' displacements, are what bending takes of the length [1/m].
        stretch: displacement along the frame by the stretch of the rod.
    """

    along: float
    bends: tuple[float, ...]
    slopes: tuple[float, ...]
    shortening: tuple[tuple[float, ...], ...]
    stretch: float


class RodMass(NamedTuple):
    """A part of the mass of a rod, and the section in which it is."""

    mass: float
    section: Section


@attrs.frozen(kw_only=True, eq=False)
class Rod:
    """A rod of a linkage.

    Attributes:
        length: between its ends [m].
        direction: from its first end to the other, from the axis of the body [rad].
        clamped: whether its frame stays with the section at its first end, instead of going through both ends.
        start: its first end, in the axes of the body [m].
        masses: those of its ends, and of the beam at the nodes of Gauss.
        stiffness: of each coordinate [N/m].
        damping: of each coordinate [N s/m].
        frequencies: (m) of its shapes, held as its frame is [Hz].
    """

    length: float
    direction: float
    clamped: bool
    start: tuple[float, float]
    masses: tuple[RodMass, ...]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    frequencies: tuple[float, ...]
    _shapes: _Shapes

    def section_at(self, point: Array) -> Section:
        """Return the section at a point (2,) of the body, in its axes [m]."""
        return self.section(math.dist(self.start, point))

    def section(self, along: float) -> Section:
        """Return the section at a distance from the first end [m]."""
        return _section(self._shapes, self.length, along)

    def fastest_vibration(self, contacts: Iterable[tuple[float, Section]]) -> float:
        """Return the highest angular frequency of the rod in its model [rad/s], when nothing but contacts holds it.

        Args:
            contacts: stiffness of each [N/m], and its section.
        """
        M = _weighted(self.masses)
        K = _weighted(contacts) + np.diag([0.0, 0.0, 0.0, *self.stiffness])
        inverse = np.linalg.inv(np.linalg.cholesky(M))
        return math.sqrt(np.linalg.eigvalsh(inverse @ K @ inverse.T)[-1])

    def largest_deflection(self, bends: Array) -> Array:
        """Return the largest displacement (...) across the frame along the rod [m], for bends (..., m)."""
        stations = np.linspace(0.0, self.length, _STATIONS)
        return np.asarray(np.abs(bends @ self._shapes.bends(stations)).max(axis=-1), dtype=np.float64)


def refuse_rods(what: str, rods: Iterable[str]) -> None:
    """Refuse elastic bodies where all have to be rigid.

    Args:
        what: refuses them.
        rods: names of the elastic bodies.

    Raises:
        InvalidValueError: there are any.
    """
    if names := ", ".join(rods):
        raise InvalidValueError(f"{what}: expected rigid bodies, got elastic {names}; leave out their 'elastic'")


class RodBody(NamedTuple):
    """The numbers of a body whose rod is asked for.

    Attributes:
        mass: [kg].
        inertia: about its centre [kg m²].
        along: its centre, along the axis of the body [m].
        across: its centre, across that axis [m].
    """

    mass: float
    inertia: float
    along: float
    across: float


def rod_of_body(
    elastic: Elasticity, body: RodBody, points: Mapping[str, Array], held: str | None, *, clamped: bool
) -> Rod:
    """Return the rod that an elastic body is.

    Args:
        elastic: what makes it elastic.
        body: its numbers.
        points: (2,) its points by name, in its axes [m].
        held: the name of the point in which an ideal joint carries it; None for a free body.
        clamped: see ``Rod``.

    Raises:
        UnknownNameError: there is no point of the name of an end.
        InvalidValueError: a point or the centre is not on the line between the ends, the joint is at neither, or the
            mass cannot be that of a uniform rod with masses in its ends.
    """
    for name in elastic.ends:
        one_of("point", name, points)
    first, other = elastic.ends if held != elastic.ends[1] else elastic.ends[::-1]
    if held not in (None, first):
        raise InvalidValueError(f"expected its joint at one of its ends {first} and {other}, got {held}")
    span = points[other] - points[first]
    length = float(np.linalg.norm(span))
    positive(length, f"distance from {first} to {other}")
    places = {**points, "its centre": np.array([body.along, body.across])}
    along = {name: float((place - points[first]) @ span) / length for name, place in places.items()}
    for name, place in places.items():
        aside = float(np.linalg.norm(place - points[first] - span * (along[name] / length)))
        if max(aside, -along[name], along[name] - length) > _STRAIGHT * length:
            raise InvalidValueError(
                f"expected all of its points and its centre on the line from {first} to {other}, got {name} off it"
            )
    direction, start = math.atan2(span[1], span[0]), (float(points[first][0]), float(points[first][1]))
    return _make_rod(elastic, _Beam(body.mass, body.inertia, along["its centre"], length, direction, start), clamped)


class _Beam(NamedTuple):
    """What of a body is a rod's: mass, inertia, distance of the centre from the first end, length, direction, start."""

    mass: float
    inertia: float
    centre: float
    length: float
    direction: float
    start: tuple[float, float]


@lru_cache(maxsize=_KEPT)
def _make_rod(elastic: Elasticity, body: _Beam, clamped: bool) -> Rod:  # noqa: FBT001 - a key of the cache
    length, modes = body.length, elastic.modes
    beam, *ends = _split_mass(body)
    nodes, weights = _gauss(0.0, length, 2 * modes + 4)
    places = np.array([0.0, length, *nodes])
    parts = np.array([*ends, *(weights * beam / length)])
    shapes = (_clamped_shapes if clamped else _sines)(length, modes, ends[1] / beam)
    rigidity = elastic.young * elastic.second_moment
    k_bend = rigidity * np.diag(_gram(shapes.curvatures, length))
    m_bend = (shapes.bends(places) ** 2) @ parts
    k_stretch = elastic.young * elastic.area / length
    m_stretch = float(parts @ (places / length) ** 2)
    stiffness, modal = np.array([*k_bend, k_stretch]), np.array([*m_bend, m_stretch])
    return Rod(
        length=length,
        direction=body.direction,
        clamped=clamped,
        start=body.start,
        masses=tuple(
            RodMass(float(part), _section(shapes, length, float(s)))
            for part, s in zip(parts, places, strict=True)
            if abs(part) > _NO_MASS * body.mass
        ),
        stiffness=tuple(stiffness.tolist()),
        damping=tuple((2 * elastic.damping * np.sqrt(stiffness * modal)).tolist()),
        frequencies=tuple((np.sqrt(k_bend / m_bend) / (2 * math.pi)).tolist()),
        shapes=shapes,
    )


def _split_mass(body: _Beam) -> tuple[float, float, float]:
    """Return the masses of the beam, of its first end and of the other, with mass, centre and inertia of the body."""
    mass, inertia, centre, length = body[:4]
    beam = 6 * (mass * centre * (length - centre) - inertia) / length**2
    other = mass * centre / length - beam / 2
    first = mass - beam - other
    if beam <= 0 or min(first, other) < -_ROUNDED * mass:
        uniform = mass * length**2 / 12
        raise InvalidValueError(
            f"its mass cannot be that of a uniform rod with masses in its ends: expected a centre near the middle of "
            f"the ends and an inertia from {uniform:.4g} kg m², that of a uniform rod, to below three times as much, "
            f"got {inertia:.4g} kg m² and a centre at {centre * 1e3:.4g} of {length * 1e3:.4g} mm"
        )
    return beam, first, other


@lru_cache(maxsize=_KEPT)
def _section(shapes: _Shapes, length: float, along: float) -> Section:
    at = np.array([along])
    return Section(
        along,
        tuple(shapes.bends(at)[:, 0].tolist()),
        tuple(shapes.slopes(at)[:, 0].tolist()),
        tuple(tuple(row) for row in _gram(shapes.slopes, along).tolist()),
        along / length,
    )


def _weighted(parts: Iterable[tuple[float, Section]]) -> Array:
    """Return the sum of weighted squares of how sections move along and across, when a straight free rod moves.

    The rod moves along, across, and about its first end; then come its own coordinates.
    """
    total = np.asarray(0.0)
    for weight, section in parts:
        along = np.array([1.0, 0.0, 0.0, *(0.0 for _ in section.bends), section.stretch])
        across = np.array([0.0, 1.0, section.along, *section.bends, 0.0])
        total = total + weight * (np.outer(along, along) + np.outer(across, across))
    return total


# ---- shapes --------------------------------------------------------------------------------------------------------


def _sines(length: float, modes: int, _tip_mass: float) -> _Shapes:
    """Return the sines of a rod on two pins."""
    waves = np.arange(1, modes + 1)[:, None] * (math.pi / length)

    def bends(s: Array) -> Array:
        # The sine of a multiple of π is 0 but for rounding; the other end lies on the frame.
        return np.where(s == length, 0.0, np.sin(waves * s))

    def slopes(s: Array) -> Array:
        return np.asarray(waves * np.cos(waves * s), dtype=np.float64)

    return _Shapes(bends, slopes, lambda s: -(waves**2) * bends(s))


def _clamped_shapes(length: float, modes: int, tip_mass: float) -> _Shapes:
    """Return shapes of a beam that is clamped at its first end; their displacement at the tip is 1.

    The cubic of a force at the tip and the lowest modes are made modes of their own.

    Args:
        length: [m].
        modes: number of shapes.
        tip_mass: in the other end, by the mass of the beam.
    """
    clamp, place = Polynomial([0.0, 0.0, 1.0]), Polynomial([0.0, 1.0 / length])
    basis = [(clamp * Legendre.basis(i, domain=[0, 1]).convert(kind=Polynomial))(place) for i in range(_POLYNOMIALS)]

    def at(order: int) -> _Functions:
        functions = [shape.deriv(order) if order else shape for shape in basis]
        return lambda s: np.array([function(s) for function in functions])

    shapes = _Shapes(at(0), at(1), at(2))
    end = shapes.bends(np.array([length]))[:, 0]
    k = _gram(shapes.curvatures, length)
    m = _gram(shapes.bends, length) / length + tip_mass * np.outer(end, end)
    cubic = np.linalg.solve(k, end)
    chosen = np.column_stack([cubic, _modes(m, k)[:, : modes - 1]])
    turn = chosen @ _modes(chosen.T @ m @ chosen, chosen.T @ k @ chosen)
    turn = turn / (end @ turn)
    return _Shapes(*(_combined(turn, functions) for functions in shapes))


def _modes(m: Array, k: Array) -> Array:
    """Return the solutions of k x = ω² m x in columns, the slowest first."""
    inverse = np.linalg.inv(np.linalg.cholesky(m))
    return np.asarray(inverse.T @ np.linalg.eigh(inverse @ k @ inverse.T)[1], dtype=np.float64)


def _combined(turn: Array, shapes: _Functions) -> _Functions:
    return lambda s: np.asarray(turn.T @ shapes(s), dtype=np.float64)


def _gram(functions: _Functions, end: float) -> Array:
    """Return (m, m) the integrals of products of functions from 0 to a place."""
    s, weights = _gauss(0.0, end, _FINE)
    values = functions(s)
    return np.asarray((values * weights) @ values.T, dtype=np.float64)


def _gauss(start: float, end: float, count: int) -> tuple[Array, Array]:
    """Return nodes and weights of Gauss' rule between two places."""
    x, weights = np.polynomial.legendre.leggauss(count)
    return (start + end) / 2 + (end - start) / 2 * x, (end - start) / 2 * weights
