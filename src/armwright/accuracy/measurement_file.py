"""Tests out of tables: rows that belong together, what was commanded beside what was attained."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import attrs
import numpy as np

from armwright.accuracy.cycles import Kind
from armwright.accuracy.scales import angles_question, lengths_question
from armwright.accuracy.table import Row, read_tables
from armwright.accuracy.trace import Trace
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.files.limits import beyond, limit

# Tests of which every row is one attained pose; of the others a cycle is a run of many rows.
POSES: frozenset[Kind] = frozenset({"pose", "multidirectional", "distance", "drift", "exchangeability", "compliance"})
# What a test cannot be without.
_COMMANDED: frozenset[Kind] = frozenset(
    {"pose", "distance", "drift", "path", "reorientation", "cornering", "velocity", "weaving"}
)
# What tells the parts of a test apart, where it is not the name of the pose.
_LABELS: Mapping[Kind, str] = {"multidirectional": "direction", "compliance": "direction", "exchangeability": "robot"}
_TIMED: frozenset[Kind] = frozenset({"settling", "posing", "velocity", "weaving"})


@attrs.frozen(kw_only=True, eq=False)
class Cloud:
    """Attained poses of one part of a test.

    Attributes:
        label: direction, robot, or name of the pose; may be empty.
        t: when they were measured [s]; None where it does not matter.
        cycles: (n) numbers of the cycles.
        places: (n, 2) or (n, 3) [m].
        angles: (n, k) [rad].
        loads: (n,) [N]; None where it does not matter.
        commanded: (2,) or (3,) [m]; None where nothing was.
        commanded_angles: (k,) [rad]; None where nothing was.
    """

    label: str
    t: float | None
    cycles: tuple[int, ...]
    places: Array
    angles: Array
    loads: Array | None
    commanded: Array | None
    commanded_angles: Array | None


@attrs.frozen(kw_only=True, eq=False)
class PoseTest:
    """A test of single poses.

    Attributes:
        kind: name of the test.
        name: of the pose; of both poses for a distance.
        condition: in free words; may be empty.
        clouds: its parts, in order of the file.
        angle_names: about which of a, b, c its angles turn.
    """

    kind: Kind
    name: str
    condition: str
    clouds: tuple[Cloud, ...]
    angle_names: tuple[str, ...]

    @property
    def size(self) -> int:
        """2 in a plane, 3 in space."""
        return int(self.clouds[0].places.shape[1])


@attrs.frozen(kw_only=True, eq=False)
class PathTest:
    """A test of runs, sample by sample.

    Attributes:
        kind: name of the test.
        name: of the path or pose.
        condition: in free words; may be empty.
        commanded: the commanded path; None where none is needed.
        runs: one per cycle.
        speed: commanded [m/s]; None where none is told.
        angle_names: about which of a, b, c its angles turn.
    """

    kind: Kind
    name: str
    condition: str
    commanded: Trace | None
    runs: tuple[Trace, ...]
    speed: float | None
    angle_names: tuple[str, ...]

    @property
    def size(self) -> int:
        """2 in a plane, 3 in space."""
        return self.runs[0].size


AnyTest: TypeAlias = PoseTest | PathTest


def read_measurements(
    paths: Path | str | Sequence[Path | str],
    *,
    columns: Mapping[str, str] | None = None,
    skip_incomplete: bool = False,
) -> tuple[AnyTest, ...]:
    """Read the tests of one file or of several that belong together.

    Args:
        paths: CSV files, in the format of docs/iso9283.md; each has its own units.
        columns: names of columns, with unit, by those in the files: ``{"X": "x_mm"}``.
        skip_incomplete: leave out rows with cells that should not be empty; an ``IncompleteRowsWarning`` says how many.

    Returns:
        The tests, in the order in which they begin.

    Raises:
        FileFormatError: a file is missing, broken, or says what cannot be; the text has file, line and column.
        InvalidValueError: there are no files.
    """
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    if not files:
        raise InvalidValueError("measurements: expected one file at least, got none")
    groups: dict[tuple[str, ...], list[Row]] = {}
    for table in read_tables(files, columns=columns, skip_incomplete=skip_incomplete):
        for row in table.rows():
            # A distance takes two poses.
            name = "" if row.test == "distance" else row.name
            groups.setdefault((row.test, name, row.condition), []).append(row)
    _refuse_many(groups)
    return tuple(_pose_test(rows) if rows[0].test in POSES else _path_test(rows) for rows in groups.values())


def _refuse_many(groups: Mapping[tuple[str, ...], Sequence[Row]]) -> None:
    """Refuse more tests, and poses, instants and runs in them, than a laboratory measures: each is an object.

    Raises:
        FileFormatError: there are more.
    """
    parts: set[tuple[Any, ...]] = set()
    most = limit("entries")
    for group, rows in groups.items():
        for one in rows:
            parts.add((group, _part(one) if one.test in POSES else one.cycle))
            if len(parts) > most:
                raise one.error("test", f"too many tests, and poses and runs in them: {beyond('entries')}")


def _pose_test(rows: list[Row]) -> PoseTest:
    _one_layout(rows)
    first = rows[0]
    commanded: dict[str, Row] = {}
    for one in (one for one in rows if one.cycle is None):
        if one.name in commanded:
            raise one.error("cycle", f"commanded is given twice, first in line {commanded[one.name].line}")
        commanded[one.name] = one
    clouds: dict[tuple[str, float | None], list[Row]] = {}
    for one in (one for one in rows if one.cycle is not None):
        _refuse_incomplete(one)
        clouds.setdefault(_part(one), []).append(one)
    for cloud in clouds.values():
        _refuse_twins(cloud)
    if not clouds:
        raise rows[0].error("cycle", "there is what was commanded, but nothing that was attained")
    found = tuple(_cloud(part, commanded) for part in clouds.values())
    names = list(dict.fromkeys(one.name for one in rows))
    if first.test == "distance":
        found = _paired(rows, found, names)
    return PoseTest(
        kind=first.test,
        name=" to ".join(names),
        condition=first.condition,
        clouds=found,
        angle_names=first.angle_names,
    )


def _part(one: Row) -> tuple[str, float | None]:
    """Return to which part of its test a row belongs: a direction, a robot or a pose, and for drift when."""
    return getattr(one, _LABELS.get(one.test, "name")), one.t if one.test == "drift" else None


def _refuse_incomplete(one: Row) -> None:
    needed = _LABELS.get(one.test)
    if needed and not getattr(one, needed):
        raise one.error(needed, f"a test of {one.test} tells the {needed} of every row")
    if one.test == "drift" and one.t is None:
        raise one.error("t_min", "a test of drift tells when every row was measured: t_s, t_min or t_h")
    if one.test == "compliance" and one.load is None:
        raise one.error("load_n", "a test of compliance tells the load of every row")


def _refuse_twins(rows: Sequence[Row]) -> None:
    """Refuse two rows of one part of a test that have the same cycle and load."""
    cycles = np.fromiter((one.cycle or 0 for one in rows), dtype=np.int64, count=len(rows))
    loads = np.fromiter((-np.inf if one.load is None else one.load for one in rows), np.float64, count=len(rows))
    order = np.lexsort((loads, cycles))
    same = (cycles[order][1:] == cycles[order][:-1]) & (loads[order][1:] == loads[order][:-1])
    if same.any():
        twins = order[1:][same]
        which = int(twins.argmin())
        one, first = rows[int(twins[which])], rows[int(order[:-1][same][which])]
        raise one.error("cycle", f"cycle {one.cycle} is there twice, first in line {first.line}")


def _cloud(rows: list[Row], commanded: dict[str, Row]) -> Cloud:
    first = rows[0]
    goal = commanded.get(first.name)
    if goal is None and first.test in _COMMANDED:
        raise rows[0].error("cycle", f"what was commanded for {first.name} is not there: a row with cycle commanded")
    places, angles = _stacked(rows, "place"), _stacked(rows, "angles")
    if goal is not None:
        _ask(goal, np.array([goal.place]), places)
        question = angles_question(np.array(goal.angles), angles)
        if question:
            raise goal.error("cycle", question)
    label, t = _part(first)
    return Cloud(
        label=label,
        t=t,
        cycles=tuple(one.cycle for one in rows if one.cycle is not None),
        places=places,
        angles=angles,
        loads=np.array([one.load for one in rows]) if first.test == "compliance" else None,
        commanded=None if goal is None else np.array(goal.place),
        commanded_angles=None if goal is None else np.array(goal.angles),
    )


def _paired(rows: list[Row], clouds: tuple[Cloud, ...], names: list[str]) -> tuple[Cloud, ...]:
    """Return the two poses of a distance with their cycles in one order."""
    if len(clouds) != 2:
        raise rows[0].error("pose", f"a distance is that of two poses, got {len(clouds)}: {', '.join(names)}")
    lacking = set(clouds[0].cycles) ^ set(clouds[1].cycles)
    if lacking:
        raise rows[0].error("cycle", f"cycle {min(lacking)} of {' to '.join(names)} has one of the two poses only")
    order = [np.argsort(cloud.cycles) for cloud in clouds]
    return tuple(
        attrs.evolve(cloud, cycles=tuple(sorted(cloud.cycles)), places=cloud.places[rank], angles=cloud.angles[rank])
        for cloud, rank in zip(clouds, order, strict=True)
    )


def _path_test(rows: list[Row]) -> PathTest:
    _one_layout(rows)
    first = rows[0]
    path = [one for one in rows if one.cycle is None]
    runs: dict[int, list[Row]] = {}
    for one in rows:
        if one.cycle is not None:
            runs.setdefault(one.cycle, []).append(one)
    if not runs:
        raise rows[0].error("cycle", "there is what was commanded, but nothing that was attained")
    if not path and first.test in _COMMANDED:
        raise rows[0].error("cycle", f"the commanded path of {first.name} is not there: rows with cycle commanded")
    if path and first.test == "settling":
        raise path[0].error("cycle", "a test of settling has no commanded row: it is told by where it comes to rest")
    commanded = _trace(path, timed=False) if path else None
    traces = tuple(_trace(run, timed=True) for run in runs.values())
    if commanded is not None:
        for run, trace in zip(runs.values(), traces, strict=True):
            _ask(run[0], commanded.places, trace.places)
    speeds = {one.speed for one in rows if one.speed is not None}
    if len(speeds) > 1:
        raise rows[0].error("speed", f"{first.test} {first.name} has different commanded speeds")
    if not speeds and first.test in {"velocity", "weaving"}:
        raise rows[0].error("speed_mm_per_s", f"a test of {first.test} tells the commanded speed in one of its rows")
    return PathTest(
        kind=first.test,
        name=first.name,
        condition=first.condition,
        commanded=commanded,
        runs=traces,
        speed=speeds.pop() if speeds else None,
        angle_names=first.angle_names,
    )


def _trace(rows: list[Row], *, timed: bool) -> Trace:
    """Return one run, or the commanded path."""
    first = rows[0]
    if len(rows) < 2:
        raise first.error("cycle", f"a {'run' if timed else 'path'} has two rows at least, and this is its only one")
    return Trace(
        places=_stacked(rows, "place"),
        times=_times(rows) if timed else None,
        angles=_stacked(rows, "angles") if first.angles else None,
    )


def _stacked(rows: Sequence[Row], what: str) -> Array:
    """Return (n, k) coordinates or angles of rows of one layout."""
    width = len(getattr(rows[0], what))
    numbers = (number for one in rows for number in getattr(one, what))
    return np.fromiter(numbers, dtype=np.float64, count=width * len(rows)).reshape(len(rows), width)


def _times(rows: list[Row]) -> list[float] | None:
    """Return the times of a run; None where it tells none and needs none."""
    first = rows[0]
    if first.t is None:
        if first.test in _TIMED:
            raise first.error("t_s", f"a test of {first.test} needs the time of every sample")
        return None
    times: list[float] = []
    for one in rows:
        if one.t is None:
            raise one.error("t_s", "empty; expected a number, as in the rows before")
        if times and not one.t > times[-1]:
            raise one.error("t_s", f"samples are in order of time, and {one.t:g} s does not follow {times[-1]:g} s")
        times.append(one.t)
    return times


def _ask(one: Row, commanded: Array, attained: Array) -> None:
    question = lengths_question(commanded, attained)
    if question:
        raise one.error("cycle", question)


def _one_layout(rows: Iterable[Row]) -> None:
    """Refuse rows of one test of which some are in a plane and some in space, or have other angles."""
    first, *others = rows
    for one in others:
        if (len(one.place), one.angle_names) != (len(first.place), first.angle_names):
            raise one.error(
                "x", f"{first.path}:{first.line} has other coordinates or angles of the same {first.test} test"
            )
