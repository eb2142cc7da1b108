"""Calibration as a robust least-squares problem: the errors of an arm and their covariance from measured readings.

A prior of zero mean keeps errors small that the readings hardly identify; the rest is Gauss and Newton's method with
iteratively reweighted readings. A reading has one robust weight for all its numbers, in whatever frame they are; in the
last fit outliers have weight 0. Rotations are scaled against lengths by the noise of either.

Source:
    Holland & Welsch (1977) for iteratively reweighted least squares; spec of the calibration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

import attrs
import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.calibration.chain import Chain, JointErrorModel
from armwright.calibration.identifiability import (
    MAX_STANDARD_ERROR,
    FixedParameter,
    Identifiability,
    is_overdetermined,
    preferred_parameters,
    select_identifiable,
)
from armwright.calibration.initial_guess import initial_guess
from armwright.calibration.noise import (
    TYPICAL_NOISE,
    Noise,
    length_scales,
    median_noise,
    noise_and_outliers,
    robust_weights,
    standard_deviations,
)
from armwright.calibration.readings import Readings, readings
from armwright.calibration.residuals import MeasurementModel, PoseError, Residuals
from armwright.errors import ContradictionError, InvalidValueError, ShapeError, TooFewError, UnknownNameError
from armwright.notebook import html_table

# Rounds of selecting errors and fitting them, and of reweighting within one fit.
_ROUNDS, _REWEIGHTINGS = 8, 30
# Rounds end when the noise is no longer below this part of that of the round before: outliers then have their weight.
_NOISE_DECREASE = 0.9
# Reweighting ends when no weight changes by more.
_WEIGHT_TOLERANCE = 1e-3
# A fit ends when its cost decreases by less than a part of 1e-11; its error is then far below the standard errors. It
# takes some ten evaluations; readings that make no sense could take minutes.
_SOLVER_OPTIONS: dict[str, Any] = {"x_scale": "jac", "ftol": 1e-11, "xtol": 1e-11, "gtol": None, "max_nfev": 100}
# Standard deviation of the prior of errors [m], [rad]. It binds errors that readings hardly identify: two such errors
# can otherwise run away together. One whose standard error is a tenth of it is moved by a hundredth of that at most.
PRIOR_SIGMA = (0.02, 0.05)
# Errors of joints have a twentieth of that: gears run true to an arc minute or a few.
_JOINT_ERROR_FACTOR = 0.05
# What may be wrong where an arm and its readings do not belong together.
CHECKS = (
    "check the units, the sign and the zero of the joint, the order of the columns, and whether a joint is coupled to "
    "another (q3 = a2 q2 + q3, as on palletisers), which arm files cannot represent"
)


@attrs.frozen(kw_only=True, eq=False)
class Calibration:
    """The errors of an arm, estimated from a measurement.

    Attributes:
        model: the arm with all errors that it can have, and the setup of the measurement.
        identifiability: which errors are fitted, and why the others are not.
        errors: (k,) all errors, 0 where they are fixed [m], [rad].
        covariance: (f, f) of the errors that are fitted.
        before: residuals of m readings with the nominal arm, its base best-fitted.
        after: residuals with the corrected arm.
        noise: of the measurement, from the residuals.
        degrees_of_freedom: how many more numbers were measured than errors fitted, without outliers.
        outliers: numbers of readings whose residuals are too large for the noise; they do not count.
    """

    model: MeasurementModel
    identifiability: Identifiability
    errors: Array
    covariance: Array
    before: PoseError
    after: PoseError
    noise: Noise
    degrees_of_freedom: int
    outliers: tuple[int, ...]

    @property
    def chain(self) -> Chain:
        """The arm with all errors that it can have."""
        return self.model.chain

    @property
    def arm_errors(self) -> Array:
        """The errors of the arm, without those of the setup [m], [rad]."""
        return self.errors[: len(self.chain.names)]

    @property
    def names(self) -> tuple[str, ...]:
        """The f errors that are fitted."""
        return tuple(self.identifiability.names[i] for i in self.identifiability.fitted)

    @property
    def values(self) -> Array:
        """(f,) the errors that are fitted [m], [rad]."""
        return np.asarray(self.errors[list(self.identifiability.fitted)], dtype=np.float64)

    @property
    def standard_errors(self) -> Array:
        """(f,) of the errors that are fitted [m], [rad]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    @property
    def fixed(self) -> tuple[FixedParameter, ...]:
        """The errors that are not fitted, and why."""
        return self.identifiability.fixed

    def intervals(self, confidence: float = 0.95) -> Array:
        """Return (f, 2) the confidence intervals of the errors that are fitted, by Student's t [m], [rad].

        Raises:
            InvalidValueError: ``confidence`` is not between 0 and 1.
        """
        if not 0 < confidence < 1:
            raise InvalidValueError(f"confidence: expected between 0 and 1, got {confidence:g}")
        half = float(student.ppf((1 + confidence) / 2, self.degrees_of_freedom)) * self.standard_errors
        return np.stack([self.values - half, self.values + half], axis=1)

    def predict(self, q: ArrayLike, *, payload: ArrayLike | None = None) -> Array:
        """Return (m, 3) the positions of the corrected arm's tool, in the frame of the measurements [m].

        Args:
            q: (m, n) joint positions [rad] or [m].
            payload: (4,) or (m, 4) what the tool holds, see ``readings``.
        """
        return self.chain.forward(q, self.arm_errors, payload=payload).position

    def uncertainty(self, q: ArrayLike, *, payload: ArrayLike | None = None) -> Array:
        """Return (m, 3, 3) the covariance of ``predict`` that follows from that of the errors [m²]."""
        own = [(i, j) for i, j in enumerate(self.identifiability.fitted) if j < len(self.chain.names)]
        rows, columns = [i for i, _ in own], [j for _, j in own]
        J = self.chain.forward(q, self.arm_errors, payload=payload).position_jacobian[:, :, columns]
        return np.asarray(J @ self.covariance[np.ix_(rows, rows)] @ J.swapaxes(1, 2), dtype=np.float64)

    def _repr_html_(self) -> str:
        """Show every parameter deviation that was fitted, with its standard error."""
        rows = zip(self.names, self.values.tolist(), self.standard_errors.tolist(), strict=True)
        title = f"{len(self.names)} parameter deviations, {self.degrees_of_freedom} degrees of freedom (m, rad)"
        return html_table(title, ("parameter", "estimate", "standard error"), rows)


