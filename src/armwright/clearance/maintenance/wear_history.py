"""How the journals of a linkage lie at their walls while these wear, tabulated over one life of worn walls.

What a pin loses depends on strokes times wear coefficient, so that one life serves for every coefficient, as for the
lives of ``reliability``. The growth of a clearance is that of the distance from the middle of the bearing to the
journal, the mean over the path.

Source:
    Spec of the life, 1 and 5.
"""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.ideal import inverse_dynamics, tip_position, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.static_equilibrium import force_magnitudes
from armwright.clearance.wear.between_states import between_states
from armwright.clearance.wear.life import worn_steps
from armwright.clearance.wear.worn_stroke import Stroke, gaps_in_cones
from armwright.clearance.wear.worn_surfaces import BROKEN, WearLaw, WornSurfaces

# A step of the life takes at most this part of a new clearance, or this part of the depth that is worn already.
_STEP, _GROWING = 0.04, 0.2
# Pins that are worn by this part of what breaks them are beyond any plan.
_NEARLY_BROKEN = 0.5
# Every pin grows a little with strokes, so that its growth tells them [m].
_LEAST_GROWTH = 1e-12
# Beyond its last state a life goes on as in its last step, so many times as long.
_BEYOND = 1e6


@attrs.frozen(kw_only=True, eq=False)
class Places:
    """Configurations of a linkage with n coordinates and p pins, at m places.

    Attributes:
        q: (m, n) closed coordinates.
        qd: (m, n) their speeds.
        qdd: (m, n) their accelerations.
        tip: (m, 2) position of the tip without clearance [m].
        gains: (m, 2, p, 2) shift of the tip by that of a journal in its bearing.
        along: (m, 2, p) shift of the tip by clearance, B.
    """

    q: Array
    qd: Array
    qdd: Array
    tip: Array
    gains: Array
    along: Array

    @classmethod
    def of(cls, linkage: Linkage, q: Array, qd: Array | None = None, qdd: Array | None = None) -> Places:
        """Return places with closed coordinates (m, n) and their motion, or at rest.

        Raises:
            InvalidValueError: a configuration is singular, or a pin carries no force there.
        """
        still = np.zeros_like(q)
        speeds, accelerations = still if qd is None else qd, still if qdd is None else qdd
        reactions = inverse_dynamics(linkage, q, speeds, accelerations)[1]
        directions = reactions / force_magnitudes(linkage, reactions)[..., None]
        gains = tip_sensitivity(linkage, q)
        return cls(
            q=q,
            qd=speeds,
            qdd=accelerations,
            tip=tip_position(linkage, q),
            gains=gains,
            along=np.einsum("mipj,mpj->mip", gains, directions),
        )


@attrs.frozen(kw_only=True, eq=False)
class GrowthTable:
    """How p clearances grow with strokes times wear coefficient, from new, as straight lines between s states.

    Attributes:
        exposures: (s, p) strokes times wear coefficient, increasing from 0 [m²/N].
        growths: (s, p) of the clearances, increasing from 0 [m].
    """

    exposures: Array
    growths: Array

    @classmethod
    def of(cls, exposures: Array, growths: Array) -> GrowthTable:
        """Return the table of states (s, p) from 0 on; beyond the last one the last line goes on."""
        rising = np.maximum.accumulate(growths, axis=0) + _LEAST_GROWTH * exposures / exposures[-1]
        far = _BEYOND * exposures[-1]
        slope = (rising[-1] - rising[-2]) / (exposures[-1] - exposures[-2])
        return cls(
            exposures=np.concatenate([exposures, [far]]),
            growths=np.concatenate([rising, [rising[-1] + slope * (far - exposures[-1])]]),
        )

    def grown(self, growths: Array, exposure: Array) -> Array:
        """Return growths (..., p) that have become of growths (..., p) after an exposure (..., p) [m]."""
        before, x = np.broadcast_arrays(growths, exposure)
        after = np.empty(before.shape)
        for i in range(before.shape[-1]):
            done = np.interp(before[..., i], self.growths[:, i], self.exposures[:, i])
            after[..., i] = np.interp(done + x[..., i], self.exposures[:, i], self.growths[:, i])
        # Rounding does not let a clearance shrink.
        return np.asarray(np.maximum(after, before))


class WornShifts(NamedTuple):
    """How the tip moves at m places while p pins wear, as straight lines between s states.

    Attributes:
        growths: (s, p) of the clearances [m].
        along: (s, m, 2, p) mean shift of the tip by each pin [m].
        by_clearance: (s, m, 2, p) shift of the tip by the clearance of the new pin.
        across: (s, m, 2, p) shift of the tip by each pin and the part of its friction cone in which its journal is [m].
    """

    growths: Array
    along: Array
    by_clearance: Array
    across: Array

    def at(self, growths: Array) -> tuple[Array, Array, Array]:
        """Return (..., m, 2, p) shifts along, by clearance and across, after growths (..., p)."""
        along, by_clearance, across = between_states(self.growths, growths, self.along, self.by_clearance, self.across)
        return along, by_clearance, across


