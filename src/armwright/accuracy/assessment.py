"""Every measure that a set of tests allows."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any

import attrs
import numpy as np

from armwright.accuracy.characteristics import Characteristic, Result, characteristics_of
from armwright.accuracy.compliance import StaticCompliance, static_compliance
from armwright.accuracy.corner import corner_deviations
from armwright.accuracy.distance import distance_accuracy, distance_repeatability
from armwright.accuracy.measurement_file import AnyTest, Cloud, PathTest, PoseTest
from armwright.accuracy.path import path_deviation, path_velocity
from armwright.accuracy.pose import pose_accuracy, pose_repeatability
from armwright.accuracy.settling_time import posing_time, settling
from armwright.accuracy.variation import exchangeability, multidirectional_variation, pose_drift
from armwright.accuracy.weaving import weaving_deviation
from armwright.arrays import Array
from armwright.errors import InvalidValueError, listed, one_of
from armwright.files.result_table import ResultTable

_AXES = "xyz"
# What the standard asks a report to say beside the numbers, by the words of ``--about``.
CONDITIONS = {
    "robot": "Robot, serial number",
    "load": "Load",
    "speed": "Speed",
    "temperature": "Ambient temperature",
    "instrument": "Measuring instrument",
    "operator": "Operator",
    "date": "Date of the measurement",
}
# Decimals of readings in mm and degrees that are told apart; and the difference of equal numbers at most.
_MAX_DECIMALS, _EQUAL = 3, 1e-6
# How many tests a note names.
_MAX_NAMED_TESTS = 4


@attrs.frozen(kw_only=True, eq=False)
class Assessment:
    """What a set of tests says of a robot.

    Attributes:
        measures: in the order of the tests.
        results: for each test, in their order, what its functions returned.
        tests: as they were read.
        about: what was said of the conditions of the tests, by the words of ``CONDITIONS``.
    """

    measures: tuple[Characteristic, ...]
    results: tuple[tuple[Result, ...], ...]
    tests: tuple[AnyTest, ...]
    about: Mapping[str, str] = attrs.field(factory=dict)

    @property
    def planar(self) -> bool:
        """Whether any test was measured in a plane only, without z."""
        return any(test.size == 2 for test in self.tests)

    @property
    def few(self) -> bool:
        """Whether any measure was made of fewer cycles than the standard asks for."""
        return any(measure.few for measure in self.measures)

    @property
    def exceeded(self) -> tuple[Characteristic, ...]:
        """The measures that do not keep their limits."""
        return tuple(measure for measure in self.measures if measure.holds is False)

    @property
    def decimals(self) -> list[int]:
        """The decimals of each measure in its unit, one for all of a unit.

        Lengths and angles have one decimal more than the readings that they were made of, other units of a test as many
        as give the largest of them four digits.
        """
        readings = _reading_decimals(self.tests)
        largest: dict[tuple[str, ...], float] = {}
        groups = [(one.test, one.name, one.condition, one.unit) for one in self.measures]
        for group, one in zip(groups, self.measures, strict=True):
            if math.isfinite(one.value):
                largest[group] = max(largest.get(group, 0.0), abs(one.value) * one.scale)
        return [
            readings[one.unit] + 1 if one.unit in readings else _four_digits(largest.get(group, 0.0))
            for group, one in zip(groups, self.measures, strict=True)
        ]

    @property
    def notes(self) -> list[str]:
        """What a reader must know beside the numbers."""
        names = [f"{test.kind} {test.name}" for test in self.tests if test.size == 2]
        which = "all tests" if len(names) == len(self.tests) else listed(names, _MAX_NAMED_TESTS)
        exceeded = ", ".join(sorted({measure.symbol for measure in self.exceeded}))
        notes = {
            f"planar reduction: {which} measured in a plane, without z; distances are computed in that plane": names,
            "fewer cycles than ISO 9283 requires, where n or the note says so: such a measure is an estimate": self.few,
            f"limit exceeded: {exceeded}": exceeded,
        }
        return [note for note, applies in notes.items() if applies]

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units; what is infinite is none."""
        measures = [
            {
                **attrs.asdict(measure),
                "value": measure.value if math.isfinite(measure.value) else None,
                "few": measure.few,
                "holds": measure.holds,
            }
            for measure in self.measures
        ]
        about = {"about": dict(self.about)} if self.about else {}
        return {"standard": "ISO 9283:1998", **about, "planar": self.planar, "notes": self.notes, "measures": measures}

    def tables(self) -> Iterator[ResultTable]:
        """Give a table for each test, with a row for each measure; limits where any of the test is stated."""
        texts = iter([one.rounded(decimals) for one, decimals in zip(self.measures, self.decimals, strict=True)])
        for (test, name, condition), group in groupby(self.measures, attrgetter("test", "name", "condition")):
            measures = list(group)
            bounded = any(measure.limit is not None for measure in measures)
            yield ResultTable(
                title=f"{test} {name}{f', {condition}' if condition else ''}",
                heads=("symbol", "measure", "value", "unit", "n", *(["limit"] if bounded else []), "note"),
                rows=[
                    (
                        measure.symbol,
                        # The components of a measure need no words: AP_x below AP.
                        "" if "_" in measure.symbol else measure.what,
                        next(texts),
                        measure.displayed_unit,
                        measure.displayed_cycles,
                        *([measure.displayed_limit] if bounded else []),
                        " ".join(filter(None, (measure.verdict, measure.note))),
                    )
                    for measure in measures
                ],
                numbers=(2, 4, 5) if bounded else (2, 4),
                marks=tuple({"exceeds": "over"}.get(measure.verdict, measure.verdict) for measure in measures),
            )

    def with_limits(self, limits: Mapping[str, float]) -> "Assessment":
        """Return the same with limits that measures should keep.

        Args:
            limits: by symbol, in SI units, without sign.

        Raises:
            UnknownNameError: nothing has been measured of a symbol.
        """
        for symbol in limits:
            one_of("measure", symbol, {measure.symbol for measure in self.measures})
        bounded = (attrs.evolve(measure, limit=limits.get(measure.symbol, measure.limit)) for measure in self.measures)
        return attrs.evolve(self, measures=tuple(bounded))


