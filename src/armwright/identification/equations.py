"""The linear equations of identification: columns and efforts, averaged over a few readings each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from armwright.arrays import Array, ArrayLike, Flags
from armwright.identification.signals import Motion

# Equations whose columns exist at full rate at a time.
_BLOCK = 256


class Columns(Protocol):
    """A model whose efforts are linear in its parameters."""

    def base_columns(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Return the columns (k, n, b) of its parameters."""


class Equations(NamedTuple):
    """Equations of one motion: efforts = columns @ base parameters, an average over the same readings on both sides.

    Attributes:
        name: of the log.
        t: (k,) times of their middles [s].
        columns: (k, n, b).
        tau: (k, n) efforts [N m] or [N].
        usable: (k, n) which equations tell anything.
    """

    name: str
    t: Array
    columns: Array
    tau: Array
    usable: Flags


def equations(
    model: Columns, motions: Iterable[Motion], decimation: int, *, values: Array | None = None
) -> Iterator[Equations]:
    """Give the equations of motions.

    Averages of both sides of an equation are an equation again, exactly, whatever the columns do meanwhile; so friction
    that reverses and products of velocities lose nothing as they would if the motion itself were filtered as much.

    Args:
        model: of the arm.
        motions: of it.
        decimation: readings that are averaged to one equation.
        values: (b,) base parameters, of what has no jumps; then one more column is the rate of the efforts that they
            predict, whose coefficient is how much later positions were read than efforts [s].
    """
    for motion in motions:
        count = len(motion.t) // decimation
        if not count:
            continue
        columns, predicted = [], []
        for first in range(0, count, _BLOCK):
            rows = slice(first * decimation, min(first + _BLOCK, count) * decimation)
            Y = model.base_columns(motion.q[rows], motion.qd[rows], motion.qdd[rows])
            columns.append(_averaged(Y, decimation))
            if values is not None:
                predicted.append(Y @ values)
        if values is not None:
            rates = np.gradient(np.concatenate(predicted), motion.t[1] - motion.t[0], axis=0)
            columns = [np.concatenate([np.concatenate(columns), _averaged(rates, decimation)[..., None]], axis=2)]
        used = slice(count * decimation)
        forward = _averaged((motion.qd[used] > 0).astype(np.float64), decimation)
        yield Equations(
            name=motion.name,
            t=_averaged(motion.t[used], decimation),
            columns=np.concatenate(columns),
            tau=_averaged(motion.tau[used], decimation),
            # Where a joint reverses between two readings it is at rest in between.
            usable=(_averaged(motion.usable[used].astype(np.float64), decimation) == 1)
            & ((forward == 0) | (forward == 1)),
        )


def _averaged(values: Array, count: int) -> Array:
    return np.asarray(values.reshape(-1, count, *values.shape[1:]).mean(axis=1))
