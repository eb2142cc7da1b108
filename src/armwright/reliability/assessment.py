"""What tolerances of a mechanism do to its accuracy: bounds, probabilities, shares, and tolerances of least cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal

import attrs
import numpy as np

from armwright.arrays import Array, Numbers, evenly_spread, finite_or_none, integer, positive
from armwright.errors import InvalidValueError, TooFewError
from armwright.files.result_table import ResultTable
from armwright.reliability.allocation import Allocation, Rule, allocate, error_bounds
from armwright.reliability.linear_error import Estimate, LinearError
from armwright.reliability.tolerances import Tolerance, sampled_deviations

# The linear law is said to be off where its errors differ by more from those of the full mechanism.
_LINEAR = 0.01
# Errors below this are rounding [m].
_ROUNDING = 1e-12
# Least and largest limit of the error [m].
_LIMITS = (1e-12, 1e6)
# Numbers of sampled errors at most.
_SAMPLED = 20_000_000
# A tolerance of least cost that differs by a smaller part from the given one is as good as that.
_CHANGED = 0.05
_MEANING = (
    "Tolerances are half widths. Worst case: all dimensions are at the ends of their tolerances. Statistical: "
    "deviations are normal and independent, and a tolerance is three standard deviations."
)


@attrs.frozen(kw_only=True, eq=False)
class Mechanism:
    """An arm or a linkage at p poses, k of whose dimensions have tolerances.

    Attributes:
        name: of it.
        kind: what it is.
        point: what has the error: ``tool`` or ``tip``.
        complete: what computes it without the linear law: ``full kinematics``, ``full equilibrium``.
        poses: (p, ...) what is known of each pose, by the names that JSON has for it.
        error: of the point, linear in the deviations.
        lengths: (samples, k) deviations to (samples, p) lengths of the errors, without the linear law [m]; it is told
            where to say what is being done.
        notes: what a reader must know of this mechanism.
    """

    name: str
    kind: Literal["arm", "linkage"]
    point: str
    complete: str
    poses: Mapping[str, Array]
    error: LinearError
    lengths: Callable[[Array, Callable[[str], None]], Array]
    notes: tuple[str, ...] = ()


@attrs.frozen(kw_only=True, eq=False)
class ToleranceAssessment:
    """Accuracy of a mechanism whose dimensions are within tolerances.

    Attributes:
        mechanism: the nominal one, at p poses.
        numbers: (p,) of each among those that were given, from 1.
        given: how many were given.
        tolerances: k of its dimensions.
        limit: of the error [m]; None where none is asked for.
        worst_case: (p,) the longest error at each pose [m].
        statistical: (p,) the longest error within the ellipsoid of three standard deviations [m].
        sampled: (samples, p) lengths of the errors of random mechanisms, without the linear law [m].
        nonlinearity: root mean square of what these differ by from the errors of the linear law, by that of what
            deviations do after the latter, at the pose where this is largest.
        on_path: probability that the error is beyond the limit at any pose; None without a limit.
        at_poses: (p,) the same at each pose, by the exact law; None without a limit.
        allocation: tolerances of least cost that keep the limit; None where none is asked for.
        rule: by which they keep it.
    """

    mechanism: Mechanism
    numbers: Numbers
    given: int
    tolerances: tuple[Tolerance, ...]
    limit: float | None
    worst_case: Array
    statistical: Array
    sampled: Array
    nonlinearity: float
    on_path: Estimate | None = None
    at_poses: Array | None = None
    allocation: Allocation | None = None
    rule: Rule = "worst-case"

    @property
    def error(self) -> LinearError:
        """The error, linear in the deviations."""
        return self.mechanism.error

    @property
    def mean(self) -> Array:
        """(p,) length of the mean error at each pose [m]."""
        return np.asarray(np.linalg.norm(self.error.offset, axis=-1), dtype=np.float64)

    @cached_property
    def worst_pose(self) -> int:
        """The pose, from 0, at which the error varies most."""
        return int(np.linalg.eigvalsh(self.error.covariance)[:, -1].argmax())

    @cached_property
    def ranking(self) -> list[int]:
        """The dimensions, those with the largest share of the variance at the worst pose first."""
        return [int(i) for i in np.argsort(-self.error.shares[self.worst_pose], kind="stable")]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        notes = [_MEANING]
        if (count := len(self.numbers)) < self.given:
            notes.append(
                f"{count} of the {self.given} poses are computed, evenly spread; the error may be longer between."
            )
        if self.nonlinearity > _LINEAR:
            notes.append(
                f"The errors of the {self.mechanism.complete} differ by {self.nonlinearity:.1%} from the linear law: "
                "trust the sampled ones."
            )
        if self.on_path is not None and self.on_path.standard_error > 0.1 * self.on_path.probability:
            notes.append("The probability on the path is rough: its standard error is more than a tenth of it.")
        return (*notes, *self.mechanism.notes)

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        allocation = self.allocation
        return {
            self.mechanism.kind: self.mechanism.name,
            "limit_m": self.limit,
            "poses": [
                {
                    "number": int(self.numbers[p]),
                    **{name: values[p].tolist() for name, values in self.mechanism.poses.items()},
                    "mean_m": float(self.mean[p]),
                    "worst_case_m": float(self.worst_case[p]),
                    "statistical_m": float(self.statistical[p]),
                    "probability": None if self.at_poses is None else float(self.at_poses[p]),
                }
                for p in range(len(self.numbers))
            ],
            "on_path": None if self.on_path is None else self.on_path._asdict(),
            "sampled_beyond_limit": None if self.limit is None else int((self.sampled > self.limit).any(axis=1).sum()),
            "samples": len(self.sampled),
            "nonlinearity": self.nonlinearity,
            "dimensions": [
                {
                    "name": self.tolerances[i].name,
                    "unit": self.tolerances[i].unit,
                    "half_width": self.tolerances[i].half_width,
                    "share": float(self.error.shares[self.worst_pose, i]),
                    "allocated": finite_or_none(allocation.half_widths[i]) if allocation else None,
                    "allocated_cost": float(allocation.costs[i]) if allocation else None,
                }
                for i in self.ranking
            ],
            "allocation": None
            if allocation is None
            else {
                "rule": self.rule,
                "cost": float(allocation.costs.sum()),
                "least_cost": allocation.least_cost,
                "scaled_cost": allocation.scaled_cost,
            },
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the tables: the mechanism, its dimensions, and its tolerances of least cost."""
        count = len(self.numbers)
        yield ResultTable(
            title=f"{self.mechanism.name}: error of the {self.mechanism.point} at {count} pose{'s' * (count > 1)}",
            heads=("quantity", "worst pose", "value"),
            rows=tuple(self._summary()),
            numbers=(1, 2),
        )
        yield self._dimension_table()

    def _summary(self) -> Iterator[tuple[str, str, str]]:
        if self.error.offset.any():
            yield "mean dimensions, mm", self._number(self.mean), _mm(self.mean.max())
        yield "worst case, mm", self._number(self.worst_case), _mm(self.worst_case.max())
        yield "statistical, mm", self._number(self.statistical), _mm(self.statistical.max())
        mean, kind = self.sampled.mean(axis=0), self.mechanism.kind
        yield f"mean error of sampled {kind}s, mm", self._number(mean), _mm(mean.max())
        yield f"{self.mechanism.complete} against linear law", "", f"{100 * self.nonlinearity:.2g} %"
        if self.limit is None or self.at_poses is None or self.on_path is None:
            return
        beyond, count = int((self.sampled > self.limit).any(axis=1).sum()), len(self.sampled)
        path = self.on_path
        limit = f"{self.limit * 1e3:g} mm"
        yield f"P(error > {limit}) at a pose, exact", self._number(self.at_poses), f"{self.at_poses.max():.3g}"
        yield f"P(error > {limit}) at any pose", "", f"{path.probability:.3g} ± {path.standard_error:.1g}"
        yield f"sampled {kind}s beyond {limit}", "", f"{beyond} of {count}"

    def _number(self, values: Array) -> str:
        """Return the number of the pose with the largest value."""
        return str(self.numbers[values.argmax()])

    def _dimension_table(self) -> ResultTable:
        allocation, shares = self.allocation, self.error.shares[self.worst_pose]
        heads = ["dimension", "tolerance", "share, %"]
        if allocation is not None:
            heads += ["least cost", "change", "cost before", "cost"]
        rows = []
        for i in self.ranking:
            one = self.tolerances[i]
            value, unit = one.displayed
            row = [one.name, f"±{value:.4g} {unit}", f"{100 * shares[i]:.1f}"]
            if allocation is not None:
                new = allocation.half_widths[i]
                ratio = new / one.half_width
                row += [
                    f"±{value * ratio:.4g} {unit}" if np.isfinite(new) else "any",
                    f"x {ratio:.3g}" if np.isfinite(new) else "free",
                    f"{one.cost:.3g}",
                    f"{allocation.costs[i]:.3g}",
                ]
            rows.append(tuple(row))
        remark = ""
        if allocation is not None and self.limit is not None:
            saved = allocation.scaled_cost / allocation.costs.sum() - 1
            remark = (
                f"Least cost for {self.limit * 1e3:g} mm by the {self.rule} rule: {allocation.costs.sum():.4g}; the "
                f"given tolerances, all scaled to the same limit, cost {allocation.scaled_cost:.4g}: {saved:.1%} more. "
                f"{self._advice(allocation)}"
            )
        return ResultTable(
            title=f"Dimensions, by their share of the variance at pose {self.numbers[self.worst_pose]}",
            heads=tuple(heads),
            rows=tuple(rows),
            numbers=range(1, len(heads)),
            remark=remark,
        )

    def _advice(self, allocation: Allocation) -> str:
        """Say which tolerance to relax and which to tighten first."""
        factors = allocation.half_widths / [each.half_width for each in self.tolerances]
        bound = np.where(np.isfinite(factors), factors, 1.0)
        relaxed, tightened = int(bound.argmax()), int(bound.argmin())
        parts = []
        if bound[relaxed] > 1 + _CHANGED:
            parts.append(f"relax {self.tolerances[relaxed].name} first (x {bound[relaxed]:.3g})")
        if bound[tightened] < 1 - _CHANGED:
            parts.append(f"tighten {self.tolerances[tightened].name} first (x {bound[tightened]:.3g})")
        text = ", and ".join(parts) or "the given tolerances are about those of least cost"
        return f"{text[0].upper()}{text[1:]}."


