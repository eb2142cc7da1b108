"""Tests out of tables: rows that belong together, what was commanded beside what was attained."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.accuracy.cycles import Kind
from armwright.accuracy.measured import Trace
from armwright.accuracy.scales import angles_question, lengths_question
from armwright.accuracy.table import Row, read_table
from armwright.arrays import Array
from armwright.errors import FileFormatError, InvalidValueError

# Tests of which every row is one attained pose; of the others a cycle is a run of many rows.
POSES: frozenset[Kind] = frozenset({"pose", "multidirectional", "distance", "drift", "exchangeability", "compliance"})
# What a test cannot be without.
_COMMANDED: frozenset[Kind] = frozenset(
    {"pose", "distance", "drift", "path", "reorientation", "cornering", "velocity", "weaving"}
)
_TIMED: frozenset[Kind] = frozenset({"settling", "posing", "velocity", "weaving"})


class Found(NamedTuple):
    """A row, and the file in which it stands."""

    path: Path
    row: Row

    def error(self, key: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of this row."""
        return FileFormatError(self.path, self.row.line, key, message)


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


def read_measurements(paths: Path | str | Sequence[Path | str]) -> tuple[AnyTest, ...]:
    """Read the tests of one file or of several that belong together.

    Args:
        paths: CSV files, in the format of docs/iso9283.md; each has its own units.

    Returns:
        The tests, in the order in which they begin.

    Raises:
        FileFormatError: a file is missing, broken, or says what cannot be; the text has file, line and column.
        InvalidValueError: there are no files.
    """
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    if not files:
        raise InvalidValueError("measurements: expected one file at least, got none")
    groups: dict[tuple[str, ...], list[Found]] = {}
    for file in files:
        table = read_table(file)
        for row in table.rows:
            # A distance takes two poses.
            name = "" if row.test == "distance" else row.name
            groups.setdefault((row.test, name, row.condition), []).append(Found(table.path, row))
    return tuple(_pose_test(rows) if rows[0].row.test in POSES else _path_test(rows) for rows in groups.values())


def _pose_test(rows: list[Found]) -> PoseTest:
    _one_layout(rows)
    first = rows[0].row
    commanded: dict[str, Found] = {}
    for one in (one for one in rows if one.row.cycle is None):
        if one.row.name in commanded:
            raise one.error("cycle", f"commanded is given twice, first in line {commanded[one.row.name].row.line}")
        commanded[one.row.name] = one
    clouds: dict[tuple[Any, ...], list[Found]] = {}
    seen: dict[tuple[Any, ...], Found] = {}
    for one in (one for one in rows if one.row.cycle is not None):
        part, key = _part(one)
        if (*part, *key) in seen:
            twin = seen[*part, *key]
            raise one.error("cycle", f"cycle {one.row.cycle} is there twice, first in line {twin.row.line}")
        seen[*part, *key] = one
        clouds.setdefault(part, []).append(one)
    if not clouds:
        raise rows[0].error("cycle", "there is what was commanded, but nothing that was attained")
    found = tuple(_cloud(part, commanded) for part in clouds.values())
    names = list(dict.fromkeys(one.row.name for one in rows))
    if first.test == "distance":
        found = _paired(rows, found, names)
    return PoseTest(
        kind=first.test,
        name=" to ".join(names),
        condition=first.condition,
        clouds=found,
        angle_names=first.angle_names,
    )


