"""How long an arm lives that repeats a motion: its reducers and bearings, and its repeatability as play grows."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import (
    Array,
    ArrayLike,
    Numbers,
    evenly_spread,
    finite_or_none,
    joint_array,
    not_negative,
    positive,
    read_only,
)
from armwright.errors import InvalidValueError, ShapeError
from armwright.files.result_table import ResultTable
from armwright.kinematics.jacobians import jacobian
from armwright.reliability.life_file import LifeFile, PlayGrowth
from armwright.reliability.play_life import PlayLife, WearRates, play_life
from armwright.reliability.reducer_life import Load, Rating, life_hours, load_of

# Of the lives of components, and of the repeatability, what these parts of arms do not reach.
QUANTILES = (0.05, 0.1, 0.5, 0.95)
# Part of the components that the life of their rating is reached by: L10.
_RATED = 0.9
_HOUR = 3600.0
# Points of the curve of the repeatability over the cycles.
_CURVE = 60
_LIMITS = (1e-9, 1.0)
# An arm rests where every joint is slower than this part of its fastest.
_RESTS = 0.01
# Part by which growth and first play are changed to see what that does.
_STEP = 0.02


@attrs.frozen(kw_only=True)
class ComponentLife:
    """The life of a reducer or a bearing.

    Attributes:
        joint: its number, from 0.
        name: ``reducer`` or ``bearing``.
        rating: as its maker states it.
        load: that the motion asks.
        hours: that nine in ten such components live, those of a rating for nine in ten [h]; may be infinite.
    """

    joint: int
    name: str
    rating: Rating
    load: Load
    hours: float

    @property
    def exceeded(self) -> tuple[str, ...]:
        """What of the rating the motion exceeds: ``average``, ``peak``."""
        over = {
            "average": self.load.mean_effort > self.rating.average,
            "peak": self.load.largest_effort > self.rating.peak,
        }
        return tuple(name for name, is_over in over.items() if is_over)


@attrs.frozen(kw_only=True, eq=False)
class ArmLife:
    """The life of an arm that repeats a motion.

    Attributes:
        arm: with n joints.
        cycle: how long the motion and the pause behind it take [s].
        components: with ratings, those that fail first in front.
        slope: of the Weibull law of these.
        work: (n,) effort times way of each joint in a cycle [J].
        q: (p, n) poses at which the repeatability counts: where the arm rests, or all if it never does.
        numbers: (p,) of each among the rows of the motion, from 1.
        resting: whether the arm rests there.
        visited: (v, n) poses of the whole motion.
        visited_numbers: (v,) of each among its rows, from 1.
        plays: of joints, by number from 0.
        rates: growth of all plays per cycle; None where no joint has any.
        limit: of the repeatability [m]; None where none is asked for.
        play: lives until the limit; None without a limit or rates.
        curve: cycles (c,), and what 5, 50 and 95 % of the arms do not exceed of the repeatability at the worst pose
            (3, c) [m]; None likewise.
        per_day: cycles in a day; None where that is not known.
        motion_notes: what a reader must know of the motion.
    """

    arm: Arm
    cycle: float
    components: tuple[ComponentLife, ...]
    slope: float
    work: Array
    q: Array
    numbers: Numbers
    resting: bool
    visited: Array
    visited_numbers: Numbers
    plays: dict[int, PlayGrowth]
    rates: WearRates | None = None
    limit: float | None = None
    play: PlayLife | None = None
    curve: tuple[Array, Array] | None = None
    per_day: float | None = None
    motion_notes: tuple[str, ...] = ()

    @cached_property
    def hours(self) -> float:
        """How long nine in ten arms live until the first component fails [h]; infinite where none is rated."""
        lives = np.array([one.hours for one in self.components])
        lives = lives[np.isfinite(lives)]
        if not len(lives):
            return np.inf
        least = float(lives.min())
        return float(least * ((least / lives) ** self.slope).sum() ** (-1 / self.slope))

    def cycles_of(self, hours: float) -> float:
        """Return how many cycles there are in some hours."""
        return hours * _HOUR / self.cycle

    def survival(self, hours: ArrayLike) -> Array:
        """Return the part of the arms of which no component has failed after some hours."""
        t = np.asarray(hours, dtype=np.float64) / self.hours
        return np.asarray(_RATED ** (t**self.slope))

    @cached_property
    def telling(self) -> tuple[Numbers, Array]:
        """For each joint the visited pose, from 0, where its play has the largest part in the variance; this part."""
        squares = (jacobian(self.arm, self.visited)[:, :3] ** 2).sum(axis=1)
        first = np.array([self.plays[i].first if i in self.plays else 0.0 for i in range(self.arm.n)])
        weights = np.where(first > 0, first, first[first > 0].mean() if (first > 0).any() else 1.0)
        shares = squares * weights**2
        shares /= np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
        best = shares.argmax(axis=0)
        return best, shares[best, np.arange(self.arm.n)]

    @cached_property
    def sensitivities(self) -> Array | None:
        """By how many per cent the cycles fall for one per cent more growth, and more first play, (n, 2).

        They are those of the arm with median rates, at the pose that passes the limit first, by differences. None where
        the repeatability has no such life.
        """
        if self.play is None or self.rates is None or self.limit is None:
            return None
        pose, limit, median = self.q[self.play.pose], self.limit, self.rates.median
        first = np.array([self.plays[i].first if i in self.plays else 0.0 for i in range(self.arm.n)])

        def cycles(growth: Array, play: Array) -> float:
            rates = WearRates(median=growth, spread=np.zeros(self.arm.n))
            return play_life(self.arm, pose, play, rates, limit, samples=1).quantile(0.5)

        middle = cycles(median, first)
        if not np.isfinite(middle) or not middle:
            return None
        found = np.zeros((self.arm.n, 2))
        for i in self.plays:
            step = _STEP * np.eye(self.arm.n)[i]
            more = cycles(median * (1 + step), first), cycles(median, first * (1 + step))
            less = cycles(median * (1 - step), first), cycles(median, first * (1 - step))
            found[i] = (np.array(less) - np.array(more)) / (2 * _STEP * middle)
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        notes = list(self.motion_notes)
        if self.components:
            notes.append(
                f"Lives are those that nine in ten components reach. The arm ends with the first of them, by a Weibull "
                f"law of slope {self.slope:.3g}."
            )
        over = [
            f"{one.name} of {self.arm.joint_label(one.joint)} ({', '.join(one.exceeded)})"
            for one in self.components
            if one.exceeded
        ]
        if over:
            notes.append(f"The motion exceeds ratings: {'; '.join(over)}. The law of life does not hold there.")
        if self.plays and self.rates is None:
            notes.append(
                "No growth of play is known, so there is no number of cycles. Measurements of the repeatability at the "
                "poses below, some thousand cycles apart, would tell it; a single one of 30 visits scatters by 7 %."
            )
        elif self.rates is not None:
            if self.limit is not None and not self.resting:
                notes.append("The motion never rests, so the repeatability counts at all of its poses.")
            still = [str(i + 1) for i in self.plays if not self.rates.median[i]]
            if still:
                joints = f"joint{'s' * (len(still) > 1)} {', '.join(still)}"
                notes.append(f"No growth is stated for {joints}, whose play stays what it is.")
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the life as plain data in SI units; what never ends is None."""
        play = self.play
        return {
            "arm": self.arm.name,
            "cycle_s": self.cycle,
            "hours": finite_or_none(self.hours),
            "cycles": finite_or_none(self.cycles_of(self.hours)),
            "weibull_slope": self.slope,
            "components": [
                {
                    "joint": one.joint + 1,
                    "name": one.name,
                    "hours": finite_or_none(one.hours),
                    "cycles": finite_or_none(self.cycles_of(one.hours)),
                    "load": one.load._asdict(),
                    "exceeds": list(one.exceeded),
                    "source": one.rating.source,
                }
                for one in self.components
            ],
            "work_J": self.work.tolist(),
            "limit_m": self.limit,
            "play": None
            if play is None
            else {
                "cycles": {f"{part:g}": finite_or_none(play.quantile(part)) for part in QUANTILES},
                "pose": int(self.numbers[play.pose]),
                "shares": play.shares.tolist(),
                "new_repeatability_m": float(play.repeatability.max()),
                "sensitivities": None if self.sensitivities is None else self.sensitivities.tolist(),
            },
            "telling": [
                {
                    "joint": i + 1,
                    "pose": int(self.visited_numbers[self.telling[0][i]]),
                    "share": float(self.telling[1][i]),
                }
                for i in sorted(self.plays)
            ],
            "per_day": self.per_day,
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the tables: components, the life of the repeatability, and where a play is told best."""
        rows = [
            (
                f"{one.joint + 1} {one.name}",
                *(f"{x:.4g}" for x in (one.load.mean_effort, one.load.rms_effort, one.load.largest_effort)),
                f"{self._speed(one):.4g}",
                f"{one.load.mean_effort / one.rating.effort:.0%}",
                _count(one.hours),
                _count(self.cycles_of(one.hours)),
            )
            for one in self.components
        ]
        if rows:
            rows.append(("all", *[""] * 5, _count(self.hours), _count(self.cycles_of(self.hours))))
        over = [(k, 1 if name == "average" else 3) for k, one in enumerate(self.components) for name in one.exceeded]
        unit = "N m, deg/s" if all(joint.revolute for joint in self.arm.joints) else "N m or N, deg/s or mm/s"
        yield ResultTable(
            title=f"Reducers and bearings, first to fail in front ({unit})",
            heads=("joint", "mean", "RMS", "peak", "speed", "of rated", "hours", "cycles"),
            rows=rows,
            numbers=range(1, 8),
            exceeded=over,
            section_ends=(len(rows) - 2,) if rows else (),
        )
        if self.play is not None and self.limit is not None:
            yield self._play_table(self.play, self.limit)
            yield from self._joint_table(self.play)
        poses, shares = self.telling
        yield ResultTable(
            title="Where the repeatability tells of a play",
            heads=("joint", "play, µrad or µm", "pose", "part of the variance there, %"),
            rows=[
                (
                    str(i + 1),
                    f"{self.plays[i].first * 1e6:.4g}",
                    str(self.visited_numbers[poses[i]]),
                    f"{100 * shares[i]:.0f}",
                )
                for i in sorted(self.plays)
            ],
            numbers=range(4),
        )

    def _speed(self, one: ComponentLife) -> float:
        """Return the mean speed of a component as a table shows it."""
        turning = self.arm.joints[one.joint].revolute
        return float(np.degrees(one.load.mean_speed)) if turning else one.load.mean_speed * 1e3

    def _play_table(self, play: PlayLife, limit: float) -> ResultTable:
        rows = []
        for part in QUANTILES:
            cycles = play.quantile(part)
            days = "" if self.per_day is None else _count(cycles / self.per_day)
            rows.append((f"{1 - part:.0%}", _count(cycles), days))
        order = np.argsort(-play.shares, kind="stable")
        first = ", ".join(f"joint {i + 1} {play.shares[i]:.0%}" for i in order if play.shares[i] > 0.005)
        surely, new = play.quantile(0.05), play.repeatability.max()
        return ResultTable(
            title=f"Repeatability RP within {limit * 1e3:g} mm at every pose{' of rest' if self.resting else ''}",
            heads=("of the arms", "cycles", "days" if self.per_day is not None else ""),
            rows=rows,
            numbers=(0, 1, 2),
            remark=(
                f"RP ≤ {limit * 1e3:g} mm with 95 % for {_count(surely)} cycles; {new * 1e3:.3g} mm when new. The "
                f"variance at pose {self.numbers[play.pose]}, first to pass the limit: {first}."
            ),
        )

    def _joint_table(self, play: PlayLife) -> Iterator[ResultTable]:
        if self.sensitivities is None:
            return
        order = [int(i) for i in np.argsort(-self.sensitivities.sum(axis=1), kind="stable") if i in self.plays]
        yield ResultTable(
            title="Joints: change of the cycles for 1 % more",
            heads=("joint", "part of the variance, %", "of growth, %", "of first play, %"),
            rows=[
                (str(i + 1), f"{100 * play.shares[i]:.0f}", *(f"{-x + 0.0:.2f}" for x in self.sensitivities[i]))
                for i in order
            ],
            numbers=range(4),
        )


@attrs.frozen(kw_only=True, eq=False)
class RepeatedMotion:
    """A motion of the n joints of an arm that is repeated.

    Attributes:
        t: (m,) times [s], increasing.
        q: (m, n) joint positions [rad] or [m].
        qd: (m, n) joint velocities.
        effort: (m, n) efforts at the joints [N m] or [N].
        dwell: pause before the motion is repeated [s].
        notes: what a reader must know of how it was read.
    """

    t: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    qd: Array = attrs.field(converter=read_only)
    effort: Array = attrs.field(converter=read_only)
    dwell: float = 0.0
    notes: tuple[str, ...] = ()

    def __attrs_post_init__(self) -> None:
        """Refuse rows that do not fit each other, and times that do not increase."""
        shape = self.q.shape
        if len(shape) != 2 or not shape == self.qd.shape == self.effort.shape or self.t.shape != shape[:1]:
            raise ShapeError(f"motion: expected t (m,) and q, qd, effort (m, n), got {self.t.shape} and {shape}")
        if len(self.t) < 2 or not (np.diff(self.t) > 0).all():
            raise InvalidValueError("motion: expected two times at least, and times that increase")
        not_negative(self.dwell, "dwell", "s")

    @property
    def cycle(self) -> float:
        """From one start to the next [s]."""
        return float(self.t[-1] - self.t[0]) + self.dwell

    @property
    def work(self) -> Array:
        """Effort times way of each joint in a cycle (n,) [J]."""
        return np.asarray(np.trapezoid(np.abs(self.effort * self.qd), self.t, axis=0))

    @property
    def rests(self) -> Numbers:
        """Numbers, from 0, where the arm rests, of every stay its slowest."""
        speeds = np.abs(self.qd)
        fastest = speeds.max(axis=0)
        slowness = (speeds / np.where(fastest > 0, fastest, 1.0)).max(axis=1)
        slow = np.flatnonzero(slowness <= _RESTS)
        stays = np.split(slow, np.flatnonzero(np.diff(slow) > 1) + 1)
        return np.array([stay[slowness[stay].argmin()] for stay in stays if len(stay)], dtype=np.intp)


def assess_life(
    arm: Arm,
    motion: RepeatedMotion,
    stated: LifeFile,
    *,
    limit: float | None = None,
    per_day: float | None = None,
    samples: int = 2000,
    seed: int = 0,
    most: int = 200,
) -> ArmLife:
    """Assess how long an arm lives that repeats a motion.

    Args:
        arm: with n joints.
        motion: that it repeats.
        stated: ratings of reducers and bearings, and plays.
        limit: of the repeatability RP of ISO 9283 [m]; None where it is not asked for.
        per_day: cycles in a day; None where that is not known.
        samples: how many random arms are drawn.
        seed: of these.
        most: of more poses, at so many the repeatability is computed, evenly spread.

    Raises:
        ShapeError: the motion is of another arm.
        InvalidValueError: a number is out of its range, or a limit is asked for without plays.
    """
    positions = joint_array(motion.q, arm.n)
    components = []
    for (joint, name), rating in stated.ratings.items():
        speed, effort = motion.qd[:, joint], motion.effort[:, joint]
        # In the pause a joint holds what it held at the end, such as the weight of the arm.
        held = float(effort[-1])
        load = load_of(motion.t, speed, effort, exponent=rating.exponent, dwell=motion.dwell, held=held)
        hours = life_hours(rating, load)
        components.append(ComponentLife(joint=joint, name=name, rating=rating, load=load, hours=hours))
    components.sort(key=lambda one: one.hours)
    every, rests = evenly_spread(len(positions), most), motion.rests
    rows = rests[evenly_spread(len(rests), most)] if len(rests) else every
    life = ArmLife(
        arm=arm,
        cycle=motion.cycle,
        components=tuple(components),
        slope=stated.slope,
        work=motion.work,
        q=positions[rows],
        numbers=rows + 1,
        resting=len(rests) > 0,
        visited=positions[every],
        visited_numbers=every + 1,
        plays=dict(stated.plays),
        per_day=None if per_day is None else positive(per_day, "per_day"),
        motion_notes=motion.notes,
    )
    rates = _rates(arm, stated, motion.work)
    if limit is None:
        return attrs.evolve(life, rates=rates)
    if not _LIMITS[0] <= positive(limit, "limit", "m") <= _LIMITS[1]:
        raise InvalidValueError(f"limit: expected {_LIMITS[0]:g} to {_LIMITS[1]:g} m, got {limit:g}")
    if not stated.plays:
        raise InvalidValueError("limit: a limit of the repeatability needs the play of a joint, such as [joint.1.play]")
    if rates is None:
        return attrs.evolve(life, limit=limit)
    first = np.array([stated.plays[i].first if i in stated.plays else 0.0 for i in range(arm.n)])
    play = play_life(arm, life.q, first, rates, limit, samples=samples, seed=seed)
    return attrs.evolve(life, rates=rates, limit=limit, play=play, curve=_curve(life, play, first))


def _rates(arm: Arm, stated: LifeFile, work: Array) -> WearRates | None:
    known = {i: play.rate(float(work[i])) for i, play in stated.plays.items()}
    if not any(rate is not None and rate[0] > 0 for rate in known.values()):
        return None
    values = [known.get(i) or (0.0, 0.0) for i in range(arm.n)]
    return WearRates(median=[median for median, _ in values], spread=[spread for _, spread in values])


def _curve(life: ArmLife, play: PlayLife, first: Array) -> tuple[Array, Array] | None:
    """Return cycles (c,), and the repeatability at the pose that passes the limit first: 5, 50 and 95 %, (3, c) [m]."""
    end = play.quantile(0.95)
    if not np.isfinite(end) or not end:
        return None
    cycles = np.linspace(0.0, 1.2 * end, _CURVE)
    squares = (jacobian(life.arm, life.q[play.pose])[:3] ** 2).sum(axis=0) / 12
    factor = play.factors[play.pose]
    values = [factor * np.sqrt(((first + play.rates * count) ** 2) @ squares) for count in cycles.tolist()]
    return cycles, np.quantile(np.stack(values), (0.05, 0.5, 0.95), axis=1)


def _count(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "endless"
