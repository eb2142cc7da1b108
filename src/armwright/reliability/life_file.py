"""What is known of the reducers, bearings and plays of an arm's joints, from a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import attrs

from armwright.arm.model import Arm
from armwright.errors import InvalidValueError
from armwright.files.document import Document, Table
from armwright.reliability.reducer_life import BALLS, ROLLERS, Rating, joint_speed
from armwright.reliability.wear_update import RatePosterior, updated_rate

COMPONENTS = ("reducer", "bearing")
_EXPONENTS = {"balls": BALLS, "rollers": ROLLERS}
# Slope of the Weibull law of rolling bearings with balls in ISO 281, where a file states none; and what it may be.
SLOPE, _SLOPES = 10 / 9, (0.2, 20.0)
# Plays are written in millionths of a radian or of a metre.
_MICRO = 1e-6
_MAX_SPREAD, _MAX_PLAY, _MAX_MEASUREMENTS = 10.0, 1e6, 1000


@attrs.frozen(kw_only=True)
class PlayGrowth:
    """The play of a joint, and how fast it grows.

    Attributes:
        first: of the new joint [rad] or [m].
        per_cycle: median growth in a cycle of the motion; None where it is unknown, or goes with the work.
        per_work: median growth per work of friction, effort times way [rad/J] or [m/J]; None likewise.
        spread: standard deviation of the logarithm of the growth.
        measured: rows of cycles, play and its standard error, [rad] or [m].
    """

    first: float
    per_cycle: float | None = None
    per_work: float | None = None
    spread: float = 0.0
    measured: tuple[tuple[float, float, float], ...] = ()

    def rate(self, work: float) -> tuple[float, float] | None:
        """Return the median and the spread of the growth per cycle, with what was measured; None where it is unknown.

        Args:
            work: that the joint does in a cycle [J].
        """
        median = self.per_cycle if self.per_work is None else self.per_work * work
        if median is None:
            return None
        if not self.measured or not median or not self.spread:
            return median, self.spread
        posterior = self._posterior(median)
        return posterior.median, posterior.spread

    def _posterior(self, median: float) -> RatePosterior:
        cycles, plays, errors = zip(*self.measured, strict=True)
        return updated_rate(
            median=median, spread=self.spread, first=self.first, cycles=cycles, plays=plays, errors=errors
        )


@attrs.frozen(kw_only=True)
class LifeFile:
    """What a file states.

    Attributes:
        ratings: by the number of the joint, from 0, and the name of the component.
        plays: by the number of the joint, from 0.
        slope: of the Weibull law by which components fail.
    """

    ratings: Mapping[tuple[int, str], Rating]
    plays: Mapping[int, PlayGrowth]
    slope: float = SLOPE


def read_life_file(path: Path | str, arm: Arm) -> LifeFile:
    """Read a file of ratings and plays (docs/reliability.md).

    Args:
        path: a TOML file.
        arm: whose joints they belong to.

    Raises:
        FileFormatError: the file is missing or malformed, or a joint or a key is unknown.
        InvalidValueError: it states nothing of any joint.
    """
    root = Document.read(Path(path)).root
    joints = root.table("joint")
    ratings: dict[tuple[int, str], Rating] = {}
    plays: dict[int, PlayGrowth] = {}
    for i, joint in enumerate(arm.joints):
        own = joints.table(str(i + 1))
        for component in COMPONENTS:
            if component in own:
                ratings[i, component] = _rating(own.table(component), turning=joint.revolute)
        if "play" in own:
            plays[i] = _play(own.table("play"), "rad" if joint.revolute else "m")
        own.allow(*COMPONENTS, "play")
        own.refuse_unknown_keys()
    joints.refuse_unknown_keys()
    slope = root.number("weibull_slope", SLOPE, lower=_SLOPES[0], upper=_SLOPES[1])
    root.refuse_unknown_keys()
    if not ratings and not plays:
        raise InvalidValueError(f"{path}: expected a reducer, a bearing or a play, such as [joint.1.reducer]")
    return LifeFile(ratings=ratings, plays=plays, slope=slope)


def _rating(table: Table, *, turning: bool) -> Rating:
    effort, speed = ("Nm", "deg_per_s") if turning else ("N", "mm_per_s")
    average, peak = (
        table.positive(f"{name}_{effort}") if f"{name}_{effort}" in table else math.inf for name in ("average", "peak")
    )
    rating = Rating(
        effort=table.positive(f"rated_{effort}"),
        speed=_speed(table, speed, turning=turning),
        hours=table.positive("hours"),
        average=average,
        peak=peak,
        exponent=_EXPONENTS[table.choice("kind", _EXPONENTS, default="balls")],
        source=table.text("source", default=""),
    )
    table.allow(*(f"{name}_{effort}" for name in ("average", "peak")), "input_rpm", "ratio")
    table.refuse_unknown_keys()
    return rating


def _speed(table: Table, unit: str, *, turning: bool) -> float:
    """Read the rated speed of the joint, which reducers have by that of their input and their ratio."""
    if turning and "input_rpm" in table:
        return joint_speed(table.positive("input_rpm"), table.positive("ratio"))
    return table.positive(f"speed_{unit}") * (math.radians(1) if turning else 1e-3)


def _play(table: Table, unit: str) -> PlayGrowth:
    def value(name: str) -> float | None:
        key = f"{name}_u{unit}"
        known = key in table
        table.allow(key)
        return table.number(key, lower=0.0, upper=_MAX_PLAY) * _MICRO if known else None

    per_cycle = value("growth_per_cycle")
    per_work = value("growth_per_J")
    if per_cycle is not None and per_work is not None:
        raise table.error(f"growth_per_J_u{unit}", "expected the growth per cycle or per J, not both")
    measured = _measurements(table, f"measured_u{unit}") if f"measured_u{unit}" in table else ()
    table.allow(f"measured_u{unit}")
    spread = table.number("spread", 0.0, lower=0.0, upper=_MAX_SPREAD)
    if measured and (not spread or not (per_cycle or per_work)):
        text = "expected the growth and its spread beside it, as they are believed before the measurements"
        raise table.error(f"measured_u{unit}", text)
    result = PlayGrowth(
        first=value("first") or 0.0, per_cycle=per_cycle, per_work=per_work, spread=spread, measured=measured
    )
    table.refuse_unknown_keys()
    return result


def _measurements(table: Table, key: str) -> tuple[tuple[float, float, float], ...]:
    rows = table.vectors(key, 3)
    if len(rows) > _MAX_MEASUREMENTS:
        raise table.error(key, f"expected at most {_MAX_MEASUREMENTS} measurements, got {len(rows)}")
    for index, (cycles, play, error) in enumerate(rows):
        if cycles < 0 or play < 0 or not 0 < error <= _MAX_PLAY:
            raise table.error(key, "expected cycles and a play of 0 or more, and an error above 0", index)
    return tuple((float(cycles), float(play) * _MICRO, float(error) * _MICRO) for cycles, play, error in rows)
