"""The vibration of a linkage as a result: how it rattles on its paths, its modes on the contacts, and a quieter law.

Source:
    Spec of the life, 3; thesis, 4.2 (24 test paths).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, finite_or_none
from armwright.clearance.ideal import tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.scenario import assembly_guess, close_pins_along
from armwright.clearance.settings import Settings
from armwright.clearance.vibration.contact_modes import ContactModes, contact_modes
from armwright.clearance.vibration.move_law import Aim
from armwright.clearance.vibration.rattling import DWELL, RUNS, Rattling, rattle
from armwright.errors import InvalidValueError, one_of
from armwright.files.result_table import ResultTable


class Quantity(NamedTuple):
    """A quantity of the ranking: its head in tables, and the factor to what tables show."""

    head: str
    factor: float


QUANTITIES: Mapping[str, Quantity] = {
    "loss": Quantity("lost in impacts mJ", 1e3),
    "motion-rms": Quantity("moving, RMS m/s²", 1.0),
    "motion-peak": Quantity("peak m/s²", 1.0),
    "dwell-rms": Quantity("after it, RMS m/s²", 1.0),
    "dwell-peak": Quantity("peak m/s²", 1.0),
    "force": Quantity("largest force N", 1.0),
    "impacts": Quantity("impacts", 1.0),
    "flight": Quantity("flight %", 100.0),
}
# So many of them are of the tip, the others of the contacts.
_OF_TIP = 5
# Decimals of a number in tables at most; smaller ones have exponents.
_MOST_DECIMALS = 6
# Positions along a path at which modes are computed, and those of the table.
_POSITIONS, _ROWS = 41, 5


class Ranked(NamedTuple):
    """A path in the ranking.

    Attributes:
        rattling: on it.
        mean: of the quantity over the runs.
        spread: its standard deviation.
        alike: names of its neighbours that cannot be told from it, since their spreads overlap.
    """

    rattling: Rattling
    mean: float
    spread: float
    alike: tuple[str, ...]


@attrs.frozen(kw_only=True, eq=False)
class PathModes:
    """The modes of a linkage at rest at m positions of a path.

    Attributes:
        path: that they lie on.
        time: (m,) at which the path passes them [s].
        tip: (m, 2) of the tip without clearance [m].
        modes: of the linkage there.
    """

    path: Path
    time: Array
    tip: Array
    modes: ContactModes


@attrs.frozen(kw_only=True, eq=False)
class RattlingAssessment:
    """How a linkage rattles on one or several paths.

    Attributes:
        linkage: with p pins.
        clearances: (p,) [m].
        rattlings: on each path.
        quantity: of ``QUANTITIES``, by which paths are ranked.
        modes: along the path, if there is only one; or why there are none.
        aim: a law of the only path with less loss; None where none was asked for.
    """

    linkage: Linkage
    clearances: Array
    rattlings: tuple[Rattling, ...]
    quantity: str
    modes: PathModes | str | None = None
    aim: Aim | None = None

    def ranking(self) -> list[Ranked]:
        """Return the paths, that with the least of the quantity first."""
        sized = []
        for rattling in self.rattlings:
            values = rattling.totals[self.quantity]
            sized.append((float(values.mean()), float(values.std(ddof=1)), rattling))
        # A path without a dwell is behind the others.
        sized.sort(key=lambda entry: (np.isnan(entry[0]), entry[0]))
        ranked = []
        for k, (mean, spread, rattling) in enumerate(sized):
            alike = tuple(
                other.path.name
                for m, s, other in (sized[i] for i in (k - 1, k + 1) if 0 <= i < len(sized))
                if abs(mean - m) <= spread + s
            )
            ranked.append(Ranked(rattling, mean, spread, alike))
        return ranked

    def as_data(self) -> dict[str, Any]:
        """Return the vibration as plain data in SI units."""
        return {
            "linkage": self.linkage.name,
            "clearances": dict(zip(self.linkage.clearances, self.clearances.tolist(), strict=True)),
            "runs": RUNS,
            "ranked_by": self.quantity,
            "paths": [
                {"path": ranked.rattling.path.name, "alike": list(ranked.alike), **self._data(ranked.rattling)}
                for ranked in self.ranking()
            ],
            "modes": self._modes_data(),
            "aim": None if self.aim is None else self._aim_data(self.aim),
        }

    def _data(self, rattling: Rattling) -> dict[str, Any]:
        pins = [pin.name for pin in self.linkage.pins]
        by_pin = {"force": rattling.force, "impacts": rattling.impacts, "flight": rattling.flight}
        return {
            "window": list(rattling.window),
            "dwell": rattling.dwell,
            **{name.replace("-", "_"): _mean_and_spread(values) for name, values in rattling.totals.items()},
            "pins": {
                pin: {name: _mean_and_spread(values[:, i]) for name, values in by_pin.items()}
                for i, pin in enumerate(pins)
            },
        }

    def _modes_data(self) -> dict[str, Any] | None:
        if not isinstance(self.modes, PathModes):
            return None
        modes = self.modes.modes
        return {
            "path": self.modes.path.name,
            "time": self.modes.time.tolist(),
            "tip": self.modes.tip.tolist(),
            "coordinates": [f"{coordinate.body}.{coordinate.kind}" for coordinate in self.linkage.coordinates],
            "frequencies": [[finite_or_none(f) for f in row] for row in modes.frequencies],
            "shapes": modes.shapes.tolist(),
            "contact_stiffness": modes.stiffness.tolist(),
            "indentation": modes.depths.tolist(),
        }

    def _aim_data(self, aim: Aim) -> dict[str, Any]:
        return {
            "limit": aim.limit,
            "candidates": [
                {
                    "law": move.law,
                    "ramp": move.ramp,
                    "speed": move.speed,
                    "acceleration": move.acceleration,
                    "loss": _mean_and_spread(move.rattling.loss),
                    "dwell_rms": _mean_and_spread(move.rattling.dwell_rms),
                    "goal": _mean_and_spread(move.rattling.goal),
                }
                for move in aim.candidates
            ],
            "law": aim.move.law,
            "ramp": aim.move.ramp,
            "passed_over": aim.passed_over,
            "goal": _mean_and_spread(aim.goal),
            **{name.replace("-", "_"): _mean_and_spread(values) for name, values in aim.move.rattling.totals.items()},
        }

    @property
    def notes(self) -> list[str]:
        """How the numbers are meant."""
        first = self.rattlings[0]
        notes = [
            f"± is the standard deviation over {RUNS} runs whose clearances differ by at most a nanometre",
            f"accelerations of the tip are those beyond its path, means over a sample of {first.sample * 1e6:.3g} µs",
        ]
        if first.dwell:
            notes.append(
                f"moving: between speeding up and slowing down; after it: {first.dwell * 1e3:g} ms with locked drives"
            )
        if len(self.rattlings) > 1:
            notes.append("alike: neighbours whose spreads overlap, so that their order may be chance")
        if isinstance(self.modes, str):
            notes.append(f"no natural frequencies: {self.modes}")
        elif self.modes is not None:
            notes.append(
                "natural frequencies are those at rest, drives held, without friction: the slow modes roll journals "
                "along their walls, the fast ones press the walls"
            )
        if self.aim is not None:
            notes.append(_aim_note(self.aim))
        return notes

    def tables(self) -> Iterator[ResultTable]:
        """Give the paths or the only one, its pins, its modes, and the move laws."""
        ranking = self.ranking()
        several = len(ranking) > 1
        tip, contacts = list(QUANTITIES)[:_OF_TIP], list(QUANTITIES)[_OF_TIP:]

        def cells(rattling: Rattling, names: Sequence[str]) -> list[str]:
            return [_shown(rattling.totals[name], QUANTITIES[name].factor) for name in names]

        yield ResultTable(
            title=f"Tip, ranked by {self.quantity}" if several else "Tip",
            heads=("path", *(QUANTITIES[name].head for name in tip), *(("alike",) if several else ())),
            rows=[
                (
                    ranked.rattling.path.name,
                    *cells(ranked.rattling, tip),
                    *((", ".join(ranked.alike),) if several else ()),
                )
                for ranked in ranking
            ],
            numbers=range(1, 1 + len(tip)),
        )
        heads = tuple(QUANTITIES[name].head for name in contacts)
        if several:
            rows = [(ranked.rattling.path.name, *cells(ranked.rattling, contacts)) for ranked in ranking]
            yield ResultTable(title="Contacts", heads=("path", *heads), rows=rows, numbers=range(1, 4))
            return
        (rattling,) = self.rattlings
        yield ResultTable(
            title="Contacts",
            heads=("pin", *heads),
            rows=[
                (
                    pin.name,
                    _shown(rattling.force[:, i]),
                    _shown(rattling.impacts[:, i]),
                    _shown(rattling.flight[:, i], 100.0),
                )
                for i, pin in enumerate(self.linkage.pins)
            ],
            numbers=range(1, 4),
        )
        if isinstance(self.modes, PathModes):
            yield _modes_table(self.modes)
        if self.aim is not None:
            yield _aim_table(self.aim)


def assess_rattling(
    linkage: Linkage,
    paths: Sequence[Path],
    clearances: Array,
    settings: Settings | None = None,
    *,
    friction: float | None = None,
    dwell: float = DWELL,
    quantity: str = "loss",
    progress: Callable[[int, int], None] | None = None,
) -> RattlingAssessment:
    """Return how a linkage rattles on paths, ranked; of a single path also the modes along it.

    Args:
        linkage: with p pins.
        paths: to follow.
        clearances: (p,) [m].
        settings: of the simulations.
        friction: coefficient of friction; that of the material when left out.
        dwell: how long the tip is watched after a path [s].
        quantity: of ``QUANTITIES``, by which paths are ranked.
        progress: called with the number of finished paths, and of all.

    Raises:
        UnknownNameError: there is no such quantity.
        InvalidValueError: there are no paths, or see ``rattle``.
    """
    one_of("quantity", quantity, QUANTITIES)
    if not paths:
        raise InvalidValueError("paths: expected at least one, got none")
    rattlings = []
    for number, path in enumerate(paths):
        rattlings.append(rattle(linkage, path, clearances, settings, friction=friction, dwell=dwell))
        if progress is not None:
            progress(number + 1, len(paths))
    return RattlingAssessment(
        linkage=linkage,
        clearances=clearances,
        rattlings=tuple(rattlings),
        quantity=quantity,
        modes=_modes_along(linkage, paths[0], clearances) if len(paths) == 1 else None,
    )


def _modes_along(linkage: Linkage, path: Path, clearances: Array) -> PathModes | str:
    time = np.linspace(0.0, path.duration, _POSITIONS)
    by_tip = path.follower == "tip"
    q = close_pins_along(linkage, path.evaluate(time).position, assembly_guess(linkage), by_tip=by_tip)
    try:
        modes = contact_modes(linkage, q, clearances)
    except InvalidValueError as error:
        return str(error)
    return PathModes(path=path, time=time, tip=tip_position(linkage, q), modes=modes)


def _modes_table(along: PathModes) -> ResultTable:
    frequencies = along.modes.frequencies
    picks = np.linspace(0, len(along.time) - 1, _ROWS).astype(int)
    return ResultTable(
        title="Natural frequencies at rest along the path, Hz",
        heads=("at x mm", "y mm", *(f"mode {i + 1}" for i in range(frequencies.shape[1]))),
        rows=[
            (*(f"{x * 1e3:z.1f}" for x in along.tip[k]), *("" if np.isnan(f) else f"{f:.1f}" for f in frequencies[k]))
            for k in picks
        ],
        numbers=range(2 + frequencies.shape[1]),
    )


def _aim_table(aim: Aim) -> ResultTable:
    def row(name: str, law: str, ramp: float, *values: str) -> tuple[str, ...]:
        return name, law, f"{ramp * 1e3:.1f}", *values

    def measures(rattling: Rattling, goal: Array) -> tuple[str, ...]:
        return _shown(rattling.loss, 1e3), _shown(rattling.dwell_rms), _shown(goal, 1e3)

    rows = [
        row(
            "as it is" if k == 0 else "",
            move.law,
            move.ramp,
            f"{move.speed:.2f}",
            f"{move.acceleration:.1f}",
            *measures(move.rattling, move.rattling.goal),
        )
        for k, move in enumerate(aim.candidates)
    ]
    best = aim.move
    chosen = f"{best.speed:.2f}", f"{best.acceleration:.1f}", *measures(best.rattling, aim.goal)
    rows.append(row("chosen", best.law, best.ramp, *chosen))
    return ResultTable(
        title="Move laws of the same duration",
        heads=(
            "", "acceleration", "ramp ms", "speed m/s", "at most m/s²", "lost mJ", "after it, RMS m/s²", "from goal mm",
        ),
        rows=rows,
        numbers=range(2, 8),
    )  # fmt: skip


def _aim_note(aim: Aim) -> str:
    own, best = aim.candidates[0].loss, float(aim.move.rattling.loss.mean())
    text = (
        f"the chosen law, corrected at both ends, loses {best * 1e3:.3g} mJ in impacts instead of {own * 1e3:.3g} mJ, "
        f"and its tip is {aim.goal.mean() * 1e3:.3g} mm from the goal on average (limit {aim.limit * 1e3:g} mm)"
    )
    if aim.passed_over:
        text += f"; {aim.passed_over} of the laws with less loss did not reach the goal"
    return text


def _shown(values: Array, factor: float = 1.0) -> str:
    """Return mean and spread of the runs as text, the mean with the digits that the spread leaves it, at most four."""
    mean, spread = float(values.mean()) * factor, float(values.std(ddof=1)) * factor
    if np.isnan(mean):
        return ""
    decimals = 3 - _magnitude(mean)
    if decimals > _MOST_DECIMALS:
        return f"{mean:.2g}±{spread:.1g}"
    if spread > 0:
        decimals = min(decimals, 1 - _magnitude(spread))
    decimals = max(decimals, 0)
    known = round(spread, decimals) > 0 or spread == 0
    return f"{mean:.{decimals}f}±{f'{spread:.{decimals}f}' if known else f'{spread:.1g}'}"


def _magnitude(value: float) -> int:
    return int(np.floor(np.log10(abs(value)))) if value else 0


def _mean_and_spread(values: Array) -> dict[str, float | None]:
    return {"mean": finite_or_none(values.mean()), "spread": finite_or_none(values.std(ddof=1))}
