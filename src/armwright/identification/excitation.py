"""Motions that tell most of the parameters of an arm: Fourier series that start and end at rest, within limits.

A joint moves by a few harmonics of one period; of their coefficients two combinations are bound, so that speed and
acceleration are 0 where the period begins and ends. The objective has a gradient by all coefficients: that of the
condition or the information by the columns is analytic, that of the columns by the state of the arm costs three
evaluations for every joint, however many coefficients there are.

Source:
    Swevers, Ganseman, Tükel, De Schutter & Van Brussel (1997) for periodic excitation; Park (2006) for series that
    start at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, exact_shape, integer, positive
from armwright.compiled.arm import compile_arm
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.files.result_table import ResultTable
from armwright.identification.fourier import Fourier
from armwright.identification.model import DynamicModel
from armwright.motion.quintic_polynomials import hermite
from armwright.motion.trajectory import Trajectory

Criterion: TypeAlias = Literal["condition", "information"]
# Samples of a motion at which it is optimised, and at which it is checked.
_SAMPLES, _CHECKS = 100, 1000
# The condition is smooth as a ratio of norms of the eigenvalues; the norms get closer to the largest and smallest.
_POWERS = (2.0, 6.0)
# Part of a limit that the optimum keeps to, what exceeding it costs, and iterations in each round.
_KEEP, _PENALTY, _ITERATIONS = 0.985, 300.0, 60
# Step of a difference by a state: columns are no more than quadratic in velocities, and sines of positions.
_STEP = 1e-6
# Dry friction reverses within this part of the greatest speed while the motion is optimised.
_SOFT = 0.03
# Joints of which no limit is known move by so much about 0 at most [rad], [m], and so fast.
_UNLIMITED = {True: (3.0, 2.0, 5.0), False: (0.5, 0.5, 2.0)}
# A motion that meets something is made smaller by this part, and given up when it is so small.
_SMALLER, _SMALLEST = 0.85, 0.1
# Noise of an effort where nothing is known of it, as part of the largest.
_NOISE = 0.01
# Length of a segment of the motion as polynomials [s].
_KNOT = 0.05
# Whether all of some configurations (k, n) are free of what the arm must not meet.
FreeCheck: TypeAlias = Callable[[Array], bool]


@attrs.frozen(kw_only=True, eq=False)
class MotionLimits:
    """What an excitation keeps to, (n,) each.

    Attributes:
        lower: smallest positions [rad] or [m].
        upper: largest positions.
        speed: largest speeds.
        acceleration: largest accelerations.
        effort: largest efforts of the drawing [N m] or [N]; infinite where they are not looked at.
    """

    lower: Array
    upper: Array
    speed: Array
    acceleration: Array
    effort: Array

    @classmethod
    def of(cls, arm: Arm, speed_part: float = 1.0) -> MotionLimits:
        """Return the limits of an arm, and moderate ones where it has none; a part of its speed and acceleration."""
        limits = arm.limits
        size, speed, acceleration = np.array([_UNLIMITED[bool(x)] for x in arm.revolute]).T
        lower = np.where(np.isfinite(limits.lower), limits.lower, np.minimum(0.0, limits.upper) - size)
        upper = np.where(np.isfinite(limits.upper), limits.upper, np.maximum(0.0, limits.lower) + size)
        # A revolution tells all that several tell.
        middle = (lower + upper) / 2
        return cls(
            lower=np.maximum(lower, middle - size),
            upper=np.minimum(upper, middle + size),
            speed=speed_part * np.where(np.isfinite(limits.speed), limits.speed, speed),
            acceleration=speed_part * np.where(np.isfinite(limits.acceleration), limits.acceleration, acceleration),
            effort=limits.effort,
        )


@attrs.frozen(kw_only=True, eq=False)
class Excitation:
    """A motion that was planned, and what it will tell.

    Attributes:
        model: of the arm.
        motion: the series.
        limits: that it keeps to.
        noise: (n,) standard deviation of a measured effort that errors are told for [N m] or [N].
        rate: of the independent readings that errors are told for [Hz].
        sizes: (b,) base parameters of the drawing.
        criterion: that was optimised.
        evaluations: of the objective.
    """

    model: DynamicModel
    motion: Fourier
    limits: MotionLimits
    noise: Array
    rate: float
    sizes: Array
    criterion: Criterion
    evaluations: int

    @property
    def columns(self) -> Array:
        """The base columns (k, n, b) of the motion at even times."""
        return self.model.base_columns(*self.motion(_times(self.motion.period, _CHECKS)))

    @property
    def condition(self) -> float:
        """The condition number of the base columns, not rescaled."""
        return float(np.linalg.cond(self.columns.reshape(-1, len(self.model.base.names))))

    @property
    def errors(self) -> Array:
        """Standard errors (b,) of the base parameters that are to be expected, from one period."""
        Y = (self.columns / self.noise[:, None]).reshape(-1, len(self.sizes))
        return np.asarray(np.sqrt(np.linalg.inv(Y.T @ Y * (self.rate * self.motion.period / _CHECKS)).diagonal()))

    @property
    def trajectory(self) -> Trajectory:
        """The motion as piecewise polynomials, which a cell plays."""
        count = int(np.ceil(self.motion.period / _KNOT))
        times = np.linspace(0, self.motion.period, count + 1)
        return hermite(times, *self.motion(times))

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        told = ""
        known = self.sizes > 0
        if known.any():
            part = float(np.median(self.errors[known] / self.sizes[known]))
            told = f"; half of those of the drawing are known to {part:.1%} or better"
            if part >= 1:
                told = "; half of those of the drawing, or more, would not be known: move for longer or faster"
        count, each = len(self.sizes), f"{self.rate:g} independent readings a second"
        return (
            f"condition {self.condition:.1f} of {count} base columns, not rescaled, by {self.evaluations} evaluations",
            f"standard errors of {self.motion.period:g} s with {each}{told}",
        )

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        q, qd, qdd = self.motion(_times(self.motion.period, _CHECKS))
        return {
            "arm": self.model.arm.name,
            "criterion": self.criterion,
            "period": self.motion.period,
            "a": self.motion.a.tolist(),
            "b": self.motion.b.tolist(),
            "centre": self.motion.centre.tolist(),
            "condition": self.condition,
            "noise": self.noise.tolist(),
            "errors": dict(zip(self.model.base.names, self.errors.tolist(), strict=True)),
            "drawing": dict(zip(self.model.base.names, self.sizes.tolist(), strict=True)),
            "lowest": q.min(axis=0).tolist(),
            "highest": q.max(axis=0).tolist(),
            "speed": np.abs(qd).max(axis=0).tolist(),
            "acceleration": np.abs(qdd).max(axis=0).tolist(),
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give how much of the limits the motion uses, and the errors to expect."""
        q, qd, qdd = self.motion(_times(self.motion.period, _CHECKS))
        scale = np.array([joint.units.scale for joint in self.model.arm.joints])
        peaks = np.abs(qd).max(axis=0), np.abs(qdd).max(axis=0)
        columns = np.stack([q.min(axis=0), q.max(axis=0), *peaks], axis=1) / scale[:, None]
        units = [joint.units.display for joint in self.model.arm.joints]
        yield ResultTable(
            title="Motion, in degrees or millimetres and seconds",
            heads=("joint", "", "from", "to", "speed", "acceleration"),
            rows=[
                (str(i), unit, *(f"{x:.4g}" for x in row))
                for i, (unit, row) in enumerate(zip(units, columns, strict=True), 1)
            ],
            numbers=range(2, 6),
        )
        rows = zip(self.model.base.names, self.sizes, self.errors, strict=True)
        yield ResultTable(
            title="Standard errors to expect, SI units",
            heads=("parameter", "drawing", "±"),
            rows=[(name, f"{size:.4g}" if size else "-", f"{error:.2g}") for name, size, error in rows],
            numbers=(1, 2),
        )


