"""Design of experiments: poses to measure in which the errors of an arm are most observable.

Source:
    Borm & Menq (1991); Driels & Pathre (1990); Nahvi, Hollerbach, Hayward (1994); Nahvi & Hollerbach (1996).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.cross_validation import FOLDS
from armwright.calibration.identifiability import is_overdetermined, preferred_parameters, select_identifiable
from armwright.errors import InvalidValueError, one_of
from armwright.files.result_table import ResultTable

Index: TypeAlias = Literal["O1", "O2", "O3", "O4", "O5"]
INDICES: tuple[Index, ...] = ("O1", "O2", "O3", "O4", "O5")

# Candidates in all, and at least so many for each pose that is asked for.
_CANDIDATES, _PER_POSE = 400, 4
# More poses than anybody measures.
_MAX_POSES = 10_000
# Exchanges of single poses at most.
_MAX_EXCHANGES = 200
# Noise for which errors have to be identifiable [m], [rad].
_NOISE_LENGTH, _NOISE_ANGLE = 1e-4, 5e-4


class Observability(NamedTuple):
    """Observability indices of errors in metres and radians; the larger the better.

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
        random: that of as many random poses, the median of some draws.
        names: of the errors that are identifiable.
    """

    q: Array
    observability: Observability
    random: Observability
    names: tuple[str, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """The identifiable errors, in a sentence."""
        return (f"{len(self.q)} poses make {len(self.names)} errors identifiable: {', '.join(self.names)}",)

    def as_data(self) -> dict[str, Any]:
        """Return the plan as plain data in SI units."""
        return {
            "q": self.q.tolist(),
            "identifiable": list(self.names),
            "observability": self.observability._asdict(),
            "random": self.random._asdict(),
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the table of the observability indices, beside those of random poses."""
        rows = zip(Observability._fields, self.observability, self.random, strict=True)
        shown = ((name, f"{planned:.4g}", f"{random:.4g}") for name, planned, random in rows)
        yield ResultTable(title="", heads=("index", "planned poses", "random poses"), rows=shown, numbers=(1, 2))


def observability(chain: Chain, q: Array, fitted: list[int], *, rotations: bool = False) -> Observability:
    """Return the observability of the errors with these numbers by poses (m, n), or by their positions alone."""
    return _observability(_jacobians(chain, q, rotations=rotations)[:, :, fitted], range(len(q)))


def plan_poses(
    arm: Arm,
    count: int,
    *,
    index: Index = "O1",
    seed: int = 0,
    candidates: int | None = None,
    rotations: bool = False,
    measured: ArrayLike | None = None,
    progress: Callable[[int], None] | None = None,
) -> MeasurementPlan:
    """Return poses within the limits in which an arm's errors are observable, beside those that were measured before.

    Poses are taken one by one from random candidates, each the one that increases the determinant of the information
    matrix most (D-optimal); then single ones are exchanged as long as the index asked for gets better.

    Args:
        arm: with n joints.
        count: how many poses.
        index: O1 to O5; see ``Observability``.
        seed: of the candidates.
        candidates: how many there are; 400 when left out, or 4 for each pose if that is more.
        rotations: whether rotations are measured too, not positions alone.
        measured: (k, n) configurations that were measured before [rad] or [m]; none when left out.
        progress: called with how many poses are chosen.

    Raises:
        InvalidValueError: so few poses do not identify the errors of the arm, or there are fewer candidates.
        ShapeError: ``measured`` does not fit.
        UnknownNameError: there is no such index.
    """
    one_of("index", index, INDICES)
    if not 1 <= count <= _MAX_POSES:
        expected = "1 pose or more" if count < 1 else f"{_MAX_POSES:,} poses or fewer"
        raise InvalidValueError(f"count: expected {expected}, got {count}")
    chain, rng = kinematic_chain(arm), np.random.default_rng(seed)
    candidates = max(_CANDIDATES, _PER_POSE * count) if candidates is None else candidates
    if candidates < count:
        raise InvalidValueError(f"candidates: expected {count} or more, got {candidates}")
    lower, upper = ranges(arm)
    q = lower + (upper - lower) * rng.random((candidates, arm.n))
    before = np.zeros((0, arm.n)) if measured is None else np.atleast_2d(joint_array(measured, arm.n, "measured"))
    every = _jacobians(chain, np.vstack([q, before]), rotations=rotations)
    J, first = every.reshape(-1, len(chain.names)), preferred_parameters(chain.names)
    fitted = list(select_identifiable(chain.names, J, chain.is_length, _NOISE_LENGTH, first=first).fitted)
    # A calibration is assessed by poses that it was not fitted to: the others have to be enough.
    fewest = next(
        poses
        for poses in itertools.count(FOLDS)
        if is_overdetermined(every.shape[1] * (poses - math.ceil(poses / FOLDS)), len(fitted))
    )
    if count + len(before) < fewest:
        raise InvalidValueError(
            f"count: {arm.name} has {len(fitted)} errors that {'poses' if rotations else 'points'} identify, and one "
            f"in {FOLDS} poses is held out to assess a calibration; expected {fewest - len(before)} poses or "
            f"more, got {count}"
        )
    jacobians, fixed = every[:, :, fitted], list(range(candidates, len(every)))
    selection = _select_greedily(jacobians, count, fixed, progress)
    selection = _exchange_poses(jacobians, selection, fixed, INDICES.index(index))
    draws = [
        _observability(jacobians, [*rng.choice(candidates, count, replace=False).tolist(), *fixed]) for _ in range(15)
    ]
    return MeasurementPlan(
        q=q[selection],
        observability=_observability(jacobians, [*selection, *fixed]),
        random=Observability(*(float(np.median(values)) for values in zip(*draws, strict=True))),
        names=tuple(chain.names[i] for i in fitted),
    )


