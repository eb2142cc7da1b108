"""Tests out of tables: rows that belong together, what was commanded beside what was attained."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias, get_args

import attrs
import numpy as np

from armwright.accuracy.cycles import Kind, PoseKind
from armwright.accuracy.table import Row, read_tables
from armwright.accuracy.trace import Trace
from armwright.accuracy.unit_mismatch import angle_unit_question, length_unit_question
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.files.limits import limit, limit_message

# Tests of which every row is one attained pose; of the others a cycle is a run of many rows.
POSE_KINDS: frozenset[Kind] = frozenset(get_args(PoseKind))
# Tests without a commanded pose or path.
_KINDS_WITHOUT_COMMAND = {"multidirectional", "exchangeability", "compliance", "settling", "posing"}
# The column that distinguishes the parts of a test, where it is not the name of the pose.
_LABEL_COLUMNS = {"multidirectional": "direction", "compliance": "direction", "exchangeability": "robot"}


@attrs.frozen(kw_only=True, eq=False)
class Cloud:
    """Attained poses of one part of a test.

    Attributes:
        label: direction, robot, or name of the pose; may be empty.
        t: when they were measured [s]; None where it does not matter.
        cycles: (n) numbers of the cycles.
        positions: (n, 2) or (n, 3) [m].
        angles: (n, k) [rad].
        loads: (n,) [N]; None where it does not matter.
        commanded: (2,) or (3,) [m]; None where nothing was.
        commanded_angles: (k,) [rad]; None where nothing was.
    """

    label: str
    t: float | None
    cycles: tuple[int, ...]
    positions: Array
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
        angle_names: the axes a, b, c that its angles are about.
    """

    kind: Kind
    name: str
    condition: str
    clouds: tuple[Cloud, ...]
    angle_names: tuple[str, ...]

    @property
    def size(self) -> int:
        """2 in a plane, 3 in space."""
        return int(self.clouds[0].positions.shape[1])


