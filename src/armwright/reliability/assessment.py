"""What tolerances of an arm do to its accuracy: bounds, probabilities, shares, and tolerances of least cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Numbers, evenly_spread, finite_or_none, integer, joint_array, positive
from armwright.errors import InvalidValueError, TooFewError
from armwright.files.result_table import ResultTable
from armwright.reliability.allocation import Allocation, Rule, allocate, error_bounds
from armwright.reliability.arm_errors import sampled_deviations, sampled_errors, tool_error
from armwright.reliability.linear_error import Estimate, LinearError
from armwright.reliability.tolerances import Tolerance

# The linear law is said to be off where its errors differ by more from those of the full kinematics.
_LINEAR = 0.01
# Errors below this are rounding [m].
_ROUNDING = 1e-12
# Least and largest limit of the error [m].
_LIMITS = (1e-12, 1e6)
# Numbers of sampled errors at most.
_SAMPLED = 20_000_000
_MEANING = (
    "Tolerances are half widths. Worst case: all dimensions are at the ends of their tolerances. Statistical: "
    "deviations are normal and independent, and a tolerance is three standard deviations."
)


@attrs.frozen(kw_only=True, eq=False)
class ToleranceAssessment:
    """Accuracy of an arm whose dimensions are within tolerances.

    Attributes:
        arm: the nominal arm, with n joints.
        q: (p, n) the configurations [rad] or [m].
        numbers: (p,) of each among those that were given, from 1.
        given: how many were given.
        tolerances: k of its dimensions.
        error: of the tool's position, linear in the deviations.
        limit: of the error [m]; None where none is asked for.
        worst_case: (p,) the longest error at each pose [m].
        statistical: (p,) three standard deviations along the direction in which the error varies most [m].
        sampled: (samples, p) lengths of the errors of random arms by their full kinematics [m].
        nonlinearity: root mean square of what these differ by from the errors of the linear law, by that of the latter,
            at the pose where this is largest.
        on_path: probability that the error is beyond the limit at any pose; None without a limit.
        at_poses: (p,) the same at each pose, by the exact law; None without a limit.
        allocation: tolerances of least cost that keep the limit; None where none is asked for.
        rule: by which they keep it.
    """

    arm: Arm
    q: Array
    numbers: Numbers
    given: int
    tolerances: tuple[Tolerance, ...]
    error: LinearError
    limit: float | None
    worst_case: Array
    statistical: Array
    sampled: Array
    nonlinearity: float
    on_path: Estimate | None = None
    at_poses: Array | None = None
    allocation: Allocation | None = None
    rule: Rule = "worst-case"

    @cached_property
    def worst_pose(self) -> int:
        """The pose, from 0, at which the error varies most."""
        return int(self.statistical.argmax())

    @cached_property
    def ranking(self) -> list[int]:
        """The dimensions, those with the largest share of the variance at the worst pose first."""
        return [int(i) for i in np.argsort(-self.error.shares[self.worst_pose], kind="stable")]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        notes = [_MEANING]
        if len(self.q) < self.given:
            notes.append(
                f"{len(self.q)} of the {self.given} poses are computed, evenly spread; the error may be longer between."
            )
        if self.nonlinearity > _LINEAR:
            notes.append(
                f"The errors of the full kinematics differ by {self.nonlinearity:.1%} from the linear law: trust the "
                "sampled ones."
            )
        if self.on_path is not None and self.on_path.standard_error > 0.1 * self.on_path.probability:
            notes.append("The probability on the path is rough: more --samples make it finer.")
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        allocation = self.allocation
        return {
            "arm": self.arm.name,
            "limit_m": self.limit,
            "poses": [
                {
                    "number": int(self.numbers[p]),
                    "q": self.q[p].tolist(),
                    "worst_case_m": float(self.worst_case[p]),
                    "statistical_m": float(self.statistical[p]),
                    "probability": None if self.at_poses is None else float(self.at_poses[p]),
                }
                for p in range(len(self.q))
            ],
            "on_path": None if self.on_path is None else self.on_path._asdict(),
            "sampled_beyond_limit": None if self.limit is None else int((self.sampled > self.limit).any(axis=1).sum()),
            "samples": len(self.sampled),
            "nonlinearity": self.nonlinearity,
            "dimensions": [
                {
                    "name": self.tolerances[i].name,
                    "unit": "m" if self.tolerances[i].is_length else "rad",
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
        """Give the tables: the arm, its dimensions, and its tolerances of least cost."""
        yield ResultTable(
            title=f"{self.arm.name}: error of the tool at {len(self.q)} pose{'s' if len(self.q) > 1 else ''}",
            heads=("quantity", "worst pose", "value"),
            rows=tuple(self._summary()),
            numbers=(1, 2),
        )
        yield self._dimension_table()

    def _summary(self) -> Iterator[tuple[str, str, str]]:
        yield "worst case, mm", self._number(self.worst_case), _mm(self.worst_case.max())
        yield "statistical, mm", self._number(self.statistical), _mm(self.statistical.max())
        mean = self.sampled.mean(axis=0)
        yield "mean error of sampled arms, mm", self._number(mean), _mm(mean.max())
        if self.limit is None or self.at_poses is None or self.on_path is None:
            return
        beyond, count = int((self.sampled > self.limit).any(axis=1).sum()), len(self.sampled)
        path = self.on_path
        limit = f"{self.limit * 1e3:g} mm"
        yield f"P(error > {limit}) at a pose, exact", self._number(self.at_poses), f"{self.at_poses.max():.3g}"
        yield f"P(error > {limit}) at any pose", "", f"{path.probability:.3g} ± {path.standard_error:.1g}"
        yield f"sampled arms beyond {limit}", "", f"{beyond} of {count}"

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
                f"given tolerances, all scaled to the same limit, cost {allocation.scaled_cost:.4g}: {saved:.1%} more."
            )
        return ResultTable(
            title=f"Dimensions, by their share of the variance at pose {self.numbers[self.worst_pose]}",
            heads=tuple(heads),
            rows=tuple(rows),
            numbers=range(1, len(heads)),
            remark=remark,
        )


def assess_tolerances(
    arm: Arm,
    q: ArrayLike,
    tolerances: Sequence[Tolerance],
    *,
    limit: float | None = None,
    allocation: Rule | None = None,
    samples: int = 1000,
    seed: int = 0,
    uniform: bool = False,
    most: int = 200,
    progress: Callable[[str], None] | None = None,
) -> ToleranceAssessment:
    """Assess what tolerances of an arm's dimensions do to the position of its tool.

    Args:
        arm: with n joints.
        q: (p, n) configurations, or one of them [rad] or [m].
        tolerances: of dimensions of the arm.
        limit: of the error [m]; without it there are no probabilities.
        allocation: rule by which tolerances of least cost keep the limit; None for no such tolerances.
        samples: how many random arms are drawn, with their full kinematics.
        seed: of all samples.
        uniform: whether the deviations of these are uniform within tolerances, and not normal.
        most: of more configurations, so many are computed, evenly spread, the first and the last included.
        progress: is told what is being done.

    Raises:
        ShapeError: ``q`` does not fit the arm.
        InvalidValueError: a number is out of its range, or tolerances of least cost are asked for without a limit.
        TooFewError: there is no configuration, or no tolerance.
    """
    every = np.atleast_2d(joint_array(q, arm.n))
    if not len(every) or not tolerances:
        raise TooFewError("expected a configuration and a tolerance at least")
    rows = evenly_spread(len(every), most)
    configurations = every[rows]
    if integer(samples, "samples", least=1) * len(rows) > _SAMPLED:
        raise InvalidValueError(
            f"samples: expected at most {_SAMPLED // len(rows)} random arms for so many poses, got {samples}"
        )
    if limit is not None and not _LIMITS[0] <= positive(limit, "limit", "m") <= _LIMITS[1]:
        raise InvalidValueError(f"limit: expected {_LIMITS[0]:g} to {_LIMITS[1]:g} m, got {limit:g}")
    say = progress or (lambda _: None)
    error = tool_error(arm, configurations, tolerances)
    widths = np.array([each.half_width for each in tolerances])
    worst, _ = error_bounds(error, widths, "worst-case")
    statistical, _ = error_bounds(error, widths, "statistical")
    say("random arms")
    sampled = sampled_errors(arm, configurations, tolerances, samples=samples, seed=seed, uniform=uniform)
    deviations = sampled_deviations(tolerances, samples=samples, seed=seed, uniform=uniform)
    on_path = at_poses = found = None
    if limit is not None:
        say("probabilities")
        on_path, at_poses = error.path_probability(limit, seed=seed), error.pose_probabilities(limit)
        if allocation is not None:
            say("tolerances of least cost")
            found = allocate(tolerances, error, limit, allocation)
    return ToleranceAssessment(
        arm=arm,
        q=configurations,
        numbers=rows + 1,
        given=len(every),
        tolerances=tuple(tolerances),
        error=error,
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


def _nonlinearity(error: LinearError, deviations: Array, sampled: Array) -> float:
    # Pose by pose, so that no array is larger than the sampled errors.
    largest = 0.0
    for J, full in zip(error.jacobian, sampled.T, strict=True):
        linear = np.linalg.norm(deviations @ J.T, axis=1)
        off, length = (float(np.sqrt((x**2).mean())) for x in (full - linear, linear))
        largest = max(largest, off / max(length, _ROUNDING))
    return largest


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.4f}"