class WornGaps(NamedTuple):
    """Where the journals of p pins are in their bearings at m places while they wear, between s states.

    Attributes:
        clearances: (p,) of the new pins [m].
        growths: (s, p) of the clearances [m].
        gaps: (s, 3, m, p, 2) from bearings to journals at the one end of their friction cones, in the middle, and at
            the other [m].
    """

    clearances: Array
    growths: Array
    gaps: Array

    def at(self, clearances: Array, growths: Array, tilts: Array) -> Array:
        """Return gaps (v, ..., m, p, 2) [m].

        Args:
            clearances: (..., p) of the new pins, which differ a little from those of the table [m].
            growths: (..., p) of the clearances [m].
            tilts: (v, ..., m, p) where in its cone friction holds each journal, from -1 to 1.
        """
        (now,) = between_states(self.growths, growths, np.moveaxis(self.gaps, 3, -1))
        low, middle, high = np.moveaxis(np.swapaxes(now, -1, -2), -4, 0)
        tilt = tilts[..., None]
        gaps = middle + np.maximum(tilt, 0.0) * (high - middle) - np.minimum(tilt, 0.0) * (low - middle)
        more = (clearances - self.clearances)[..., None, :, None]
        return np.asarray(gaps + more * gaps / np.linalg.norm(gaps, axis=-1, keepdims=True))

    def shifts(self, places: Places) -> WornShifts:
        """Return the shifts of the tip."""
        low, middle, high = np.moveaxis(self.gaps, 1, 0)
        # Tilts have even chances in the cone: half of them are on each side, a half of its end on average.
        mean = (low + 2 * middle + high) / 4
        outward = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
        return WornShifts(
            self.growths, *(np.einsum("mipj,smpj->smip", places.gains, x) for x in (mean, outward, (high - low) / 2))
        )


@attrs.frozen(kw_only=True, eq=False)
class WearHistory:
    """A life of worn walls of a linkage with p pins, in s states from new on.

    Attributes:
        linkage: new.
        law: of the wear, with a coefficient of one.
        surfaces: (s) worn.
        table: growth of the clearances.
    """

    linkage: Linkage
    law: WearLaw
    surfaces: tuple[WornSurfaces, ...]
    table: GrowthTable

    @classmethod
    def of(
        cls, stroke: Stroke, law: WearLaw, path: Places, *, exposure: float, factors: Array | None = None
    ) -> WearHistory:
        """Wear a linkage.

        Args:
            stroke: of the linkage.
            law: of the wear, with a coefficient of one.
            path: moments and goals of the stroke, over which the growth of a clearance is the mean.
            exposure: product of strokes and wear coefficient at which the life ends, if pins do not break before.
            factors: (p,) of the wear coefficient of each pin; 1 when left out.

        Raises:
            InvalidValueError: the clearances are too small to wear, or nothing slides in a pin.
        """
        linkage = stroke.linkage
        radii = np.array([pin.journal_radius for pin in linkage.pins])
        rates = np.ones(len(radii)) if factors is None else factors
        states, strokes = [WornSurfaces.new(len(radii), law.bins)], [0.0]
        for step in worn_steps(
            stroke, law, max_step=_STEP, growing=_GROWING, factors=rates, until=exposure, rough=True
        ):
            states.append(step.surfaces)
            strokes.append(step.strokes)
            if np.any(step.surfaces.deepest() > _NEARLY_BROKEN * BROKEN * radii):
                break
        lengths = np.linalg.norm(
            gaps_in_cones(linkage, law, states, (path.q, path.qd, path.qdd), np.zeros(1)), axis=-1
        ).mean(axis=(1, 2))
        table = GrowthTable.of(np.array(strokes)[:, None] * rates, lengths - lengths[0])
        return cls(linkage=linkage, law=law, surfaces=tuple(states), table=table)

    def gaps(self, places: Places) -> WornGaps:
        """Return where journals are at places, in all their friction cones; beyond the life they go straight on."""
        cone = np.arctan(self.linkage.material.friction)
        motion = places.q, places.qd, places.qdd
        gaps = gaps_in_cones(self.linkage, self.law, self.surfaces, motion, np.array([-cone, 0.0, cone]))
        growths = self.table.growths
        lengths = np.linalg.norm(gaps[-1], axis=-1, keepdims=True)
        far = gaps[-1] * (1 + (growths[-1] - growths[-2])[:, None] / lengths)
        return WornGaps(self.linkage.clearance_array(None), growths, np.concatenate([gaps, far[None]]))

    @property
    def exposure(self) -> float:
        """Product of strokes and the largest wear coefficient at its end [m²/N]."""
        return float(self.table.exposures[-2].max())
