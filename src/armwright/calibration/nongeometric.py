"""Non-geometric calibration: joint compliance, transmission errors, and a model of the remaining residuals.

Each candidate is added to those accepted before, and accepted only if it lowers the cross-validated errors
significantly and by a relevant part. An accepted candidate is dropped again if a later one makes it superfluous
(forward selection, then backward elimination).

The errors of held-out points that have selected the model are biased. The model, its selection included, is therefore
assessed by nested cross-validation: each part is left out in turn, and the others alone select and fit.

Source:
    Thesis, outlook of chapter 5; spec of the calibration.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Flags, joint_array, one_core
from armwright.calibration.chain import JointErrorModel
from armwright.calibration.cross_validation import (
    HeldOutErrors,
    calibrate_without,
    distinct_configurations,
    held_out_errors,
    random_folds,
)
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.joint_errors import compliances, transmission_errors
from armwright.calibration.readings import Numbers, Readings
from armwright.errors import ContradictionError, InvalidValueError, MissingExtraError, TooFewError
from armwright.extras import import_extra

# A gain is significant beyond this number of standard errors, and relevant beyond this part of the error. Four
# candidates share the significance level of two standard errors of a single one (Bonferroni).
_MIN_STANDARD_ERRORS, _MIN_PART = 2.53, 0.01
# From so many points the length scales of the Gaussian process are learnt; more cost time with their cube.
_MAX_POINTS = 300
# Bounds of length scales in sines and cosines of the joints, of the amplitude, and of the noise, as parts of the
# variance of the residuals.
_LENGTH_SCALES, _AMPLITUDE, _NOISE = (0.1, 100.0), (1e-4, 10.0), (1e-3, 10.0)


class ModelComparison(NamedTuple):
    """A candidate, compared with the model without it.

    Attributes:
        name: of the candidate.
        held_out: mean held-out distance with it [m]; None where it could not be tried.
        gain: by how much less that is than without [m].
        standard_error: of the gain [m].
        accepted: whether it is part of the model.
        reason: in words.
    """

    name: str
    held_out: float | None
    gain: float
    standard_error: float
    accepted: bool
    reason: str

    @classmethod
    def rejected(cls, name: str, reason: str) -> ModelComparison:
        """Return the comparison of a candidate that could not be tried."""
        return cls(name, None, 0.0, 0.0, accepted=False, reason=reason)


@attrs.frozen(kw_only=True, eq=False)
class NongeometricCalibration:
    """A calibration with all non-geometric models that held-out points confirm.

    Attributes:
        calibration: with the error models of joints that were accepted.
        residual_model: what is added to its positions of the tool; None where that did not help.
        comparisons: of all candidates, in order; the first is geometry alone.
        geometry: held-out errors of geometry alone.
        held_out: held-out errors of the accepted model, by which it was selected.
        nested: errors of nested cross-validation; None if it was not requested, or too few readings are left.
    """

    calibration: Calibration
    residual_model: ResidualModel | None
    comparisons: tuple[ModelComparison, ...]
    geometry: HeldOutErrors
    held_out: HeldOutErrors
    nested: HeldOutErrors | None

    def errors(self, measured: Readings) -> HeldOutErrors:
        """Return the distances and angles between readings and the predictions of the model."""
        return _errors(self.calibration, self.residual_model, measured)

    def predict(self, q: ArrayLike) -> Array:
        """Return (m, 3) the positions of the arm's tool, in the frame of the measurements [m]."""
        positions = self.calibration.predict(q)
        if self.residual_model is None:
            return positions
        return np.asarray(positions + self.residual_model.shift(q), dtype=np.float64)


class ResidualModel:
    """A Gaussian process of the residuals over the joint configuration.

    Three coordinates share their length scales, amplitude and noise, which are learnt from the points themselves. Far
    from all points it is 0.
    """

    def __init__(self, arm: Arm, process: Any, scale: float) -> None:
        """Keep a process and its unit [m]."""
        self._arm, self._process, self._scale = arm, process, scale

    def shift(self, q: ArrayLike) -> Array:
        """Return (m, 3) what is to be added to the positions of the arm's tool [m]."""
        with one_core():
            mean = self._process.predict(_features(self._arm, np.atleast_2d(joint_array(q, self._arm.n))))
        return np.asarray(mean * self._scale, dtype=np.float64)


