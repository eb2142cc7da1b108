"""A linkage whose pins wear, as its maintenance sees it: what clearances do to the tip, and how they grow.

Along the path and at the poses of a check every journal lies at the wall to which the motion presses it, or anywhere in
its friction cone about that. The walls wear, and with them the places of the journals change, as a worn life of the
linkage tells.

Source:
    Spec of the life, 1 and 5; spec of the clearance, 4.3.
"""

from __future__ import annotations

from itertools import combinations

import attrs
import numpy as np

from armwright.arrays import Array, integer, positive
from armwright.clearance.correction import predict_contact_loss
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.maintenance.wear_history import Places, WearHistory, WornGaps, WornShifts
from armwright.clearance.paths import Path
from armwright.clearance.wear.worn_stroke import Stroke
from armwright.clearance.wear.worn_surfaces import WearLaw, wearing_clearances
from armwright.errors import InvalidValueError

# Moments of a stroke: at which its wear is integrated, and at which the error of its tip counts beside its goals.
_MOMENTS, _WATCHED = 81, 9
# Round each surface: fewer than `wear` takes by default, whose growth is the same to a few hundredths.
_BINS = 120
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
class MaintainedLinkage:
    """A linkage on its path, with the poses at which it is measured.

    Attributes:
        linkage: with p pins, new.
        stroke: along the path.
        watched: moments and, at the end, goals at which the error of the tip counts.
        times: (m,) of these in the stroke [s].
        drives_by_shift: (m, d, 2) how the drives have to move for a shift of the tip there [1/m, or 1].
        aim: (m, 2, 2) part of such a shift that they can make.
        poses: at which a check holds the arm at rest.
        history: of its wear, with the mean clearances of new pins and the same wear coefficient in all of them.
        shifts: of the tip where it is watched.
        pose_gaps: of the pins at the poses of a check.
        left_out: moments at which the error does not count, since journals may leave their walls.
    """

    linkage: Linkage
    stroke: Stroke
    watched: Places
    times: Array
    drives_by_shift: Array
    aim: Array
    poses: Places
    history: WearHistory
    shifts: WornShifts
    pose_gaps: WornGaps
    left_out: int

    @property
    def by_tip(self) -> bool:
        """Whether the drives can move the tip anywhere in the plane."""
        return len(self.linkage.drives) == 2

    def taken(self, new: Array, growths: Array) -> Array:
        """Return (..., m, 2) the shift of the tip that a correction takes away [m].

        Args:
            new: (p,) mean clearances of the new pins [m].
            growths: (..., p) mean growths of these [m].
        """
        along, by_clearance, _ = self.shifts.at(growths)
        shift = along.sum(axis=-1) + by_clearance @ (new - self.linkage.clearance_array(None))
        return np.asarray((self.aim @ shift[..., None])[..., 0])

    def moves(self, taken: Array) -> Array:
        """Return (..., m, 2) how a correction moves the commanded tip [m], or (..., m, 1) the single drive [rad, m].

        Args:
            taken: (..., m, 2) the shift that it takes away [m].
        """
        return -taken if self.by_tip else np.asarray(-np.einsum("mdi,...mi->...md", self.drives_by_shift, taken))


def maintained_linkage(
    linkage: Linkage, path: Path, law: WearLaw | None = None, *, exposure: float, poses: int = 3
) -> MaintainedLinkage:
    """Prepare a linkage for the plan of its checks.

    Args:
        linkage: with the clearances of new pins.
        path: of a stroke.
        law: of the wear; its coefficient and its bins do not count.
        exposure: product of strokes and wear coefficient until which the walls are worn [m²/N].
        poses: at which a check holds the arm.

    Raises:
        InvalidValueError: the path cannot be followed, a pin does not wear, a body is elastic, or no poses are left.
    """
    if integer(poses, "poses", least=1) > _MAX_POSES:
        raise InvalidValueError(f"poses: expected 1 to {_MAX_POSES}, got {poses}")
    refuse_rods("plan of checks", linkage.rods)
    wearing_clearances(linkage)
    unit = attrs.evolve(law or WearLaw(coefficient=1.0), coefficient=1.0, bins=_BINS)
    stroke = Stroke.of(linkage, path, _MOMENTS)
    watched, times, left_out = _watched(linkage, path, stroke)
    history = WearHistory.of(stroke, unit, watched, exposure=positive(exposure, "exposure", "m²/N"))
    by_drives = _tip_by_drives(linkage, watched.q)
    inverse: Array = np.linalg.pinv(by_drives, rcond=1e-6).astype(np.float64)
    if len(linkage.drives) == 1:
        gains = np.linalg.norm(by_drives, axis=-2, keepdims=True)
        inverse[np.broadcast_to(gains < _ABLE * gains.max(), inverse.shape)] = 0.0
    measured = _telling_poses(linkage, stroke, poses)
    return MaintainedLinkage(
        linkage=linkage,
        stroke=stroke,
        watched=watched,
        times=times,
        drives_by_shift=inverse,
        aim=by_drives @ inverse,
        poses=measured,
        history=history,
        shifts=history.gaps(watched).shifts(watched),
        pose_gaps=history.gaps(measured),
        left_out=left_out,
    )


# ---- inside --------------------------------------------------------------------------------------------------------


def _watched(linkage: Linkage, path: Path, stroke: Stroke) -> tuple[Places, Array, int]:
    """Return moments of the motion, and the goals at rest; their times; and how many moments were left out."""
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
    places = Places.of(linkage, *(np.concatenate([x[kept], y]) for x, y in columns))
    return places, np.concatenate([stroke.time[kept], stroke.goals]), len(rows) - len(kept)


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
