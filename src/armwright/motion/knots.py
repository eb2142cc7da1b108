"""What profiles are given: points and when they are passed, two ends, limits; checked once for all of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armwright.arrays import LARGEST, Array, ArrayLike, floats, number, one_or_each, one_per_joint
from armwright.errors import InvalidValueError, ShapeError

# A motion shorter than a billionth of a second is a slip of the unit; powers of its time would not be numbers [s].
SHORTEST = 1e-9
# Nor would those of a time as long as this [s].
_MAX_LENGTH = 1e50
# A path of no joint farther than this is rounding of the inverse kinematics [rad] or [m].
NOWHERE = 1e-12


def timed_points(title: str, times: ArrayLike, points: ArrayLike, what: str = "points") -> tuple[Array, Array]:
    """Return times (k,) that rise, and points (k, n), two at least.

    Raises:
        KindError: one is something else than real numbers.
        ShapeError: fewer than two, or shapes that do not fit.
        InvalidValueError: the times do not rise, or a number is NaN or infinite.
    """
    t, q = floats(times, "times", LARGEST), floats(points, what, LARGEST)
    if t.ndim != 1 or q.ndim != 2 or len(t) != len(q) or len(t) < 2 or not q.size:
        raise ShapeError(f"{title}: expected k times and (k, n) {what} with k at least 2, got {t.shape} and {q.shape}")
    falls = np.flatnonzero(t[1:] <= t[:-1])
    if len(falls):
        i = int(falls[0])
        raise InvalidValueError(
            f"{title}: times must increase, got {t[i]:g} s and then {t[i + 1]:g} s at {what[:-1]} {i + 1}"
        )
    return t, q


def two_ends(q_start: ArrayLike, q_goal: ArrayLike) -> tuple[Array, Array]:
    """Return two configurations (n,).

    Raises:
        KindError: one is something else than real numbers.
        ShapeError: they are not (n,), both of them.
        InvalidValueError: a number is NaN or infinite.
    """
    start = joint_vector(q_start, "q_start")
    return start, one_per_joint(q_goal, len(start), "q_goal")


def joint_vector(value: ArrayLike, what: str = "displacement") -> Array:
    """Return one number per joint (n,), at least one.

    Raises:
        KindError: the value is something else than real numbers.
        ShapeError: it is not (n,).
        InvalidValueError: a number is NaN or infinite.
    """
    displacement = floats(value, what, LARGEST)
    if displacement.ndim != 1 or not displacement.size:
        raise ShapeError(f"{what}: expected shape (n,), got {displacement.shape}")
    return displacement


def check_duration(duration: float) -> float:
    """Return ``duration`` if a motion can last so long.

    Raises:
        KindError: it is no number.
        InvalidValueError: it is shorter than a billionth of a second, or longer than any motion.
    """
    duration = number(duration, "duration")
    if not duration >= SHORTEST:
        raise InvalidValueError(f"duration: expected at least {SHORTEST:g} s, got {duration}")
    if duration > _MAX_LENGTH:
        raise InvalidValueError(f"duration: expected at most {_MAX_LENGTH:g} s, got {duration:g}")
    return duration


def limit_per_joint(value: ArrayLike, joints: int, what: str) -> Array:
    """Return limits (n,) above 0; infinite where a joint has none. One number stands for all joints.

    Raises:
        KindError: the value is something else than real numbers.
        ShapeError: it is neither one number nor (n,).
        InvalidValueError: a limit is NaN, 0 or below.
    """
    limits = one_or_each(value, joints, what, "joint", np.inf)
    for j in np.flatnonzero(~(limits > 0)):
        raise InvalidValueError(f"{what}: expected more than 0, got {limits[j]:g} for joint {j + 1}")
    return limits


def rate_or_rest(rate: ArrayLike | None, joints: int, what: str) -> Array:
    """Return the joint rates (n,) at an end of a motion; 0 when they are left out.

    Raises:
        KindError: the rates are something else than real numbers.
        ShapeError: they are not (n,).
        InvalidValueError: a rate is NaN or infinite.
    """
    return np.zeros(joints) if rate is None else one_per_joint(rate, joints, what)


def segments_at(starts: Array, t: ArrayLike, count: int) -> npt.NDArray[np.intp]:
    """Return which (...) of ``count`` segments, by their ``starts`` (k,), times (...) are in; at a start the next."""
    # np.clip would take many times as long as these.
    return np.asarray(np.minimum(np.maximum(starts.searchsorted(t, side="right") - 1, 0), count - 1), dtype=np.intp)


def divided(times: Array, parts: npt.NDArray[np.intp]) -> Array:
    """Return times (k,) with every interval divided into so many parts (k - 1,)."""
    h = np.repeat(np.diff(times) / parts, parts)
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.append(np.repeat(times[:-1], parts) + number * h, times[-1])
