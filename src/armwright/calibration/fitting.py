"""The errors of an arm from measured points: robust least squares, with the covariance of what is found.

Source:
    Triggs et al. (2000) for the weights of outliers; spec of the calibration.
"""

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from scipy.optimize import least_squares

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, floats
from armwright.calibration.chain import Chain, chain_of
from armwright.calibration.identifying import Held, Identified, identify
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from armwright.spatial.poses import pose
from armwright.spatial.rotations import nearest_rotation

# Points that are off by more times their usual deviation count less.
_USUAL = 3.0
# From a median of absolute values to the standard deviation of a normal distribution.
_MEDIAN = 1.4826
# The variance of those numbers of a normal distribution that are within three deviations.
_WITHIN = 0.97334
_ROUNDS = 8
# Rounds end when one finds the noise no smaller than this part of what the last found: outliers then weigh what they
# should.
_SETTLED = 0.9
# A measurement that no rigid motion brings so near to the arm is of another arm, or in other units [m].
_FARTHEST = 0.2
_LEAST_NOISE, _FIRST_NOISE = 1e-9, 1e-4
# A fit ends when it gets better by less than this part; its errors are then far nearer than they are known.
_FINISHED = 1e-11
# What is off by more than this is not believed unless the points say so clearly [m], [rad]. It binds what they hardly
# tell: two such errors can otherwise run away together. What is told to a tenth of it is moved by a hundredth of its
# deviation at most.
_BELIEVED_LENGTH, _BELIEVED_ANGLE = 0.02, 0.05


@attrs.frozen(kw_only=True, eq=False)
class Calibration:
    """What a measurement says of an arm.

    Attributes:
        chain: the arm with all errors that it can have.
        identified: which of them are fitted, and why the others are not.
        errors: (k,) of all, 0 for those that are held [m], [rad].
        covariance: (f, f) of those that are fitted.
        before: (m,) distances of the points from where the arm as said would be, its base moved to fit [m].
        after: (m,) from where the corrected arm is [m].
        noise: standard deviation of a coordinate, from what is left [m].
        outliers: numbers of points that are off by more than they should be.
    """

    chain: Chain
    identified: Identified
    errors: Array
    covariance: Array
    before: Array
    after: Array
    noise: float
    outliers: tuple[int, ...]

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
    def held(self) -> tuple[Held, ...]:
        """The errors that are not fitted, and why."""
        return self.identified.held

    def predict(self, q: ArrayLike) -> Array:
        """Return (m, 3) where the corrected arm has its tool, in the frame of the measurements [m]."""
        return self.chain.reach(q, self.errors).position


