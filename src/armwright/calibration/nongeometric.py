"""Non-geometric calibration: joint compliance, transmission errors, and a model of the remaining residuals.

Each candidate is added to those accepted before, and accepted only if it lowers the cross-validated errors
significantly and by a part worth having. An accepted candidate is dropped again if a later one makes it superfluous
(forward selection, then backward elimination).

Held-out points that were used to choose are biased by the choice. So the whole, choice included, is judged by nested
cross-validation: one part after the other is left out, and the others alone choose and fit.

Source:
    Thesis, outlook of chapter 5; spec of the calibration.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
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

# A gain is significant from so many standard errors on, and worth having from such a part of the error on. Four
# candidates share the level of significance that two standard errors are for one (Bonferroni).
_SIGNIFICANT, _WORTH = 2.53, 0.01
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
        """Return that of a candidate that could not be tried."""
        return cls(name, None, 0.0, 0.0, accepted=False, reason=reason)


@attrs.frozen(kw_only=True, eq=False)
class NongeometricCalibration:
    """A calibration with all non-geometric models that held-out points confirm.

    Attributes:
        calibration: with the error models of joints that were accepted.
        residual_model: what is added to its positions of the tool; None where that did not help.
        comparisons: of all candidates, in order; the first is geometry alone.
        geometry: held-out errors of geometry alone.
        held_out: held-out errors of the accepted model, by which it was chosen.
        nested: held out of the choice, too; None where this was not asked for, or too few readings are left.
    """

    calibration: Calibration
    residual_model: ResidualModel | None
    comparisons: tuple[ModelComparison, ...]
    geometry: HeldOutErrors
    held_out: HeldOutErrors
    nested: HeldOutErrors | None

    def errors(self, measured: Readings) -> HeldOutErrors:
        """Return by how much the arm misses readings."""
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
    significant, worth = gain > _SIGNIFICANT * standard_error, gain > _WORTH * float(before.mean())
    if significant and worth:
        reason = "the held-out error decreases"
    elif gain <= 0:
        reason = "the held-out error does not decrease"
    elif not significant:
        reason = "the gain is not significant"
    else:
        reason = "the gain is too small to be worth it"
    return ModelComparison(
        name, float(after.mean()), gain, standard_error, accepted=significant and worth, reason=reason
    )


class _Folds:
    """Readings in folds, and what was fitted without some of them: each is fitted once."""

    def __init__(self, arm: Arm, measured: Readings, *, folds: int, seed: int, base: Array | None) -> None:
        self.arm, self.measured, self.seed, self.base = arm, measured, seed, base
        self.folds = random_folds(measured.q, folds, seed)
        self.points = measured.with_point & (measured.frame == 0)
        self.configuration = distinct_configurations(measured.q)
        self._calibrations: dict[Any, Calibration] = {}
        self._residual_models: dict[Any, ResidualModel] = {}

    def without(self, out: frozenset[int]) -> Flags:
        """Return (m,) which readings are not in some folds."""
        if not out:
            return np.ones(len(self.measured), dtype=np.bool_)
        return np.asarray(~np.any([self.folds[fold] for fold in out], axis=0), dtype=np.bool_)

    def calibration(self, out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> Calibration:
        """Return the arm as calibrated without some folds."""
        key = (out, tuple(error.name for error in joints))
        if key not in self._calibrations:
            called = f"part {' and '.join(str(fold + 1) for fold in sorted(out))} of {len(self.folds)}"
            fit = calibrate if not out else partial(calibrate_without, held_out=~self.without(out), called=called)
            self._calibrations[key] = fit(self.arm, self.measured, base=self.base, joint_errors=joints)
        return self._calibrations[key]

    def residual_model(self, out: frozenset[int], joints: tuple[JointErrorModel, ...]) -> ResidualModel:
        """Return the model of the residuals of the same readings."""
        key = (out, tuple(error.name for error in joints))
        if key not in self._residual_models:
            calibration, train = self.calibration(out, joints), self.points & self.without(out)
            q = self.measured.q[train]
            residuals = self.measured.points[train] - calibration.predict(q)
            self._residual_models[key] = _fit_residuals(self.arm, q, residuals, self.seed)
        return self._residual_models[key]

    def held_out(
        self, out: frozenset[int], joints: tuple[JointErrorModel, ...], *, with_residual_model: bool = False
    ) -> HeldOutErrors:
        """Return by how much readings miss arms that were fitted without their fold, and without some others."""
        held = HeldOutErrors.unknown(len(self.measured))
        for fold in set(range(len(self.folds))) - out:
            without = out | {fold}
            rows = self.folds[fold]
            model = self.residual_model(without, joints) if with_residual_model else None
            held.put(rows, _errors(self.calibration(without, joints), model, self.measured.take(rows)))
        return held


class _Selection(NamedTuple):
    """The model that held-out points chose."""

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
        nested: whether to hold points out of the choice, too, which takes about three times as long.
        progress: called with what is being done.

    Raises:
        InvalidValueError: no point was measured, or see ``calibrate``.
    """
    report = progress or _ignore
    data = _Folds(arm, measured, folds=folds, seed=seed, base=base)
    if not data.points.any():
        raise InvalidValueError("expected points in the measuring frame, whose residuals are modelled; got none")
    every: frozenset[int] = frozenset()
    selection = _select(data, every, report)
    report("fitting the accepted model")
    return NongeometricCalibration(
        calibration=data.calibration(every, selection.joints),
        residual_model=data.residual_model(every, selection.joints) if selection.with_residual_model else None,
        comparisons=selection.comparisons,
        geometry=selection.geometry,
        held_out=selection.held_out,
        nested=_nested(data, report) if nested else None,
    )