def plan_excitation(
    model: DynamicModel,
    *,
    limits: MotionLimits | None = None,
    period: float = 20.0,
    harmonics: int = 5,
    criterion: Criterion = "condition",
    noise: ArrayLike | None = None,
    rate: float = 10.0,
    is_free: FreeCheck | None = None,
    starts: int = 1,
    seed: int = 0,
) -> Excitation:
    """Plan a motion of an arm that tells its base parameters.

    Args:
        model: of the arm, with the law of friction to be fitted.
        limits: to keep to; those of the arm when left out.
        period: of the motion, which is its duration [s].
        harmonics: of the series, 3 or more.
        criterion: ``condition`` of the columns as they are, or ``information``: the determinant of the information on
            the parameters, weighted by the noise of the joints.
        noise: (n,) standard deviation of a measured effort [N m] or [N]; a hundredth of the largest when left out.
        rate: of independent readings, for which errors are told [Hz].
        is_free: whether configurations are free of what the arm must not meet; everywhere when left out.
        starts: from how many random motions to begin; the best one is kept.
        seed: of these.

    Raises:
        InvalidValueError: a number is out of its range.
        IncapableArmError: no motion within the limits was found that meets nothing.
    """
    positive(period, "period", "s")
    positive(rate, "rate", "Hz")
    integer(harmonics, "harmonics", least=3)
    integer(starts, "starts", least=1)
    if criterion not in ("condition", "information"):
        raise InvalidValueError(f"criterion: expected condition or information, got {criterion}")
    arm = model.arm
    limits = MotionLimits.of(arm) if limits is None else limits
    if noise is None:
        finite = np.isfinite(arm.limits.effort)
        noise = _NOISE * np.where(finite, arm.limits.effort, 100.0)
    sigma = exact_shape(noise, (arm.n,), "noise")
    objective = _Objective(model, limits, sigma, period, harmonics, criterion)
    rng = np.random.default_rng(seed)
    best: tuple[float, Fourier] | None = None
    for _ in range(starts):
        found = _free(objective.fitted(objective.best(rng)), is_free, period)
        if found is None:
            continue
        value = objective.final(found)
        if best is None or value < best[0]:
            best = value, found
    if best is None:
        raise IncapableArmError(
            f"arm '{arm.name}': no motion within the limits meets nothing: move the arm away from what it would meet, "
            "or allow smaller positions"
        )
    return Excitation(
        model=model,
        motion=best[1],
        limits=limits,
        noise=sigma,
        rate=rate,
        sizes=objective.sizes,
        criterion=criterion,
        evaluations=objective.evaluations,
    )