def assess(
    mechanism_at: Callable[[Numbers], Mechanism],
    given: int,
    tolerances: Sequence[Tolerance],
    *,
    limit: float | None,
    allocation: Rule | None,
    samples: int,
    seed: int,
    uniform: bool,
    most: int,
    progress: Callable[[str], None] | None,
) -> ToleranceAssessment:
    """Assess what tolerances do to the accuracy of a mechanism; see ``assess_tolerances``.

    Args:
        mechanism_at: returns the mechanism at those of the given poses that have some numbers, from 0.
        given: number of poses.
        tolerances: of its dimensions.
        limit: of the error [m]; None for no probabilities.
        allocation: rule by which tolerances of least cost keep the limit; None for no such tolerances.
        samples: how many random mechanisms are drawn.
        seed: of all samples.
        uniform: whether the deviations of these are uniform within tolerances.
        most: of more poses, so many are computed.
        progress: is told what is being done.

    Raises:
        InvalidValueError: a number is out of its range.
        TooFewError: there is no pose, or no tolerance.
    """
    if not given or not tolerances:
        raise TooFewError("expected a pose and a tolerance at least")
    rows = evenly_spread(given, most)
    if integer(samples, "samples", least=1) * len(rows) > _SAMPLED:
        raise InvalidValueError(
            f"samples: expected at most {_SAMPLED // len(rows)} random mechanisms for so many poses, got {samples}"
        )
    if limit is not None:
        check_limit(limit)
    say = progress or (lambda _: None)
    mechanism = mechanism_at(rows)
    error = mechanism.error
    widths = np.array([each.half_width for each in tolerances])
    worst, _ = error_bounds(error, widths, "worst-case")
    statistical, _ = error_bounds(error, widths, "statistical")
    on_path = at_poses = found = None
    if limit is not None:
        say("probabilities")
        on_path, at_poses = error.path_probability(limit, seed=seed), error.pose_probabilities(limit)
        if allocation is not None:
            say("tolerances of least cost")
            found = allocate(tolerances, error, limit, allocation)
    say(f"random {mechanism.kind}s")
    deviations = sampled_deviations(tolerances, samples=samples, seed=seed, uniform=uniform)
    sampled = mechanism.lengths(deviations, say)
    return ToleranceAssessment(
        mechanism=mechanism,
        numbers=rows + 1,
        given=given,
        tolerances=tuple(tolerances),
        limit=limit,
        worst_case=worst,
        statistical=statistical,
        sampled=sampled,
        nonlinearity=_nonlinearity(error, deviations, sampled),
        on_path=on_path,
        at_poses=at_poses,
        allocation=found,
        rule=allocation or "worst-case",
    )


def check_limit(limit: float) -> None:
    """Refuse a limit of the error [m] that no mechanism has.

    Raises:
        InvalidValueError: it is out of its range.
    """
    if not _LIMITS[0] <= positive(limit, "limit", "m") <= _LIMITS[1]:
        raise InvalidValueError(f"limit: expected {_LIMITS[0]:g} to {_LIMITS[1]:g} m, got {limit:g}")


def _nonlinearity(error: LinearError, deviations: Array, sampled: Array) -> float:
    # Pose by pose, so that no array is larger than the sampled errors.
    largest = 0.0
    for mean, J, full in zip(error.offset, error.jacobian, sampled.T, strict=True):
        shifts = deviations @ J.T
        off, size = (_root_mean_square(x) for x in (full - np.linalg.norm(mean + shifts, axis=1), shifts))
        largest = max(largest, off / max(size, _ROUNDING))
    return largest


def _root_mean_square(x: Array) -> float:
    """Return that of numbers (samples,), or of the lengths of vectors (samples, d)."""
    return float(np.sqrt((x**2).sum() / len(x)))


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.4f}"