@attrs.frozen(kw_only=True, eq=False)
class PathTest:
    """A test of runs, sample by sample.

    Attributes:
        kind: name of the test.
        name: of the path or pose.
        condition: in free words; may be empty.
        commanded: the commanded path; None where none is needed.
        runs: one per cycle.
        speed: commanded [m/s]; None where the file has none.
        angle_names: the axes a, b, c that its angles are about.
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
    paths: Path | str | Sequence[Path | str], *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> tuple[AnyTest, ...]:
    """Read the tests of one file or of several that belong together.

    Args:
        paths: CSV files, in the format of docs/iso9283.md; each has its own units.
        columns: names of columns, with unit, by those in the files: ``{"X": "x_mm"}``.
        skip_incomplete: leave out rows with cells that should not be empty; an ``IncompleteRowsWarning`` says how many.

    Returns:
        The tests, in the order in which they begin.

    Raises:
        FileFormatError: a file is missing or invalid; the message has file, line and column.
        InvalidValueError: there are no files.
    """
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    if not files:
        raise InvalidValueError("measurements: expected at least one file, got none")
    tables = read_tables(files, columns=columns, skip_incomplete=skip_incomplete)
    tests = _rows_by_test(row for table in tables for row in table.rows())
    return tuple(_pose_test(rows) if rows[0].test in POSE_KINDS else _path_test(rows) for rows in tests)


def _rows_by_test(rows: Iterable[Row]) -> list[list[Row]]:
    """Return the rows of each test.

    Raises:
        FileFormatError: there are more tests, and poses, instants and runs in them, than a laboratory measures: each is
            an object.
    """
    groups: dict[tuple[str, ...], list[Row]] = {}
    parts, most = set[tuple[Any, ...]](), limit("entries")
    for row in rows:
        # A distance takes two poses.
        group = (row.test, "" if row.test == "distance" else row.name, row.word("condition"))
        groups.setdefault(group, []).append(row)
        parts.add((group, _part_key(row) if row.test in POSE_KINDS else row.cycle))
        if len(parts) > most:
            raise row.error("test", f"too many tests, and poses and runs in them: {limit_message('entries')}")
    return [*groups.values()]


def _pose_test(rows: list[Row]) -> PoseTest:
    first, clouds = rows[0], _attained_parts(rows, _part_key)
    commanded: dict[str, Row] = {}
    for row in (row for row in rows if row.cycle is None):
        earlier = commanded.setdefault(row.name, row)
        if earlier is not row:
            raise row.error("cycle", f"a second commanded pose, after the one in line {earlier.line}")
    for cloud in clouds.values():
        _refuse_repeated_cycles(cloud)
    parts = tuple(_cloud(part, commanded) for part in clouds.values())
    names = list(dict.fromkeys(row.name for row in rows))
    if first.test == "distance":
        parts = _pair_cycles(rows, parts, names)
    return PoseTest(
        kind=first.test,
        name=" to ".join(names),
        condition=first.word("condition"),
        clouds=parts,
        angle_names=first.angle_names,
    )


def _attained_parts(rows: Sequence[Row], part_key: Callable[[Row], Any]) -> dict[Any, list[Row]]:
    """Return the attained rows of a test by the part to which each belongs.

    Raises:
        FileFormatError: there are none, or some are in a plane and some in space, or have other angles.
    """
    first = rows[0]
    for row in rows:
        if (len(row.position), row.angle_names) != (len(first.position), first.angle_names):
            message = f"{first.path}:{first.line} has other coordinates or angles of the same {first.test} test"
            raise row.error("x", message)
    parts: dict[Any, list[Row]] = {}
    for row in rows:
        if row.cycle is not None:
            parts.setdefault(part_key(row), []).append(row)
    if not parts:
        raise first.error("cycle", "the test has commanded rows, but no attained ones")
    return parts


def _part_key(row: Row) -> tuple[str, float | None]:
    """Return the part of its test to which a row belongs: a direction, a robot or a pose, and for drift a time."""
    column = _LABEL_COLUMNS.get(row.test)
    return row.word(column) if column else row.name, row.number("t") if row.test == "drift" else None


def _refuse_repeated_cycles(rows: Sequence[Row]) -> None:
    """Refuse two rows of one part of a test that have the same cycle and load."""
    cycles = np.fromiter((row.cycle or 0 for row in rows), dtype=np.int64, count=len(rows))
    loads = np.nan_to_num(np.array([row.number("load") for row in rows], dtype=np.float64), nan=-np.inf)
    order = np.lexsort((loads, cycles))
    same = (cycles[order][1:] == cycles[order][:-1]) & (loads[order][1:] == loads[order][:-1])
    if same.any():
        twins = order[1:][same]
        earliest = int(twins.argmin())
        row, first = rows[int(twins[earliest])], rows[int(order[:-1][same][earliest])]
        raise row.error("cycle", f"a second row of cycle {row.cycle}, after line {first.line}")


def _cloud(rows: list[Row], commanded: dict[str, Row]) -> Cloud:
    first = rows[0]
    goal = commanded.get(first.name)
    if goal is None and first.test not in _KINDS_WITHOUT_COMMAND:
        raise first.error("cycle", f"{first.name} has no commanded pose: expected a row with cycle commanded")
    positions, angles = _stack_rows(rows, "position"), _stack_rows(rows, "angles")
    if goal is not None:
        _refuse_different_units(goal, np.array([goal.position]), positions)
        question = angle_unit_question(np.array(goal.angles), angles)
        if question:
            raise goal.error("cycle", question)
    label, t = _part_key(first)
    return Cloud(
        label=label,
        t=t,
        cycles=tuple(row.cycle for row in rows if row.cycle is not None),
        positions=positions,
        angles=angles,
        loads=np.array([row.number("load") for row in rows]) if first.test == "compliance" else None,
        commanded=None if goal is None else np.array(goal.position),
        commanded_angles=None if goal is None else np.array(goal.angles),
    )


def _pair_cycles(rows: list[Row], clouds: tuple[Cloud, ...], names: list[str]) -> tuple[Cloud, ...]:
    """Return the two poses of a distance with their cycles in one order."""
    if len(clouds) != 2:
        raise rows[0].error("pose", f"a distance needs two poses, got {len(clouds)}: {', '.join(names)}")
    unpaired = set(clouds[0].cycles) ^ set(clouds[1].cycles)
    if unpaired:
        raise rows[0].error("cycle", f"cycle {min(unpaired)} of {' to '.join(names)} has one of the two poses only")
    order = [np.argsort(cloud.cycles) for cloud in clouds]
    return tuple(
        attrs.evolve(cloud, cycles=tuple(sorted(cloud.cycles)), positions=cloud.positions[i], angles=cloud.angles[i])
        for cloud, i in zip(clouds, order, strict=True)
    )


def _path_test(rows: list[Row]) -> PathTest:
    first, runs = rows[0], _attained_parts(rows, lambda row: row.cycle)
    path = [row for row in rows if row.cycle is None]
    if not path and first.test not in _KINDS_WITHOUT_COMMAND:
        raise first.error("cycle", f"{first.name} has no commanded path: expected rows with cycle commanded")
    if path and first.test == "settling":
        raise path[0].error("cycle", "a settling test must not have a commanded row: its pose is the end of the run")
    commanded = _trace(path, timed=False) if path else None
    traces = tuple(_trace(run, timed=True) for run in runs.values())
    if commanded is not None:
        for run, trace in zip(runs.values(), traces, strict=True):
            _refuse_different_units(run[0], commanded.positions, trace.positions)
    speeds = {row.number("speed") for row in rows} - {None}
    if len(speeds) > 1:
        raise first.error("speed", f"{first.test} {first.name} has different commanded speeds")
    if not speeds and first.test in {"velocity", "weaving"}:
        raise first.error("speed_mm_per_s", f"a test of {first.test} has the commanded speed in one of its rows")
    return PathTest(
        kind=first.test,
        name=first.name,
        condition=first.word("condition"),
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
        positions=_stack_rows(rows, "position"),
        times=_times(rows) if timed else None,
        angles=_stack_rows(rows, "angles") if first.angles else None,
    )


def _stack_rows(rows: Sequence[Row], what: str) -> Array:
    """Return (n, k) coordinates or angles of rows of one layout."""
    width = len(getattr(rows[0], what))
    numbers = (number for row in rows for number in getattr(row, what))
    return np.fromiter(numbers, dtype=np.float64, count=width * len(rows)).reshape(len(rows), width)


def _times(rows: list[Row]) -> list[float] | None:
    """Return the times of a run; None where it has none."""
    if rows[0].number("t") is None:
        return None
    times = [row.number("t") or 0.0 for row in rows]
    for row, (before, t) in zip(rows[1:], pairwise(times), strict=True):
        if not t > before:
            raise row.error("t_s", f"samples must be in order of time, but {t:g} s follows {before:g} s")
    return times


def _refuse_different_units(row: Row, commanded: Array, attained: Array) -> None:
    question = length_unit_question(commanded, attained)
    if question:
        raise row.error("cycle", question)
