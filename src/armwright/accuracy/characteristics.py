"""The numbers of ISO 9283, each with its symbol, its unit, its cycles and the limit it should keep."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import attrs
import numpy as np

from armwright.accuracy.compliance import StaticCompliance
from armwright.accuracy.corner import CornerDeviation
from armwright.accuracy.cycles import ASKED, DIRECTIONS, LOADS, ROBOTS, Kind
from armwright.accuracy.distance import DistanceAccuracy, DistanceRepeatability
from armwright.accuracy.measurement_file import AnyTest, PoseTest
from armwright.accuracy.path import PathDeviation, PathVelocity
from armwright.accuracy.pose import PoseAccuracy, PoseRepeatability
from armwright.accuracy.settling_time import PosingTime, Settling
from armwright.accuracy.variation import PoseDrift, Variation
from armwright.accuracy.weaving import WeavingDeviation
from armwright.arrays import Array

# Units for people: name, and how many of it are one in SI units.
_DISPLAYED = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180 / np.pi),
    "s": ("s", 1.0),
    "m/s": ("mm/s", 1e3),
    "m/N": ("mm/N", 1e3),
    "": ("%", 100.0),
}
Result: TypeAlias = (
    PoseAccuracy
    | PoseRepeatability
    | Variation
    | PoseDrift
    | DistanceAccuracy
    | DistanceRepeatability
    | Settling
    | PosingTime
    | PathDeviation
    | PathVelocity
    | CornerDeviation
    | StaticCompliance
    | WeavingDeviation
)
_AXES = "xyz"


@attrs.frozen(kw_only=True)
class Characteristic:
    """One number of ISO 9283.

    Attributes:
        symbol: such as ``RP`` or ``AP_x``.
        what: in words.
        value: in SI units, ratios as they are.
        unit: ``m``, ``rad``, ``s``, ``m/s``, ``m/N``, or empty for a ratio.
        either_way: whether it is to be read as plus or minus.
        test: name of the test.
        name: of the pose or path.
        condition: in free words; may be empty.
        cycles: of which it was made.
        asked: cycles that the standard asks for.
        note: anything worth a word, such as where.
        lacking: whether the test has fewer parts than the standard asks for: directions of approach, robots or loads.
        limit: what it should not exceed, without sign; None where there is none.
    """

    symbol: str
    what: str
    value: float
    unit: str
    either_way: bool = False
    test: Kind
    name: str
    condition: str
    cycles: int
    asked: int
    note: str = ""
    lacking: bool = False
    limit: float | None = None

    @property
    def few(self) -> bool:
        """Whether it was made of fewer cycles or parts than the standard asks for."""
        return self.lacking or self.cycles < self.asked

    @property
    def holds(self) -> bool | None:
        """Whether it keeps its limit; None where there is none."""
        return None if self.limit is None else bool(abs(self.value) <= self.limit)

    @property
    def verdict(self) -> str:
        """``holds`` or ``exceeds`` its limit; empty where there is none."""
        return {None: "", True: "holds", False: "exceeds"}[self.holds]

    @property
    def displayed_unit(self) -> str:
        """The unit for people: mm, deg, s, mm/s, mm/N or %."""
        return _DISPLAYED[self.unit][0]

    @property
    def scale(self) -> float:
        """How many of that unit are one in SI units."""
        return _DISPLAYED[self.unit][1]

    @property
    def displayed_value(self) -> str:
        """The value in that unit, plus or minus where it is one."""
        value = f"{self.value * self.scale:.4g}" if np.isfinite(self.value) else "never"
        return f"± {value}" if self.either_way else value

    @property
    def displayed_limit(self) -> str:
        """The limit in that unit; empty where there is none."""
        return "" if self.limit is None else f"{self.limit * self.scale:.4g}"

    @property
    def displayed_cycles(self) -> str:
        """The cycles, and, where those are too few, how many the standard asks for."""
        return f"{self.cycles} of {self.asked}" if self.few else str(self.cycles)


def characteristics_of(test: AnyTest, result: Result) -> Iterator[Characteristic]:
    """Give the numbers of a result of a test."""
    of = {"test": test.kind, "name": test.name, "condition": test.condition, "cycles": result.cycles}
    for fields in _TELL[type(result)](test, result):
        yield Characteristic(**{**of, "asked": ASKED[test.kind], **fields})


def _axes(symbol: str, what: str, values: Array, **more: Any) -> Iterator[dict[str, Any]]:
    for axis, value in zip(_AXES, values.tolist(), strict=False):
        yield {"symbol": f"{symbol}_{axis}", "what": f"{what} along {axis}", "value": value, "unit": "m", **more}


def _turns(test: AnyTest, symbol: str, what: str, values: Array, **more: Any) -> Iterator[dict[str, Any]]:
    for angle, value in zip(test.angle_names, values.tolist(), strict=True):
        yield {"symbol": f"{symbol}_{angle}", "what": f"{what} about {angle}", "value": value, "unit": "rad", **more}


def _pose_accuracy(test: AnyTest, one: PoseAccuracy) -> Iterator[dict[str, Any]]:
    yield {"symbol": "AP", "what": "pose accuracy", "value": one.position, "unit": "m"}
    yield from _axes("AP", "pose accuracy", one.components)
    yield from _turns(test, "AP", "pose accuracy", one.angles)


def _pose_repeatability(test: AnyTest, one: PoseRepeatability) -> Iterator[dict[str, Any]]:
    yield {"symbol": "RP", "what": "pose repeatability", "value": one.radius, "unit": "m"}
    yield from _turns(test, "RP", "pose repeatability", one.angles, either_way=True)


def _variation(test: AnyTest, one: Variation) -> Iterator[dict[str, Any]]:
    symbol, what, asked, parts = "vAP", "multi-directional variation", DIRECTIONS, "directions of approach"
    if test.kind == "exchangeability":
        symbol, what, asked, parts = "E", "exchangeability", ROBOTS, "robots"
    labels = [cloud.label for cloud in test.clouds] if isinstance(test, PoseTest) else []
    few = _lacking(len(one.barycentres), asked, parts)
    note = f"between {' and '.join(labels[i] for i in one.pair)}{few}"
    yield {"symbol": symbol, "what": what, "value": one.position, "unit": "m", "note": note, "lacking": bool(few)}
    yield from _turns(test, symbol, what, one.angles, lacking=bool(few))


def _lacking(count: int, asked: int, parts: str) -> str:
    """Say how many parts of a test there are, if they are too few."""
    return f", {count} of {asked} {parts}" if count < asked else ""


def _drift(test: AnyTest, one: PoseDrift) -> Iterator[dict[str, Any]]:
    note = f"over {(one.times[-1] - one.times[0]) / 3600:.3g} h, {len(one.times)} measurements"
    yield {"symbol": "dAP", "what": "drift of pose accuracy", "value": one.accuracy_change, "unit": "m", "note": note}
    yield {"symbol": "dRP", "what": "drift of pose repeatability", "value": one.repeatability_change, "unit": "m"}
    yield from _turns(test, "dAP", "drift of pose accuracy", one.accuracy_change_angles)
    yield from _turns(test, "dRP", "drift of pose repeatability", one.repeatability_change_angles)


def _distance_accuracy(test: AnyTest, one: DistanceAccuracy) -> Iterator[dict[str, Any]]:
    note = f"of {one.commanded * 1e3:.6g} mm"
    yield {"symbol": "AD", "what": "distance accuracy", "value": one.distance, "unit": "m", "note": note}
    yield from _axes("AD", "distance accuracy", one.components)
    yield from _turns(test, "AD", "distance accuracy", one.angles)


def _distance_repeatability(test: AnyTest, one: DistanceRepeatability) -> Iterator[dict[str, Any]]:
    what = "distance repeatability"
    yield {"symbol": "RD", "what": what, "value": one.distance, "unit": "m", "either_way": True}
    yield from _axes("RD", what, one.components, either_way=True)
    yield from _turns(test, "RD", what, one.angles, either_way=True)


def _settling(_test: AnyTest, one: Settling) -> Iterator[dict[str, Any]]:
    note = f"within {one.band * 1e3:.4g} mm"
    yield {"symbol": "t", "what": "stabilisation time", "value": one.time, "unit": "s", "note": note}
    yield {"symbol": "OV", "what": "pose overshoot", "value": one.overshoot, "unit": "m", "note": note}


def _posing(_test: AnyTest, one: PosingTime) -> Iterator[dict[str, Any]]:
    note = f"over {one.distance * 1e3:.4g} mm, within {one.band * 1e3:.4g} mm"
    yield {"symbol": "TP", "what": "minimum posing time", "value": one.time, "unit": "s", "note": note}


def _path(test: AnyTest, one: PathDeviation) -> Iterator[dict[str, Any]]:
    for symbol, what, value, at, angles in (
        ("AT", "path accuracy", one.accuracy, one.accuracy_at, one.accuracy_angles),
        ("RT", "path repeatability", one.repeatability, one.repeatability_at, one.repeatability_angles),
    ):
        note = f"at {at * 1e3:.4g} mm along"
        yield {"symbol": symbol, "what": what, "value": value, "unit": "m", "note": note}
        yield from _turns(test, symbol, what, angles, either_way=symbol == "RT")


def _velocity(_test: AnyTest, one: PathVelocity) -> Iterator[dict[str, Any]]:
    yield {"symbol": "AV", "what": "path velocity accuracy", "value": one.accuracy, "unit": ""}
    what = "path velocity repeatability"
    yield {"symbol": "RV", "what": what, "value": one.repeatability, "unit": "", "either_way": True}
    yield {"symbol": "FV", "what": "path velocity fluctuation", "value": one.fluctuation, "unit": "m/s"}


def _corner(_test: AnyTest, one: CornerDeviation) -> Iterator[dict[str, Any]]:
    note = f"at ({', '.join(f'{x * 1e3:.4g}' for x in one.place)}) mm"
    yield {"symbol": "CR", "what": "cornering round-off", "value": one.round_off, "unit": "m", "note": note}
    yield {"symbol": "CO", "what": "cornering overshoot", "value": one.overshoot, "unit": "m", "note": note}
    if one.settling_length is not None:
        what = "stabilisation path length"
        yield {"symbol": "SPL", "what": what, "value": one.settling_length, "unit": "m", "note": note}


def _weaving(_test: AnyTest, one: WeavingDeviation) -> Iterator[dict[str, Any]]:
    note = f"of {one.commanded_stroke * 1e3:.4g} mm"
    yield {"symbol": "WS", "what": "weaving stroke error", "value": one.stroke, "unit": "", "note": note}
    note = f"of {one.commanded_frequency:.4g} Hz"
    yield {"symbol": "WF", "what": "weaving frequency error", "value": one.frequency, "unit": "", "note": note}


def _compliance(_test: AnyTest, one: StaticCompliance) -> Iterator[dict[str, Any]]:
    axis = int(np.argmax(np.abs(one.direction)))
    few = _lacking(len(one.loads), LOADS, "loads")
    note = f"force along {'-' if one.direction[axis] < 0 else '+'}{_AXES[axis]}, up to {one.loads[-1]:.4g} N{few}"
    more = {"unit": "m/N", "note": note, "lacking": bool(few)}
    what = "static compliance"
    yield {"symbol": "C", "what": f"{what} along the force", "value": one.along, **more}
    yield from _axes("C", what, one.components, **more)


_TELL: dict[type, Callable[[AnyTest, Any], Iterator[dict[str, Any]]]] = {
    PoseAccuracy: _pose_accuracy,
    PoseRepeatability: _pose_repeatability,
    Variation: _variation,
    PoseDrift: _drift,
    DistanceAccuracy: _distance_accuracy,
    DistanceRepeatability: _distance_repeatability,
    Settling: _settling,
    PosingTime: _posing,
    PathDeviation: _path,
    PathVelocity: _velocity,
    CornerDeviation: _corner,
    WeavingDeviation: _weaving,
    StaticCompliance: _compliance,
}
