"""The numbers of ISO 9283, each with its symbol, its unit, its cycles and the limit it should keep."""

from collections.abc import Callable, Iterator
from typing import Any, Protocol

import attrs
import numpy as np

from armwright.accuracy.compliance import StaticCompliance
from armwright.accuracy.corner import CornerDeviation
from armwright.accuracy.cycles import DIRECTIONS, LOADS, REQUIRED_CYCLES, ROBOTS, Kind
from armwright.accuracy.distance import DistanceAccuracy, DistanceRepeatability
from armwright.accuracy.measurement_file import AnyTest, PoseTest
from armwright.accuracy.path import PathDeviation, PathVelocity
from armwright.accuracy.pose import PoseAccuracy, PoseRepeatability
from armwright.accuracy.settling_time import PosingTime, Settling
from armwright.accuracy.variation import PoseDrift, Variation
from armwright.accuracy.weaving import WeavingDeviation
from armwright.arrays import Array

# Units for people: name, and how many of it are one in SI units.
_DISPLAY_UNITS = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180 / np.pi),
    "s": ("s", 1.0),
    "m/s": ("mm/s", 1e3),
    "m/N": ("mm/N", 1e3),
    "": ("%", 100.0),
}
_AXES = "xyz"


class Result(Protocol):
    """What a function of this folder returns for a test."""

    @property
    def cycles(self) -> int:
        """The smallest number of cycles that it was made of."""


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
        required: cycles that the standard asks for.
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
    required: int
    note: str = ""
    lacking: bool = False
    limit: float | None = None

    @property
    def few(self) -> bool:
        """Whether it was made of fewer cycles or parts than the standard asks for."""
        return self.lacking or self.cycles < self.required

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
        return _DISPLAY_UNITS[self.unit][0]

    @property
    def scale(self) -> float:
        """How many of that unit are one in SI units."""
        return _DISPLAY_UNITS[self.unit][1]

    @property
    def displayed_value(self) -> str:
        """The value in that unit with four digits, plus or minus where it is one."""
        return self._signed(f"{self.value * self.scale:.4g}")

    def rounded(self, decimals: int) -> str:
        """Return the value in that unit with so many decimals, plus or minus where it is one."""
        return self._signed(f"{self.value * self.scale:z.{decimals}f}")

    def _signed(self, text: str) -> str:
        value = text if np.isfinite(self.value) else "never"
        return f"± {value}" if self.either_way else value

    @property
    def displayed_limit(self) -> str:
        """The limit in that unit; empty where there is none."""
        return "" if self.limit is None else f"{self.limit * self.scale:.4g}"

    @property
    def displayed_cycles(self) -> str:
        """The cycles, and, where those are too few, how many the standard asks for."""
        return f"{self.cycles} of {self.required}" if self.few else str(self.cycles)


def characteristics_of(test: AnyTest, result: Result) -> Iterator[Characteristic]:
    """Give the numbers of a result of a test."""
    common = {"test": test.kind, "name": test.name, "condition": test.condition, "cycles": result.cycles}
    for fields in _FIELDS_OF[type(result)](test, result):
        yield Characteristic(**{**common, "required": REQUIRED_CYCLES[test.kind], **fields})


def _axis_fields(symbol: str, what: str, values: Array, **more: Any) -> Iterator[dict[str, Any]]:
    for axis, value in zip(_AXES, values.tolist(), strict=False):
        yield {"symbol": f"{symbol}_{axis}", "what": f"{what} along {axis}", "value": value, "unit": "m", **more}


def _angle_fields(test: AnyTest, symbol: str, what: str, values: Array, **more: Any) -> Iterator[dict[str, Any]]:
    for angle, value in zip(test.angle_names, values.tolist(), strict=True):
        yield {"symbol": f"{symbol}_{angle}", "what": f"{what} about {angle}", "value": value, "unit": "rad", **more}


def _pose_accuracy_fields(test: PoseTest, result: PoseAccuracy) -> Iterator[dict[str, Any]]:
    yield {"symbol": "AP", "what": "pose accuracy", "value": result.position, "unit": "m"}
    yield from _axis_fields("AP", "pose accuracy", result.components)
    yield from _angle_fields(test, "AP", "pose accuracy", result.angles)


def _pose_repeatability_fields(test: PoseTest, result: PoseRepeatability) -> Iterator[dict[str, Any]]:
    yield {"symbol": "RP", "what": "pose repeatability", "value": result.radius, "unit": "m"}
    yield from _angle_fields(test, "RP", "pose repeatability", result.angles, either_way=True)


def _variation_fields(test: PoseTest, result: Variation) -> Iterator[dict[str, Any]]:
    symbol, what, required, parts = "vAP", "multi-directional variation", DIRECTIONS, "directions of approach"
    if test.kind == "exchangeability":
        symbol, what, required, parts = "E", "exchangeability", ROBOTS, "robots"
    few = _shortage_note(len(result.barycentres), required, parts)
    note = f"between {' and '.join(test.clouds[i].label for i in result.pair)}{few}"
    yield {"symbol": symbol, "what": what, "value": result.position, "unit": "m", "note": note, "lacking": bool(few)}
    yield from _angle_fields(test, symbol, what, result.angles, lacking=bool(few))


def _shortage_note(count: int, required: int, parts: str) -> str:
    """Say how many parts of a test there are, if they are too few."""
    return f", {count} of {required} {parts}" if count < required else ""


