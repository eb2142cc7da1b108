"""How good a calibration is on readings that it has not seen."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.calibration.chain import JointErrorModel, chain_of
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.readings import Numbers, Readings, refuse_not_fitted
from armwright.errors import ContradictionError, InvalidValueError, TooFewError

# Postures whose joints differ by less are one [rad], [m].
_SAME = 1e-4
# Parts into which postures are dealt out, each of which is held out once.
FOLDS = 5


class HeldOut(NamedTuple):
    """By how much readings miss arms that were calibrated without them.

    Attributes:
        distance: (m,) length of what is missed [m].
        turn: (m,) angle of what is missed [rad]; NaN of readings that tell no turn.
        places: (m, 3) where those arms have their tool [m].
    """

    distance: Array
    turn: Array
    places: Array

    @classmethod
    def unknown(cls, m: int) -> "HeldOut":
        """Return that of m readings none is known yet."""
        return cls(np.full(m, np.nan), np.full(m, np.nan), np.full((m, 3), np.nan))

    def put(self, rows: Flags, known: "HeldOut") -> None:
        """Take note of those of some rows (m,)."""
        for mine, more in zip(self, known, strict=True):
            mine[rows] = more


def held_out_errors(found: Calibration, seen: Readings) -> HeldOut:
    """Return by how much readings miss a calibrated arm."""
    off = found.model.off(seen, found.errors)
    return HeldOut(off.distance, off.turn, found.predict(seen.q))


def calibrate_without(
    arm: Arm,
    seen: Readings,
    away: Flags,
    which: str,
    *,
    base: Array | None = None,
    bends: tuple[JointErrorModel, ...] = (),
    without: Sequence[str] = (),
) -> Calibration:
    """Return the arm as calibrated without some readings.

    Args:
        arm: as it is said to be, with n joints.
        seen: m readings of it.
        away: (m,) those that are held out.
        which: what they are called in a message, such as ``part 2 of 5``.
        base: see ``calibrate``.
        bends: see ``calibrate``.
        without: see ``calibrate``.

    Raises:
        ContradictionError: the others alone are readings of another arm; see ``calibrate``.
        InvalidValueError: they are too few, or all readings of a frame, a plane or an anchor are held out.
    """
    try:
        refuse_not_fitted(seen.take(~away), seen.take(away))
        return calibrate(arm, seen.take(~away), base=base, bends=bends, without=without)
    except (ContradictionError, InvalidValueError) as error:
        raise type(error)(f"with {which} held out: {error}") from error


def cross_validate(
    arm: Arm,
    seen: Readings,
    *,
    folds: int = FOLDS,
    seed: int = 0,
    base: Array | None = None,
    bends: tuple[JointErrorModel, ...] = (),
    without: Sequence[str] = (),
    regions: bool = False,
    progress: Callable[[int], None] | None = None,
) -> HeldOut:
    """Return by how much each reading misses an arm that was calibrated without it.

    The postures are dealt out into folds by chance; each fold is held against a calibration by all others.

    Args:
        arm: as it is said to be, with n joints.
        seen: m readings of it.
        folds: how many parts the postures are dealt out into.
        seed: of the dealing.
        base: see ``calibrate``.
        bends: see ``calibrate``.
        without: see ``calibrate``.
        regions: whether each part is a region of the workspace, so that the arm is judged where it was not measured.
        progress: told how many folds are done.

    Raises:
        ContradictionError: a part alone leaves readings of another arm; see ``calibrate``.
        InvalidValueError: there are not as many postures as folds, or too few for the errors of the arm; all readings
            of a frame, a plane or an anchor are in one fold.
    """
    held = HeldOut.unknown(len(seen))
    parts = workspace_regions(arm, seen.q, folds) if regions else random_folds(seen.q, folds, seed)
    for fold, away in enumerate(parts, 1):
        which = f"part {fold} of {folds}"
        found = calibrate_without(arm, seen, away, which, base=base, bends=bends, without=without)
        held.put(away, held_out_errors(found, seen.take(away)))
        if progress is not None:
            progress(fold)
    return held


def random_folds(q: Array, folds: int, seed: int) -> list[Flags]:
    """Return by fold which of some postures (m, n) are in it, (m,) truth values; one and the same is in one fold.

    Raises:
        InvalidValueError: there are not as many postures as folds, or fewer than two folds.
    """
    posture = distinct_configurations(q)
    count = int(posture.max()) + 1
    if count < 2:
        raise TooFewError(
            f"folds: {len(q)} readings of one posture leave none to hold out; measure in several postures"
        )
    if not 2 <= folds <= count:
        raise InvalidValueError(f"folds: expected 2 to {count}, one posture in each or more, got {folds}")
    number = (np.random.default_rng(seed).permutation(count) % folds)[posture]
    return [number == fold for fold in range(folds)]


def workspace_regions(arm: Arm, q: Array, folds: int) -> list[Flags]:
    """Return by region of the workspace which of some postures (m, n) are in it, (m,) truth values.

    Where the arm as said has its tool is cut across its longest side, again and again, into parts of about as many
    postures each; one and the same posture is in one part.

    Raises:
        InvalidValueError: there are not as many postures as parts, or fewer than two parts.
    """
    posture = distinct_configurations(q)
    count = int(posture.max()) + 1
    if not 2 <= folds <= count:
        raise InvalidValueError(f"folds: expected 2 to {count}, one posture in each or more, got {folds}")
    _, first = np.unique(posture, return_index=True)
    places = chain_of(arm).reach(q[first]).position

    def cut(members: Numbers, parts: int) -> list[Numbers]:
        if parts == 1:
            return [members]
        along = places[members, np.argmax(np.ptp(places[members], axis=0))]
        order = members[np.argsort(along, kind="stable")]
        half = parts // 2
        middle = len(order) * half // parts
        return [*cut(order[:middle], half), *cut(order[middle:], parts - half)]

    return [np.isin(posture, members) for members in cut(np.arange(count), folds)]


def distinct_configurations(q: Array) -> Numbers:
    """Return by number which posture each row (m, n) has, in the order in which they come first.

    Positions that encoders tell are never quite the same: rows that differ by less than a tenth of a milliradian or
    millimetre are of one posture.
    """
    rows = len(q)
    near = np.array([*cKDTree(q).query_pairs(_SAME)], dtype=np.intp).reshape(-1, 2)
    _, same = connected_components(coo_array((np.ones(len(near)), near.T), shape=(rows, rows)), directed=False)
    _, first = np.unique(same, return_index=True)
    return np.asarray(np.argsort(np.argsort(first))[same], dtype=np.intp)