def _ignore(what: str) -> None:
    """Report nothing."""


def _nested(data: _Folds, report: Callable[[str], None]) -> HeldOutErrors | None:
    """Return the errors of nested cross-validation; None where too few readings are left to choose by."""
    held = HeldOutErrors.unknown(len(data.measured))
    for number, rows in enumerate(data.folds):
        out = frozenset({number})
        report(f"nested cross-validation, part {number + 1} of {len(data.folds)}")
        try:
            selection = _select(data, out, _ignore)
        except (ContradictionError, InvalidValueError):
            return None
        model = data.residual_model(out, selection.joints) if selection.with_residual_model else None
        held.put(rows, _errors(data.calibration(out, selection.joints), model, data.measured.take(rows)))
    return held


def _select(data: _Folds, out: frozenset[int], report: Callable[[str], None]) -> _Selection:
    """Return the model that the points outside of some folds confirm.

    Args:
        data: the readings.
        out: folds that are left out of everything.
        report: called with what is being done.
    """
    if len(data.folds) - len(out) < 2:
        raise TooFewError("two parts of the readings at least must be left to choose by")
    points = data.points & data.without(out)
    configuration = data.configuration[points]

    def compare(name: str, before: HeldOutErrors, after: HeldOutErrors) -> ModelComparison:
        return compare_held_out(name, before.distance[points], after.distance[points], configuration)

    report("cross-validating: geometry")
    held = geometry = data.held_out(out, ())
    comparisons = [ModelComparison("geometry", float(held.distance[points].mean()), 0.0, 0.0, accepted=True, reason="")]
    joints, held = _select_joint_errors(
        data.arm,
        held,
        compare=compare,
        validate=lambda joints: data.held_out(out, joints),
        comparisons=comparisons,
        report=report,
    )
    report("modelling the residuals")
    name, accepted = "Gaussian process of the residuals", False
    try:
        better = data.held_out(out, joints, with_residual_model=True)
    except MissingExtraError as error:
        comparisons.append(ModelComparison.rejected(name, str(error)))
    else:
        comparisons.append(compare(name, held, better))
        accepted = comparisons[-1].accepted
        held = better if accepted else held
    return _Selection(joints, accepted, geometry, held, tuple(comparisons))


def _select_joint_errors(
    arm: Arm,
    held: HeldOutErrors,
    *,
    compare: Callable[[str, HeldOutErrors, HeldOutErrors], ModelComparison],
    validate: Callable[[tuple[JointErrorModel, ...]], HeldOutErrors],
    comparisons: list[ModelComparison],
    report: Callable[[str], None],
) -> tuple[tuple[JointErrorModel, ...], HeldOutErrors]:
    """Return the error models of joints that held-out points confirm, and the held-out errors with them.

    Args:
        arm: the nominal arm.
        held: held-out errors of geometry alone.
        compare: held-out errors without and with a candidate.
        validate: cross-validates with some models.
        comparisons: grows by what is tried here.
        report: called with what is being done.
    """
    fixed = f"no joint of {arm.name} is revolute"
    candidates = [
        ("joint compliance under gravity", compliances(arm), f"{arm.name} has no masses"),
        ("transmission error, first harmonic", transmission_errors(arm, 1), fixed),
        ("transmission error, second harmonic", transmission_errors(arm, 2), fixed),
    ]
    joints: tuple[JointErrorModel, ...] = ()
    accepted: list[tuple[int, tuple[JointErrorModel, ...]]] = []
    for name, more, absent in candidates:
        if not more:
            comparisons.append(ModelComparison.rejected(name, absent))
            continue
        report(f"cross-validating: {name}")
        try:
            better = validate((*joints, *more))
        except (ContradictionError, InvalidValueError) as error:
            comparisons.append(ModelComparison.rejected(name, str(error)))
            continue
        comparisons.append(compare(name, held, better))
        if comparisons[-1].accepted:
            joints, held = (*joints, *more), better
            accepted.append((len(comparisons) - 1, more))
    # What was accepted first may have stood in for what came later.
    for number, part in accepted[:-1]:
        name = comparisons[number].name
        report(f"cross-validating: without {name}")
        fewer = tuple(error for error in joints if error not in part)
        less = validate(fewer)
        if not compare(name, less, held).accepted:
            joints, held = fewer, less
            comparisons[number] = comparisons[number]._replace(
                accepted=False, reason="superfluous beside a later candidate"
            )
    return joints, held


def _errors(calibration: Calibration, model: ResidualModel | None, measured: Readings) -> HeldOutErrors:
    """Return by how much a calibrated arm misses readings, with its residual model where they are points."""
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
