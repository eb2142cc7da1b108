"""Trials of a program in a cell with physics, as the task of a sweep."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.physics.trials import Case, Verdict, draw_case, judge
from armwright.physics.world import PhysicsCell
from armwright.program.bytecode.assembler import assembly
from armwright.program.bytecode.instructions import Code
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits, RunError
from armwright.sweep.task import FAILURE, Output

# Between the cause of a failure and its message.
SEPARATOR = ": "


@attrs.frozen(kw_only=True, eq=False)
class ProgramTrials:
    """Trials of a program. A point is the number of a trial.

    Attributes:
        code: of the program.
        cell: in which it runs.
        seed: of all trials.
        limits: of each run.
        identity: all else that the results depend on, as JSON data, such as hashes of the files.
    """

    code: Code
    cell: Cell
    seed: int
    limits: Limits = attrs.field(factory=Limits)
    identity: Mapping[str, Any] = attrs.field(factory=dict)

    @property
    def name(self) -> str:
        """The name of the task."""
        return "trials"

    @property
    def settings(self) -> Mapping[str, Any]:
        """The other inputs of the results."""
        return {
            "seed": self.seed,
            "limits": attrs.asdict(self.limits),
            "code": _hash(assembly(self.code)),
            "cell": cell_hashes(self.cell),
            **self.identity,
        }

    @property
    def outputs(self) -> Mapping[str, Output]:
        """How a trial ended; its cause of failure is its message."""
        return {
            "distance": Output(description="of the part that is farthest from its goal", units="m"),
            "angle": Output(description="of the part that is rotated farthest from its goal", units="rad"),
            "duration": Output(description="until the program ended", units="s"),
            "ended": Output(description="1 where the program has come to its end, 0 where an error ended it"),
        }

    @property
    def axes(self) -> Mapping[str, Any]:
        """No axes."""
        return {}

    def __call__(self, points: Array) -> Mapping[str, Any]:
        """Run the trials with the numbers (m, 1)."""
        rows = [self._run(round(number)) for number in points[:, 0].tolist()]
        columns: dict[str, Any] = {name: [row[name] for row in rows] for name in self.outputs}
        return {**columns, FAILURE: [row[FAILURE] for row in rows]}

    def _run(self, number: int) -> dict[str, Any]:
        case = draw_case(self.cell, self.seed, number)
        world = case.world()
        error: RunError | None = None
        try:
            duration = interpret(self.code, case.cell, world, limits=self.limits).duration
        except RunError as stopped:
            error, duration = stopped, stopped.time
        verdict = judge_run(world, case, duration, error)
        failure = f"{verdict.cause}{SEPARATOR}{verdict.message}" if verdict.cause else ""
        return {
            "distance": verdict.distance,
            "angle": verdict.angle,
            "duration": duration,
            "ended": float(error is None),
            FAILURE: failure,
        }


def cell_hashes(cell: Cell) -> dict[str, Any]:
    """Return the hashes of what a cell has, by its fields and names: of meshes and arms too, which are in other files.

    Cells of which these are equal are equal.
    """
    hashes: dict[str, Any] = {}
    for field in attrs.fields(Cell):
        value = getattr(cell, field.name)
        by_name = isinstance(value, Mapping)
        hashes[field.name] = {name: _hash(entry) for name, entry in value.items()} if by_name else _hash(value)
    return hashes


def _hash(value: Any) -> str:
    return sha256(json.dumps(value, default=_as_data).encode()).hexdigest()


def _as_data(value: Any) -> Any:
    """Return what JSON does not hold as data that are others for another value."""
    match value:
        case np.ndarray():
            return [value.dtype.str, value.shape, sha256(value.tobytes()).hexdigest()]
        case Mapping():
            return dict(value)
        case frozenset():
            return sorted(value)
        case _:
            return [type(value).__name__, *(getattr(value, field.name) for field in attrs.fields(type(value)))]


def judge_run(world: PhysicsCell, case: Case, duration: float, error: RunError | None) -> Verdict:
    """Return the verdict on the world of a program that ended after some time [s], by itself or by an error."""
    ended_by = None if error is None else (error.diagnostic.code, str(error))
    # As many ticks as arms take to come to rest may have gone by since an error.
    return judge(world, case.cell, max(duration, world.now), ended_by)
