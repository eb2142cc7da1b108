"""The task of a sweep, the rows that it returns, and rows of runs that fail."""

from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from math import prod
from typing import Any, Protocol, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, array_key, floats, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, MissingExtraError, ShapeError, shown
from armwright.sweep.errors import SweepError

# A structured array of m runs: a field per output, NaN where there is nothing; ``status``, a ``Status`` each; and
# ``message``, empty where a run ended well.
Rows: TypeAlias = npt.NDArray[np.void]

# Under this name a task may return a text per row, empty where the row went well.
FAILURE = "failure"
# Names that every result has, or that mean something else.
_RESERVED = ("run", "status", "message", "letter", FAILURE)
# Characters of a message that are kept.
_MAX_MESSAGE_LENGTH = 300
# NumPy counts the bytes of a row by 32 bits; the message and the status are in it too [bytes].
_LARGEST_ROW = 2**31 - 2**16


class Status(IntEnum):
    """How a run ended."""

    DONE = 0
    """The run succeeded."""
    FAILED = 1
    """The task raised an error, or reported that the run failed."""
    KILLED = 2
    """The worker died each time the run was tried."""


def _axis_names(value: Iterable[str]) -> tuple[str, ...]:
    return tuple(value)


@attrs.frozen(kw_only=True)
class Output:
    """One quantity that a task returns.

    Attributes:
        description: what it is, in a line.
        units: "1" where there is none.
        dims: the axes of what one run returns; none for a scalar.
    """

    description: str = ""
    units: str = "1"
    dims: tuple[str, ...] = attrs.field(default=(), converter=_axis_names)


def _values(value: Any) -> Array:
    values = floats(value, "values of an axis")
    if values.ndim != 1 or not values.size:
        raise ShapeError(f"values of an axis: expected a row of numbers, got shape {values.shape}")
    return read_only(values)


@attrs.frozen(kw_only=True)
class Axis:
    """An axis of outputs beside that of the runs: times, positions on a path, joints.

    Attributes:
        values: (s,) coordinates.
        units: "1" where there is none.
        description: what it is, in a line.
    """

    values: Array = attrs.field(converter=_values, eq=array_key)
    units: str = "1"
    description: str = ""

    __reduce__ = reduce_by_fields


class Task(Protocol):
    """A function of the points of a design, with a description of its outputs.

    A task can be pickled, and each row of what it returns depends on that row of the points alone.

    Attributes:
        name: of the task.
        settings: all else that its results depend on, as JSON data; part of the identity of a sweep.
        outputs: by name, what it returns.
        axes: by name, the axes of those outputs.
    """

    @property
    def name(self) -> str: ...  # noqa: D102 - described above
    @property
    def settings(self) -> Mapping[str, Any]: ...  # noqa: D102
    @property
    def outputs(self) -> Mapping[str, Output]: ...  # noqa: D102
    @property
    def axes(self) -> Mapping[str, Axis]: ...  # noqa: D102

    def __call__(self, points: Array) -> Mapping[str, Any]:
        """Return by name the outputs at (m, k) points, (m, ...) each.

        Under ``failure`` it may return m texts, which say why a row failed. An error that is raised makes the rows be
        tried one by one.
        """
        ...


def check_task(task: Task, parameters: Sequence[str]) -> None:
    """Check that the names of a task and a design are distinct, that axes of outputs exist, and that a run has a row.

    Raises:
        InvalidValueError: it has no output, two things have the same name, or a reserved one, or the outputs of a run
            have more than 2 GiB.
    """
    if not task.outputs:
        raise InvalidValueError(f"task '{task.name}': expected one output or more, got none")
    used = dict.fromkeys(_RESERVED, "a name that every result has")
    kinds: Mapping[str, Iterable[str]] = {
        "a parameter of the design": parameters,
        "an output of the task": task.outputs,
        "an axis of the task": task.axes,
    }
    for kind, names in kinds.items():
        for name in names:
            if not name.isidentifier():
                raise InvalidValueError(f"'{name}' as {kind}: expected an identifier of letters, digits and _")
            if name in used:
                raise InvalidValueError(f"'{name}' cannot be {kind}: it is already {used[name]}")
            used[name] = kind
    for name, output in task.outputs.items():
        for dim in output.dims:
            if dim not in task.axes:
                known = ", ".join(task.axes) or "none"
                raise InvalidValueError(f"output '{name}': the task has no axis '{dim}'. Known: {known}.")
    numbers = sum(map(prod, _shapes(task).values()))
    if 8 * numbers > _LARGEST_ROW:
        raise InvalidValueError(
            f"outputs: a run of {numbers} numbers has more than 2 GiB; return fewer numbers per run"
        )


