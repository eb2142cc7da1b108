"""How probable it is that the tip of a linkage with random clearances is too far off: at a pose, on a path, for life.

Source:
    Spec of the life, 4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from scipy.special import chdtrc

from armwright.arrays import Array, ArrayLike, integer, not_negative
from armwright.clearance.dimensions import dimensions_of
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.wear.life import wear_life
from armwright.clearance.wear.worn_stroke import Stroke, lean
from armwright.clearance.wear.worn_surfaces import WearLaw, WornSurfaces
from armwright.errors import InvalidValueError, counted
from armwright.files.result_table import ResultTable
from armwright.reliability.assessment import check_limit
from armwright.reliability.linear_error import Estimate
from armwright.reliability.linkage_errors import RandomClearances, RandomLinkage
from armwright.reliability.linkage_life import PARTS, LinkageLife
from armwright.reliability.linkage_wear import GapGrowth, Measure, WearingLinkage
from armwright.reliability.tip_samples import tip_samples
from armwright.reliability.tolerances import SHOWN
from armwright.reliability.wear_measurements import MOST_STROKES, WearMeasurement, measured_residuals
from armwright.reliability.weighted_draws import draw

if TYPE_CHECKING:
    from armwright.sweep.machines import Machines

# The linear law is said to be off where its errors differ by more from those of the equilibrium, in parts of their
# spread; or where the probabilities of both differ by more than this many of the standard errors of the sample.
_LINEAR, _SIGNIFICANT = 0.02, 3.0
# A clearance that would be below 0 with a larger probability is worth a word.
_BELOW_ZERO = 1e-9
# Equilibria of a sample at most.
_MOST_EQUILIBRIA = 2_000_000
# Random linkages whose clearances alone are random, and others.
_SAMPLES = 2000, 200
# A step of the worn walls takes at most this part of a clearance.
_STEP = 0.04
# Measurements contradict what was stated before where their residuals are so improbable.
_CONTRADICTION = 1e-3


@attrs.frozen(kw_only=True, eq=False)
class WearStatement:
    """What is stated of the wear of a linkage.

    Attributes:
        path: of a stroke.
        law: of the wear; its coefficient is the median.
        spread: standard deviation of the logarithm of the coefficient.
        each: whether every pin has a coefficient of its own.
        arc: on which the wear is spread evenly [rad]; None for the walls of a worn mean linkage.
        steps: of these.
        limits: of ``error`` and ``RP`` [m].
        measured: of this linkage.
        after: strokes after which the probability of an error beyond its limit is asked for.
    """

    path: Path
    law: WearLaw
    spread: float = 0.5
    each: bool = False
    arc: float | None = None
    steps: int = 20
    limits: Mapping[Measure, float]
    measured: tuple[WearMeasurement, ...] = ()
    after: float | None = None


@attrs.frozen(kw_only=True, eq=False)
class LinkageReliability:
    """Probabilities that the error of the tip passes a limit.

    Attributes:
        random: the linkage at p poses of rest.
        labels: of the poses.
        limit: of the error [m]; None where only lives are asked for.
        at_poses: (p,) probability at each pose; None likewise.
        on_path: probability at any pose; None likewise.
        samples: random linkages, whose complete equilibria were computed.
        nonlinearity: root mean square of what their errors differ by from those of the linear law, by that of the
            deviations of the latter, at the pose where this is largest.
        beyond: parts of these linkages with an error beyond the limit at any pose, in the equilibrium, and by the
            linear law; None without a limit.
        lives: until limits are passed.
        after: strokes, and the probability of an error beyond the limit at any pose after them; None where not asked.
        misfit: probability of residuals of measurements as large where what was stated before holds.
        measured: how many measurements there are.
    """

    random: RandomLinkage
    labels: tuple[str, ...]
    limit: float | None
    at_poses: Array | None
    on_path: Estimate | None
    samples: int
    nonlinearity: float
    beyond: tuple[float, float] | None
    lives: tuple[LinkageLife, ...] = ()
    after: tuple[float, Estimate] | None = None
    misfit: float = 1.0
    measured: int = 0

    @property
    def linkage(self) -> Linkage:
        """The linkage with its nominal dimensions."""
        return self.random.linkage

    @property
    def _sources(self) -> tuple[str, ...]:
        """What the error varies by: the dimensions, and the friction in each pin."""
        held = tuple(f"{pin} friction" for pin in self.linkage.clearances) if self.random.friction else ()
        return (*self.random.names, *held)

    @property
    def worst_pose(self) -> int:
        """The pose, from 0, with the largest probability, or else the largest mean error."""
        sizes = np.linalg.norm(self.random.offset, axis=-1) if self.at_poses is None else self.at_poses
        return int(sizes.argmax())

    @property
    def notes(self) -> tuple[str, ...]:
        """How the numbers are meant, and what to doubt."""
        clearances = self.random.clearances
        poses = counted(len(self.labels), "pose")
        others = ", other dimensions normal" * bool(self.random.deviations)
        notes = [f"The tip rests at {poses}; clearances are {clearances.shape}{others}."]
        if self.random.friction:
            notes.append(
                "Friction holds journals anywhere in their friction cones, at each pose anew, but not over the strokes."
            )
        else:
            notes.append("There is no friction in the error: journals lie in the directions of their forces.")
        if clearances.below_zero > _BELOW_ZERO:
            notes.append(
                f"A clearance would be below 0 with probability {clearances.below_zero:.2g}, and counts as 0 there; "
                "the exact law at a pose does not know that."
            )
        notes += self._linearity_notes()
        if self.on_path is not None and self.on_path.standard_error > 0.1 * self.on_path.probability:
            notes.append("The probability on the path is rough.")
        for life in self.lives:
            notes += self._life_notes(life)
        if self.measured:
            notes.append(
                f"{counted(self.measured, 'measurement')} of this linkage; residuals as large have "
                f"probability {self.misfit:.2g}"
                + ("." if self.misfit > _CONTRADICTION else ": they contradict what was stated; trust no life.")
            )
        return tuple(notes)

    def _linearity_notes(self) -> Iterator[str]:
        yield (
            f"Errors of {self.samples} random linkages in complete equilibrium differ from the linear law by "
            f"{self.nonlinearity:.2g} of their spread."
        )
        if self.nonlinearity > _LINEAR:
            yield "The linear law is off: trust the part of the sampled linkages, not the probabilities by the law."
        if self.beyond is not None:
            full, linear = self.beyond
            error = np.sqrt(max(full * (1 - full), linear * (1 - linear)) / self.samples)
            if abs(full - linear) > _SIGNIFICANT * error:
                yield f"Of them {full:.3g} are beyond the limit in equilibrium, {linear:.3g} by the linear law."

    def _life_notes(self, life: LinkageLife) -> Iterator[str]:
        name = "RP" if life.measure == "RP" else "Error"
        surely = life.quantile(PARTS[0])
        if np.isfinite(surely):
            yield f"{name} within {life.limit * 1e3:g} mm with 95 % for {surely:.4g} strokes."
        last = float(life.wearing.growth.wear[-1]) / life.wearing.median
        if len(life.wearing.growth.wear) > 2 and life.quantile(0.5) > last:
            yield (
                f"The worn walls are known up to {last:.3g} strokes with the median coefficient, and extrapolated "
                "beyond: take more --steps."
            )

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        random = self.random
        return {
            "linkage": self.linkage.name,
            "clearances": {
                "names": list(self.linkage.clearances),
                "mean": random.clearances.mean.tolist(),
                "covariance": random.clearances.covariance.tolist(),
                "shape": random.clearances.shape,
            },
            "deviations": dict(random.deviations),
            "limit": self.limit,
            "poses": [
                {
                    "name": label,
                    "mean_error": random.offset[p].tolist(),
                    "probability": None if self.at_poses is None else float(self.at_poses[p]),
                    "shares": dict(zip(self._sources, random.shares[p].tolist(), strict=True)),
                }
                for p, label in enumerate(self.labels)
            ],
            "on_path": None if self.on_path is None else self.on_path._asdict(),
            "sampled": {
                "linkages": self.samples,
                "nonlinearity": self.nonlinearity,
                "beyond_limit": None if self.beyond is None else self.beyond[0],
                "beyond_limit_linear": None if self.beyond is None else self.beyond[1],
            },
            "after": None if self.after is None else {"strokes": self.after[0], **self.after[1]._asdict()},
            "measurements": self.measured,
            "misfit": self.misfit,
            "wear": self._wear_data() if self.lives else None,
            "lives": [life.as_data() for life in self.lives],
        }

    def _wear_data(self) -> dict[str, Any]:
        wearing, draws = self.lives[0].wearing, self.lives[0].draws
        after = draws.quantile
        coefficients = wearing.coefficients(draws.z)
        return {
            "median": wearing.median,
            "spread": wearing.spread,
            "draws": len(draws.z),
            "effective_draws": draws.effective,
            "coefficients": {
                pin: {f"{part:g}": float(after(coefficients[:, i], part)) for part in (0.05, 0.5, 0.95)}
                for i, pin in enumerate(wearing.linkage.clearances)
            },
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the probabilities, the dimensions at the worst pose, the lives and the wear coefficients."""
        if self.limit is not None and self.at_poses is not None:
            yield self._probability_table(self.limit, self.at_poses)
        yield self._dimension_table()
        yield self._life_table()
        if self.lives:
            yield self._coefficient_table(self.lives[0])

    def _probability_table(self, limit: float, at_poses: Array) -> ResultTable:
        worst = self.worst_pose
        exact = self.random.error.exact is None
        rows = [(f"at {self.labels[worst]}", f"{at_poses[worst]:.3g}", "0, exact law" if exact else "sampled")]
        if self.on_path is not None and len(self.labels) > 1:
            rows.append(
                (
                    f"at any of {len(self.labels)} poses",
                    f"{self.on_path.probability:.3g}",
                    f"{self.on_path.standard_error:.1g}",
                )
            )
        if self.after is not None:
            strokes, found = self.after
            cells = f"{found.probability:.3g}", f"{found.standard_error:.1g}"
            none = f"none of {found.samples} draws", ""
            rows.append((f"at any, after {_count(strokes)} strokes", *(cells if found.probability else none)))
        if self.beyond is not None:
            full = self.beyond[0]
            error = np.sqrt(full * (1 - full) / self.samples)
            rows.append(
                (
                    f"at any, of {self.samples} linkages in equilibrium",
                    f"{full:.3g}" if full else "none",
                    f"{error:.1g}" if full else "",
                )
            )
        return ResultTable(
            title=f"Probability of an error beyond {limit * 1e3:g} mm",
            heads=("where", "probability", "± standard error"),
            rows=rows,
            numbers=(1, 2),
        )

    def _dimension_table(self) -> ResultTable:
        random, worst = self.random, self.worst_pose
        pins = len(self.linkage.pins)
        units = {dimension.name: dimension.unit for dimension in dimensions_of(self.linkage)}
        rows = []
        for i, name in enumerate(self._sources):
            scale, unit = SHOWN[units.get(name, "m")]
            mean = f"{random.clearances.mean[i] * 1e3:.4f}" if i < pins else ""
            spread = f"{random.spreads[i] / scale:.4g} {unit}" if i < len(random.names) else ""
            rows.append((name, mean, spread, f"{100 * random.shares[worst, i]:.1f}"))
        return ResultTable(
            title=f"Dimensions, at {self.labels[worst]}",
            heads=("dimension", "mean mm", "deviation", "share of the variance, %"),
            rows=rows,
            numbers=(1, 2, 3),
        )

    def _life_table(self) -> ResultTable:
        rows = []
        for life in self.lives:
            for part in PARTS:
                low, high = life.interval(part)
                rows.append(
                    (
                        life.measure,
                        f"{life.limit * 1e3:g}",
                        f"{100 * (1 - part):.0f} %" + {0.1: ", B10", 0.5: ", B50"}.get(part, ""),
                        _count(life.quantile(part)),
                        f"{_count(low)} to {_count(high)}",
                        _count(life.draws.quantile_error(life.strokes, part)),
                    )
                )
        return ResultTable(
            title="Strokes until a limit is passed",
            heads=("measure", "limit mm", "reached by", "strokes", "90 % for k", "± sampling"),
            rows=rows,
            numbers=(1, 2, 3, 4, 5),
            section_ends=tuple(len(PARTS) * (k + 1) - 1 for k in range(len(self.lives) - 1)),
        )

    def _coefficient_table(self, life: LinkageLife) -> ResultTable:
        wearing, draws, parts = life.wearing, life.draws, life.pin_parts()
        coefficients = wearing.coefficients(draws.z) * 1e9
        rows = []
        for i in np.argsort(-parts, kind="stable"):
            low, middle, high = draws.quantile(coefficients[:, i], (0.05, 0.5, 0.95))
            rows.append(
                (self.linkage.pins[i].name, f"{middle:.3g}", f"{low:.3g} to {high:.3g}", f"{100 * parts[i]:.0f}")
            )
        return ResultTable(
            title="Pins, those whose wear counts most first",
            heads=("pin", "k mm³/(N m)", "90 %", "part of the growth of the error, %"),
            rows=rows,
            numbers=(1, 2, 3),
        )


