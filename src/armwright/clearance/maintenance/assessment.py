"""The plan of the checks of a wearing linkage as a result, from what was measured until now, and what it is worth.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, finite_or_none, integer, not_negative
from armwright.clearance.estimation.misfit import CONTRADICTION, p_value
from armwright.clearance.maintenance.belief import FEWEST_SAMPLES, Belief, WearPrior
from armwright.clearance.maintenance.check_file import PastCheck
from armwright.clearance.maintenance.comparison import Maintained, compare_ways, standard_error
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage
from armwright.clearance.maintenance.strategy import NextStop, Planner, Strategy
from armwright.errors import ContradictionError, InvalidValueError, counted, one_of
from armwright.files.result_table import ResultTable

# Corrections that are printed; the others are in the files.
_SHOWN = 12
# Simulated lives are many, and their next checks may scatter more.
_FEWER = 20
_LEVEL = 0.9


class Known(NamedTuple):
    """What was known after a check.

    Attributes:
        strokes: at the check.
        clearances: (3, p) lower bound, mean and upper bound [m].
        coefficients: (3, p) lower bound, median and upper bound [m²/N].
    """

    strokes: float
    clearances: Array
    coefficients: Array

    @classmethod
    def of(cls, belief: Belief) -> Known:
        """Return what is known."""
        (c_low, c_high), (k_low, k_high) = belief.interval(_LEVEL)
        middle = np.exp(np.median(belief.logs, axis=0))
        return cls(
            belief.strokes,
            np.stack([c_low, belief.clearances.mean(axis=0), c_high]),
            np.stack([k_low, middle, k_high]),
        )


@attrs.frozen(kw_only=True, eq=False)
class CheckPlan:
    """A plan from what is known now.

    Attributes:
        planner: with the linkage and the strategy.
        history: what was known, from the new linkage until now; the last is that of now.
        changed: strokes at which bearings were changed, by pin.
        belief: of now, with the bearings changed that are due.
        due: names of the pins whose bearings are to be changed now.
        next_stop: when to measure next, and corrections of the path.
        planned: simulated lives after the plan.
        fixed: with checks at equal distances, fewest first; the last is the first that is as safe as the plan, if any.
        strokes_per_day: None where it is unknown.
    """

    planner: Planner
    history: Sequence[Known]
    changed: Mapping[str, float]
    belief: Belief
    due: Sequence[str]
    next_stop: NextStop
    planned: Maintained
    fixed: Sequence[Maintained]
    strokes_per_day: float | None

    @property
    def machine(self) -> MaintainedLinkage:
        """The linkage on its path."""
        return self.planner.machine

    @property
    def pins(self) -> tuple[str, ...]:
        """Names of the pins."""
        return tuple(self.machine.linkage.clearances)

    def corrections(self) -> Iterator[tuple[float, Array, Array]]:
        """Give each correction of the path until the next check.

        Yields:
            Its strokes, (p,) the mean clearances that it is made for [m], and (m, 2) how it moves the commanded tip at
            the watched places [m], or (m, 1) the single drive [rad, m].
        """
        planned = self.next_stop.corrections
        for strokes, clearances, taken in zip(*planned, strict=True):
            if strokes < min(self.next_stop.strokes, self.planner.strategy.horizon):
                yield float(strokes), clearances, self.machine.moves(taken)

    def equally_safe(self) -> Maintained | None:
        """Return the fewest checks at equal distances that are as safe as the plan."""
        safe = float(self.planned.outside.mean())
        return next((one for one in self.fixed if one.outside.mean() <= safe), None)

    def first_changes(self) -> Iterator[tuple[str, float, Array]]:
        """Give for each pin the share of lives in which its bearing is changed, and strokes until then."""
        for i, pin in enumerate(self.pins):
            firsts = [next((s.strokes for s in life.stops if i in s.changed), np.inf) for life in self.planned.lives]
            made = np.array(firsts)[np.isfinite(firsts)]
            yield pin, len(made) / len(firsts), made

    def forecast(self, points: int = 60) -> tuple[Array, Array]:
        """Return strokes (n,) from now to the horizon, and (n, 3, p) bounds and means of clearances unmeasured [m]."""
        times = np.linspace(self.belief.strokes, self.planner.strategy.horizon, points)
        c = self.belief.forecast(times, self.planner.growth_noise)
        low, high = np.quantile(c, (0.5 - _LEVEL / 2, 0.5 + _LEVEL / 2), axis=1)
        return times, np.stack([low, c.mean(axis=1), high], axis=1)

    def poses(self) -> Iterator[tuple[Array, Array]]:
        """Give (2,) the position of the tip [m] and (d,) the coordinates of the drives [rad, m] of each pose."""
        poses = self.machine.poses
        yield from zip(poses.tip, poses.q[:, list(self.machine.linkage.driven)], strict=True)

    def as_data(self) -> dict[str, Any]:
        """Return the plan as plain data in SI units."""
        strategy = self.planner.strategy
        times, bands = self.forecast()
        same = self.equally_safe()
        return {
            "linkage": self.machine.linkage.name,
            "path": self.machine.stroke.name,
            "limit": strategy.limit,
            "alpha": strategy.alpha,
            "horizon": strategy.horizon,
            "change_at": finite_or_none(strategy.change_at),
            "strokes": self.belief.strokes,
            "strokes_per_day": self.strokes_per_day,
            "history": [
                {
                    "strokes": known.strokes,
                    "clearances": dict(zip(self.pins, known.clearances.T.tolist(), strict=True)),
                    "wear_coefficients": dict(zip(self.pins, known.coefficients.T.tolist(), strict=True)),
                }
                for known in self.history
            ],
            "change_now": list(self.due),
            "next_check": finite_or_none(self.next_stop.strokes),
            "out_of_limit": {
                "strokes": self.next_stop.times.tolist(),
                "probabilities": self.next_stop.probabilities.tolist(),
            },
            "poses": [{"tip": tip.tolist(), "drives": drives.tolist()} for tip, drives in self.poses()],
            "places": [
                {"time": time, "tip": tip}
                for time, tip in zip(self.machine.times.tolist(), self.machine.watched.tip.tolist(), strict=True)
            ],
            "corrections": [
                {"strokes": n, "clearances": dict(zip(self.pins, c.tolist(), strict=True)), "moves": moves.tolist()}
                for n, c, moves in self.corrections()
            ],
            "forecast": {
                "strokes": times.tolist(),
                "clearances": {pin: bands[:, :, i].tolist() for i, pin in enumerate(self.pins)},
            },
            "changes": [
                {"pin": pin, "share_of_lives": share, "strokes": float(np.median(made)) if len(made) else None}
                for pin, share, made in self.first_changes()
            ],
            "lives": len(self.planned.lives),
            "plan": self.planned.as_data(),
            "fixed": [one.as_data() for one in self.fixed],
            "equally_safe_checks": None if same is None else same.checks,
        }

    @property
    def notes(self) -> list[str]:
        """What to do, and how the numbers are meant."""
        strategy, stop = self.planner.strategy, self.next_stop
        when = (
            f"next check after {stop.strokes:.4g} strokes{self._days(stop.strokes)}"
            if np.isfinite(stop.strokes)
            else f"no check is due until {strategy.horizon:.4g} strokes"
        )
        notes = [when]
        if self.due:
            notes.append(f"change now: {', '.join(self.due)}; a correction of the path helps no longer")
        stops, until = self.planned.stops, f"until {strategy.horizon:.4g} strokes, of {len(self.planned.lives)} lives"
        moved = "commanded tip" if self.machine.by_tip else "drive"
        notes += [
            f"expected stops: {stops.mean():.3g} ± {standard_error(stops):.2g} {until}",
            f"corrections.csv (-o) has by how much a correction moves the {moved} at moments and goals of the path",
            "errors are those of journals that lie at their walls, anywhere in their friction cones, without impacts",
        ]
        if self.machine.left_out:
            notes.append(
                f"{self.machine.left_out} moments of the path do not count, since journals may leave their walls there"
            )
        same = self.equally_safe()
        if not self.planned.outside.any():
            notes.append("no simulated stroke was out of limit; more lives (--lives) compare the ways better")
        elif same is None:
            notes.append(
                f"none of the fixed intervals with up to {self.fixed[-1].checks} checks is as safe as the plan"
            )
        else:
            notes.append(
                f"as safe at equal distances: {counted(same.checks or 0, 'check')}, {same.stops.mean():.3g} stops"
            )
        return notes

    def tables(self) -> Iterator[ResultTable]:
        """Give what is known, poses, corrections, changes, and the comparison with fixed intervals."""
        now = self.history[-1]
        changes = {pin: (share, made) for pin, share, made in self.first_changes()}
        yield ResultTable(
            title=f"Pins after {now.strokes:.4g} strokes",
            heads=("pin", "clearance mm", "5 %", "95 %", "k mm³/(N m)", "5 %", "95 %", "changed in lives", "after"),
            rows=[
                (
                    pin,
                    *(f"{x * 1e3:.4f}" for x in now.clearances[[1, 0, 2], i]),
                    *(f"{x * 1e9:.2e}" for x in now.coefficients[[1, 0, 2], i]),
                    f"{changes[pin][0]:.0%}",
                    f"{np.median(changes[pin][1]):.3g}" if len(changes[pin][1]) else "",
                )
                for i, pin in enumerate(self.pins)
            ],
            numbers=range(1, 9),
        )
        drives = [drive.body for drive in self.machine.linkage.drives]
        units = [("mm", 1e3) if kind == "slide" else ("deg", 180 / np.pi) for kind in self._drive_kinds()]
        yield ResultTable(
            title="Poses of a check",
            heads=(
                "pose",
                "tip x mm",
                "y mm",
                *(f"{name} {unit}" for name, (unit, _) in zip(drives, units, strict=True)),
            ),
            rows=[
                (
                    str(k + 1),
                    *(f"{x * 1e3:.2f}" for x in tip),
                    *(f"{x * scale:.3f}" for x, (_, scale) in zip(q, units, strict=True)),
                )
                for k, (tip, q) in enumerate(self.poses())
            ],
            numbers=range(1, 3 + len(drives)),
        )
        head, scale = ("tip mm", 1e3) if self.machine.by_tip else (f"{drives[0]} {units[0][0]}", units[0][1])
        rows = [
            (
                f"{n:.4g}",
                *(f"{c * 1e3:.4f}" for c in clearances),
                f"{np.linalg.norm(moves, axis=-1).max() * scale:.4f}",
            )
            for n, clearances, moves in self.corrections()
        ]
        yield ResultTable(
            title="Corrections of the path until the next check",
            heads=("strokes", *(f"{pin} mm" for pin in self.pins), f"largest move of {head}"),
            rows=rows[:_SHOWN],
            numbers=range(2 + len(self.pins)),
            remark=f"and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else "",
        )
        yield ResultTable(
            title=f"Simulated lives until {self.planner.strategy.horizon:.4g} strokes",
            heads=("checks", "interval", "stops", "±", "corrections", "changes", "out of limit %", "±"),
            rows=[
                (
                    "plan" if one.checks is None else str(one.checks),
                    "" if one.checks is None else f"{one.strokes / (one.checks + 1):.3g}",
                    f"{one.stops.mean():.2f}",
                    f"{standard_error(one.stops):.2f}",
                    f"{one.corrections.mean():.1f}",
                    f"{one.changes.mean():.2f}",
                    f"{one.outside.mean() * 100:.3f}",
                    f"{standard_error(one.outside) * 100:.3f}",
                )
                for one in (self.planned, *self.fixed)
            ],
            numbers=range(1, 8),
        )

    def _days(self, strokes: float) -> str:
        """Return the days until then, where the strokes of a day are known."""
        if self.strokes_per_day is None:
            return ""
        return f", in {(strokes - self.belief.strokes) / self.strokes_per_day:.4g} days"

    def _drive_kinds(self) -> list[str]:
        linkage = self.machine.linkage
        return [linkage.coordinates[i].kind for i in linkage.driven]


def plan_checks(
    machine: MaintainedLinkage,
    prior: WearPrior,
    strategy: Strategy,
    *,
    checks: Sequence[PastCheck] = (),
    changed: Mapping[str, float] | None = None,
    strokes: float | None = None,
    strokes_per_day: float | None = None,
    lives: int = 20,
    samples: int = 20_000,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> CheckPlan:
    """Plan the checks of a linkage from what was measured until now.

    Args:
        machine: the linkage on its path.
        prior: what is known of new pins.
        strategy: to follow.
        checks: past ones, in the order of their strokes.
        changed: strokes at which bearings were changed, by pin; after a check at the same strokes.
        strokes: done until now; those of the last check or change when left out.
        strokes_per_day: for the notes.
        lives: simulated, of each way of maintenance.
        samples: of the filter; that of a simulated life has a twentieth.
        seed: of all random numbers.
        progress: called with the number of simulated hundredths, and of all.

    Raises:
        UnknownNameError: there is no such pin.
        InvalidValueError: a number is out of its range.
        ContradictionError: a check contradicts what was believed.
    """
    integer(lives, "simulated lives", least=2)
    rng = np.random.default_rng([seed, 0])
    planner = Planner.of(machine, strategy, samples, seed)
    history = learn(planner, Belief.of_new_pins(prior, machine.history.table, rng, samples), checks, changed or {}, rng)
    belief = history[-1]
    now = belief.strokes if strokes is None else strokes
    if not belief.strokes <= not_negative(now, "strokes done") < strategy.horizon:
        raise InvalidValueError(
            f"strokes done: expected {belief.strokes:g} or more, and fewer than the horizon of {strategy.horizon:g}, "
            f"got {now:g}"
        )
    if now > belief.strokes:
        history.append(belief.at(now, rng))
    fresh, due, stop = planner.changes(history[-1], rng)
    if stop.strokes < now + strategy.soonest:
        raise InvalidValueError(
            f"limit: {strategy.limit * 1e3:g} mm cannot be kept: a check would be due after {stop.strokes - now:.3g} "
            f"strokes, with all corrections and changes; expected {strategy.soonest:.3g} or more, a tenth of the least "
            f"interval"
        )
    few = max(samples // _FEWER, FEWEST_SAMPLES)
    start = history[-1].thinned(few, rng)
    planned, *fixed = compare_ways(Planner.of(machine, strategy, few, seed), start, lives, seed, progress)
    return CheckPlan(
        planner=planner,
        history=[Known.of(known) for known in history],
        changed=changed or {},
        belief=fresh,
        due=[list(machine.linkage.clearances)[pin] for pin in due],
        next_stop=stop,
        planned=planned,
        fixed=fixed,
        strokes_per_day=strokes_per_day,
    )


def learn(
    planner: Planner,
    new: Belief,
    checks: Sequence[PastCheck],
    changed: Mapping[str, float],
    rng: np.random.Generator,
) -> list[Belief]:
    """Return what was known of new pins, and after each check and each change of a bearing.

    Args:
        planner: with the linkage and the noise of readings.
        new: what is known of new pins.
        checks: that were made.
        changed: strokes at which bearings were changed, by pin; after a check at the same strokes.
        rng: for the samples.

    Raises:
        UnknownNameError: there is no such pin.
        InvalidValueError: strokes are negative.
        ContradictionError: a check contradicts what was believed.
    """
    machine = planner.machine
    names = list(machine.linkage.clearances)
    events: list[tuple[float, PastCheck | str]] = [(check.strokes, check) for check in checks]
    for pin, moment in changed.items():
        one_of("pin", pin, names)
        events.append((not_negative(moment, f"change of {pin}", "strokes"), pin))
    history = [new]
    for moment, event in sorted(events, key=lambda pair: (pair[0], isinstance(pair[1], str))):
        before = history[-1].at(moment, rng)
        if isinstance(event, str):
            history.append(before.with_new_bearing(names.index(event), rng))
        else:
            measured = event.measured(machine, planner.strategy.noise, (before.new.mean(axis=0), before.growths))
            history.append(history[-1].updated(moment, measured, rng))
            _refuse_surprise(history[-1], len(measured.values))
    return history


# ---- inside --------------------------------------------------------------------------------------------------------


def _refuse_surprise(belief: Belief, values: int) -> None:
    """Refuse a check that nobody could have expected."""
    p = float(p_value(belief.misfit, values))
    if p < CONTRADICTION:
        raise ContradictionError(
            f"the check after {belief.strokes:g} strokes contradicts what was believed before (test of the misfit: "
            f"p = {p:.2g}); check its units and poses, whether a bearing was changed (--changed), the noise of the "
            f"readings (--noise-um), and the spread of the wear coefficients (--k-spread)"
        )
