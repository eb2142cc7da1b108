"""A linkage whose pins wear, as its maintenance sees it: what clearances do to the tip, and how they grow.

Along the path and at the poses of a check every journal lies at the wall to which the motion presses it, so that the
tip is displaced by B c; friction holds a journal anywhere in its cone, which displaces the tip across that by T c φ.
The growth of each clearance by stroke and unit of the wear coefficient is tabulated over the clearance.

Source:
    Spec of the life, 1 and 5; spec of the clearance, 4.3.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, integer, positive
from armwright.clearance.correction import predict_contact_loss
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.ideal import close_pins, inverse_dynamics, tip_position, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.plane_vectors import perpendicular
from armwright.clearance.static_equilibrium import force_magnitudes
from armwright.clearance.wear.worn_stroke import Stroke, lean_new, leaning_growth
from armwright.clearance.wear.worn_surfaces import BROKEN, WearLaw, wearing_clearances
from armwright.errors import InvalidValueError

# Moments of a stroke: at which its wear is integrated, and at which the error of its tip counts beside its goals.
_MOMENTS, _WATCHED = 81, 9
# Clearances at which the growth is tabulated, and bins whose depth is less than this part of the deepest are not worn.
_LEVELS, _WORN = 6, 1e-3
# Candidates for the poses of a check along each axis, in the box round the path, which is at least so wide [m].
_CANDIDATES, _LEAST_BOX = 6, 0.2
# Of a drive, for the derivative of the tip [rad, m].
_STEP = 1e-5
# A single drive that moves the tip by less than this part of the most on the path is near a dead centre: a correction
# would move it far, along a curve.
_ABLE = 0.25
# Poses that move the tip by more for a clearance are near a singular configuration.
_REGULAR = 3.0
_MAX_POSES = 6


@attrs.frozen(kw_only=True, eq=False)
class Places:
    """Configurations of a linkage with n coordinates and p pins, at m places.

    Attributes:
        q: (m, n) closed coordinates.
        qd: (m, n) their speeds.
        qdd: (m, n) their accelerations.
        tip: (m, 2) position of the tip without clearance [m].
        along: (m, 2, p) shift of the tip by clearance, B.
        across: (m, 2, p) shift of the tip by clearance and angle of a journal in its friction cone, T [1/rad].
    """

    q: Array
    qd: Array
    qdd: Array
    tip: Array
    along: Array
    across: Array

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
            along=np.einsum("mipj,mpj->mip", gains, directions),
            across=np.einsum("mipj,mpj->mip", gains, perpendicular(directions)),
        )

    def friction_covariance(self, clearances: Array, cone: float) -> Array:
        """Return (m, 2, 2) the covariance of a single visit where journals lie anywhere within the cone [m²]."""
        shifts = self.across * clearances * cone
        return np.asarray(np.einsum("mip,mjp->mij", shifts, shifts) / 3)


@attrs.frozen(kw_only=True, eq=False)
class GrowthTable:
    """How p clearances grow with sliding: dc/dN = k g(c), from a few clearances each.

    Attributes:
        clearances: (g, p) increasing [m].
        rates: (g, p) growth by stroke and wear coefficient there [N/m].
        exposures: (g, p) product of strokes and wear coefficient that leads there from the first [m²/N].
    """

    clearances: Array
    rates: Array
    exposures: Array

    @classmethod
    def of(cls, clearances: Array, rates: Array) -> GrowthTable:
        """Return the table of growth rates (g, p), all above 0; beyond its ends they stay as they are there."""
        far = 100 * clearances.max()
        c = np.concatenate([clearances[:1] - far, clearances, clearances[-1:] + far])
        g = np.concatenate([rates[:1], rates, rates[-1:]])
        steps = np.diff(c, axis=0) * (1 / g[:-1] + 1 / g[1:]) / 2
        return cls(clearances=c, rates=g, exposures=np.concatenate([np.zeros((1, c.shape[1])), steps.cumsum(axis=0)]))

    def grown(self, clearances: Array, exposure: Array) -> Array:
        """Return clearances (..., p) after strokes times wear coefficients (..., p) [m]."""
        c, x = np.broadcast_arrays(clearances, exposure)
        grown = np.empty(c.shape)
        for i in range(c.shape[-1]):
            now = np.interp(c[..., i], self.clearances[:, i], self.exposures[:, i])
            grown[..., i] = np.interp(now + x[..., i], self.exposures[:, i], self.clearances[:, i])
        # Rounding does not let a clearance shrink.
        return np.asarray(np.maximum(grown, c))


@attrs.frozen(kw_only=True, eq=False)
class MaintainedLinkage:
    """A linkage on its path, with the poses at which it is measured.

    Attributes:
        linkage: with p pins, new.
        law: of the wear, with a coefficient of one.
        stroke: along the path.
        watched: moments and goals at which the error of the tip counts.
        drives_by_shift: (m, d, 2) how the drives have to move for a shift of the tip there [1/m, or 1].
        aim: (m, 2, 2) part of such a shift that they can make.
        poses: at which a check holds the arm at rest.
        table: growth of its clearances.
        depth_by_work: (p,) mean depth of what is worn, by wear coefficient and force times sliding distance [1/m²].
        cone: half-angle of the friction cone [rad].
        left_out: moments at which the error does not count, since journals may leave their walls.
    """

    linkage: Linkage
    law: WearLaw
    stroke: Stroke
    watched: Places
    drives_by_shift: Array
    aim: Array
    poses: Places
    table: GrowthTable
    depth_by_work: Array
    cone: float
    left_out: int

    @property
    def by_tip(self) -> bool:
        """Whether the drives can move the tip anywhere in the plane."""
        return len(self.linkage.drives) == 2

    def shift_by_clearance(self) -> Array:
        """Return (m, 2, p) the shift of the tip by clearance that the drives can take away."""
        return np.asarray(self.aim @ self.watched.along)


def maintained_linkage(
    linkage: Linkage, path: Path, law: WearLaw | None = None, *, exposure: float, poses: int = 3
) -> MaintainedLinkage:
    """Prepare a linkage for the plan of its checks.

    Args:
        linkage: with the clearances of new pins.
        path: of a stroke.
        law: of the wear; its coefficient does not count.
        exposure: product of strokes and wear coefficient until which growth is tabulated [m²/N].
        poses: at which a check holds the arm.

    Raises:
        InvalidValueError: the path cannot be followed, a pin does not wear, a body is elastic, or no poses are left.
    """
    if integer(poses, "poses", least=1) > _MAX_POSES:
        raise InvalidValueError(f"poses: expected 1 to {_MAX_POSES}, got {poses}")
    refuse_rods("plan of checks", linkage.rods)
    c = wearing_clearances(linkage)
    unit = attrs.evolve(law or WearLaw(coefficient=1.0), coefficient=1.0)
    stroke = Stroke.of(linkage, path, _MOMENTS)
    watched, left_out = _watched(linkage, path, stroke)
    table, depth_by_work = _tabulate(stroke, unit, c, positive(exposure, "exposure", "m²/N"))
    by_drives = _tip_by_drives(linkage, watched.q)
    inverse: Array = np.linalg.pinv(by_drives, rcond=1e-6).astype(np.float64)
    if len(linkage.drives) == 1:
        gains = np.linalg.norm(by_drives, axis=-2, keepdims=True)
        inverse[np.broadcast_to(gains < _ABLE * gains.max(), inverse.shape)] = 0.0
    return MaintainedLinkage(
        linkage=linkage,
        law=unit,
        stroke=stroke,
        watched=watched,
        drives_by_shift=inverse,
        aim=by_drives @ inverse,
        poses=_telling_poses(linkage, stroke, poses),
        table=table,
        depth_by_work=depth_by_work,
        cone=float(np.arctan(linkage.material.friction)),
        left_out=left_out,
    )


# ---- inside --------------------------------------------------------------------------------------------------------


def _tabulate(stroke: Stroke, law: WearLaw, clearances: Array, exposure: float) -> tuple[GrowthTable, Array]:
    """Return growth along the life that equal wear coefficients lead to, and (p,) the depth by work half way."""
    first = _growth(stroke, law, clearances)
    radii = np.array([pin.journal_radius for pin in stroke.linkage.pins])
    far = exposure * first.rates
    # Broken pins are beyond any plan.
    far *= min(1.0, float((BROKEN * radii / far).min()))
    levels = clearances + np.linspace(0.0, 1.0, _LEVELS)[:, None] * far
    growths = [first, *(_growth(stroke, law, level) for level in levels[1:])]
    middle = growths[_LEVELS // 2]
    return GrowthTable.of(levels, np.array([growth.rates for growth in growths])), middle.rates / middle.work


class _Growth(NamedTuple):
    rates: Array
    work: Array


def _growth(stroke: Stroke, law: WearLaw, clearances: Array) -> _Growth:
    """Return (p,) the mean depth of what a stroke wears on both surfaces, for clearances (p,), and (p,) its F ds."""
    linkage = stroke.linkage.with_clearances(dict(zip(stroke.linkage.clearances, clearances, strict=True)))
    leaning = lean_new(attrs.evolve(stroke, linkage=linkage), law)
    growth = leaning_growth(law, linkage, leaning)
    rates = np.zeros(len(clearances))
    for surfaces in (growth.bearing, growth.journal):
        worn = surfaces > _WORN * surfaces.max(axis=-1, keepdims=True)
        rates += np.where(worn, surfaces, 0.0).sum(axis=-1) / np.maximum(worn.sum(axis=-1), 1)
    return _Growth(rates, leaning.history.work)


def _watched(linkage: Linkage, path: Path, stroke: Stroke) -> tuple[Places, int]:
    """Return moments of the motion, and the goals at rest; and how many moments were left out."""
    rows = np.linspace(0, len(stroke.time) - 1, _WATCHED + 2).astype(int)[1:-1]
    loose = (
        [interval for intervals in predict_contact_loss(linkage, path).values() for interval in intervals]
        if (path.follower == "tip")
        else []
    )
    gap = stroke.time[1] - stroke.time[0]
    kept = [k for k in rows if not any(begin - gap <= stroke.time[k] <= end + gap for begin, end in loose)]
    still = np.zeros_like(stroke.rest)
    motion = stroke.motion
    columns = ((motion.q, stroke.rest), (motion.qd, still), (motion.qdd, still))
    return Places.of(linkage, *(np.concatenate([x[kept], y]) for x, y in columns)), len(rows) - len(kept)


def _tip_by_drives(linkage: Linkage, q: Array) -> Array:
    """Return (m, 2, d) the derivative of the tip by the drives."""
    columns = []
    drives = q[:, list(linkage.driven)]
    for step in _STEP * np.eye(drives.shape[1]):
        ends = [tip_position(linkage, close_pins(linkage, q, drives=drives + sign * step)) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * _STEP))
    return np.stack(columns, axis=-1)


def _telling_poses(linkage: Linkage, stroke: Stroke, count: int) -> Places:
    """Return the poses at rest that tell the clearances best: the sum of their variances is least."""
    candidates = _candidates(linkage, stroke)
    information = np.einsum("mip,miq->mpq", candidates.along, candidates.along)
    # A little is known of every clearance before, so that fewer equations than pins have a best choice too.
    prior = 1e-3 * np.eye(information.shape[-1])
    sets = np.array(list(combinations(range(len(information)), min(count, len(information)))))
    variances = np.trace(np.linalg.inv(information[sets].sum(axis=1) + prior), axis1=-2, axis2=-1)
    best = sets[int(variances.argmin())]
    return Places.of(linkage, candidates.q[best])


def _candidates(linkage: Linkage, stroke: Stroke) -> Places:
    """Return regular poses at rest: of a grid in the box round the path, or along the path of a single drive."""
    if len(linkage.drives) != 2:
        guesses = list(stroke.motion.q[np.linspace(0, len(stroke.time) - 1, _CANDIDATES**2).astype(int)])
        goals: list[dict[str, Array]] = [{"drives": q[list(linkage.driven)]} for q in guesses]
    else:
        tip = tip_position(linkage, stroke.motion.q)
        middle, half = (tip.max(axis=0) + tip.min(axis=0)) / 2, np.maximum(np.ptp(tip, axis=0), _LEAST_BOX) / 2
        axes = [np.linspace(m - h, m + h, _CANDIDATES) for m, h in zip(middle, half, strict=True)]
        positions = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        guesses = [stroke.motion.q[np.linalg.norm(tip - position, axis=-1).argmin()] for position in positions]
        goals = [{"tip": position} for position in positions]
    kept = []
    for guess, goal in zip(guesses, goals, strict=True):
        try:
            q = close_pins(linkage, guess, **goal)
            place = Places.of(linkage, q[None])
        except InvalidValueError:
            continue
        if np.linalg.norm(place.along[0], axis=0).max() < _REGULAR:
            kept.append(q)
    if not kept:
        raise InvalidValueError(f"{linkage.name}: found no pose near the path at which all pins carry forces at rest")
    return Places.of(linkage, np.array(kept))