def _part(one: Found) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return to which part of its test a row belongs, and what tells it from the others there."""
    row = one.row
    needed = {"multidirectional": "direction", "compliance": "direction", "exchangeability": "robot"}.get(row.test)
    if needed and not getattr(row, needed):
        raise one.error(needed, f"a test of {row.test} tells the {needed} of every row")
    if row.test == "drift" and row.t is None:
        raise one.error("t_min", "a test of drift tells when every row was measured: t_s, t_min or t_h")
    if row.test == "compliance" and row.load is None:
        raise one.error("load_n", "a test of compliance tells the load of every row")
    label = getattr(row, needed) if needed else row.name
    return (label, row.t if row.test == "drift" else None), (row.load, row.cycle)


def _cloud(rows: list[Found], commanded: dict[str, Found]) -> Cloud:
    first = rows[0].row
    goal = commanded.get(first.name)
    if goal is None and first.test in _COMMANDED:
        raise rows[0].error("cycle", f"what was commanded for {first.name} is not there: a row with cycle commanded")
    places, angles = np.array([one.row.place for one in rows]), np.array([one.row.angles for one in rows])
    if goal is not None:
        _ask(goal, np.array([goal.row.place]), places)
        question = angles_question(np.array(goal.row.angles), angles)
        if question:
            raise goal.error("cycle", question)
    needed = {"multidirectional": first.direction, "compliance": first.direction, "exchangeability": first.robot}
    return Cloud(
        label=needed.get(first.test, first.name),
        t=first.t if first.test == "drift" else None,
        cycles=tuple(one.row.cycle for one in rows if one.row.cycle is not None),
        places=places,
        angles=angles,
        loads=np.array([one.row.load for one in rows]) if first.test == "compliance" else None,
        commanded=None if goal is None else np.array(goal.row.place),
        commanded_angles=None if goal is None else np.array(goal.row.angles),
    )


def _paired(rows: list[Found], clouds: tuple[Cloud, ...], names: list[str]) -> tuple[Cloud, ...]:
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


def _path_test(rows: list[Found]) -> PathTest:
    _one_layout(rows)
    first = rows[0].row
    path = [one for one in rows if one.row.cycle is None]
    runs: dict[int, list[Found]] = {}
    for one in rows:
        if one.row.cycle is not None:
            runs.setdefault(one.row.cycle, []).append(one)
    if not runs:
        raise rows[0].error("cycle", "there is what was commanded, but nothing that was attained")
    if not path and first.test in _COMMANDED:
        raise rows[0].error("cycle", f"the commanded path of {first.name} is not there: rows with cycle commanded")
    commanded = _trace(path, timed=False) if path else None
    traces = tuple(_trace(run, timed=True) for run in runs.values())
    if commanded is not None:
        for run, trace in zip(runs.values(), traces, strict=True):
            _ask(run[0], commanded.places, trace.places)
    speeds = {one.row.speed for one in rows if one.row.speed is not None}
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


def _trace(rows: list[Found], *, timed: bool) -> Trace:
    """Return one run, or the commanded path."""
    first = rows[0]
    if len(rows) < 2:
        raise first.error("cycle", f"a {'run' if timed else 'path'} has two rows at least, and this is its only one")
    angles = [one.row.angles for one in rows]
    return Trace(
        places=[one.row.place for one in rows],
        times=_times(rows) if timed else None,
        angles=np.array(angles) if angles[0] else None,
    )


def _times(rows: list[Found]) -> list[float] | None:
    """Return the times of a run; None where it tells none and needs none."""
    first = rows[0]
    if first.row.t is None:
        if first.row.test in _TIMED:
            raise first.error("t_s", f"a test of {first.row.test} needs the time of every sample")
        return None
    times: list[float] = []
    for one in rows:
        if one.row.t is None:
            raise one.error("t_s", "empty; expected a number, as in the rows before")
        if times and not one.row.t > times[-1]:
            raise one.error("t_s", f"samples are in order of time, and {one.row.t:g} s does not follow {times[-1]:g} s")
        times.append(one.row.t)
    return times


def _ask(one: Found, commanded: Array, attained: Array) -> None:
    question = lengths_question(commanded, attained)
    if question:
        raise one.error("cycle", question)


def _one_layout(rows: Iterable[Found]) -> None:
    """Refuse rows of one test of which some are in a plane and some in space, or have other angles."""
    first, *others = rows
    for one in others:
        if (len(one.row.place), one.row.angle_names) != (len(first.row.place), first.row.angle_names):
            raise one.error(
                "x", f"{first.path}:{first.row.line} has other coordinates or angles of the same {first.row.test} test"
            )
