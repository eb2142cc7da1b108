"""The worn surfaces of pins: how much has gone from each bearing and each journal, in bins of their angle.

Archard's law takes dh = k p ds from the surfaces at each place, shared between bearing and journal.

Source:
    Archard (1953); spec of the life, 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, in_range, integer, not_negative, number
from armwright.clearance.lane_layout import Integers
from armwright.clearance.linkage import Linkage, Material
from armwright.clearance.wear.foundation import bin_angles, foundation_modulus, hertz_half_angle, layer_modulus
from armwright.errors import InvalidValueError, one_of

Pressure: TypeAlias = Literal["hertz", "winkler"]
PRESSURES: tuple[Pressure, ...] = ("hertz", "winkler")
# Fewer bins do not tell a worn place from a round wall; more take long.
FEWEST_BINS, MOST_BINS = 36, 3600
# A contact narrower than two bins to each side is made as wide: no profile tells it.
_NARROWEST = 2
# A smaller clearance is none, and its walls have no direction in which they wear [m].
_LEAST_CLEARANCE = 1e-9
# Wear coefficients, to that of the growth by unit of it [mm³/(N m)]; widths and layers [mm].
_COEFFICIENTS, _LENGTHS = (1e-15, 1e9), (1e-3, 1e5)
# Depths beyond this part of the radius of a journal are no wear but a broken pin.
BROKEN = 0.5


@attrs.frozen(kw_only=True)
class WearLaw:
    """How fast surfaces wear, and how the force of a pin is spread on them.

    Attributes:
        coefficient: k of Archard's law, volume by force and sliding distance [m²/N].
        width: of the bearings [m].
        bearing_share: part of the wear that the bearing takes; the journal takes the rest.
        pressure: ``hertz``, on the half-angle of a line contact of solid bodies, or ``winkler``, on an elastic layer.
        layer: thickness of the elastic layer [m].
        layer_material: what it is made of; only for ``winkler``.
        bins: round each surface.
    """

    coefficient: float
    width: float = 0.02
    bearing_share: float = 0.5
    pressure: Pressure = "hertz"
    layer: float = 1e-3
    layer_material: Material = attrs.field(factory=Material)
    bins: int = 360

    def __attrs_post_init__(self) -> None:
        """Check names and ranges."""
        in_range(number(self.coefficient, "wear coefficient") * 1e9, _COEFFICIENTS, "wear coefficient", "mm³/(N m)")
        in_range(number(self.width, "width") * 1e3, _LENGTHS, "width", "mm")
        in_range(number(self.layer, "layer") * 1e3, _LENGTHS, "layer", "mm")
        one_of("pressure", self.pressure, PRESSURES)
        if not 0 <= not_negative(self.bearing_share, "bearing share") <= 1:
            raise InvalidValueError(f"bearing share: expected 0 to 1, got {self.bearing_share:g}")
        if integer(self.bins, "bins", least=FEWEST_BINS) > MOST_BINS:
            raise InvalidValueError(f"bins: expected {FEWEST_BINS} to {MOST_BINS}, got {self.bins}")

    def bin_area(self, radius: float) -> float:
        """Return the area of a bin of a journal of this radius [m²]."""
        return self.width * radius * 2 * np.pi / self.bins

    def moduli(self, linkage: Linkage, pin: int, forces: Array) -> Array:
        """Return the modulus of the foundation of a pin under forces (s,) [N/m³]."""
        if self.pressure == "winkler":
            return np.full(len(forces), layer_modulus(self.layer_material, self.layer))
        sizes = linkage.pins[pin].clearance, linkage.pins[pin].journal_radius, self.width
        angle = hertz_half_angle(forces, *sizes, linkage.material)
        return foundation_modulus(forces, np.maximum(angle, _NARROWEST * 2 * np.pi / self.bins), *sizes)


@attrs.frozen(kw_only=True, eq=False)
class WornSurfaces:
    """Depths that have gone from the surfaces of p pins, in m bins from the axes of their bodies.

    Attributes:
        bearing: (p, m) [m].
        journal: (p, m) [m].
    """

    bearing: Array
    journal: Array

    @classmethod
    def new(cls, pins: int, bins: int) -> WornSurfaces:
        """Return surfaces from which nothing has gone."""
        return cls(bearing=np.zeros((pins, bins)), journal=np.zeros((pins, bins)))

    def walls(self, pin: int, clearance: float, rotations: Array) -> Array:
        """Return (s, m) how far a journal in the middle is from its wall, over the bins of the bearing [m].

        Args:
            pin: its number.
            clearance: of the new pin [m].
            rotations: (s,) of the journal in its bearing [rad].
        """
        lower, upper, part = _bins_under(rotations, self.journal.shape[1])
        journal = self.journal[pin]
        return np.asarray(clearance + self.bearing[pin] + (1 - part) * journal[lower] + part * journal[upper])

    def plus(self, growth: WornSurfaces, strokes: Array | float) -> WornSurfaces:
        """Return these surfaces after strokes, of all pins or (p, 1) of each, that take this growth."""
        return WornSurfaces(
            bearing=self.bearing + strokes * growth.bearing, journal=self.journal + strokes * growth.journal
        )

    def deepest(self) -> Array:
        """Return (p,) the largest depth of each pin, on either surface [m]."""
        return np.asarray(np.maximum(self.bearing.max(axis=-1), self.journal.max(axis=-1)))


def surfaces_between(strokes: Array, states: Sequence[WornSurfaces], at: float) -> WornSurfaces:
    """Return the surfaces of a life after some strokes; between its states depths grow evenly.

    Args:
        strokes: (n,) increasing, at each state.
        states: n of them.
        at: strokes between the first and the last.
    """
    k = int(np.clip(np.searchsorted(strokes, at), 1, len(states))) - 1
    if k == len(states) - 1:
        return states[k]
    first, second = states[k : k + 2]
    growth = WornSurfaces(bearing=second.bearing - first.bearing, journal=second.journal - first.journal)
    return first.plus(growth, float((at - strokes[k]) / (strokes[k + 1] - strokes[k])))


def wearing_clearances(linkage: Linkage) -> Array:
    """Return (p,) the clearances of pins that can wear [m].

    Raises:
        InvalidValueError: there are no pins, or a clearance is too small.
    """
    if not linkage.pins:
        raise InvalidValueError(f"{linkage.name} has no pins with clearance that could wear")
    c = linkage.clearance_array(None)
    if not np.all(c >= _LEAST_CLEARANCE):
        raise InvalidValueError(
            f"clearances: wear needs them at least {_LEAST_CLEARANCE * 1e3:g} mm, got {c.min() * 1e3:g} mm"
        )
    return c


def stroke_growth(law: WearLaw, radii: Array, loads: Array, shares: Array, rotations: Array) -> WornSurfaces:
    """Return what a stroke takes from the surfaces of p pins; the volume is k times the load, but for rounding.

    Args:
        law: of the wear.
        radii: (p,) of the journals [m].
        loads: (s, p) force times sliding distance at each moment [N m].
        shares: (s, p, m) part of each bin of the bearing in the force.
        rotations: (s, p) of the journals in their bearings [rad].
    """
    m = law.bins
    bearing, journal = np.zeros((len(radii), m)), np.zeros((len(radii), m))
    for i, radius in enumerate(radii):
        depth = law.coefficient * loads[:, i, None] * shares[:, i] / law.bin_area(radius)
        bearing[i] = law.bearing_share * depth.sum(axis=0)
        lower, upper, part = _bins_under(rotations[:, i], m)
        weights = (1 - law.bearing_share) * depth
        journal[i] = np.bincount(lower.ravel(), (weights * (1 - part)).ravel(), m)
        journal[i] += np.bincount(upper.ravel(), (weights * part).ravel(), m)
    return WornSurfaces(bearing=bearing, journal=journal)


def mean_growth(coefficient: float, work: float, radius: float, arc: float, width: float) -> float:
    """Return the mean growth of a clearance per stroke [m], where wear is spread evenly on an arc [rad].

    Args:
        coefficient: k [m²/N].
        work: integral of the force over the sliding distance of a stroke [N m].
        radius: of the journal [m].
        arc: [rad].
        width: of the bearing [m].
    """
    return coefficient * work / (radius * arc * width)


def _bins_under(rotations: Array, count: int) -> tuple[Integers, Integers, Array]:
    """Return (s, m) numbers of the two bins of journals under each bin of the bearing, and the part of the second."""
    place = (bin_angles(count) - rotations[:, None]) * (count / (2 * np.pi))
    first = np.floor(place)
    lower = first.astype(np.int64) % count
    return lower, (lower + 1) % count, np.asarray(place - first)