def calibrate_points(
    arm: Arm,
    q: ArrayLike,
    points: ArrayLike,
    *,
    base: Array | None = None,
    only: Sequence[str] | None = None,
    without: Sequence[str] = (),
    robust: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Estimate the errors of an arm from measured points or poses of its tool.

    Args:
        arm: the nominal arm, with n joints.
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) positions of the tool [m], or (m, 4, 4) its poses.
        base: see ``calibrate``.
        only: see ``calibrate``.
        without: see ``calibrate``.
        robust: see ``calibrate``.
        progress: see ``calibrate``.

    Raises:
        ShapeError: joint positions and points are not as many.
        ContradictionError: the points are those of another arm.
        TooFewError: there are fewer numbers than errors.
        UnknownNameError: ``only`` or ``without`` has a name that no error has.
    """
    measured = readings(q, points)
    return calibrate(arm, measured, base=base, only=only, without=without, robust=robust, progress=progress)


def calibrate(
    arm: Arm,
    measured: Readings,
    *,
    base: Array | None = None,
    joint_errors: tuple[JointErrorModel, ...] = (),
    only: Sequence[str] | None = None,
    without: Sequence[str] = (),
    robust: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Estimate the errors of an arm from readings of any kind.

    Args:
        arm: the nominal arm, with n joints.
        measured: points, poses, planes that were touched, distances.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; estimated when left out.
        joint_errors: models of the joints whose coefficients are estimated beside the errors of the geometry.
        only: errors of the arm to fit, such as ``base.x`` or all of a part such as ``tool``; all that are identifiable
            when left out.
        without: errors not to fit, such as ``beta`` of all joints, or ``joint3.alpha``.
        robust: whether readings with large residuals weigh less.
        progress: called with what is being done.

    Raises:
        ShapeError: the readings are of arms with another number of joints.
        ContradictionError: the readings are those of another arm, or their residuals hide every error.
        TooFewError: there are fewer numbers than errors.
        UnknownNameError: ``only`` or ``without`` has a name that no error has.
    """
    if measured.q.shape[1] != arm.n:
        raise ShapeError(f"expected readings of {arm.n} joints, as {arm.name} has, got {measured.q.shape[1]}")
    model = initial_guess(arm, measured, base=base, joint_errors=joint_errors)
    first, allowed = _candidate_errors(model, only, without)
    selected, errors, noise = _select_and_fit(model, measured, first, allowed, robust=robust, progress=progress)
    if robust and selected.fitted:
        # Each outlier, though its weight is small, still pulls as hard as a usual reading, and many pull together.
        errors = _fit(model, measured, list(selected.fitted), errors, noise, robust=True, reject_outliers=True)
    return _with_covariance(model, selected, measured, errors, robust=robust)