def assess(
    tests: Sequence[AnyTest], *, few: bool = False, band: float | None = None, corners: float = 0.0
) -> Assessment:
    """Return every measure that tests allow.

    Args:
        tests: as ``read_measurements`` returns them.
        few: take fewer cycles than the standard asks for.
        band: radius within which a pose counts as reached, and a leg after a corner as followed [m]; where it is None,
            RP of the test ``pose`` of that name is taken for a pose, and a leg gets no length of stabilisation.
        corners: how near to a corner AT and RT are not taken [m].

    Raises:
        ArmwrightError: a test lacks something, or has too few cycles; the text says which.
    """
    measures: list[Characteristic] = []
    results: list[tuple[Result, ...]] = []
    for test in tests:
        try:
            test_results = _test_results(test, tests, few=few, band=band, corners=corners)
        except InvalidValueError as error:
            raise type(error)(f"{_test_title(test)}: {str(error).removeprefix(f'{test.kind}: ')}") from error
        results.append(test_results)
        for result in test_results:
            measures.extend(characteristics_of(test, result))
    return Assessment(measures=tuple(measures), results=tuple(results), tests=tuple(tests))


def _reading_decimals(tests: Sequence[AnyTest]) -> dict[str, int]:
    """Return the decimals of the readings by unit: of positions in mm, of angles in degrees."""
    decimals = {"m": 0, "rad": 0}
    for test in tests:
        for part in test.clouds if isinstance(test, PoseTest) else test.runs:
            for unit, values in (
                ("m", part.positions * 1e3),
                ("rad", np.degrees(() if part.angles is None else part.angles)),
            ):
                fits = (d for d in range(_MAX_DECIMALS) if np.allclose(values, values.round(d), rtol=0, atol=_EQUAL))
                decimals[unit] = max(decimals[unit], next(fits, _MAX_DECIMALS))
    return decimals


def _four_digits(largest: float) -> int:
    return max(0, 3 - math.floor(math.log10(largest))) if largest > 0 else 0