def evaluate(task: Task, points: Array) -> Rows:
    """Run a task at some points; an error that it raises becomes the status of the rows that it fails at.

    Args:
        task: what is done.
        points: (m, k) one row per run.

    Raises:
        SweepError: the task returned something else than its outputs.
        MissingExtraError: it needs a library that this machine does not have: no run would tell anything.
    """
    points = read_only(points)
    try:
        returned = task(points)
    except MissingExtraError:
        raise
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in a run, the sweep goes on
        if len(points) == 1:
            return failed_row(task, Status.FAILED, f"{type(error).__name__}: {error}")
        return np.concatenate([evaluate(task, point) for point in np.split(points, len(points))])
    return _check_outputs(task, returned, len(points))


def failed_row(task: Task, status: Status, message: str) -> Rows:
    """Return the row of a run without results: NaN everywhere."""
    row = _empty_rows(task, [_one_line(message)])
    row["status"] = status
    for name in task.outputs:
        row[name] = np.nan
    return row


def _check_outputs(task: Task, returned: Mapping[str, Any], runs: int) -> Rows:
    """Return the outputs of a task as rows, if they are those that it declares."""
    if not isinstance(returned, Mapping):
        raise SweepError(f"task '{task.name}' returned {shown(returned)}; expected outputs by name")
    names, expected = (", ".join(sorted(names)) for names in ({*returned} - {FAILURE}, task.outputs))
    if names != expected:
        raise SweepError(f"task '{task.name}' returned {names or 'nothing'}; its outputs are {expected}")
    messages = [_one_line(str(text)) for text in returned.get(FAILURE, ("",) * runs)]
    if len(messages) != runs:
        raise SweepError(f"task '{task.name}': '{FAILURE}': expected {runs} texts, one per run, got {len(messages)}")
    rows = _empty_rows(task, messages)
    rows["status"] = [Status.FAILED if text else Status.DONE for text in messages]
    for name in task.outputs:
        try:
            values = np.array(returned[name], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise SweepError(f"task '{task.name}': output '{name}': expected numbers, got {error}") from error
        if values.shape != (shape := rows[name].shape):
            raise SweepError(
                f"task '{task.name}': output '{name}': expected shape {shape}, got {values.shape}; the first axis is "
                "that of the runs"
            )
        rows[name] = values
    return rows


def _empty_rows(task: Task, messages: Sequence[str]) -> Rows:
    """Return rows with messages, whose numbers are still to be filled in."""
    kinds = [(name, np.float64, shape) for name, shape in _shapes(task).items()]
    longest = max(1, *map(len, messages))
    rows = np.empty(len(messages), np.dtype([*kinds, ("status", np.int8), ("message", f"U{longest}")]))
    rows["message"] = messages
    return rows


def _shapes(task: Task) -> dict[str, tuple[int, ...]]:
    """Return by output the shape of what one run returns."""
    return {name: tuple(len(task.axes[dim].values) for dim in output.dims) for name, output in task.outputs.items()}


def _one_line(text: str) -> str:
    """Return a text on one line, not too long, without what a file cannot hold."""
    line = " ".join(text.replace("\0", " ").split()).encode("utf-8", "replace").decode()
    return line if len(line) <= _MAX_MESSAGE_LENGTH else f"{line[: _MAX_MESSAGE_LENGTH - 3]}..."