# ---- inside --------------------------------------------------------------------------------------------------------


def _candidate_errors(
    model: MeasurementModel, only: Sequence[str] | None, without: Sequence[str]
) -> tuple[list[int], set[int]]:
    """Return the errors that are selected before all others, in order, and all that may be fitted."""
    names = model.names

    def matching_errors(word: str) -> set[int]:
        matches = {i for i, name in enumerate(names) if name == word or word in name.split(".")}
        if not matches:
            parts = dict.fromkeys(part for name in names for part in name.split("."))
            raise UnknownNameError("error", word, [*names, *parts])
        return matches

    setup = set(range(len(model.chain.names), len(names)))
    allowed = set(range(len(names))) if only is None else setup.union(*map(matching_errors, only))
    # An arm without parallel axes has no beta to leave out.
    parts = {part for name in names for part in (name, *name.split("."))}
    allowed -= set[int]().union(*(matching_errors(word) for word in without if word in parts or word != "beta"))
    return [*sorted(setup), *preferred_parameters(names)], allowed


def _select_and_fit(
    model: MeasurementModel,
    measured: Readings,
    first: list[int],
    allowed: set[int],
    *,
    robust: bool,
    progress: Callable[[str], None] | None,
) -> tuple[Identifiability, Array, Noise]:
    """Return which errors are identifiable, the errors, and the noise, which depend on one another."""
    largest = _by_error_type(model, *MAX_STANDARD_ERROR)
    errors, fitted = np.zeros(len(model.names)), tuple[int, ...]()
    rounds: list[tuple[Identifiability, Array, Noise]] = []
    # Before anything is fitted, the residuals do not estimate the noise.
    start = median_noise(model.residuals(measured), 0)
    noise = before = Noise(*map(min, start, TYPICAL_NOISE))
    for _ in range(_ROUNDS):
        residuals = model.residuals(measured, errors)
        J, count = residuals.jacobian * length_scales(residuals, noise)[:, None], len(residuals.values)
        # What is fitted already comes first: of two nearly collinear errors, one would displace the other and run away.
        order = list(dict.fromkeys([*fitted, *first]))
        select = partial(
            select_identifiable, model.names, J, model.is_length, noise.length, first=order, max_standard_error=largest
        )
        selected = select(allowed=allowed)
        if fitted and not is_overdetermined(count, len(selected.fitted)):
            # The residuals of so few readings are next to nothing, and more errors seem identifiable than are.
            reason = "so few readings have no degree of freedom left to distinguish it from noise"
            restricted = select(allowed=set(fitted))
            new = (FixedParameter(model.names[i], reason, ()) for i in selected.fitted if i not in restricted.fitted)
            selected = attrs.evolve(restricted, fixed=(*selected.fixed, *new))
        settled = all(now > _NOISE_DECREASE * then for now, then in zip(noise, before, strict=True))
        if selected.fitted == fitted and settled:
            rounds[-1:] = [(selected, errors, noise)]
            break
        if not selected.fitted:
            raise ContradictionError(
                f"the residuals of {model.chain.arm.name}, {noise.length * 1e3:.3g} mm, are too large for any of its "
                f"errors to be identifiable: are these its readings? If so, {CHECKS}"
            )
        fitted, before = selected.fitted, noise
        if not is_overdetermined(count, len(fitted)):
            raise TooFewError(f"{len(measured)} readings give {count} numbers for {len(fitted)} errors; measure more")
        if progress is not None:
            progress(f"fitting {len(fitted)} errors to {len(measured)} readings")
        errors = _fit(model, measured, list(fitted), errors, noise, robust=robust)
        noise = median_noise(model.residuals(measured, errors), len(fitted))
        rounds.append((selected, errors, noise))
    # Noise hides errors, and errors that are not fitted look like noise: rounds may lead away, and the last is not
    # always the best.
    best = min(rounds, key=lambda result: result[2].length)
    return best if best[2].length < _NOISE_DECREASE * noise.length else rounds[-1]