def _test_title(test: AnyTest) -> str:
    return f"{test.kind} {test.name}{f' ({test.condition})' if test.condition else ''}"


def _test_results(
    test: AnyTest, tests: Sequence[AnyTest], *, few: bool, band: float | None, corners: float
) -> tuple[Result, ...]:
    if isinstance(test, PoseTest):
        return _pose_results(test, few=few)
    if test.kind in {"settling", "posing"}:
        radius = _repeatability_band(test, tests) if band is None else band
        return ((settling if test.kind == "settling" else posing_time)(test.runs, radius, few=few),)
    path, runs, speed = test.commanded, test.runs, test.speed
    assert path is not None  # noqa: S101 - no test of the others is read without
    if test.kind == "cornering":
        return corner_deviations(path, runs, band=band, few=few)
    if test.kind == "weaving":
        assert speed is not None  # noqa: S101 - nor is one of weaving read without a speed
        return (weaving_deviation(path, runs, speed, few=few),)
    deviations = (
        () if test.kind == "velocity" else (path_deviation(path, runs, corners=corners, kind=test.kind, few=few),)
    )
    return deviations if speed is None else (*deviations, path_velocity(path, runs, speed, few=few))


def _pose_results(test: PoseTest, *, few: bool) -> tuple[Result, ...]:
    # Drift is over time; the clouds of other tests have none, and stay in the order of the file.
    clouds = sorted(test.clouds, key=lambda cloud: cloud.t or 0.0)
    positions, angles = [cloud.positions for cloud in clouds], [cloud.angles for cloud in clouds]
    first = test.clouds[0]
    goal = first.commanded_angles
    if test.kind == "pose":
        return (
            pose_accuracy(positions[0], _commanded(first), angles=angles[0], commanded_angles=goal, few=few),
            pose_repeatability(positions[0], angles=angles[0], few=few),
        )
    if test.kind == "distance":
        both, goals = (angles[0], angles[1]), (goal, clouds[1].commanded_angles)
        return (
            distance_accuracy(*positions, *map(_commanded, clouds), angles=both, commanded_angles=goals, few=few),
            distance_repeatability(*positions, angles=both, few=few),
        )
    if test.kind == "drift":
        times = [cloud.t or 0.0 for cloud in clouds]
        drift = pose_drift(times, positions, _commanded(first), angles=angles, commanded_angles=goal, few=few)
        return (drift,)
    if test.kind == "compliance":
        return tuple(_compliance(cloud, test.size, few=few) for cloud in clouds)
    variation = multidirectional_variation if test.kind == "multidirectional" else exchangeability
    return (variation(positions, angles=angles, few=few),)


def _compliance(cloud: Cloud, size: int, *, few: bool) -> StaticCompliance:
    axis = cloud.label.lstrip("+-").lower()
    if len(axis) != 1 or axis not in _AXES[:size]:
        directions = ", ".join(f"+{axis}, -{axis}" for axis in _AXES[:size])
        raise InvalidValueError(f"no direction '{cloud.label}' of a force; expected one of {directions}")
    direction = np.eye(size)[_AXES.index(axis)] * (-1 if cloud.label.startswith("-") else 1)
    assert cloud.loads is not None  # noqa: S101 - no test of compliance is read without
    return static_compliance(cloud.loads, cloud.positions, direction, few=few)


def _commanded(cloud: Cloud) -> Array:
    assert cloud.commanded is not None  # noqa: S101 - no such test is read without
    return cloud.commanded


def _repeatability_band(test: PathTest, tests: Sequence[AnyTest]) -> float:
    """Return RP of the pose at which a robot settles."""
    pose_tests = [t for t in tests if isinstance(t, PoseTest) and t.kind == "pose" and t.name == test.name]
    pose_tests = [t for t in pose_tests if t.condition == test.condition] or pose_tests
    if not pose_tests:
        raise InvalidValueError(f"no band is specified, and pose {test.name} has no test whose RP could be the band")
    # The cycles of that test are counted where it is assessed itself.
    return pose_repeatability(pose_tests[0].clouds[0].positions, few=True).radius