def assess_linkage(
    linkage: Linkage,
    q: ArrayLike,
    clearances: RandomClearances,
    *,
    deviations: Mapping[str, float] | None = None,
    friction: bool = False,
    limit: float | None = None,
    wear: WearStatement | None = None,
    samples: int | None = None,
    seed: int = 0,
    machines: Machines | None = None,
    progress: Callable[[str], None] | None = None,
) -> LinkageReliability:
    """Assess how probable it is that the error of the tip passes a limit.

    Args:
        linkage: with m pins.
        q: (p, n) coordinates with closed pins, at which the drives are locked; see ``closed_at`` and ``closed_along``.
        clearances: of the m pins.
        deviations: standard deviations of other dimensions by name [m, rad, kg, N].
        friction: whether it holds the journals of the new linkage anywhere in their friction cones.
        limit: of the error [m].
        wear: of the linkage; without it there are no lives.
        samples: how many random linkages are computed in complete equilibrium: 2000 where none is said, or 200 where
            more than clearances is random, which takes longer.
        seed: of all samples.
        machines: that compute the random linkages as a sweep; this process where there are none. The results are the
            same.
        progress: is told what is being done.

    Raises:
        InvalidValueError: a number is out of its range, or a pin carries no force at rest.
        UnknownNameError: there is no such dimension.
    """
    say = progress or (lambda _: None)
    random = RandomLinkage.at(linkage, q, clearances, deviations, friction=friction)
    count = integer(_SAMPLES[bool(random.deviations)] if samples is None else samples, "samples", least=2)
    if count * len(random.q) > _MOST_EQUILIBRIA:
        raise InvalidValueError(
            f"samples: expected at most {_MOST_EQUILIBRIA // len(random.q)} for {len(random.q)} poses, got {count}"
        )
    if limit is not None:
        check_limit(limit)
    say("random linkages in equilibrium")
    z = np.random.default_rng(seed).normal(size=(count, random.size))
    linear, full = random.drawn_errors(z), tip_samples(random.task, z, seed=seed, machines=machines, say=say)
    at_poses = on_path = beyond = None
    if limit is not None:
        say("probabilities")
        at_poses, on_path = random.error.pose_probabilities(limit), random.error.path_probability(limit, seed=seed)
        over = [float((np.linalg.norm(x, axis=-1) > limit).any(axis=1).mean()) for x in (full, linear)]
        beyond = over[0], over[1]
    assessed = LinkageReliability(
        random=random,
        labels=_labels(linkage, random.q),
        limit=limit,
        at_poses=at_poses,
        on_path=on_path,
        samples=count,
        nonlinearity=_nonlinearity(random, linear, full),
        beyond=beyond,
    )
    return assessed if wear is None else _with_lives(assessed, wear, seed, say)


