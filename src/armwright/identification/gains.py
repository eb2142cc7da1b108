"""Gains of drives, effort per current, from motions without and with a load that is known.

Currents alone tell masses only in units of the gains; a known load sets the scale. What is noisy are the currents, so
they are what is predicted: i = (Y theta + L pi) / k, with the unknown parameters of the arm and the inverses of the
gains; with the load known in mass alone, its centre and inertia are unknown as well.

Source:
    Gautier & Briot (2014), Global identification of joint drive gains and dynamic parameters of robots.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Link
from armwright.arrays import Array, positive
from armwright.dynamics.bodies import body_of
from armwright.dynamics.regressors import OF_LINK
from armwright.errors import ContradictionError
from armwright.identification.checks import refuse_other_units
from armwright.identification.equations import Equations, equations
from armwright.identification.fitting import robust, summed, weighted
from armwright.identification.log import Log
from armwright.identification.model import DynamicModel
from armwright.identification.payload import LoadedModel
from armwright.identification.signals import motions, preparation_of

_MAX_STEPS, _SETTLED = 20, 1e-6
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


class Gains(NamedTuple):
    """Gains of the drives of n joints.

    Attributes:
        values: (n,) effort at the joint per current [N m/A] or [N/A].
        errors: (n,) their standard errors.
    """

    values: Array
    errors: Array


def drive_gains(
    model: DynamicModel, unloaded: Sequence[Log], loaded: Sequence[Log], load: Link, *, mass_alone: bool = False
) -> Gains:
    """Return the gains of the drives of an arm.

    Args:
        model: of the arm, with a law of friction.
        unloaded: logs of currents without the load.
        loaded: logs of currents with it, best of the same motions.
        load: the load, in the tool frame.
        mass_alone: whether only its mass is known, not its centre and inertia.

    Raises:
        InvalidValueError: the load has no mass; a log is of another arm, or in other units.
        FileFormatError: positions look like degrees.
        TooFewError: too little motion is left.
        ContradictionError: a gain comes out as nothing.
    """
    positive(load.mass, "mass of the load", "kg")
    refuse_other_units(model.arm, [*unloaded, *loaded])
    n = model.arm.n
    body = body_of(load)
    known = np.array([body.mass, *body.moment, *(body.tensor[a][b] for a, b in _PAIRS)])
    unknown = list(range(1, OF_LINK)) if mass_alone else []
    known[unknown] = 0.0
    logs = [log.without_spikes().moving() for log in (*unloaded, *loaded)]
    preparation = preparation_of(logs)
    blocks: list[tuple[Equations, Array]] = []
    for log, carries in zip(logs, [False] * len(unloaded) + [True] * len(loaded), strict=True):
        both = LoadedModel(model=model, loaded=carries, of_arm=model.base.names)
        for block in equations(both, motions([log], preparation), preparation.decimation):
            own, of_load = block.columns[:, :, :-OF_LINK], block.columns[:, :, -OF_LINK:]
            columns = np.concatenate([own, of_load[:, :, unknown]], axis=2)
            blocks.append((block._replace(columns=columns), of_load @ known))
    inverse, x = _start(blocks, n)
    for _ in range(_MAX_STEPS):
        fit = weighted(summed(_linear(blocks, inverse, x)))
        step = np.abs(fit.values[-n:] - inverse).max()
        x, inverse = fit.values[:-n], fit.values[-n:]
        if step < _SETTLED * np.abs(inverse).max():
            break
    found = robust(list(_linear(blocks, inverse, x)))
    inverse, errors = found.values[-n:], found.errors[-n:]
    for i in np.flatnonzero(np.abs(inverse) < 3 * errors):
        raise ContradictionError(
            f"the load does not show in the currents of {model.arm.joint_label(int(i))}: move it, with and without load"
        )
    return Gains(values=1 / inverse, errors=errors / inverse**2)


def _start(blocks: Sequence[tuple[Equations, Array]], n: int) -> tuple[Array, Array]:
    """Return inverses of gains (n,), each by its own joint, and the parameters that follow."""
    inverse = np.zeros(n)
    for j in range(n):
        rows = [block.usable[:, j] for block, _ in blocks]
        parts = [np.hstack([block.columns[:, j], load[:, j, None]]) for block, load in blocks]
        A = np.concatenate([part[used] for part, used in zip(parts, rows, strict=True)])
        y = np.concatenate([block.tau[used, j] for (block, _), used in zip(blocks, rows, strict=True)])
        lengths = np.maximum(np.linalg.norm(A, axis=0), np.finfo(float).tiny)
        inverse[j] = np.linalg.lstsq(A / lengths, y, rcond=1e-8)[0][-1] / lengths[-1]
    safe = np.where(np.abs(inverse) > np.finfo(float).tiny, inverse, 1.0)
    scaled = [block._replace(tau=block.tau / safe - load) for block, load in blocks]
    return safe, weighted(summed(scaled)).values


def _linear(blocks: Sequence[tuple[Equations, Array]], inverse: Array, x: Array) -> list[Equations]:
    """Return the equations of currents, made linear at inverses of gains (n,) and parameters (b,)."""
    result = []
    for block, load in blocks:
        efforts = block.columns @ x + load
        own = np.zeros((*efforts.shape, len(inverse)))
        own[:, range(len(inverse)), range(len(inverse))] = efforts
        columns = np.concatenate([block.columns * inverse[:, None], own], axis=2)
        # i = inverse * efforts, to first order in both.
        tau = block.tau + inverse * (efforts - load)
        result.append(block._replace(columns=columns, tau=tau))
    return result