def _jacobians(chain: Chain, q: Array, *, rotations: bool) -> Array:
    """Return (m, 3 or 6, k) the Jacobian of each pose by all errors; rotations as lengths of the same noise."""
    tool = chain.forward(q)
    if not rotations:
        return tool.position_jacobian
    return np.concatenate([tool.position_jacobian, tool.rotation_jacobian * (_NOISE_LENGTH / _NOISE_ANGLE)], axis=1)


def _stack(jacobians: Array, selection: Sequence[int]) -> Array:
    return np.asarray(jacobians[list(selection)].reshape(-1, jacobians.shape[-1]), dtype=np.float64)


def _observability(jacobians: Array, selection: Sequence[int]) -> Observability:
    """Return the observability by some of the poses whose Jacobians these are."""
    s = np.linalg.svd(_stack(jacobians, selection), compute_uv=False)
    if len(s) < jacobians.shape[-1] or s[-1] <= 1e-12 * s[0]:
        return Observability(0.0, 0.0, 0.0, 0.0, 0.0)
    return Observability(
        O1=float(np.exp(np.log(s).mean()) / np.sqrt(len(selection))),
        O2=float(s[-1] / s[0]),
        O3=float(s[-1]),
        O4=float(s[-1] ** 2 / s[0]),
        O5=float(1.0 / (1.0 / s).sum()),
    )


def _select_greedily(
    jacobians: Array, count: int, fixed: Sequence[int], progress: Callable[[int], None] | None
) -> list[int]:
    """Return the poses that add most to the determinant, one after the other."""
    before = _stack(jacobians, fixed)
    information = 1e-6 * np.eye(jacobians.shape[-1]) + before.T @ before
    selection: list[int] = []
    for _ in range(count):
        inverse = np.linalg.inv(information)
        # det(I + A C Aᵀ) of the rows of each candidate.
        gains = np.linalg.det(np.eye(jacobians.shape[1]) + jacobians @ inverse @ np.swapaxes(jacobians, 1, 2))
        gains[[*selection, *fixed]] = -np.inf
        best = int(np.argmax(gains))
        selection.append(best)
        information = information + jacobians[best].T @ jacobians[best]
        if progress is not None:
            progress(len(selection))
    return selection


def _exchange_poses(jacobians: Array, selection: list[int], fixed: list[int], index: int) -> list[int]:
    """Exchange single poses for others as long as the index gets better."""
    rng = np.random.default_rng(0)
    best = _observability(jacobians, [*selection, *fixed])[index]
    others = [i for i in range(len(jacobians) - len(fixed)) if i not in selection]
    for _ in range(min(_MAX_EXCHANGES, len(others) * len(selection))):
        position, other = int(rng.integers(len(selection))), int(rng.integers(len(others)))
        tried = selection.copy()
        tried[position] = others[other]
        value = _observability(jacobians, [*tried, *fixed])[index]
        if value > best:
            others[other], selection, best = selection[position], tried, value
    return selection
