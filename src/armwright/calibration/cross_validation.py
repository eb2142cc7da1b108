"""Cross-validation of a calibration: the errors at readings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.calibration.chain import JointErrorModel, kinematic_chain
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.readings import Numbers, Readings, refuse_unlocated
from armwright.errors import ContradictionError, InvalidValueError, TooFewError

# Configurations whose joints differ by less are the same [rad], [m].
_CONFIGURATION_TOLERANCE = 1e-4
# Usual number of folds.
FOLDS = 5


class HeldOutErrors(NamedTuple):
    """Errors of readings, each predicted by an arm that was calibrated without it.

    Attributes:
        distance: (m,) between tool and reading [m].
        angle: (m,) between the rotations of tool and reading [rad]; NaN for readings without a rotation.
        positions: (m, 3) of the tools of those arms [m].
    """

    distance: Array
    angle: Array
    positions: Array

    @classmethod
    def unknown(cls, m: int) -> HeldOutErrors:
        """Return those of m readings of which none is known yet."""
        return cls(np.full(m, np.nan), np.full(m, np.nan), np.full((m, 3), np.nan))

    def put(self, rows: Flags, known: HeldOutErrors) -> None:
        """Store those of some rows (m,)."""
        for own, more in zip(self, known, strict=True):
            own[rows] = more


def held_out_errors(calibration: Calibration, measured: Readings) -> HeldOutErrors:
    """Return the errors of a calibrated arm at readings."""
    errors = calibration.model.pose_errors(measured, calibration.errors)
    return HeldOutErrors(errors.distance, errors.angle, calibration.predict(measured.q, payload=measured.payload))


def calibrate_without(
    arm: Arm,
    measured: Readings,
    held_out: Flags,
    called: str,
    *,
    joint_errors: tuple[JointErrorModel, ...] = (),
    without: Sequence[str] = (),
) -> Calibration:
    """Return the arm as calibrated without some readings.

    Args:
        arm: the nominal arm, with n joints.
        measured: m readings of it.
        held_out: (m,) which are held out.
        called: what they are called in a message, such as ``part 2 of 5``.
        joint_errors: see ``calibrate``.
        without: see ``calibrate``.

    Raises:
        ContradictionError: the others alone are readings of another arm; see ``calibrate``.
        InvalidValueError: they are too few, or all readings of a frame, a plane or an anchor are held out.
    """
    try:
        refuse_unlocated(measured.take(~held_out), measured.take(held_out))
        return calibrate(arm, measured.take(~held_out), joint_errors=joint_errors, without=without)
    except (ContradictionError, InvalidValueError) as error:
        raise type(error)(f"with {called} held out: {error}") from error


def cross_validate(
    arm: Arm,
    measured: Readings,
    *,
    folds: int = FOLDS,
    seed: int = 0,
    without: Sequence[str] = (),
    regions: bool = False,
) -> HeldOutErrors:
    """Return the error of each reading, predicted by an arm that was calibrated without it.

    Configurations are assigned to folds at random; each fold is compared with a calibration by all others.

    Args:
        arm: the nominal arm, with n joints.
        measured: m readings of it.
        folds: how many there are.
        seed: of the assignment.
        without: see ``calibrate``.
        regions: whether each fold is a region of the workspace, so that the arm is judged where it was not measured.

    Raises:
        ContradictionError: a part alone leaves readings of another arm; see ``calibrate``.
        InvalidValueError: there are not as many configurations as folds, or too few for the errors of the arm; all
            readings of a frame, a plane or an anchor are in one fold.
    """
    held = HeldOutErrors.unknown(len(measured))
    parts = workspace_regions(arm, measured.q, folds) if regions else random_folds(measured.q, folds, seed)
    for fold, rows in enumerate(parts, 1):
        calibration = calibrate_without(arm, measured, rows, f"part {fold} of {folds}", without=without)
        held.put(rows, held_out_errors(calibration, measured.take(rows)))
    return held


def random_folds(q: Array, folds: int, seed: int) -> list[Flags]:
    """Return by fold which of some configurations (m, n) are in it, (m,) truth values; equal ones are in one fold.

    Raises:
        InvalidValueError: there are not as many configurations as folds, or fewer than two folds.
    """
    configuration, count = _configurations_for_folds(q, folds)
    number = (np.random.default_rng(seed).permutation(count) % folds)[configuration]
    return [number == fold for fold in range(folds)]


def workspace_regions(arm: Arm, q: Array, folds: int) -> list[Flags]:
    """Return by region of the workspace which of some configurations (m, n) are in it, (m,) truth values.

    The positions of the nominal arm's tool are cut across their longest side, again and again, into parts of about as
    many configurations each (a k-d tree); equal configurations are in one part.

    Raises:
        InvalidValueError: there are not as many configurations as parts, or fewer than two parts.
    """
    configuration, count = _configurations_for_folds(q, folds)
    _, first = np.unique(configuration, return_index=True)
    positions = kinematic_chain(arm).forward(q[first]).position

    def split(members: Numbers, parts: int) -> list[Numbers]:
        if parts == 1:
            return [members]
        along = positions[members, np.argmax(np.ptp(positions[members], axis=0))]
        order = members[np.argsort(along, kind="stable")]
        half = parts // 2
        middle = len(order) * half // parts
        return [*split(order[:middle], half), *split(order[middle:], parts - half)]

    return [np.isin(configuration, members) for members in split(np.arange(count), folds)]


def _configurations_for_folds(q: Array, folds: int) -> tuple[Numbers, int]:
    """Return ``distinct_configurations``, and how many there are, if they are enough for so many folds."""
    configuration = distinct_configurations(q)
    count = int(configuration.max()) + 1
    if count < 2:
        message = f"folds: {len(q)} readings of one joint configuration leave none to hold out; measure in several"
        raise TooFewError(message)
    if not 2 <= folds <= count:
        raise InvalidValueError(f"folds: expected 2 to {count}, one joint configuration in each or more, got {folds}")
    return configuration, count


def distinct_configurations(q: Array) -> Numbers:
    """Return by number which configuration each row (m, n) has, in the order of their first rows.

    Positions of encoders are never exactly equal: rows that differ by less than a tenth of a milliradian or
    millimetre are one configuration.
    """
    rows = len(q)
    near = np.array([*cKDTree(q).query_pairs(_CONFIGURATION_TOLERANCE)], dtype=np.intp).reshape(-1, 2)
    _, same = connected_components(coo_array((np.ones(len(near)), near.T), shape=(rows, rows)), directed=False)
    _, first = np.unique(same, return_index=True)
    return np.asarray(np.argsort(np.argsort(first))[same], dtype=np.intp)
