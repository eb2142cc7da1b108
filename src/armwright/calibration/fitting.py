"""The errors of an arm from what was measured of it: robust least squares, with the covariance of what is found.

A reading that is far off counts less, as a whole: all three coordinates of a point, in whatever frame they are told;
in the end, one that is off by twice what usual ones stay below does not count. Turns are weighed against lengths by
what is left of either.

Source:
    Holland & Welsch (1977) for least squares with weights; spec of the calibration.
"""

from collections.abc import Callable, Sequence
from functools import partial

import attrs
import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.calibration.chain import Chain, JointErrorModel
from armwright.calibration.identifiability import (
    MAX_STANDARD_ERROR_ANGLE,
    MAX_STANDARD_ERROR_LENGTH,
    FixedParameter,
    Identifiability,
    is_overdetermined,
    preferred_parameters,
    select_identifiable,
)
from armwright.calibration.initial_guess import initial_guess
from armwright.calibration.measurement_model import MeasurementModel, PoseError
from armwright.calibration.noise import TYPICAL, Noise, length_scales, median_noise, noise_and_outliers, robust_weights
from armwright.calibration.readings import Readings, readings
from armwright.errors import ContradictionError, InvalidValueError, ShapeError, TooFewError, UnknownNameError

_ROUNDS, _WEIGHINGS = 8, 30
# Rounds end when one finds the noise no smaller than this part of what the last found: outliers then weigh what they
# should.
_SETTLED = 0.9
# Weights are settled when none changes by more.
_WEIGHED = 1e-3
# A fit ends when it gets better by less than this part; its errors are then far nearer than they are known.
_FINISHED = 1e-11
# It takes some ten steps; readings that make no sense could take minutes.
_STEPS = 100
# What is off by more than this is not believed unless the readings say so clearly [m], [rad]. It binds what they
# hardly tell: two such errors can otherwise run away together. What is told to a tenth of it is moved by a hundredth
# of its deviation at most.
PRIOR_SIGMA_LENGTH, PRIOR_SIGMA_ANGLE = 0.02, 0.05
# Bends of joints are a twentieth of that: gears run true to an arc minute or a few.
_BENDS = 0.05
# What may be wrong where an arm and its readings do not belong together.
CHECK = (
    "check the units, the sign and the zero of the joint, the order of the columns, and whether a joint is coupled to "
    "another (q3 = a2 q2 + q3, as on palletisers), which arm files cannot say"
)