def _times(period: float, count: int) -> Array:
    return np.arange(count) * period / count


def _free(motion: Fourier, is_free: FreeCheck | None, period: float) -> Fourier | None:
    """Return a motion, made smaller until it meets nothing; None where even the smallest meets something."""
    if is_free is None:
        return motion
    size = 1.0
    while size > _SMALLEST:
        smaller = motion.scaled(size)
        if is_free(smaller(_times(period, _CHECKS))[0]):
            return smaller
        size *= _SMALLER
    return None


class _Objective:
    """What is to be as small as possible, as a function of the coefficients of a series."""

    def __init__(  # noqa: PLR0917 - what it depends on
        self,
        model: DynamicModel,
        limits: MotionLimits,
        sigma: Array,
        period: float,
        harmonics: int,
        criterion: Criterion,
    ) -> None:
        self._model, self._limits, self._criterion, self._sigma = model, limits, criterion, sigma
        self._series = Fourier.zero(model.arm.n, harmonics, period)
        self._basis = self._series.basis(_times(period, _SAMPLES))
        self.evaluations = 0
        self._power = _POWERS[0]
        arm = model.arm
        known = not any(link.unknown for link in arm.links)
        self._efforts = compile_arm(arm) if known and np.isfinite(limits.effort).any() else None
        named = dict(zip(model.names, np.zeros(len(model.names)), strict=True))
        if known:
            from armwright.dynamics.regressors import OF_LINK, dynamic_parameters  # noqa: PLC0415 - of known arms only

            of_links = dynamic_parameters(arm)[: OF_LINK * arm.n]
            named |= dict(zip(model.names[: len(of_links)], of_links.tolist(), strict=True))
        self.sizes = np.abs(model.base.combinations @ list(named.values()))

    def best(self, rng: np.random.Generator) -> Array:
        """Return the coefficients of the best motion from a random one."""
        from scipy.optimize import minimize  # noqa: PLC0415 - takes a tenth of a second to load

        n, k = self._model.arm.n, self._basis[0].shape[1]
        x = rng.normal(size=(k, n)) * 0.3
        x[-1] = 0.0
        x = x.ravel()
        for self._power in _POWERS:
            found = minimize(
                self._value, x, jac=True, method="L-BFGS-B", options={"maxiter": _ITERATIONS, "maxcor": 20}
            )
            x = found.x
        return np.asarray(x.reshape(k, n))

    def fitted(self, x: Array) -> Fourier:
        """Return the series of coefficients, made smaller until it keeps to all limits at a fine grid."""
        motion = self._motion(x)
        q, qd, qdd = motion(_times(motion.period, _CHECKS))
        limits, centre = self._limits, motion.centre
        sizes = [
            ((q - centre).max(axis=0) / np.maximum(limits.upper - centre, 1e-9)).max(),
            ((centre - q).max(axis=0) / np.maximum(centre - limits.lower, 1e-9)).max(),
            (np.abs(qd).max(axis=0) / limits.speed).max(),
            (np.abs(qdd).max(axis=0) / limits.acceleration).max(),
        ]
        motion = motion.scaled(1 / max(1.0, *sizes))
        while self._efforts is not None:
            tau = self._efforts.inverse_dynamics(*motion(_times(motion.period, _CHECKS)))
            if (np.abs(tau).max(axis=0) <= limits.effort).all():
                break
            motion = motion.slowed(_SMALLER)
            if motion.size < _SMALLEST:
                raise IncapableArmError(f"arm '{self._model.arm.name}': its efforts do not suffice for any motion")
        return motion

    def final(self, motion: Fourier) -> float:
        """Return the criterion itself of a motion."""
        Y = self._model.base_columns(*motion(_times(motion.period, _SAMPLES)))
        if self._criterion == "condition":
            return float(np.linalg.cond(Y.reshape(-1, Y.shape[2])))
        Y = (Y / self._sigma[:, None]).reshape(-1, Y.shape[2])
        return -float(np.linalg.slogdet(Y.T @ Y)[1])

    def _motion(self, x: Array) -> Fourier:
        """Return the series of free coefficients; the last row is where it is centred, by the range of each joint."""
        middle, half = (self._limits.lower + self._limits.upper) / 2, (self._limits.upper - self._limits.lower) / 2
        return self._series.with_coefficients(x[:-1] * self._scale, middle + half * x[-1])

    @property
    def _scale(self) -> Array:
        return np.minimum(self._limits.speed, 1.0)

    def _value(self, flat: Array) -> tuple[float, Array]:
        """Return the objective with what exceeding limits costs, and its gradient by the free coefficients."""
        self.evaluations += 1
        x = flat.reshape(-1, self._model.arm.n)
        half = (self._limits.upper - self._limits.lower) / 2
        scale = np.vstack([np.tile(self._scale, (len(x) - 1, 1)), half])
        middle = (self._limits.lower + self._limits.upper) / 2
        states = [basis @ (x * scale) for basis in self._basis]
        states[0] = states[0] + middle
        value, slopes = self._criterion_and_slopes(states)
        for state, slope, low, high in zip(states, slopes, *self._bounds(), strict=True):
            span = (high - low) / 2
            over = np.maximum(state - high, 0) / span + np.minimum(state - low, 0) / span
            value += _PENALTY * float((over**2).mean())
            np.add(slope, 2 * _PENALTY * over / span / over.size, out=slope)
        if self._efforts is not None:
            value += self._effort_cost(states, slopes)
        gradient = sum(basis.T @ slope for basis, slope in zip(self._basis, slopes, strict=True)) * scale
        return value, gradient.ravel()

    def _bounds(self) -> tuple[list[Array], list[Array]]:
        """Return the bounds of positions, velocities and accelerations."""
        limits, middle = self._limits, (self._limits.lower + self._limits.upper) / 2
        keep = [_KEEP * limits.speed, _KEEP * limits.acceleration]
        half = _KEEP * (limits.upper - limits.lower) / 2
        return [middle - half, *(-x for x in keep)], [middle + half, *keep]

    def _effort_cost(self, states: list[Array], slopes: list[Array]) -> float:
        """Return what efforts beyond their limits cost, and add its slopes."""
        if self._efforts is None:
            return 0.0
        limit = np.where(np.isfinite(self._limits.effort), _KEEP * self._limits.effort, 1e9)
        over = self._efforts.inverse_dynamics(*states) / limit
        over = np.sign(over) * np.maximum(np.abs(over) - 1, 0)
        if over.any():
            partials = self._efforts.inverse_dynamics_derivatives(*states)
            for slope, partial in zip(slopes, partials, strict=True):
                np.add(slope, 2 * _PENALTY / over.size * np.einsum("ki,kij->kj", over / limit, partial), out=slope)
        return _PENALTY * float((over**2).mean())

    def _criterion_and_slopes(self, states: list[Array]) -> tuple[float, list[Array]]:
        """Return the smooth criterion and its slopes (k, n) by positions, velocities and accelerations."""
        Y = self._columns(states)
        k, n, b = Y.shape
        weights = np.ones(n) if self._criterion == "condition" else 1 / self._sigma
        A = (Y * weights[:, None]).reshape(-1, b)
        sizes, vectors = np.linalg.eigh(A.T @ A)
        sizes = np.maximum(sizes, 1e-12 * sizes[-1])
        if self._criterion == "information":
            value, factors = -float(np.log(sizes).sum()) / b, -1 / sizes / b
        else:
            p = self._power
            up, down = (sizes / sizes[-1]) ** p, (sizes[0] / sizes) ** p
            value = (np.log(up.sum()) + np.log(down.sum())) / (2 * p) + float(np.log(sizes[-1] / sizes[0])) / 2
            factors = (up / up.sum() - down / down.sum()) / sizes / 2
        slopes_of_columns = 2 * (A @ ((vectors * factors) @ vectors.T)).reshape(k, n, b) * weights[:, None]
        return value, self._slopes(states, slopes_of_columns)

    def _slopes(self, states: list[Array], of_columns: Array) -> list[Array]:
        """Return slopes by the states (k, n), given those by the columns (k, n, b)."""
        k, n = states[0].shape
        moved = []
        for kind in range(3):
            for joint in range(n):
                state = states[kind].copy()
                state[:, joint] += _STEP
                moved.append([state if other == kind else states[other] for other in range(3)])
        stacked = [np.concatenate([states[kind], *(each[kind] for each in moved)]) for kind in range(3)]
        Y = self._columns(stacked).reshape(len(moved) + 1, k, -1)
        values = np.einsum("skj,kj->sk", Y, of_columns.reshape(k, -1), optimize=True)
        differences = (values[1:] - values[0]) / _STEP
        return [differences[kind * n : (kind + 1) * n].T.copy() for kind in range(3)]

    def _columns(self, states: Sequence[Array]) -> Array:
        """Return the base columns (k, n, b), those of dry friction without the jump that no search can climb."""
        Y = self._model.base_columns(*states)
        soft = np.tanh(states[1] / (_SOFT * self._limits.speed))
        for term, shape in (("coulomb", soft), ("forward", (soft + 1) / 2), ("backward", (soft - 1) / 2)):
            for joint in range(self._model.arm.n):
                if (name := f"{term}{joint + 1}") in self._model.base.names:
                    Y[:, joint, self._model.base.names.index(name)] = shape[:, joint]
        return Y
