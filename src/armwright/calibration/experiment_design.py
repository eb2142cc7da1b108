"""Which poses to measure: those that tell most of an arm's errors.

Source:
    Borm & Menq (1991); Driels & Pathre (1990); Nahvi, Hollerbach, Hayward (1994); Nahvi & Hollerbach (1996).
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.calibration.chain import Chain, chain_of
from armwright.calibration.cross_validation import FOLDS
from armwright.calibration.identifiability import is_overdetermined, preferred_parameters, select_identifiable
from armwright.errors import InvalidValueError, one_of

Index: TypeAlias = Literal["O1", "O2", "O3", "O4", "O5"]
INDICES: tuple[Index, ...] = ("O1", "O2", "O3", "O4", "O5")

# As many candidates, and so many for each pose that is asked for.
_CANDIDATES, _EACH = 400, 4
# More poses than anybody measures.
_MOST_POSES = 10_000
# Poses are exchanged for better ones so often at most.
_MOST_EXCHANGES = 200
# Noise at which one asks what can be told at all [m], [rad].
_USUAL_NOISE, _USUAL_TURN = 1e-4, 5e-4


class Observability(NamedTuple):
    """How well poses tell errors that are counted in metres and radians; the larger the better.

    Attributes:
        O1: geometric mean of the singular values, by the root of the number of poses.
        O2: smallest by largest: the inverse of the condition number.
        O3: the smallest.
        O4: the smallest, squared, by the largest: how little noise is amplified.
        O5: the inverse of the sum of their inverses.
    """

    O1: float
    O2: float
    O3: float
    O4: float
    O5: float


class MeasurementPlan(NamedTuple):
    """Poses to measure.

    Attributes:
        q: (m, n) joint positions [rad] or [m].
        observability: of these poses, with those that were measured before.
        by_chance: that of as many poses taken by chance, the median of some tries.
        names: of the errors that they tell.
    """

    q: Array
    observability: Observability
    by_chance: Observability
    names: tuple[str, ...]


def observability(chain: Chain, q: Array, kept: list[int], *, turns: bool = False) -> Observability:
    """Return how well poses (m, n), or their places alone, tell the errors with these numbers."""
    return _indices(_rows(chain, q, turns=turns)[:, :, kept].reshape(-1, len(kept)), len(q))


def plan_poses(
    arm: Arm,
    count: int,
    *,
    index: Index = "O1",
    seed: int = 0,
    candidates: int | None = None,
    turns: bool = False,
    measured: ArrayLike | None = None,
    progress: Callable[[int], None] | None = None,
) -> MeasurementPlan:
    """Return poses inside the limits that tell an arm's errors well, beside those that were measured before.

    Poses are taken one by one from candidates drawn by chance, each the one that adds most to what is told of all
    errors together (the determinant); then single ones are exchanged as long as the index asked for gets better.

    Args:
        arm: with n joints.
        count: how many poses.
        index: O1 to O5; see ``Observability``.
        seed: of the candidates.
        candidates: how many there are; 400 when left out, or 4 for each pose if that is more.
        turns: whether turns are measured too, not places alone.
        measured: (k, n) postures that were measured before [rad] or [m]; none when left out.
        progress: told how many poses are chosen.

    Raises:
        InvalidValueError: so few poses do not tell the errors of the arm, or there are fewer candidates.
        ShapeError: ``measured`` does not fit.
        UnknownNameError: there is no such index.
    """
    one_of("index", index, INDICES)
    if not 1 <= count <= _MOST_POSES:
        expected = "1 pose or more" if count < 1 else f"{_MOST_POSES:,} poses or fewer"
        raise InvalidValueError(f"count: expected {expected}, got {count}")
    chain = chain_of(arm)
    rng = np.random.default_rng(seed)
    if candidates is None:
        candidates = max(_CANDIDATES, _EACH * count)
    if candidates < count:
        raise InvalidValueError(f"candidates: expected {count} or more, got {candidates}")
    lower, upper = ranges(arm)
    q = lower + (upper - lower) * rng.random((candidates, arm.n))
    before = np.zeros((0, arm.n)) if measured is None else np.atleast_2d(joint_array(measured, arm.n, "measured"))
    slopes = _rows(chain, np.vstack([q, before]), turns=turns)
    J = slopes.reshape(-1, len(chain.names))
    told = select_identifiable(chain.names, J, chain.is_length, _USUAL_NOISE, first=preferred_parameters(chain.names))
    kept = list(told.kept)
    numbers, poses = slopes.shape[1], count + len(before)
    fewest = _fewest(numbers, len(kept))
    if poses < fewest:
        raise InvalidValueError(
            f"count: {arm.name} has {len(kept)} errors that {'poses' if turns else 'points'} can tell, and one in "
            f"{FOLDS} poses is held out to see how good a calibration is; expected {fewest - len(before)} poses or "
            f"more, got {count}"
        )
    rows, fixed = slopes[:, :, kept], list(range(candidates, len(slopes)))
    taken = _greedy(rows, count, fixed, progress)
    taken = _exchanged(rows, taken, fixed, INDICES.index(index))
    chance = [
        _indices(_stacked(rows, [*rng.choice(candidates, count, replace=False).tolist(), *fixed]), poses)
        for _ in range(15)
    ]
    return MeasurementPlan(
        q=q[taken],
        observability=_indices(_stacked(rows, [*taken, *fixed]), poses),
        by_chance=Observability(*(float(np.median([one[i] for one in chance])) for i in range(len(INDICES)))),
        names=tuple(chain.names[i] for i in kept),
    )


def _fewest(numbers: int, errors: int) -> int:
    """Return how many poses are enough for so many errors, each measured by so many numbers.

    A calibration is judged by poses that it has not seen: those that are left have to be enough.
    """
    return next(
        more for more in itertools.count(FOLDS) if is_overdetermined(numbers * (more - math.ceil(more / FOLDS)), errors)
    )


def _rows(chain: Chain, q: Array, *, turns: bool) -> Array:
    """Return (m, 3 or 6, k) what is measured in each posture by all errors; turns as lengths of the same noise."""
    reached = chain.reach(q)
    if not turns:
        return reached.by_position
    return np.concatenate([reached.by_position, reached.by_turn * (_USUAL_NOISE / _USUAL_TURN)], axis=1)


def _stacked(rows: Array, taken: Sequence[int]) -> Array:
    return np.asarray(rows[list(taken)].reshape(-1, rows.shape[-1]), dtype=np.float64)


def _indices(A: Array, poses: int) -> Observability:
    s = np.linalg.svd(A, compute_uv=False)
    if len(s) < A.shape[1] or s[-1] <= 1e-12 * s[0]:
        return Observability(0.0, 0.0, 0.0, 0.0, 0.0)
    return Observability(
        O1=float(np.exp(np.log(s).mean()) / np.sqrt(poses)),
        O2=float(s[-1] / s[0]),
        O3=float(s[-1]),
        O4=float(s[-1] ** 2 / s[0]),
        O5=float(1.0 / (1.0 / s).sum()),
    )


def _greedy(rows: Array, count: int, fixed: Sequence[int], progress: Callable[[int], None] | None) -> list[int]:
    """Return the poses that add most to the determinant, one after the other."""
    known = _stacked(rows, fixed)
    information = 1e-6 * np.eye(rows.shape[-1]) + known.T @ known
    taken: list[int] = []
    for _ in range(count):
        inverse = np.linalg.inv(information)
        # det(I + A C Aᵀ) of the rows of each candidate.
        gains = np.linalg.det(np.eye(rows.shape[1]) + rows @ inverse @ np.swapaxes(rows, 1, 2))
        gains[[*taken, *fixed]] = -np.inf
        best = int(np.argmax(gains))
        taken.append(best)
        information = information + rows[best].T @ rows[best]
        if progress is not None:
            progress(len(taken))
    return taken


def _exchanged(rows: Array, taken: list[int], fixed: list[int], index: int) -> list[int]:
    """Exchange single poses for others as long as the index gets better."""
    rng = np.random.default_rng(0)
    best = _indices(_stacked(rows, [*taken, *fixed]), len(taken) + len(fixed))[index]
    others = [i for i in range(len(rows) - len(fixed)) if i not in taken]
    for _ in range(min(_MOST_EXCHANGES, len(others) * len(taken))):
        place, other = int(rng.integers(len(taken))), int(rng.integers(len(others)))
        tried = taken.copy()
        tried[place] = others[other]
        value = _indices(_stacked(rows, [*tried, *fixed]), len(tried) + len(fixed))[index]
        if value > best:
            others[other], taken, best = taken[place], tried, value
    return taken
