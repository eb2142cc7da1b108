"""The results of the trials of a program: how many succeed, how exactly parts are placed, why others fail."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, finite_or_none
from armwright.errors import counted
from armwright.files.result_table import ResultTable
from armwright.program.vm.trials import SEPARATOR

# The quantile of the normal distribution between which and its negative 95 % lie.
_Z = 1.959963984540054
# Bars of the histogram of placing errors, and failures that are printed.
_BARS, _MOST_FAILURES = 20, 20


class Trial(NamedTuple):
    """How a trial ended.

    Attributes:
        number: from 1; with the seed of all trials it repeats this one.
        cause: why it failed; empty where it succeeded.
        message: the cause in words.
        distance: of the part that is farthest from its goal [m]; not a number where nothing is known of that.
        angle: of the part that is rotated farthest from its goal [rad].
        duration: until the program ended [s].
        ended: whether the program came to its end.
    """

    number: int
    cause: str
    message: str
    distance: float
    angle: float
    duration: float
    ended: bool


def trial(number: int, failure: str, numbers: Mapping[str, float]) -> Trial:
    """Return a trial from its row of a sweep: what its failure says, and its outputs by name."""
    cause, separator, message = failure.partition(SEPARATOR)
    if failure and not separator:
        cause, message = "killed", failure
    distance, angle, duration = (numbers[name] for name in ("distance", "angle", "duration"))
    return Trial(number, cause, message, distance, angle, duration, numbers["ended"] == 1.0)


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the interval that contains a probability with 95 % confidence.

    Source:
        E. B. Wilson, "Probable inference, the law of succession, and statistical inference", J. Am. Stat. Assoc. 22
        (1927).
    """
    share, weight = successes / trials, _Z**2 / trials
    middle = (share + weight / 2) / (1 + weight)
    half = math.sqrt(weight * (share * (1 - share) + weight / 4)) / (1 + weight)
    # What is rounded is not beyond a certain failure or success.
    return max(middle - half, 0.0) if successes else 0.0, min(middle + half, 1.0) if successes < trials else 1.0


@attrs.frozen(kw_only=True)
class TrialsSummary:
    """The summary of the trials of a program in a cell.

    Attributes:
        program: its name.
        cell: name of the cell.
        seed: of all trials.
        trials: in the order of their numbers.
    """

    program: str
    cell: str
    seed: int
    trials: tuple[Trial, ...]

    @property
    def successes(self) -> int:
        """The number of trials that succeeded."""
        return sum(not it.cause for it in self.trials)

    @property
    def success(self) -> float:
        """The share of trials that succeeded."""
        return self.successes / len(self.trials)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval of the probability of success, of 95 % confidence."""
        return wilson_interval(self.successes, len(self.trials))

    @property
    def failures(self) -> tuple[Trial, ...]:
        """The trials that failed."""
        return tuple(it for it in self.trials if it.cause)

    @property
    def causes(self) -> dict[str, tuple[int, ...]]:
        """The numbers of the trials by the cause of failure, the most frequent cause first."""
        counts = Counter(it.cause for it in self.failures)
        return {
            cause: tuple(it.number for it in self.failures if it.cause == cause) for cause, _ in counts.most_common()
        }

    @property
    def distances(self) -> Array:
        """The placing errors (k,) of the trials whose program came to its end [m]."""
        return np.array([it.distance for it in self.trials if it.ended and math.isfinite(it.distance)])

    @property
    def angles(self) -> Array:
        """The angles (k,) from the goals of the trials whose program came to its end [rad]."""
        return np.array([it.angle for it in self.trials if it.ended and math.isfinite(it.angle)])

    @property
    def notes(self) -> tuple[str, ...]:
        """The share of success with its interval, the placing errors, and how a failure is repeated."""
        low, high = self.interval
        share = f"{self.successes} of {len(self.trials)} trials succeed: {self.success:.1%}"
        rows = [f"{share}, with 95 % confidence {low:.1%} to {high:.1%}"]
        if self.distances.size:
            middle, most = _quantiles(self.distances * 1e3)
            turned, most_turned = _quantiles(np.degrees(self.angles))
            ended = counted(len(self.distances), "trial")
            rows.append(
                f"largest placing errors of a part, in the {ended} whose program came to its end: "
                f"median {middle:.3g} mm and {turned:.3g} deg, 95 % below {most:.3g} mm and {most_turned:.3g} deg"
            )
        if self.failures:
            number = self.failures[0].number
            rows.append(f"to repeat one alone, with all its files: --seed {self.seed} --trial {number} -o FOLDER")
        return tuple(rows)

    def histogram(self) -> tuple[Array, Array]:
        """Return the edges (21,) of bars of placing errors [m] and the number (20,) of trials in each."""
        counts, edges = np.histogram(
            self.distances, bins=_BARS, range=(0.0, max(self.distances.max(initial=0.0), 1e-6))
        )
        return edges, counts

    def as_data(self) -> dict[str, Any]:
        """Return the summary as plain data; lengths in mm and angles in degrees where the name says so."""
        edges, counts = self.histogram()
        durations = [it.duration for it in self.trials if math.isfinite(it.duration)]
        return {
            "program": self.program,
            "cell": self.cell,
            "seed": self.seed,
            "trials": len(self.trials),
            "successes": self.successes,
            "success": self.success,
            "interval": list(self.interval),
            "causes": {
                cause: {"count": len(numbers), "trials": list(numbers)} for cause, numbers in self.causes.items()
            },
            "failures": [
                {"trial": it.number, "seed": self.seed, "cause": it.cause, "message": it.message}
                for it in self.failures
            ],
            "errors_mm": _spread(self.distances * 1e3),
            "errors_deg": _spread(np.degrees(self.angles)),
            "histogram": {"edges_mm": (edges * 1e3).tolist(), "counts": counts.tolist()},
            "duration": _spread(np.array(durations)),
            "each": [
                {
                    "trial": it.number,
                    "cause": it.cause or None,
                    "ended": it.ended,
                    "error_mm": finite_or_none(it.distance * 1e3),
                    "error_deg": finite_or_none(math.degrees(it.angle)),
                    "duration_s": finite_or_none(it.duration),
                }
                for it in self.trials
            ],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the causes of failure, and the failures."""
        total = len(self.trials)
        yield ResultTable(
            title="Failures by cause",
            heads=("cause", "trials", "share", "numbers"),
            rows=[
                (cause, str(len(numbers)), f"{len(numbers) / total:.1%}", _listed(numbers))
                for cause, numbers in self.causes.items()
            ],
            numbers=(1, 2),
        )
        hidden = len(self.failures) - _MOST_FAILURES
        yield ResultTable(
            title="Failures",
            heads=("trial", "cause", "message"),
            rows=[(str(it.number), it.cause, it.message) for it in self.failures[:_MOST_FAILURES]],
            numbers=(0,),
            remark=f"{hidden} more are in trials.json" if hidden > 0 else "",
        )


def _quantiles(values: Array) -> tuple[float, float]:
    """Return the median, and what 95 % do not exceed."""
    middle, most = np.quantile(values, (0.5, 0.95)).tolist()
    return middle, most


def _spread(values: Array) -> dict[str, float | None]:
    if not values.size:
        return {"median": None, "p95": None, "largest": None}
    middle, most = _quantiles(values)
    return {"median": middle, "p95": most, "largest": float(values.max())}


def _listed(numbers: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, numbers[:_MOST_FAILURES]))
    return f"{shown}, ..." if len(numbers) > _MOST_FAILURES else shown
