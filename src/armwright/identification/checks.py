"""What is wrong with a log: gaps, clipped currents, other units, joints that stand still or are swapped."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import ContradictionError, FileFormatError, InvalidValueError, counted, listed
from armwright.identification.equations import Equations
from armwright.identification.log import LEAST_MOTION, Log
from armwright.identification.model import DynamicModel
from armwright.identification.result import Prediction
from armwright.identification.signals import Motion

# Velocities that differ from the derivative of positions by more than this part are in other units.
_OTHER_UNIT = 0.2
# A joint that is so many times as fast as it can be is in another unit, or its times are.
_TOO_FAST = 5.0
# Where no joint reaches this part of its speed, times are in another unit, too.
_TOO_SLOW = 0.01
# Efforts that are so many times what the drawing asks for, or so small a part, are in another unit.
_TOO_STRONG = 30.0
# Swapped joints explain this part less of their residuals' squares, both.
_SWAPPED = 0.5
# Efforts of a joint that count the other way explain so little of all residuals' squares, by those of each joint.
_REVERSED = 0.4
# A joint of whose efforts more than this part is not explained.
_UNEXPLAINED = 0.7
_MAX_NAMED = 5
_TINY = float(np.finfo(float).tiny)
_UNITS = {
    math.degrees(1): "they look like degrees per second",
    1000.0: "they look like thousandths, or the times like milliseconds",
    1e-3: "the times look like thousandths of seconds",
    -1.0: "they count in the other direction",
}


def refuse_other_units(arm: Arm, logs: Sequence[Log]) -> None:
    """Refuse logs in other units, and joints that are not those of the arm.

    Raises:
        FileFormatError: positions or velocities are in another unit.
        InvalidValueError: a log has another number of joints, other velocities than its positions have, or efforts that
            never change.
    """
    for log in logs:
        if log.n != arm.n:
            raise InvalidValueError(f"{log.name}: expected {counted(arm.n, 'joint')} of {arm.name}, got {log.n}")
        if not np.ptp(log.effort, axis=0).any():
            raise InvalidValueError(f"{log.name}: no effort ever changes: are they efforts, and is the log complete?")
        if mistake := degrees_by_mistake(arm, log.q):
            raise FileFormatError(log.name, None, "", f"{mistake}; are the units right?")
        rate = np.gradient(log.q, log.t, axis=0)
        fastest = np.quantile(np.abs(rate), 0.99, axis=0)
        for i in np.flatnonzero(fastest > _TOO_FAST * arm.limits.speed):
            unit = arm.joints[i].units.position
            raise InvalidValueError(
                f"{log.name}: {arm.joint_label(int(i))} moves at {fastest[i]:.3g} {unit}/s, and its limit is "
                f"{arm.limits.speed[i]:.3g} {unit}/s; are the units of positions and times right?"
            )
        if log.qd is not None:
            _refuse_other_velocities(arm, log, rate)


def _refuse_other_velocities(arm: Arm, log: Log, rate: Array) -> None:
    for i in range(log.n):
        own = log.qd[:, i] if log.qd is not None else rate[:, i]
        if np.ptp(log.q[:, i]) < LEAST_MOTION or not own.any():
            continue
        factor = float(own @ rate[:, i] / (rate[:, i] @ rate[:, i]))
        if abs(factor - 1) > _OTHER_UNIT:
            near = min(_UNITS, key=lambda unit: abs(factor - unit) / abs(unit))
            hint = f": {_UNITS[near]}" if abs(factor - near) < _OTHER_UNIT * abs(near) else ""
            raise InvalidValueError(
                f"{log.name}: the velocities of {arm.joint_label(i)} are {factor:.3g} times the derivative of its "
                f"positions{hint}"
            )


def log_warnings(arm: Arm, logs: Sequence[Log]) -> Iterator[str]:
    """Give warnings of repeated times, gaps, clipped efforts and joints that do not move."""
    yield from dict.fromkeys(note for log in logs for note in log.notes)
    for log in logs:
        fastest = np.quantile(np.abs(np.gradient(log.q, log.t, axis=0)), 0.99, axis=0)
        if (fastest < _TOO_SLOW * arm.limits.speed).all() and np.isfinite(arm.limits.speed).any():
            part = float((fastest / arm.limits.speed).max())
            yield f"{log.name}: no joint reaches more than {part:.1g} of its largest speed: are the times in seconds?"
        gaps = log.gaps()
        if gaps:
            where = listed([f"{length:.3g} s at {start:.4g} s" for start, length in gaps], _MAX_NAMED)
            yield f"{log.name}: {counted(len(gaps), 'gap')} ({where}); the parts between them are filtered apart"
        for i in np.flatnonzero(log.clipped.any(axis=0)):
            count, largest = int(log.clipped[:, i].sum()), float(np.abs(log.effort[log.clipped[:, i], i]).max())
            yield (
                f"{log.name}: the effort of {arm.joint_label(int(i))} stays at {largest:.4g} "
                f"{arm.joints[i].units.effort}, {counted(count, 'reading')} together: clipped, and left out"
            )
    moves = [np.ptp(log.q, axis=0) >= LEAST_MOTION for log in logs]
    constant = [np.ptp(log.effort, axis=0) == 0 for log in logs]
    for i in np.flatnonzero(np.any(moves, axis=0) & np.all(constant, axis=0)):
        yield f"the effort of {arm.joint_label(int(i))} never changes while it moves: was it measured?"
    travel = np.max([np.ptp(log.q, axis=0) for log in logs], axis=0)
    for i in np.flatnonzero(travel < LEAST_MOTION):
        label = arm.joint_label(int(i))
        yield f"{label} does not move in any log: nothing is learnt of its drive, and little of its link"


def effort_warnings(arm: Arm, motions: Sequence[Motion]) -> Iterator[str]:
    """Give a warning of efforts that have nothing to do with what the drawing of an arm asks for."""
    if any(link.unknown for link in arm.links) or not any(link.mass for link in arm.links):
        return
    measured = np.concatenate([motion.tau[::10] for motion in motions])
    states = [np.concatenate([getattr(motion, name)[::10] for motion in motions]) for name in ("q", "qd", "qdd")]
    asked = inverse_dynamics(arm, *states)
    loaded = int(np.argmax(asked.std(axis=0)))
    ratio = float(measured[:, loaded].std() / max(asked[:, loaded].std(), np.finfo(float).tiny))
    if not 1 / _TOO_STRONG < ratio < _TOO_STRONG:
        yield (
            f"the efforts of {arm.joint_label(loaded)} vary {ratio:.3g} times as much as the masses of the drawing ask "
            "for: are the units or the drive gains right?"
        )


def refuse_swapped(model: DynamicModel, blocks: Sequence[Equations]) -> None:
    """Refuse logs in which the efforts of two joints are swapped, or count in the other direction.

    Raises:
        ContradictionError: the motion explains the efforts much better if they are swapped back.
    """
    n = model.arm.n
    # Equations in which all joints move.
    moving = [np.flatnonzero(np.all(block.usable, axis=1)) for block in blocks]
    A = np.concatenate([block.columns[rows] for block, rows in zip(blocks, moving, strict=True)])
    tau = np.concatenate([block.tau[rows] for block, rows in zip(blocks, moving, strict=True)])
    if tau.size <= A.shape[2]:
        # Where joints never move together, nothing tells one from another.
        return
    # Every joint counts by its own columns, whichever efforts it is given.
    N = np.einsum("knb,knc->bc", A, A, optimize=True)
    lengths = np.sqrt(np.maximum(N.diagonal(), np.finfo(float).tiny))
    inverse = np.linalg.pinv(N / np.outer(lengths, lengths), rcond=1e-10, hermitian=True) / np.outer(lengths, lengths)
    right = np.einsum("knb,kj->njb", A, tau, optimize=True)

    def squares(order: Sequence[int], signs: Array) -> Array:
        values = inverse @ sum(signs[i] * right[i, j] for i, j in enumerate(order))
        return np.asarray(((tau[:, list(order)] * signs - A @ values) ** 2).sum(axis=0))

    same = np.ones(n)
    straight = squares(range(n), same)
    for i in range(n):
        turned = squares(range(n), np.where(np.arange(n) == i, -1.0, 1.0)) / np.maximum(straight, _TINY)
        if turned[i] < _REVERSED and turned.mean() < _REVERSED:
            raise ContradictionError(
                f"the efforts of {model.arm.joint_label(i)} look reversed: counted the other way, what the motion does "
                f"not explain falls to {math.sqrt(turned.mean()):.0%}"
            )
    for i, j in combinations(range(n), 2):
        order = list(range(n))
        order[i], order[j] = j, i
        swapped = squares(order, same)
        # Squares of the efforts of i and j, however they are numbered.
        if swapped[i] < _SWAPPED * straight[j] and swapped[j] < _SWAPPED * straight[i]:
            raise ContradictionError(
                f"the efforts of {model.arm.joint_label(i)} and {model.arm.joint_label(j)} look swapped: swapped back, "
                f"what the motion does not explain falls to {math.sqrt(swapped[j] / straight[i]):.0%} and "
                f"{math.sqrt(swapped[i] / straight[j]):.0%}"
            )


def badly_explained(arm: Arm, fitted: Sequence[Prediction]) -> Iterator[str]:
    """Give a warning of joints of whose efforts motions explain hardly anything."""
    errors = np.sqrt(np.mean([((each.measured - each.predicted) ** 2).mean(axis=0) for each in fitted], axis=0))
    sizes = np.sqrt(np.mean([(each.measured**2).mean(axis=0) for each in fitted], axis=0))
    bad = [str(i + 1) for i in np.flatnonzero((errors > _UNEXPLAINED * sizes) & (sizes > 0))]
    if bad:
        yield (
            f"the motion explains hardly anything of the efforts of joint{'s' * (len(bad) > 1)} {', '.join(bad)} of "
            f"{arm.name}: are the units, the signs, the times and the order of the joints right?"
        )


def refuse_reversed(model: DynamicModel, values: Array, errors: Array) -> None:
    """Refuse efforts that drive a joint by its friction: they count in the other direction than its positions.

    Args:
        model: of the arm.
        values: (b,) base parameters.
        errors: (b,) their standard errors.

    Raises:
        ContradictionError: the friction of a joint is clearly negative.
    """
    names = model.base.names
    for i in range(model.arm.n):
        columns = [names.index(name) for term in ("viscous", "coulomb") if (name := f"{term}{i + 1}") in names]
        if columns and all(values[k] < -_MAX_NAMED * errors[k] for k in columns):
            raise ContradictionError(
                f"the friction of {model.arm.joint_label(i)} comes out negative: its efforts or its positions count in "
                "the other direction"
            )