def compare_held_out(name: str, before: Array, after: Array, configuration: Numbers) -> ModelComparison:
    """Compare held-out distances without and with a candidate.

    Args:
        name: of the candidate.
        before: (p,) distances without it [m].
        after: (p,) distances with it [m].
        configuration: (p,) number of that of each; readings of one configuration are correlated, and count once.
    """
    gain = float((before - after).mean())
    cluster = np.bincount(np.unique(configuration, return_inverse=True)[1], before - after - gain)
    count = len(cluster)
    standard_error = float(np.sqrt(count / max(1, count - 1) * np.sum(cluster**2)) / len(before))
    significant, relevant = gain > _MIN_STANDARD_ERRORS * standard_error, gain > _MIN_PART * float(before.mean())
    if significant and relevant:
        reason = "the held-out error decreases"
    elif gain <= 0:
        reason = "the held-out error does not decrease"
    elif not significant:
        reason = "the gain is not significant"
    else:
        reason = "the gain is too small to be worth it"
    return ModelComparison(
        name, float(after.mean()), gain, standard_error, accepted=significant and relevant, reason=reason
    )


class _Candidate(NamedTuple):
    """Error models of joints that are accepted or rejected together.

    Attributes:
        name: of the candidate.
        models: one or two for each joint; none if the arm has no such joints.
        reason_for_none: why there are none.
    """

    name: str
    models: tuple[JointErrorModel, ...]
    reason_for_none: str


def _candidates(arm: Arm) -> list[_Candidate]:
    no_gears = f"no joint of {arm.name} is revolute"
    return [
        _Candidate("joint compliance under gravity", compliances(arm), f"{arm.name} has no masses"),
        _Candidate("transmission error, first harmonic", transmission_errors(arm, 1), no_gears),
        _Candidate("transmission error, second harmonic", transmission_errors(arm, 2), no_gears),
    ]