def _fit(
    model: MeasurementModel,
    measured: Readings,
    fitted: list[int],
    start: Array,
    noise: Noise,
    *,
    robust: bool,
    reject_outliers: bool = False,
) -> Array:
    """Return (k,) the errors by iteratively reweighted least squares, on request without outliers.

    The cost is the sum of the squares of the weighted residuals and of the prior residuals, errors by their prior
    sigmas, all scaled to lengths with the standard deviation of the noise.
    """
    errors = start.copy()
    errors[[i for i in range(len(errors)) if i not in fitted]] = 0.0
    prior = noise.length * np.diag(1 / _by_error_type(model, *PRIOR_SIGMA)[fitted])
    scales = weights = length_scales(model.residuals(measured, errors), noise)

    # Residuals, weights and the Jacobian are asked for at the same errors, one after the other.
    @lru_cache(maxsize=2)
    def residuals_at(fitted_errors: bytes) -> Residuals:
        errors[fitted] = np.frombuffer(fitted_errors)
        return model.residuals(measured, errors)

    def weights_now() -> Array:
        residuals = residuals_at(errors[fitted].tobytes())
        return np.asarray(scales * robust_weights(residuals, noise, reject_outliers=reject_outliers))

    def cost_residuals(x: Array) -> Array:
        return np.concatenate([residuals_at(x.tobytes()).values * weights, prior @ x])

    def cost_jacobian(x: Array) -> Array:
        return np.vstack([residuals_at(x.tobytes()).jacobian[:, fitted] * weights[:, None], prior])

    for _ in range(_REWEIGHTINGS):
        if robust:
            weights = weights_now()
        errors[fitted] = least_squares(cost_residuals, errors[fitted].copy(), cost_jacobian, **_SOLVER_OPTIONS).x
        if not robust:
            break
        reweighted = weights_now()
        if np.all(np.abs(reweighted - weights) <= _WEIGHT_TOLERANCE * scales):
            break
    return errors


def _with_covariance(
    model: MeasurementModel, selected: Identifiability, measured: Readings, errors: Array, *, robust: bool
) -> Calibration:
    """Return the errors with their covariance: the inverse of the information of readings and prior.

    The information matrix is formed in units of the prior sigmas, in which that of the prior is the identity.
    """
    fitted = list(selected.fitted)
    residuals = model.residuals(measured, errors)
    noise, outlying, degrees_of_freedom = noise_and_outliers(residuals, len(measured), len(fitted), robust=robust)
    sigma, prior_sigma = standard_deviations(residuals, noise), _by_error_type(model, *PRIOR_SIGMA)[fitted]
    counted = ~outlying[residuals.reading]
    A = residuals.jacobian[counted][:, fitted] / sigma[counted, None] * prior_sigma
    covariance = np.linalg.inv(A.T @ A + np.eye(len(fitted))) * np.outer(prior_sigma, prior_sigma)
    return Calibration(
        model=model,
        identifiability=selected,
        errors=errors,
        covariance=np.asarray(covariance, dtype=np.float64),
        before=model.pose_errors(measured),
        after=model.pose_errors(measured, errors),
        noise=noise,
        degrees_of_freedom=degrees_of_freedom,
        outliers=tuple(np.flatnonzero(outlying).tolist()),
    )


def _by_error_type(model: MeasurementModel, length: float, angle: float) -> Array:
    """Return (k,) one value for lengths and one for angles; of errors of joints a twentieth."""
    joint_errors = {error.name for error in model.chain.joint_errors}
    parts = np.array([_JOINT_ERROR_FACTOR if name in joint_errors else 1.0 for name in model.names])
    return np.asarray(np.where(model.is_length, length, angle) * parts, dtype=np.float64)