def _drift_fields(test: AnyTest, result: PoseDrift) -> Iterator[dict[str, Any]]:
    note = f"over {(result.times[-1] - result.times[0]) / 3600:.3g} h, {len(result.times)} measurements"
    what = "drift of pose accuracy"
    yield {"symbol": "dAP", "what": what, "value": result.accuracy_change, "unit": "m", "note": note}
    yield {"symbol": "dRP", "what": "drift of pose repeatability", "value": result.repeatability_change, "unit": "m"}
    yield from _angle_fields(test, "dAP", what, result.accuracy_change_angles)
    yield from _angle_fields(test, "dRP", "drift of pose repeatability", result.repeatability_change_angles)


def _distance_accuracy_fields(test: AnyTest, result: DistanceAccuracy) -> Iterator[dict[str, Any]]:
    note = f"of {result.commanded * 1e3:.6g} mm"
    yield {"symbol": "AD", "what": "distance accuracy", "value": result.distance, "unit": "m", "note": note}
    yield from _axis_fields("AD", "distance accuracy", result.components)
    yield from _angle_fields(test, "AD", "distance accuracy", result.angles)


def _distance_repeatability_fields(test: AnyTest, result: DistanceRepeatability) -> Iterator[dict[str, Any]]:
    what = "distance repeatability"
    yield {"symbol": "RD", "what": what, "value": result.distance, "unit": "m", "either_way": True}
    yield from _axis_fields("RD", what, result.components, either_way=True)
    yield from _angle_fields(test, "RD", what, result.angles, either_way=True)


def _settling_fields(_test: AnyTest, result: Settling) -> Iterator[dict[str, Any]]:
    note = f"within {result.band * 1e3:.4g} mm"
    yield {"symbol": "t", "what": "stabilisation time", "value": result.time, "unit": "s", "note": note}
    yield {"symbol": "OV", "what": "pose overshoot", "value": result.overshoot, "unit": "m", "note": note}


def _posing_fields(_test: AnyTest, result: PosingTime) -> Iterator[dict[str, Any]]:
    note = f"over {result.distance * 1e3:.4g} mm, within {result.band * 1e3:.4g} mm"
    yield {"symbol": "TP", "what": "minimum posing time", "value": result.time, "unit": "s", "note": note}


def _path_fields(test: AnyTest, result: PathDeviation) -> Iterator[dict[str, Any]]:
    for symbol, what, value, station, angles in (
        ("AT", "path accuracy", result.accuracy, result.accuracy_at, result.accuracy_angles),
        ("RT", "path repeatability", result.repeatability, result.repeatability_at, result.repeatability_angles),
    ):
        note = f"at {station * 1e3:.4g} mm along"
        yield {"symbol": symbol, "what": what, "value": value, "unit": "m", "note": note}
        yield from _angle_fields(test, symbol, what, angles, either_way=symbol == "RT")


def _velocity_fields(_test: AnyTest, result: PathVelocity) -> Iterator[dict[str, Any]]:
    yield {"symbol": "AV", "what": "path velocity accuracy", "value": result.accuracy, "unit": ""}
    what = "path velocity repeatability"
    yield {"symbol": "RV", "what": what, "value": result.repeatability, "unit": "", "either_way": True}
    yield {"symbol": "FV", "what": "path velocity fluctuation", "value": result.fluctuation, "unit": "m/s"}


def _corner_fields(_test: AnyTest, result: CornerDeviation) -> Iterator[dict[str, Any]]:
    note = f"at ({', '.join(f'{x * 1e3:.4g}' for x in result.position)}) mm"
    yield {"symbol": "CR", "what": "cornering round-off", "value": result.round_off, "unit": "m", "note": note}
    yield {"symbol": "CO", "what": "cornering overshoot", "value": result.overshoot, "unit": "m", "note": note}
    if result.settling_length is not None:
        what = "stabilisation path length"
        yield {"symbol": "SPL", "what": what, "value": result.settling_length, "unit": "m", "note": note}


def _weaving_fields(_test: AnyTest, result: WeavingDeviation) -> Iterator[dict[str, Any]]:
    note = f"of {result.commanded_stroke * 1e3:.4g} mm"
    yield {"symbol": "WS", "what": "weaving stroke error", "value": result.stroke, "unit": "", "note": note}
    note = f"of {result.commanded_frequency:.4g} Hz"
    yield {"symbol": "WF", "what": "weaving frequency error", "value": result.frequency, "unit": "", "note": note}


def _compliance_fields(_test: AnyTest, result: StaticCompliance) -> Iterator[dict[str, Any]]:
    axis = int(np.argmax(np.abs(result.direction)))
    few = _shortage_note(len(result.loads), LOADS, "loads")
    note = f"force along {'-' if result.direction[axis] < 0 else '+'}{_AXES[axis]}, up to {result.loads[-1]:.4g} N{few}"
    more = {"unit": "m/N", "note": note, "lacking": bool(few)}
    what = "static compliance"
    yield {"symbol": "C", "what": f"{what} along the force", "value": result.along, **more}
    yield from _axis_fields("C", what, result.components, **more)


_FIELDS_OF: dict[type, Callable[[Any, Any], Iterator[dict[str, Any]]]] = {
    PoseAccuracy: _pose_accuracy_fields,
    PoseRepeatability: _pose_repeatability_fields,
    Variation: _variation_fields,
    PoseDrift: _drift_fields,
    DistanceAccuracy: _distance_accuracy_fields,
    DistanceRepeatability: _distance_repeatability_fields,
    Settling: _settling_fields,
    PosingTime: _posing_fields,
    PathDeviation: _path_fields,
    PathVelocity: _velocity_fields,
    CornerDeviation: _corner_fields,
    WeavingDeviation: _weaving_fields,
    StaticCompliance: _compliance_fields,
}
