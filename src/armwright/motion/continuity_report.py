"""How smooth a motion is: what jumps where, at every knot and at both ends."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, Flags, not_negative, read_only, reduce_by_fields
from armwright.errors import KindError, shown
from armwright.motion.polynomials import derivative, evaluate
from armwright.motion.trajectory import Trajectory

NAMES = ("position", "speed", "acceleration", "jerk")
# Of numbers of size 1 on a segment of 1 s rounding leaves so much of a derivative.
_ROUNDING = 64 * np.finfo(np.float64).eps


@attrs.frozen(kw_only=True, eq=False)
class Continuity:
    """What jumps in a motion of n joints.

    Attributes:
        times: (k,) of the knots, start and end among them [s].
        jumps: (4, k, n) of position, speed, acceleration and jerk: the value just after a knot less that just
            before. Before the start and after the end the joints stand still.
        counted: (4, k, n) which of them are larger than the tolerance and than what rounding leaves.
        tolerance: part of the largest magnitude that the derivative has in any joint and at any time.
    """

    times: Array = attrs.field(converter=read_only)
    jumps: Array = attrs.field(converter=read_only)
    counted: Flags = attrs.field(converter=read_only)
    tolerance: float

    __reduce__ = reduce_by_fields

    @property
    def order(self) -> int:
        """The highest derivative up to which nothing jumps at the knots between start and end.

        0 is position, 3 jerk, the highest that is sampled; -1 where the position jumps already.
        """
        return _order(self.counted[:, 1:-1])

    @property
    def order_at_ends(self) -> tuple[int, int]:
        """The same at the start and at the end, against rest."""
        return _order(self.counted[:, :1]), _order(self.counted[:, -1:])

    def largest(self, order: int) -> Array:
        """Return the largest magnitude of the jumps between start and end, (n,); 0 where there is no knot."""
        return np.asarray(np.abs(self.jumps[order, 1:-1]).max(axis=0, initial=0.0))

    def __str__(self) -> str:
        """Say it in a few lines."""
        inside = len(self.times) - 2
        lines = [f"at {inside} knots: {_smooth(self.order)}" if inside else "no knots between start and end"]
        for order in range(self.order + 1, 4) if inside else ():
            count = int(self.counted[order, 1:-1].any(axis=-1).sum())
            if not count:
                continue
            jumps = np.abs(self.jumps[order, 1:-1])
            k, j = np.unravel_index(int(jumps.argmax()), jumps.shape)
            lines.append(
                f"  {NAMES[order]} jumps at {count} of them, most at {self.times[k + 1]:.6g} s: joint {j + 1} by "
                f"{jumps[k, j]:.6g}"
            )
        for name, order, index in zip(("start, from rest", "end, to rest"), self.order_at_ends, (0, -1), strict=True):
            line = f"at the {name}: {_smooth(order)}"
            if order < 3:
                jumps = np.abs(self.jumps[order + 1, index])
                line += f"; {NAMES[order + 1]} jumps, most in joint {jumps.argmax() + 1} by {jumps.max():.6g}"
            lines.append(line)
        return "\n".join(lines)


def continuity(trajectory: Trajectory, *, tolerance: float = 1e-9) -> Continuity:
    """Return what jumps at the knots of a motion and, against rest, at both of its ends.

    Args:
        trajectory: the motion. Segments without duration are left out.
        tolerance: a jump counts that is larger than this part of the largest magnitude which the derivative has in
            any joint at any time, and larger than what rounding leaves on segments so short.

    Raises:
        KindError: ``trajectory`` is none, or the tolerance no number.
        InvalidValueError: the tolerance is below 0.
    """
    if not isinstance(trajectory, Trajectory):
        raise KindError(f"continuity: expected a trajectory, got {shown(trajectory)}")
    tolerance = not_negative(tolerance, "tolerance")
    lengths = np.diff(trajectory.times)
    lasting = lengths > 0
    if not lasting.any():
        lasting[-1] = True
    lengths, terms = lengths[lasting], trajectory.coefficients[lasting]
    times = np.append(trajectory.times[:-1][lasting], trajectory.duration)
    around = np.minimum(np.append(np.inf, lengths), np.append(lengths, np.inf))
    size = np.abs(trajectory.coefficients[:, 0]).max()
    jumps, counted = [], []
    for order in range(4):
        of = derivative(terms, order)
        starts, ends = of[:, 0], evaluate(of, lengths[:, None])
        still = np.zeros_like(starts[:1])
        before = np.concatenate([still if order else starts[:1], ends])
        after = np.concatenate([starts, still if order else ends[-1:]])
        largest = trajectory.peaks(order).max()
        with np.errstate(divide="ignore", over="ignore"):
            rounding = _ROUNDING * size / np.where(around > 0, around, np.inf) ** order
        jumps.append(after - before)
        counted.append(np.abs(after - before) > np.maximum(tolerance * largest, rounding)[:, None])
    return Continuity(times=times, jumps=np.stack(jumps), counted=np.stack(counted), tolerance=tolerance)


def _order(counted: Flags) -> int:
    jumping = np.flatnonzero(counted.any(axis=(1, 2)))
    return int(jumping[0]) - 1 if len(jumping) else 3


def _smooth(order: int) -> str:
    if order < 0:
        return "position is discontinuous"
    names = NAMES[: order + 1]
    text = " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]
    return f"{text} {'are' if len(names) > 1 else 'is'} continuous"