@attrs.frozen(kw_only=True, eq=False)
class Calibration:
    """What a measurement says of an arm.

    Attributes:
        model: the arm with all errors that it can have, and what it was measured against.
        identified: which of them are fitted, and why the others are not.
        errors: (k,) of all, 0 for those that are held [m], [rad].
        covariance: (f, f) of those that are fitted.
        before: by how much each of m readings misses the arm as said, its base moved to fit.
        after: by how much it misses the corrected arm.
        noise: of the measurement, from what is left.
        freedom: how many more numbers were measured than errors fitted, outliers left out.
        outliers: numbers of readings that are off by more than they should be; they do not count.
    """

    model: MeasurementModel
    identified: Identifiability
    errors: Array
    covariance: Array
    before: PoseError
    after: PoseError
    noise: Noise
    freedom: int
    outliers: tuple[int, ...]

    @property
    def chain(self) -> Chain:
        """The arm with all errors that it can have."""
        return self.model.chain

    @property
    def own(self) -> Array:
        """The errors of the arm alone [m], [rad]."""
        return self.errors[: len(self.chain.names)]

    @property
    def names(self) -> tuple[str, ...]:
        """The errors that are fitted."""
        return tuple(self.identified.names[i] for i in self.identified.kept)

    @property
    def values(self) -> Array:
        """(f,) the errors that are fitted [m], [rad]."""
        return np.asarray(self.errors[list(self.identified.kept)], dtype=np.float64)

    @property
    def deviations(self) -> Array:
        """(f,) their standard deviations [m], [rad]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    @property
    def held(self) -> tuple[FixedParameter, ...]:
        """The errors that are not fitted, and why."""
        return self.identified.held

    def intervals(self, part: float = 0.95) -> Array:
        """Return (f, 2) in which each error is with this probability, by Student's t [m], [rad].

        Raises:
            InvalidValueError: ``part`` is not between 0 and 1.
        """
        if not 0 < part < 1:
            raise InvalidValueError(f"part: expected between 0 and 1, got {part:g}")
        half = float(student.ppf((1 + part) / 2, self.freedom)) * self.deviations
        return np.stack([self.values - half, self.values + half], axis=1)

    def predict(self, q: ArrayLike) -> Array:
        """Return (m, 3) where the corrected arm has its tool, in the frame of the measurements [m]."""
        return self.chain.reach(q, self.own).position

    def uncertainty(self, q: ArrayLike) -> Array:
        """Return (m, 3, 3) the covariance of where the corrected arm has its tool, from that of its errors [m²]."""
        own = [(i, j) for i, j in enumerate(self.identified.kept) if j < len(self.chain.names)]
        rows, columns = [i for i, _ in own], [j for _, j in own]
        J = self.chain.reach(q, self.own).by_position[:, :, columns]
        return np.asarray(J @ self.covariance[np.ix_(rows, rows)] @ J.swapaxes(1, 2), dtype=np.float64)


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
    """Find the errors of an arm from points or poses that its tool was measured at.

    Args:
        arm: as it is said to be, with n joints.
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m], or (m, 4, 4) how it stood.
        base: see ``calibrate``.
        only: see ``calibrate``.
        without: see ``calibrate``.
        robust: see ``calibrate``.
        progress: see ``calibrate``.

    Raises:
        ShapeError: joint positions and points are not as many.
        ContradictionError: the points are those of another arm.
        TooFewError: there are fewer numbers than errors.
        UnknownNameError: ``only`` or ``without`` names what there is not.
    """
    seen = readings(q, points)
    return calibrate(arm, seen, base=base, only=only, without=without, robust=robust, progress=progress)


def calibrate(
    arm: Arm,
    seen: Readings,
    *,
    base: Array | None = None,
    bends: tuple[JointErrorModel, ...] = (),
    only: Sequence[str] | None = None,
    without: Sequence[str] = (),
    robust: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Find the errors of an arm from whatever was measured of it.

    Args:
        arm: as it is said to be, with n joints.
        seen: points, poses, planes that were touched, distances.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; found when left out.
        bends: of its joints, to be found beside the errors of its geometry.
        only: errors of the arm to fit, such as ``base.x`` or all of a part such as ``tool``; all that can be told when
            left out.
        without: errors not to fit, such as ``beta`` of all joints, or ``joint3.alpha``.
        robust: whether readings that are far off count less.
        progress: told what is being done.

    Raises:
        ShapeError: the readings are of arms with another number of joints.
        ContradictionError: the readings are those of another arm, or what is left of them hides every error.
        TooFewError: there are fewer numbers than errors.
        UnknownNameError: ``only`` or ``without`` names what there is not.
    """
    if seen.q.shape[1] != arm.n:
        raise ShapeError(f"expected readings of {arm.n} joints, as {arm.name} has, got {seen.q.shape[1]}")
    model = initial_guess(arm, seen, base=base, bends=bends)
    found, errors, noise = _rounds(model, seen, _chosen(model, only, without), robust=robust, progress=progress)
    kept = list(found.kept)
    if robust and kept:
        # Each outlier, though it counts little, still pulls as hard as a usual reading, and many pull together.
        errors = _fitted(model, seen, kept, errors, noise, robust=True, strict=True)
    return _told(model, found, seen, errors, robust=robust)


# ---- inside --------------------------------------------------------------------------------------------------------


def _chosen(model: MeasurementModel, only: Sequence[str] | None, without: Sequence[str]) -> tuple[list[int], set[int]]:
    """Return the order in which errors are taken, and those that may be."""
    names = model.names

    def named(one: str) -> set[int]:
        fits = {i for i, name in enumerate(names) if name == one or one in name.split(".")}
        if not fits:
            parts = dict.fromkeys(part for name in names for part in name.split("."))
            raise UnknownNameError("error", one, [*names, *parts])
        return fits

    around = set(model.surroundings)
    allowed = set(range(len(names))) if only is None else around.union(*map(named, only))
    # What there is not need not be left out.
    parts = {part for name in names for part in (name, *name.split("."))}
    allowed -= set[int]().union(*(named(one) for one in without if one in parts or one != "beta"))
    return [*sorted(around), *preferred_parameters(names)], allowed


def _no_more(found: Identifiability, before: Identifiability) -> Identifiability:
    """Return what was fitted before; what else seems to be told is held."""
    why = "so few readings leave nothing over to tell it from noise"
    more = (FixedParameter(found.names[i], why, ()) for i in found.kept if i not in before.kept)
    return attrs.evolve(before, held=(*found.held, *more))


