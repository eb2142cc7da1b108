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
from armwright.calibration.joint_errors import compliances, lateral_compliances, transmission_errors
from armwright.calibration.readings import Numbers, Readings
from armwright.errors import ContradictionError, InvalidValueError, MissingExtraError, TooFewError
from armwright.extras import import_extra

# A gain is significant beyond this number of standard errors, and relevant beyond this part of the error. Five
# candidates share the significance level of two standard errors of a single one (Bonferroni).
_MIN_STANDARD_ERRORS, _MIN_PART = 2.61, 0.01
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

    def predict(self, q: ArrayLike, *, payload: ArrayLike | None = None) -> Array:
        """Return (m, 3) the positions of the arm's tool, in the frame of the measurements [m].

        Args:
            q: (m, n) joint positions [rad] or [m].
            payload: (4,) or (m, 4) what the tool holds, see ``readings``.
        """
        positions = self.calibration.predict(q, payload=payload)
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
    objection = ""
    if gain <= 0:
        objection = "the held-out error does not decrease"
    elif not gain > _MIN_STANDARD_ERRORS * standard_error:
        objection = "the gain is not significant"
    elif not gain > _MIN_PART * float(before.mean()):
        objection = "the gain is too small to be worth it"
    reason = objection or "the held-out error decreases"
    return ModelComparison(name, float(after.mean()), gain, standard_error, accepted=not objection, reason=reason)


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


class _Model(NamedTuple):
    """What is fitted beside the geometry."""

    joints: tuple[JointErrorModel, ...] = ()
    with_residual_model: bool = False