def _nonlinearity(random: RandomLinkage, linear: Array, full: Array) -> float:
    off, spread = (np.sqrt(np.square(x).sum(axis=-1).mean(axis=0)) for x in (full - linear, linear - random.offset))
    return float((off / np.where(spread > 0, spread, np.inf)).max())


def _with_lives(
    assessed: LinkageReliability, wear: WearStatement, seed: int, say: Callable[[str], None]
) -> LinkageReliability:
    random = attrs.evolve(assessed.random, friction=False)
    # Wear begins at the mean clearances.
    means = dict(zip(random.linkage.clearances, random.clearances.mean.tolist(), strict=True))
    mean = random.linkage.with_clearances(means)
    say("wear")
    stroke = Stroke.of(mean, wear.path)
    if wear.arc is None:
        growth = GapGrowth.worn(random, wear_life(stroke, wear.law, steps=wear.steps, max_step=_STEP))
    else:
        new = lean(stroke, wear.law, WornSurfaces.new(len(mean.pins), wear.law.bins))
        growth = GapGrowth.even(random, new.history.work, arc=wear.arc, width=wear.law.width)
    wearing = WearingLinkage(
        random=random, growth=growth, median=wear.law.coefficient, spread=wear.spread, each=wear.each
    )
    say("lives")
    residuals = partial(measured_residuals, wearing, wear.measured) if wear.measured else None
    draws = draw(wearing.size, residuals, seed=seed)
    lives = {name: LinkageLife.of(wearing, name, limit, draws) for name, limit in wear.limits.items()}
    return attrs.evolve(
        assessed,
        lives=tuple(lives.values()),
        after=None if wear.after is None or "error" not in lives else _after(lives["error"], wear, seed),
        misfit=float(chdtrc(len(wear.measured), draws.misfit)) if wear.measured else 1.0,
        measured=len(wear.measured),
    )


def _after(life: LinkageLife, wear: WearStatement, seed: int) -> tuple[float, Estimate]:
    """Return strokes and the probability of an error beyond its limit after them: of measured linkages by the draws."""
    strokes = not_negative(wear.after or 0.0, "strokes")
    if strokes > MOST_STROKES:
        raise InvalidValueError(f"strokes: expected at most {MOST_STROKES:g}, got {strokes:g}")
    if wear.measured:
        return strokes, Estimate(*life.probability(strokes), len(life.strokes))
    return strokes, life.wearing.error_after(strokes).path_probability(life.limit, seed=seed)


def _labels(linkage: Linkage, q: Array) -> tuple[str, ...]:
    return tuple(f"({x * 1e3:.4g}, {y * 1e3:.4g}) mm" for x, y in tip_position(linkage, q).tolist())


def _count(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "endless"
