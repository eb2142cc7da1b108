"""The error of a linkage whose clearances are random and grow with its strokes.

What a pin loses depends on strokes times wear coefficient alone, so that one history of wear serves for every
coefficient: a clearance is that of the new pin and what that history adds to it.

Source:
    Archard (1953); spec of the life, 1 and 4.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, Flags, Numbers, not_negative, positive
from armwright.clearance.ideal import tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.wear.between_states import between_states
from armwright.clearance.wear.life import WearLife
from armwright.clearance.wear.worn_stroke import resting_gaps
from armwright.clearance.wear.worn_surfaces import mean_growth
from armwright.errors import InvalidValueError
from armwright.reliability.linear_error import LinearError
from armwright.reliability.linkage_errors import LARGEST_LOG, RandomLinkage

Measure: TypeAlias = Literal["error", "RP"]
# Least and largest median of a wear coefficient [m²/N], and the largest spread of its logarithm.
_COEFFICIENTS, _WIDEST = (1e-24, 1e-6), 5.0
# The least arc on which a pin wears [rad].
_LEAST_ARC = 1e-3
# Visits of a pose from which its repeatability follows.
_VISITS = 20_000
# A life is found between strokes that differ by a factor of two, by so many halvings.
_HALVINGS = 26
# Strokes are doubled so often, from those that take a micrometre [m].
_DOUBLINGS, _FIRST_GROWTH = 60, 1e-6


@attrs.frozen(kw_only=True, eq=False)
class GapGrowth:
    """How the gaps of m pins grow at p poses of rest, as straight lines between s states.

    Attributes:
        wear: (s,) strokes times wear coefficient, from 0 [m²/N]; beyond the last state the last line goes on.
        lengths: (s, p, m) growth of the gap of each pin [m].
        shifts: (s, p, 2, m) shift of the tip by it [m].
    """

    wear: Array
    lengths: Array
    shifts: Array

    @classmethod
    def even(cls, random: RandomLinkage, work: Array, *, arc: float, width: float) -> GapGrowth:
        """Return a growth that is spread evenly on an arc.

        Args:
            random: the new linkage.
            work: (m,) force times sliding distance of a stroke [N m].
            arc: [rad].
            width: of the bearings [m].
        """
        radii = [pin.journal_radius for pin in random.linkage.pins]
        if not _LEAST_ARC <= positive(arc, "arc", "rad") <= 2 * np.pi:
            raise InvalidValueError(f"arc: expected {_LEAST_ARC:g} to {2 * np.pi:.4g} rad, got {arc:g}")
        positive(width, "width", "m")
        lengths = np.array([mean_growth(1.0, w, r, arc, width) for w, r in zip(work, radii, strict=True)])
        lengths = np.broadcast_to(lengths, (len(random.q), len(radii)))
        shifts = random.jacobian * lengths[:, None]
        return cls(
            wear=np.array([0.0, 1.0]),
            lengths=np.stack([np.zeros_like(lengths), lengths]),
            shifts=np.stack([np.zeros_like(shifts), shifts]),
        )

    @classmethod
    def worn(cls, random: RandomLinkage, life: WearLife) -> GapGrowth:
        """Return the growth of gaps at the worn walls of a life of the mean linkage."""
        linkage = random.linkage
        gains = tip_sensitivity(linkage, random.q)
        gaps = np.array([resting_gaps(linkage, life.law, surfaces, random.q) for surfaces in life.surfaces])
        sizes = np.linalg.norm(gaps, axis=-1)
        return cls(
            wear=life.strokes * life.law.coefficient,
            lengths=sizes - sizes[0],
            shifts=np.einsum("pami,spmi->spam", gains, gaps - gaps[0]),
        )

    def lengths_at(self, wear: Array) -> Array:
        """Return (n, p, m) what wear (n, m) of each pin adds to gaps [m]."""
        return between_states(self.wear, wear, self.lengths)[0]

    def shifts_at(self, wear: Array) -> Array:
        """Return (n, p, 2, m) how wear (n, m) of each pin shifts the tip [m]."""
        return between_states(self.wear, wear, self.shifts)[0]


@attrs.frozen(kw_only=True, eq=False)
class WearingLinkage:
    """A linkage of random dimensions that wears at a random rate.

    It is described by standard normal numbers: one for each random dimension, and one for the wear coefficient, or for
    that of each pin.

    Attributes:
        random: the new linkage at p poses, with m pins, without friction but in its repeatability.
        growth: of its gaps.
        median: of the wear coefficient [m²/N].
        spread: standard deviation of its logarithm.
        each: whether every pin has a wear coefficient of its own, independent of the others.
    """

    random: RandomLinkage
    growth: GapGrowth
    median: float
    spread: float
    each: bool = False

    def __attrs_post_init__(self) -> None:
        """Check the ranges."""
        if self.random.friction:
            raise InvalidValueError("random: expected a linkage without friction: where journals lie is new every time")
        if not _COEFFICIENTS[0] <= positive(self.median, "wear coefficient") <= _COEFFICIENTS[1]:
            raise InvalidValueError(
                f"wear coefficient: expected {' to '.join(f'{end * 1e9:g}' for end in _COEFFICIENTS)} mm³/(N m), got "
                f"{self.median * 1e9:g}"
            )
        if not_negative(self.spread, "spread of the wear coefficient") > _WIDEST:
            raise InvalidValueError(
                f"spread of the wear coefficient: expected at most {_WIDEST:g}, got {self.spread:g}"
            )
        if not (self.growth.lengths[-1] > 0).any():
            raise InvalidValueError(f"{self.linkage.name}: nothing wears")

    @property
    def linkage(self) -> Linkage:
        """The linkage with its nominal dimensions."""
        return self.random.linkage

    @property
    def size(self) -> int:
        """How many standard normal numbers describe it."""
        return len(self.random.names) + (len(self.linkage.pins) if self.each else 1)

    def clearances(self, z: Array) -> Array:
        """Return (n, m) clearances of new linkages that numbers (n, size) describe [m]."""
        return self.random.clearances.values(z[:, : len(self.linkage.pins)])

    def coefficients(self, z: Array) -> Array:
        """Return (n, m) wear coefficients of their pins [m²/N]."""
        logs = np.minimum(self.spread * z[:, len(self.random.names) :], LARGEST_LOG)
        return np.broadcast_to(self.median * np.exp(logs), (len(z), len(self.linkage.pins)))

    def worn_clearances(self, z: Array, strokes: Array) -> Array:
        """Return (n, m) clearances after strokes (n,), the mean over the poses [m]."""
        lengths = self.growth.lengths_at(self.coefficients(z) * strokes[:, None])
        return np.asarray(self.clearances(z) + lengths.mean(axis=1))

    def errors(self, z: Array, strokes: Array) -> Array:
        """Return (n, p) lengths of the errors after strokes (n,) [m]."""
        return np.asarray(np.linalg.norm(self._errors(z, strokes), axis=-1))

    def error_after(self, strokes: float) -> LinearError:
        """Return the error after some strokes, whose probabilities are sampled with importance into the tail.

        Args:
            strokes: 0 or more.
        """
        wear = not_negative(strokes, "strokes") * self.median
        step = self.growth.shifts_at(np.full((1, len(self.linkage.pins)), wear))[0]
        new = self.random.error
        rate = step if self.each else step.sum(axis=-1, keepdims=True)

        def exact(z: Array) -> Array:
            return self._errors(z, np.full(len(z), strokes))

        return LinearError(
            names=(*new.names, *(self.linkage.clearances if self.each else ("wear",))),
            deviations=[*new.deviations, *[self.spread] * rate.shape[-1]],
            offset=new.offset + step.sum(axis=-1),
            jacobian=np.concatenate([new.jacobian, rate], axis=-1),
            exact=exact,
        )

    def repeatability(self, z: Array, strokes: Array) -> Array:
        """Return (n, p) RP of ISO 9283 after strokes (n,) [m]; friction holds journals anywhere in their cones.

        It is the standard deviation of the tip times a factor, which is that of the mean new clearances at each pose.
        Where wear shares the deviation otherwise among the pins, the factor is up to a tenth another one.
        """
        lengths = self.growth.lengths_at(self.coefficients(z) * strokes[:, None])
        gaps = self.clearances(z)[:, None] + lengths
        gains, factors = self._friction
        return np.asarray(factors * np.sqrt((gains * gaps**2).sum(axis=-1)))

    def measure(self, name: Measure, z: Array, strokes: Array) -> Array:
        """Return (n, p) a measure of the tip, ``error`` or ``RP``, after strokes (n,) [m]."""
        return (self.errors if name == "error" else self.repeatability)(z, strokes)

    def lives(self, name: Measure, limit: float, z: Array) -> Array:
        """Return (n,) strokes until a measure passes a limit [m] at any pose; 0 of new ones beyond it, may be infinite.

        Args:
            name: of the measure.
            limit: of it [m].
            z: (n, size) standard normal numbers.
        """
        positive(limit, "limit", "m")
        rate = self.growth.lengths[-1].max(axis=0) / self.growth.wear[-1] * self.coefficients(z)
        high = np.maximum(_FIRST_GROWTH / rate.max(axis=1), np.finfo(float).tiny)
        low = np.zeros(len(z))

        def passed(rows: Numbers, strokes: Array) -> Flags:
            return np.asarray(self.measure(name, z[rows], strokes).max(axis=1) > limit)

        every = np.arange(len(z))
        failed = passed(every, np.zeros(len(z)))
        open_ = every[~failed]
        for _ in range(_DOUBLINGS):
            open_ = open_[~passed(open_, high[open_])]
            if not len(open_):
                break
            low[open_], high[open_] = high[open_], 2 * high[open_]
        high[open_] = np.inf
        rows = np.setdiff1d(every[~failed], open_)
        for _ in range(_HALVINGS):
            middle = (low[rows] + high[rows]) / 2
            over = passed(rows, middle)
            high[rows], low[rows] = np.where(over, middle, high[rows]), np.where(over, low[rows], middle)
        return np.where(failed, 0.0, high)

    def pin_parts(self, z: Array, strokes: Array) -> Array:
        """Return (n, m) part of each pin's wear in the growth of the longest error after strokes (n,)."""
        shifts = self.growth.shifts_at(self.coefficients(z) * strokes[:, None])
        errors = self._errors(z, strokes)
        pose = np.linalg.norm(errors, axis=-1).argmax(axis=1)
        rows = np.arange(len(z))
        way = errors[rows, pose]
        along = np.einsum("na,nam->nm", way, shifts[rows, pose])
        return np.asarray(along / np.where(along.sum(axis=1) == 0, 1.0, along.sum(axis=1))[:, None])

    def _errors(self, z: Array, strokes: Array) -> Array:
        """Return (n, p, 2) errors after strokes (n,) [m]."""
        shifts = self.growth.shifts_at(self.coefficients(z) * strokes[:, None])
        return np.asarray(self.random.drawn_errors(z[:, : len(self.random.names)]) + shifts.sum(axis=-1))

    @cached_property
    def _friction(self) -> tuple[Array, Array]:
        """Variance of the tip by squared gap (p, m), and RP by the root of the variance for mean clearances (p,)."""
        mean = self.random.clearances.mean
        across = self.random.across * self.random.cone
        tilts = np.random.default_rng(0).uniform(-1, 1, (_VISITS, len(mean)))
        lengths = np.linalg.norm(np.tensordot(tilts * mean, across, axes=([1], [2])), axis=-1)
        # An even spread from -1 to 1 has the variance of a third.
        gains = np.square(across).sum(axis=1) / 3
        root = np.sqrt((gains * mean**2).sum(axis=-1))
        factors = (lengths.mean(axis=0) + 3 * lengths.std(axis=0, ddof=1)) / np.maximum(root, np.finfo(float).tiny)
        return gains, factors