class _FoldedReadings:
    """Readings in folds, with the calibrations and residual models without some of them; each is fitted once.

    Attributes:
        calibration: returns the arm as calibrated without some folds, with some error models of joints.
        residual_model: returns the model of the residuals of that calibration.
    """

    def __init__(self, arm: Arm, measured: Readings, *, folds: int, seed: int) -> None:
        self.arm, self.measured, self.seed = arm, measured, seed
        self.folds = random_folds(measured.q, folds, seed)
        self.points = measured.with_point & (measured.frame == 0)
        self.configuration = distinct_configurations(measured.q)
        no_gears, no_masses = f"no joint of {arm.name} is revolute", f"{arm.name} has no masses"
        self.candidates = (
            _Candidate("joint compliance under gravity", compliances(arm), no_masses),
            _Candidate("lateral compliance under gravity", lateral_compliances(arm), no_masses),
            _Candidate("transmission error, first harmonic", transmission_errors(arm, 1), no_gears),
            _Candidate("transmission error, second harmonic", transmission_errors(arm, 2), no_gears),
        )
        self.calibration = cache(self._calibrate)
        self.residual_model = cache(self._fit_residual_model)

    def held_out(self, left_out: frozenset[int]) -> Flags:
        """Return (m,) which readings are in one of the folds that are left out."""
        held_out = np.zeros(len(self.measured), dtype=np.bool_)
        for fold in left_out:
            held_out |= self.folds[fold]
        return held_out

    def _calibrate(self, left_out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> Calibration:
        if not left_out:
            return calibrate(self.arm, self.measured, joint_errors=joints)
        name = f"part {' and '.join(str(fold + 1) for fold in sorted(left_out))} of {len(self.folds)}"
        return calibrate_without(self.arm, self.measured, self.held_out(left_out), name, joint_errors=joints)

    def _fit_residual_model(self, left_out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> ResidualModel:
        train = self.measured.take(self.points & ~self.held_out(left_out))
        residuals = train.points - self.calibration(left_out, joints).predict(train.q, payload=train.payload)
        return _fit_residuals(self.arm, train.q, residuals, self.seed)

    def fold_errors(self, fold: int, without: frozenset[int], model: _Model) -> HeldOutErrors:
        """Return the errors of the readings of a fold, predicted without some folds."""
        residual_model = self.residual_model(without, model.joints) if model.with_residual_model else None
        return _errors(self.calibration(without, model.joints), residual_model, self.measured.take(self.folds[fold]))

    def held_out_errors(self, left_out: frozenset[int], model: _Model) -> HeldOutErrors:
        """Return the errors of readings, each predicted without its fold and without the folds that are left out."""
        held = HeldOutErrors.unknown(len(self.measured))
        for fold in set(range(len(self.folds))) - left_out:
            held.put(self.folds[fold], self.fold_errors(fold, left_out | {fold}, model))
        return held


class _Selection(NamedTuple):
    """The model that held-out points have selected."""

    model: _Model
    geometry: HeldOutErrors
    held_out: HeldOutErrors
    comparisons: tuple[ModelComparison, ...]


def calibrate_nongeometric(
    arm: Arm,
    measured: Readings,
    *,
    folds: int = 5,
    seed: int = 0,
    nested: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NongeometricCalibration:
    """Calibrate an arm; try joint and lateral compliance, two harmonics of transmission errors and a residual model.

    Args:
        arm: the nominal arm, with n joints.
        measured: readings of it, points among them.
        folds: of the cross-validation.
        seed: of the folds.
        nested: whether to hold points out of the selection, too, which takes about three times as long.
        progress: called with what is being done.

    Raises:
        InvalidValueError: no point was measured, or see ``calibrate``.
    """
    report = progress or (lambda _: None)
    data = _FoldedReadings(arm, measured, folds=folds, seed=seed)
    if not data.points.any():
        raise InvalidValueError("expected points in the measuring frame, whose residuals are modelled; got none")
    nothing: frozenset[int] = frozenset()
    selection = _select(data, nothing, report)
    joints, with_residual_model = selection.model
    report("fitting the accepted model")
    return NongeometricCalibration(
        calibration=data.calibration(nothing, joints),
        residual_model=data.residual_model(nothing, joints) if with_residual_model else None,
        comparisons=selection.comparisons,
        geometry=selection.geometry,
        held_out=selection.held_out,
        nested=_cross_validate_selection(data, report) if nested else None,
    )


def _cross_validate_selection(data: _FoldedReadings, report: Callable[[str], None]) -> HeldOutErrors | None:
    """Return the errors of nested cross-validation; None if too few readings are left for the selection."""
    held = HeldOutErrors.unknown(len(data.measured))
    for fold, rows in enumerate(data.folds):
        left_out = frozenset({fold})
        report(f"nested cross-validation, fold {fold + 1} of {len(data.folds)}")
        try:
            selection = _select(data, left_out, lambda _: None)
        except (ContradictionError, InvalidValueError):
            return None
        held.put(rows, data.fold_errors(fold, left_out, selection.model))
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
    points = data.points & ~data.held_out(left_out)

    def compare(name: str, before: HeldOutErrors, after: HeldOutErrors) -> ModelComparison:
        return compare_held_out(name, before.distance[points], after.distance[points], data.configuration[points])

    report("cross-validating: geometry")
    model, geometry = _Model(), data.held_out_errors(left_out, _Model())
    held_out = geometry
    mean = float(geometry.distance[points].mean())
    comparisons = {"geometry": ModelComparison("geometry", mean, 0.0, 0.0, accepted=True, reason="")}

    def choose(name: str, candidate: _Model) -> tuple[_Model, HeldOutErrors]:
        """Compare a model with the one accepted before; return the better one with its held-out errors."""
        try:
            errors = data.held_out_errors(left_out, candidate)
        except (ContradictionError, InvalidValueError, MissingExtraError) as error:
            comparisons[name] = ModelComparison.rejected(name, str(error))
            return model, held_out
        comparisons[name] = compare(name, held_out, errors)
        return (candidate, errors) if comparisons[name].accepted else (model, held_out)

    accepted: list[_Candidate] = []
    for candidate in data.candidates:
        name, models, reason = candidate
        if not models:
            comparisons[name] = ModelComparison.rejected(name, reason)
            continue
        report(f"cross-validating: {name}")
        model, held_out = choose(name, _Model((*model.joints, *models)))
        if comparisons[name].accepted:
            accepted.append(candidate)
    # A model that was accepted early may explain the same errors as a later one.
    for name, models, _ in accepted[:-1]:
        report(f"cross-validating: without {name}")
        fewer = _Model(tuple(error for error in model.joints if error not in models))
        without = data.held_out_errors(left_out, fewer)
        if not compare(name, without, held_out).accepted:
            model, held_out = fewer, without
            reason = "superfluous beside a later candidate"
            comparisons[name] = comparisons[name]._replace(accepted=False, reason=reason)
    report("modelling the residuals")
    model, held_out = choose("Gaussian process of the residuals", _Model(model.joints, with_residual_model=True))
    return _Selection(model, geometry, held_out, tuple(comparisons.values()))


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