def _rounds(
    model: MeasurementModel,
    seen: Readings,
    chosen: tuple[list[int], set[int]],
    *,
    robust: bool,
    progress: Callable[[str], None] | None,
) -> tuple[Identifiability, Array, Noise]:
    """Return what can be fitted, the errors, and the noise, which depend on one another."""
    first, allowed = chosen
    known = np.where(model.is_length, MAX_STANDARD_ERROR_LENGTH, MAX_STANDARD_ERROR_ANGLE) * _parts(model)
    errors, kept = np.zeros(len(model.names)), tuple[int, ...]()
    tried: list[tuple[Identifiability, Array, Noise]] = []
    # Before anything is fitted, what is left says nothing of the noise.
    start = median_noise(model.rows(seen), 0)
    noise = before = Noise(*map(min, start, TYPICAL))
    for _ in range(_ROUNDS):
        rows = model.rows(seen, errors)
        J = rows.by * length_scales(rows, noise)[:, None]
        # What is fitted already comes first: of two that are nearly one, one would displace the other and run away.
        order = list(dict.fromkeys([*kept, *first]))
        identified = partial(
            select_identifiable, model.names, J, model.is_length, noise.length, first=order, known=known
        )
        found = identified(allowed=allowed)
        if kept and not is_overdetermined(len(rows.off), len(found.kept)):
            # What so few readings leave is next to nothing, and seems to tell what it does not: noise.
            found = _no_more(found, identified(allowed=set(kept)))
        if found.kept == kept and all(now > _SETTLED * then for now, then in zip(noise, before, strict=True)):
            tried[-1:] = [(found, errors, noise)]
            break
        if not found.kept:
            raise ContradictionError(
                f"what {model.chain.arm.name} misses its readings by, {noise.length * 1e3:.3g} mm, hides every error "
                f"that it may have: are these its readings? If so, {CHECK}"
            )
        kept, before = found.kept, noise
        if not is_overdetermined(len(rows.off), len(kept)):
            raise TooFewError(f"{len(seen)} readings give {len(rows.off)} numbers for {len(kept)} errors; measure more")
        if progress is not None:
            progress(f"fitting {len(kept)} errors to {len(seen)} readings")
        errors = _fitted(model, seen, list(kept), errors, noise, robust=robust)
        noise = median_noise(model.rows(seen, errors), len(kept))
        tried.append((found, errors, noise))
    # What is left hides errors, and what is not fitted is left: rounds may lead away, and the last is not the best.
    best = min(tried, key=lambda one: one[2].length)
    return best if best[2].length < _SETTLED * noise.length else tried[-1]


def _fitted(
    model: MeasurementModel,
    seen: Readings,
    kept: list[int],
    start: Array,
    noise: Noise,
    *,
    robust: bool,
    strict: bool = False,
) -> Array:
    """Return (k,) errors of which those that are kept fit the readings best; if strict, without outliers."""
    errors = start.copy()
    errors[[i for i in range(len(errors)) if i not in kept]] = 0.0
    belief = noise.length * np.diag(1 / _believed(model)[kept])
    rows = model.rows(seen, errors)
    scale = weighed = length_scales(rows, noise)

    def missing(x: Array) -> Array:
        errors[kept] = x
        return np.concatenate([model.rows(seen, errors).off * weighed, belief @ x])

    def slopes(x: Array) -> Array:
        errors[kept] = x
        return np.vstack([model.rows(seen, errors).by[:, kept] * weighed[:, None], belief])

    for _ in range(_WEIGHINGS):
        if robust:
            weighed = scale * robust_weights(model.rows(seen, errors), noise, strict=strict)
        found = least_squares(
            missing,
            errors[kept].copy(),
            slopes,
            x_scale="jac",
            ftol=_FINISHED,
            xtol=_FINISHED,
            gtol=None,
            max_nfev=_STEPS,
        )
        errors[kept] = found.x
        settled = scale * robust_weights(model.rows(seen, errors), noise, strict=strict) if robust else weighed
        if np.all(np.abs(settled - weighed) <= _WEIGHED * scale):
            break
    return errors


def _believed(model: MeasurementModel) -> Array:
    """Return (k,) how far errors may be off without a question [m], [rad]."""
    return np.where(model.is_length, PRIOR_SIGMA_LENGTH, PRIOR_SIGMA_ANGLE) * _parts(model)


def _parts(model: MeasurementModel) -> Array:
    """Return (k,) how large errors may be as a part of those of the geometry."""
    bends = {bend.name for bend in model.chain.bends}
    return np.array([_BENDS if name in bends else 1.0 for name in model.names])


def _told(
    model: MeasurementModel, found: Identifiability, seen: Readings, errors: Array, *, robust: bool
) -> Calibration:
    kept = list(found.kept)
    rows = model.rows(seen, errors)
    noise, outlying, freedom = noise_and_outliers(rows, len(seen), len(kept), robust=robust)
    deviation = np.where(rows.turning, noise.turn, noise.length)
    believed = _believed(model)[kept]
    counted = ~outlying[rows.of]
    A = rows.by[counted][:, kept] / deviation[counted, None] * believed
    covariance = np.linalg.inv(A.T @ A + np.eye(len(kept))) * np.outer(believed, believed)
    return Calibration(
        model=model,
        identified=found,
        errors=errors,
        covariance=np.asarray(covariance, dtype=np.float64),
        before=model.off(seen),
        after=model.off(seen, errors),
        noise=noise,
        freedom=freedom,
        outliers=tuple(np.flatnonzero(outlying).tolist()),
    )
