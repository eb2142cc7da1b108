"""What a sweep does at each of its points: the task, what it returns, and what becomes of rows that fail."""

from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from typing import Any, NamedTuple, Protocol

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, array_key, floats, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError, shown
from armwright.sweep.errors import SweepError

# Under this name a task may return a text per row, empty where the row went well.
FAILURE = "failure"
# The names that every result has, or that mean something else.
RESERVED = ("run", "status", "message", "letter", FAILURE)
# Of what went wrong in a row, this many characters are kept.
_LONGEST_MESSAGE = 300


class Status(IntEnum):
    """What became of a run."""

    DONE = 0
    """It ended well."""
    FAILED = 1
    """The task raised an error, or said that the run failed."""
    KILLED = 2
    """The worker that ran it died, every time it was tried."""


@attrs.frozen(kw_only=True)
class Output:
    """One quantity that a task returns.

    Attributes:
        description: what it is, in a line.
        units: "1" where there is none.
        dims: the axes of what one run returns; none for one number.
    """

    description: str = ""
    units: str = "1"
    dims: tuple[str, ...] = attrs.field(default=(), converter=tuple)


def _values(value: Any) -> Array:
    values = floats(value, "values of an axis")
    if values.ndim != 1 or not values.size:
        raise ShapeError(f"values of an axis: expected a row of numbers, got shape {values.shape}")
    values.setflags(write=False)
    return values


@attrs.frozen(kw_only=True)
class Axis:
    """An axis that outputs have beside that of the runs: times, places on a path, joints.

    Attributes:
        values: (s,) where on it the numbers stand.
        units: "1" where there is none.
        description: what it is, in a line.
    """

    values: Array = attrs.field(converter=_values, eq=array_key)
    units: str = "1"
    description: str = ""

    __reduce__ = reduce_by_fields


class Task(Protocol):
    """What is done at the points of a design.

    A task can be pickled, and each row of what it returns depends on that row of the points alone.

    Attributes:
        name: of the task.
        settings: all else its results depend on, as JSON can hold it; a part of what a sweep is known by.
        outputs: by name, what it returns.
        axes: by name, the axes of those outputs.
    """

    @property
    def name(self) -> str: ...  # noqa: D102 - told above
    @property
    def settings(self) -> Mapping[str, Any]: ...  # noqa: D102
    @property
    def outputs(self) -> Mapping[str, Output]: ...  # noqa: D102
    @property
    def axes(self) -> Mapping[str, Axis]: ...  # noqa: D102

    def __call__(self, points: Array) -> Mapping[str, Any]:
        """Return by name the outputs at (m, k) points, (m, ...) each.

        A row that comes to nothing may be told by a text under ``failure``, of which there are then m. An error that
        is raised makes the rows be tried one by one.
        """
        ...


class Rows(NamedTuple):
    """What became of m runs.

    Attributes:
        values: by output, (m, ...); NaN where there is nothing.
        status: (m,) a ``Status`` each.
        message: m texts, empty where a run ended well.
    """

    values: dict[str, Array]
    status: npt.NDArray[np.int8]
    message: tuple[str, ...]


def check_task(task: Task, parameters: Sequence[str]) -> None:
    """Refuse a task whose outputs cannot be told from one another or have an axis that is not there.

    Raises:
        InvalidValueError: it has no output, or two things have the same name, or a reserved one.
    """
    if not task.outputs:
        raise InvalidValueError(f"task '{task.name}': expected one output or more, got none")
    taken = dict.fromkeys(RESERVED, "a name that every result has")
    kinds: tuple[tuple[str, Iterable[str]], ...] = (
        ("a parameter of the design", parameters),
        ("an output of the task", task.outputs),
        ("an axis of the task", task.axes),
    )
    for kind, names in kinds:
        for name in names:
            if not name.isidentifier():
                raise InvalidValueError(f"'{name}' as {kind}: expected a word of letters, digits and _")
            if name in taken:
                raise InvalidValueError(f"'{name}' cannot be {kind}: it is {taken[name]}")
            taken[name] = kind
    for name, output in task.outputs.items():
        for dim in output.dims:
            if dim not in task.axes:
                known = ", ".join(task.axes) or "none"
                raise InvalidValueError(f"output '{name}': the task has no axis '{dim}'. Known: {known}.")


def evaluate(task: Task, points: Array) -> Rows:
    """Run a task at some points; what it raises becomes the status of the rows that it fails at.

    Args:
        task: what is done.
        points: (m, k) one row per run.

    Raises:
        SweepError: what it returned does not fit what it said it would.
    """
    points = np.array(points, dtype=np.float64, order="C")
    points.setflags(write=False)
    try:
        returned = task(points)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in a run, the sweep goes on
        if len(points) == 1:
            return lost(task, Status.FAILED, f"{type(error).__name__}: {error}")
        return stacked([evaluate(task, points[i : i + 1]) for i in range(len(points))])
    return _checked(task, returned, len(points))


def failures(rows: Rows) -> int:
    """Return how many of the runs failed."""
    return int(np.count_nonzero(rows.status != Status.DONE))


def stacked(parts: Sequence[Rows]) -> Rows:
    """Put rows below one another."""
    return Rows(
        values={name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values},
        status=np.concatenate([part.status for part in parts]),
        message=tuple(text for part in parts for text in part.message),
    )


def lost(task: Task, status: Status, message: str) -> Rows:
    """Return the row of a run that came to nothing: NaN everywhere."""
    values = {name: np.full((1, *shape), np.nan) for name, shape in shapes(task).items()}
    return Rows(values, np.array([status], dtype=np.int8), (_short(message),))


def shapes(task: Task) -> dict[str, tuple[int, ...]]:
    """Return by output the shape of what one run returns."""
    return {name: tuple(len(task.axes[dim].values) for dim in output.dims) for name, output in task.outputs.items()}


def _checked(task: Task, returned: Mapping[str, Any], runs: int) -> Rows:
    """Return what a task returned as rows, if it is what the task said it would be."""
    if not isinstance(returned, Mapping):
        raise SweepError(f"task '{task.name}' returned {shown(returned)}; expected outputs by name")
    expected = shapes(task)
    told = {name for name in returned if name != FAILURE}
    if told != set(expected):
        raise SweepError(
            f"task '{task.name}' returned {', '.join(sorted(told)) or 'nothing'}; it said it would return "
            f"{', '.join(sorted(expected))}"
        )
    values = {}
    for name, shape in expected.items():
        try:
            value = np.array(returned[name], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise SweepError(f"task '{task.name}': output '{name}': expected numbers, got {error}") from error
        if value.shape != (runs, *shape):
            raise SweepError(
                f"task '{task.name}': output '{name}': expected shape {(runs, *shape)}, got {value.shape}; the first "
                "axis is that of the runs"
            )
        values[name] = value
    texts = tuple(_short(str(text)) for text in returned.get(FAILURE, ("",) * runs))
    if len(texts) != runs:
        raise SweepError(f"task '{task.name}': '{FAILURE}': expected {runs} texts, one per run, got {len(texts)}")
    status = np.array([Status.FAILED if text else Status.DONE for text in texts], dtype=np.int8)
    return Rows(values, status, texts)


def _short(text: str) -> str:
    """Return a text on one line, not too long, without what a file cannot hold."""
    line = " ".join(text.replace("\0", " ").split()).encode("utf-8", "replace").decode()
    return line if len(line) <= _LONGEST_MESSAGE else f"{line[: _LONGEST_MESSAGE - 3]}..."