class _FoldedReadings:
    """Readings in folds, with the calibrations and residual models without some of them; each is fitted once.

    Attributes:
        calibration: returns the arm as calibrated without some folds, with some error models of joints.
        residual_model: returns the model of the residuals of that calibration.
    """

    def __init__(self, arm: Arm, measured: Readings, *, folds: int, seed: int, base: Array | None) -> None:
        self.arm, self.measured, self.seed, self.base = arm, measured, seed, base
        self.folds = random_folds(measured.q, folds, seed)
        self.points = measured.with_point & (measured.frame == 0)
        self.configuration = distinct_configurations(measured.q)
        self.candidates = _candidates(arm)
        self.calibration = cache(self._calibrate)
        self.residual_model = cache(self._fit_residual_model)

    def is_outside(self, left_out: frozenset[int]) -> Flags:
        """Return (m,) which readings are in none of the folds that are left out."""
        if not left_out:
            return np.ones(len(self.measured), dtype=np.bool_)
        return np.asarray(~np.any([self.folds[fold] for fold in left_out], axis=0), dtype=np.bool_)

    def _calibrate(self, left_out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> Calibration:
        if not left_out:
            return calibrate(self.arm, self.measured, base=self.base, joint_errors=joints)
        name = f"part {' and '.join(str(fold + 1) for fold in sorted(left_out))} of {len(self.folds)}"
        held_out = ~self.is_outside(left_out)
        return calibrate_without(self.arm, self.measured, held_out, name, base=self.base, joint_errors=joints)

    def _fit_residual_model(self, left_out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> ResidualModel:
        calibration, train = self.calibration(left_out, joints), self.points & self.is_outside(left_out)
        q = self.measured.q[train]
        return _fit_residuals(self.arm, q, self.measured.points[train] - calibration.predict(q), self.seed)

    def fold_errors(
        self, fold: int, without: frozenset[int], joints: tuple[JointErrorModel, ...], *, with_residual_model: bool
    ) -> HeldOutErrors:
        """Return the errors of the readings of a fold, predicted without some folds."""
        model = self.residual_model(without, joints) if with_residual_model else None
        return _errors(self.calibration(without, joints), model, self.measured.take(self.folds[fold]))

    def held_out_errors(
        self, left_out: frozenset[int], joints: tuple[JointErrorModel, ...], *, with_residual_model: bool = False
    ) -> HeldOutErrors:
        """Return the errors of readings, each predicted without its fold and without the folds that are left out."""
        held = HeldOutErrors.unknown(len(self.measured))
        for fold in set(range(len(self.folds))) - left_out:
            errors = self.fold_errors(fold, left_out | {fold}, joints, with_residual_model=with_residual_model)
            held.put(self.folds[fold], errors)
        return held


class _Selection(NamedTuple):
    """The model that held-out points have selected."""

    joints: tuple[JointErrorModel, ...]
    with_residual_model: bool
    geometry: HeldOutErrors
    held_out: HeldOutErrors
    comparisons: tuple[ModelComparison, ...]


def calibrate_nongeometric(
    arm: Arm,
    measured: Readings,
    *,
    folds: int = 5,
    seed: int = 0,
    base: Array | None = None,
    nested: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NongeometricCalibration:
    """Calibrate an arm, and try joint compliance, two harmonics of transmission errors and a residual model.

    Args:
        arm: the nominal arm, with n joints.
        measured: readings of it, points among them.
        folds: of the cross-validation.
        seed: of the folds.
        base: see ``calibrate``.
        nested: whether to hold points out of the selection, too, which takes about three times as long.
        progress: called with what is being done.

    Raises:
        InvalidValueError: no point was measured, or see ``calibrate``.
    """
    report = progress or _ignore
    data = _FoldedReadings(arm, measured, folds=folds, seed=seed, base=base)
    if not data.points.any():
        raise InvalidValueError("expected points in the measuring frame, whose residuals are modelled; got none")
    nothing: frozenset[int] = frozenset()
    selection = _select(data, nothing, report)
    report("fitting the accepted model")
    return NongeometricCalibration(
        calibration=data.calibration(nothing, selection.joints),
        residual_model=data.residual_model(nothing, selection.joints) if selection.with_residual_model else None,
        comparisons=selection.comparisons,
        geometry=selection.geometry,
        held_out=selection.held_out,
        nested=_cross_validate_selection(data, report) if nested else None,
    )


def _ignore(what: str) -> None:
    """Report nothing."""


def _cross_validate_selection(data: _FoldedReadings, report: Callable[[str], None]) -> HeldOutErrors | None:
    """Return the errors of nested cross-validation; None if too few readings are left for the selection."""
    held = HeldOutErrors.unknown(len(data.measured))
    for number, rows in enumerate(data.folds):
        left_out = frozenset({number})
        report(f"nested cross-validation, part {number + 1} of {len(data.folds)}")
        try:
            selection = _select(data, left_out, _ignore)
        except (ContradictionError, InvalidValueError):
            return None
        with_residual_model = selection.with_residual_model
        held.put(rows, data.fold_errors(number, left_out, selection.joints, with_residual_model=with_residual_model))
    return held


def _select(data: _FoldedReadings, left_out: frozenset[int], report: Callable[[str], None]) -> _Selection:
    """Return the model that the points outside of some folds confirm.

    Args:
        data: the readings.
        left_out: folds that are left out of everything.
        report: called with what is being done.
    """
    if len(data.folds) - len(left_out) < 2:
        raise TooFewError("at least two parts of the readings must remain for the selection of a model")
    points = data.points & data.is_outside(left_out)
    configuration = data.configuration[points]

    def compare(name: str, before: HeldOutErrors, after: HeldOutErrors) -> ModelComparison:
        return compare_held_out(name, before.distance[points], after.distance[points], configuration)

    report("cross-validating: geometry")
    geometry = data.held_out_errors(left_out, ())
    mean = float(geometry.distance[points].mean())
    comparisons = [ModelComparison("geometry", mean, 0.0, 0.0, accepted=True, reason="")]
    joints, held_out = _select_joint_errors(
        data, left_out, geometry, compare=compare, comparisons=comparisons, report=report
    )
    report("modelling the residuals")
    name, accepted = "Gaussian process of the residuals", False
    try:
        better = data.held_out_errors(left_out, joints, with_residual_model=True)
    except MissingExtraError as error:
        comparisons.append(ModelComparison.rejected(name, str(error)))
    else:
        comparisons.append(compare(name, held_out, better))
        accepted = comparisons[-1].accepted
        held_out = better if accepted else held_out
    return _Selection(joints, accepted, geometry, held_out, tuple(comparisons))


def _select_joint_errors(
    data: _FoldedReadings,
    left_out: frozenset[int],
    geometry: HeldOutErrors,
    *,
    compare: Callable[[str, HeldOutErrors, HeldOutErrors], ModelComparison],
    comparisons: list[ModelComparison],
    report: Callable[[str], None],
) -> tuple[tuple[JointErrorModel, ...], HeldOutErrors]:
    """Return the error models of joints that held-out points confirm, and the held-out errors with them.

    Args:
        data: the readings.
        left_out: folds that are left out of everything.
        geometry: held-out errors of geometry alone.
        compare: compares held-out errors without and with a candidate.
        comparisons: grows by those of the candidates.
        report: called with what is being done.
    """
    joints: tuple[JointErrorModel, ...] = ()
    held_out = geometry
    accepted: list[int] = []
    for candidate in data.candidates:
        if not candidate.models:
            comparisons.append(ModelComparison.rejected(candidate.name, candidate.reason_for_none))
            continue
        report(f"cross-validating: {candidate.name}")
        try:
            better = data.held_out_errors(left_out, (*joints, *candidate.models))
        except (ContradictionError, InvalidValueError) as error:
            comparisons.append(ModelComparison.rejected(candidate.name, str(error)))
            continue
        comparisons.append(compare(candidate.name, held_out, better))
        if comparisons[-1].accepted:
            joints, held_out = (*joints, *candidate.models), better
            accepted.append(len(comparisons) - 1)
    # A model that was accepted early may explain the same errors as a later one. Geometry is the first comparison.
    for number in accepted[:-1]:
        candidate = data.candidates[number - 1]
        report(f"cross-validating: without {candidate.name}")
        fewer = tuple(error for error in joints if error not in candidate.models)
        without = data.held_out_errors(left_out, fewer)
        if not compare(candidate.name, without, held_out).accepted:
            joints, held_out = fewer, without
            comparisons[number] = comparisons[number]._replace(
                accepted=False, reason="superfluous beside a later candidate"
            )
    return joints, held_out


def _errors(calibration: Calibration, model: ResidualModel | None, measured: Readings) -> HeldOutErrors:
    """Return the errors of a calibrated arm at readings; its residual model applies to points only."""
    errors, points = held_out_errors(calibration, measured), measured.with_point & (measured.frame == 0)
    if model is not None and points.any():
        errors.positions[points] += model.shift(measured.q[points])
        errors.distance[points] = np.linalg.norm(errors.positions[points] - measured.points[points], axis=1)
    return errors


def _fit_residuals(arm: Arm, q: Array, residuals: Array, seed: int) -> ResidualModel:
    """Fit a Gaussian process to residuals (m, 3) as a function of the configuration (m, n).

    Raises:
        MissingExtraError: scikit-learn is not installed.
    """
    import_extra("sklearn.gaussian_process", "a model of the residuals", "calibration", "scikit-learn")
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - an extra
    from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415

    x = _features(arm, q)
    scale = float(np.sqrt(np.mean(residuals**2))) or 1.0
    some = np.random.default_rng(seed).permutation(len(x))[:_MAX_POINTS]
    kernel = ConstantKernel(0.3, _AMPLITUDE) * RBF([1.0] * x.shape[1], _LENGTH_SCALES) + WhiteKernel(0.7, _NOISE)
    first = GaussianProcessRegressor(kernel, random_state=seed)
    with warnings.catch_warnings(), one_core():
        # A length scale at its bound is a joint that hardly matters.
        warnings.simplefilter("ignore", ConvergenceWarning)
        first.fit(x[some], residuals[some] / scale)
        process = GaussianProcessRegressor(first.kernel_, optimizer=None).fit(x, residuals / scale)
    return ResidualModel(arm, process, scale)


def _features(arm: Arm, q: Array) -> Array:
    """Return sines and cosines of revolute joints, and positions of prismatic ones [m], (m, k)."""
    revolute = np.array([joint.revolute for joint in arm.joints], dtype=np.bool_)
    angles, slides = q[:, revolute], q[:, ~revolute]
    return np.hstack([np.sin(angles), np.cos(angles), slides])
