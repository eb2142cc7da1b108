"""Laws of friction to choose from, and the friction of joints at rest."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Flags
from armwright.identification.model import DynamicModel
from armwright.identification.signals import Motion

# What acts at a moving joint alone, and what of it jumps as the joint reverses.
_MOVING = ("viscous", "coulomb", "forward", "backward", "cube_root", "stribeck")
_DRY = ("coulomb", "forward", "backward", "stribeck")
# A joint has stopped when it has been at rest so long; when it reverses, it is for less [s].
_STOPPED = 0.2
# A speed that has a direction, and is no speed [rad/s, m/s].
_CREEP = 1e-12


class Law(NamedTuple):
    """A law of friction.

    Attributes:
        name: of it.
        terms: of ``model.TERMS``.
        speed_part: speed at which 1/e of its Stribeck friction is left, by the greatest speed of the joint; 0 for none.
    """

    name: str
    terms: tuple[str, ...]
    speed_part: float = 0.0

    def model(self, model: DynamicModel, speeds: Array) -> DynamicModel:
        """Return a model with this friction, given the greatest speeds (n,) of the joints; other terms stay."""
        others: tuple[str, ...] = tuple(term for term in model.terms if term not in (*_MOVING, "offset"))
        return attrs.evolve(
            model,
            terms=others + self.terms,
            stribeck_speed=self.speed_part * speeds if self.speed_part else model.stribeck_speed,
        )


_PLAIN = ("viscous", "coulomb", "offset")
LAWS = (
    Law("viscous and Coulomb", _PLAIN[:2]),
    Law("with an offset", _PLAIN),
    Law("with the cube root of the speed", (*_PLAIN, "cube_root")),
    Law("with Stribeck friction below 5% of the speed", (*_PLAIN, "stribeck"), 0.05),
    Law("with Stribeck friction below 20% of the speed", (*_PLAIN, "stribeck"), 0.2),
)


def predicted(model: DynamicModel, values: Array, motion: Motion, slow: Array, held: float) -> Array:
    """Return the efforts (k, n) of a motion.

    The dry friction of a slow joint acts in the direction from which it came; when it has stopped, a share is left.

    Args:
        model: of the arm.
        values: (b,) base parameters.
        motion: of the arm.
        slow: (n,) speeds below which a joint is at rest [rad/s] or [m/s].
        held: the share of friction at rest.
    """
    smooth, dry, stopped = _parts(model, values, motion, slow)
    return np.asarray(smooth + np.where(stopped, held, 1.0) * dry)


def without_dry(model: DynamicModel, values: Array) -> Array:
    """Return base parameters (b,) without dry friction, whose rate is 0 but for the moments at which it jumps."""
    return np.where(_is_dry(model), 0.0, values)


def _is_dry(model: DynamicModel) -> Flags:
    return np.array([name.rstrip("0123456789").removeprefix("coupled_") in _DRY for name in model.base.names])


def held_share(model: DynamicModel, values: Array, motions: Iterable[Motion], slow: Array) -> float:
    """Return the share of dry friction, 0 to 1, that joints keep when they have stopped between motions.

    Args:
        model: of the arm.
        values: (b,) base parameters.
        motions: in which joints stop; without stops the share is 1, as if nothing had changed.
        slow: (n,) speeds below which a joint is at rest.
    """
    product, square = 0.0, 0.0
    for motion in motions:
        smooth, dry, stopped = _parts(model, values, motion, slow)
        kept = dry * stopped
        product, square = product + float((kept * (motion.tau - smooth)).sum()), square + float((kept**2).sum())
    return float(np.clip(product / square, 0.0, 1.0)) if square > 0 else 1.0


def _parts(model: DynamicModel, values: Array, motion: Motion, slow: Array) -> tuple[Array, Array, Flags]:
    """Return efforts without dry friction (k, n), dry friction, which lags behind slow speeds, and who has stopped."""
    rest = np.abs(motion.qd) <= slow
    least = max(1, int(_STOPPED / (motion.t[1] - motion.t[0])))
    stopped = np.stack([_long_runs(column, least) for column in rest.T], axis=1)
    latest = np.maximum.accumulate(np.where(rest, -1, np.arange(len(rest))[:, None]), axis=0)
    came = np.sign(np.take_along_axis(motion.qd, np.maximum(latest, 0), axis=0)) * (latest >= 0)
    is_dry = _is_dry(model)
    smooth = model.base_columns(motion.q, motion.qd, motion.qdd) @ np.where(is_dry, 0.0, values)
    speed = np.where(rest, came * _CREEP, motion.qd)
    dry = model.base_columns(motion.q, speed, motion.qdd) @ np.where(is_dry, values, 0.0)
    return smooth, dry, stopped


def _long_runs(flags: Flags, least: int) -> Flags:
    """Return which of some flags belong to runs of at least a length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    result = np.zeros(len(flags), dtype=np.bool_)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        result[first:last] = last - first >= least
    return result