def calibrate(
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
    """Find the errors of an arm from points that its tool was measured at.

    Args:
        arm: as it is said to be, with n joints.
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m].
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; found when left out.
        only: errors to fit, such as ``base.x`` or all of a part such as ``tool``; all that can be told when left out.
        without: errors not to fit, such as ``beta`` of all joints, or ``joint3.alpha``.
        robust: whether points that are far off count less.
        progress: told what is being done.

    Raises:
        ShapeError: joint positions and points are not as many.
        InvalidValueError: there are fewer numbers than errors, or the points are those of another arm.
        UnknownNameError: ``only`` or ``without`` names what there is not.
    """
    places, seen = np.atleast_2d(floats(q, "q")), np.atleast_2d(floats(points, "points"))
    if places.shape[1:] != (arm.n,) or seen.shape != (len(places), 3):
        raise ShapeError(
            f"expected (m, {arm.n}) joint positions and (m, 3) points, got {places.shape} and {seen.shape}"
        )
    chain = chain_of(arm, base=registered(chain_of(arm), places, seen) if base is None else base)
    nominal = chain.reach(places).position
    _refuse_others(arm, nominal, seen)
    chosen = _chosen(chain, only, without)
    errors, kept = np.zeros(len(chain.names)), tuple[int, ...]()
    found: Identified | None = None
    # Before anything is fitted, what is left says nothing of the noise.
    noise = before = min(_spread((nominal - seen).ravel()), _FIRST_NOISE)
    for _ in range(_ROUNDS):
        J = chain.reach(places, errors).by_position.reshape(-1, len(chain.names))
        # What is fitted already comes first: of two that are nearly one, one would displace the other and run away.
        first = list(dict.fromkeys([*kept, *chosen[0]]))
        found = identify(chain.names, J, chain.is_length, noise, first=first, allowed=chosen[1])
        if found.kept == kept and noise > _SETTLED * before:
            break
        kept, before = found.kept, noise
        if len(kept) >= seen.size:
            raise InvalidValueError(
                f"{len(seen)} points give {seen.size} numbers for {len(kept)} errors; measure more points, "
                f"or fit fewer errors"
            )
        if progress is not None:
            progress(f"fitting {len(kept)} errors to {len(seen)} points")
        errors = _fitted(chain, (places, seen), list(kept), errors, noise, robust=robust)
        noise = max(_spread((chain.reach(places, errors).position - seen).ravel()), _LEAST_NOISE)
    assert found is not None  # noqa: S101 - there is a first round
    return _told(chain, found, places, seen, errors, robust=robust)


def registered(chain: Chain, q: Array, points: Array) -> Array:
    """Return (4, 4) the base frame that brings the arm as it is said to be nearest to the points.

    Source:
        Kabsch (1976).
    """
    own = chain.reach(q).position
    a, b = own - own.mean(axis=0), points - points.mean(axis=0)
    R = nearest_rotation(b.T @ a)
    return pose(R, points.mean(axis=0) - R @ own.mean(axis=0))


# ---- inside --------------------------------------------------------------------------------------------------------


def _refuse_others(arm: Arm, nominal: Array, seen: Array) -> None:
    """Refuse points that are in other units or of another arm."""
    spread, theirs = (float(np.linalg.norm(x - x.mean(axis=0), axis=1).mean()) for x in (nominal, seen))
    ratio = theirs / max(spread, 1e-12)
    for factor, word in (
        (1e3, "millimetres read as metres"),
        (1e-3, "metres read as millimetres"),
        (39.37, "inches read as metres"),
    ):
        if 0.8 < ratio / factor < 1.25:
            raise InvalidValueError(
                f"the points spread {ratio:.4g} times as far as {arm.name} reaches in these postures: are they {word}?"
            )
    far = float(np.median(np.linalg.norm(nominal - seen, axis=1)))
    if far > _FARTHEST:
        raise InvalidValueError(
            f"the points lie {far * 1e3:.0f} mm from where {arm.name} would have its tool, wherever it stands: are "
            f"these its joints, in this order and these units?"
        )


def _chosen(chain: Chain, only: Sequence[str] | None, without: Sequence[str]) -> tuple[list[int], set[int]]:
    """Return the order in which errors are taken, and those that may be."""
    names = chain.names

    def named(one: str) -> set[int]:
        fits = {i for i, name in enumerate(names) if name == one or one in name.split(".")}
        if not fits:
            parts = dict.fromkeys(part for name in names for part in name.split("."))
            raise UnknownNameError("error", one, [*names, *parts])
        return fits

    allowed = set(range(len(names))) if only is None else set[int]().union(*map(named, only))
    # What there is not need not be left out.
    parts = {part for name in names for part in (name, *name.split("."))}
    allowed -= set[int]().union(*(named(one) for one in without if one in parts or one != "beta"))
    # The tool before the last joint, which moves it as the tool's own errors do but for one direction.
    order = [i for part in ("base.", "tool.", ".theta") for i, name in enumerate(names) if part in name]
    return order, allowed


def _fitted(
    chain: Chain, data: tuple[Array, Array], kept: list[int], start: Array, noise: float, *, robust: bool
) -> Array:
    q, seen = data
    errors = start.copy()
    errors[[i for i in range(len(errors)) if i not in kept]] = 0.0
    belief = noise * np.diag(1 / _believed(chain)[kept])

    def missing(x: Array) -> Array:
        errors[kept] = x
        return np.concatenate([(chain.reach(q, errors).position - seen).ravel(), belief @ x])

    def slopes(x: Array) -> Array:
        errors[kept] = x
        return np.vstack([chain.reach(q, errors).by_position.reshape(-1, len(errors))[:, kept], belief])

    options = {"loss": "soft_l1", "f_scale": max(_USUAL * noise, _LEAST_NOISE)} if robust else {}
    found = least_squares(
        missing, errors[kept].copy(), slopes, x_scale="jac", ftol=_FINISHED, xtol=_FINISHED, **options
    )
    errors[kept] = found.x
    return errors


def _believed(chain: Chain) -> Array:
    """Return (k,) how far errors may be off without a question [m], [rad]."""
    return np.where(chain.is_length, _BELIEVED_LENGTH, _BELIEVED_ANGLE)


def _told(chain: Chain, found: Identified, q: Array, seen: Array, errors: Array, *, robust: bool) -> Calibration:
    kept = list(found.kept)
    reached = chain.reach(q, errors)
    off = (reached.position - seen).ravel()
    J = reached.by_position.reshape(-1, len(errors))[:, kept]
    freedom = max(1, off.size - len(kept))
    usual = off
    if robust:
        usual = off[np.abs(off) <= _USUAL * _spread(off) * np.sqrt(off.size / freedom)] / np.sqrt(_WITHIN)
    noise = max(float(np.sqrt(np.mean(usual**2) * off.size / freedom)), _LEAST_NOISE)
    believed = _believed(chain)[kept]
    A = J * believed
    inverse = np.linalg.inv(A.T @ A + noise**2 * np.eye(len(kept))) * np.outer(believed, believed)
    distance = np.linalg.norm(off.reshape(-1, 3), axis=1)
    typical = _MEDIAN * float(np.median(distance)) if robust else np.inf
    return Calibration(
        chain=chain,
        identified=found,
        errors=errors,
        covariance=np.asarray(noise**2 * inverse, dtype=np.float64),
        before=np.asarray(np.linalg.norm(chain.reach(q).position - seen, axis=1), dtype=np.float64),
        after=np.asarray(distance, dtype=np.float64),
        noise=noise,
        outliers=tuple(int(i) for i in np.flatnonzero(distance > 2 * _USUAL * max(typical, _LEAST_NOISE))),
    )


def _spread(off: Array) -> float:
    """Return the standard deviation of numbers about 0 as their median says, which outliers do not move."""
    return max(float(_MEDIAN * np.median(np.abs(off))), _LEAST_NOISE)
