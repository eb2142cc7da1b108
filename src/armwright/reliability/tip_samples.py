"""Samples of random linkages in complete equilibrium: in this process, or as a sweep on many machines.

All samples are drawn before the first is computed, and each depends on its own numbers alone. So the results are the
same bits wherever they are computed, in one go or after an interruption.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.sweep.designs import Design
from armwright.sweep.errors import SweepError
from armwright.sweep.task import FAILURE, Axis, Output, Status

if TYPE_CHECKING:
    from armwright.sweep.machines import Machines

# Linkages that are computed at once, where each takes some hundredths of a second.
LINKAGES = 64


@attrs.frozen(kw_only=True, eq=False)
class TipErrorTask:
    """Errors of the resting tips of random linkages, as the task of a sweep. A point has the numbers of a linkage.

    Attributes:
        linkage: name of the linkage.
        poses: p, of rest.
        errors: returns (s, p, 2) errors in complete equilibrium [m] for (s, k) numbers, each row for itself; it can be
            pickled.
        settings: all else that the errors depend on, as JSON data.
        block: linkages that are computed at once, about a second of work.
    """

    linkage: str
    poses: int
    errors: Callable[[Array], Array]
    settings: Mapping[str, Any]
    block: int = LINKAGES

    @property
    def name(self) -> str:
        """The name of the task."""
        return f"random linkages of {self.linkage} at rest"

    @property
    def outputs(self) -> Mapping[str, Output]:
        """The error of the tip at each pose."""
        text = "error of the resting tip along"
        return {f"error_{axis}": Output(description=f"{text} {axis}", units="m", dims=("pose",)) for axis in "xy"}

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The poses, from 1."""
        return {"pose": Axis(values=np.arange(1.0, self.poses + 1.0), description="number of the pose")}

    def __call__(self, points: Array) -> Mapping[str, Any]:
        """Return the errors of linkages (m, k); one without equilibrium fails."""
        try:
            errors, failures = self.errors(points), [""] * len(points)
        except InvalidValueError as error:
            if len(points) > 1:
                raise  # they are then tried one by one
            errors, failures = np.full((1, self.poses, 2), np.nan), [str(error)]
        return {"error_x": errors[..., 0], "error_y": errors[..., 1], FAILURE: failures}


def tip_samples(
    task: TipErrorTask,
    numbers: Array,
    *,
    seed: int,
    machines: Machines | None = None,
    say: Callable[[str], None] | None = None,
) -> Array:
    """Return (s, p, 2) errors of the tips of drawn linkages [m].

    Args:
        task: what computes them.
        numbers: (s, k) of the linkages.
        seed: with which they were drawn.
        machines: that do it as a sweep; this process alone where there are none.
        say: is told how many are computed, where this process does it.

    Raises:
        InvalidValueError: a linkage has no equilibrium.
        SweepError: the workers cannot do it; see ``sweep.run``.
    """
    if machines is None:
        found: list[Array] = []
        for start in range(0, len(numbers), task.block):
            found.append(task.errors(numbers[start : start + task.block]))
            if say is not None:
                say(f"random linkages in equilibrium: {start + len(found[-1])} of {len(numbers)}")
        return np.concatenate(found)
    from armwright.sweep.machines import evaluate_on  # noqa: PLC0415 - a slow import

    names = tuple(f"x{k}" for k in range(1, numbers.shape[1] + 1))
    rows = evaluate_on(machines, task, Design(names=names, points=numbers, seed=seed), block=task.block)
    for number in np.flatnonzero(rows["status"] != Status.DONE).tolist():
        text = f"random linkage {number + 1} of {len(numbers)}: {rows['message'][number]}"
        if rows["status"][number] == Status.KILLED:
            raise SweepError(f"{text}; use another folder to try again")
        raise InvalidValueError(text)
    return np.stack([rows["error_x"], rows["error_y"]], axis=-1)
