"""Tolerances of least cost that keep an error within its limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.optimize import brentq, minimize

from armwright.arrays import Array, positive
from armwright.errors import InvalidValueError
from armwright.reliability.farthest_point import farthest_point
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tolerances import Tolerance
from armwright.reliability.worst_case import longest_sum

Rule: TypeAlias = Literal["worst-case", "statistical"]

# Tolerances change by at most this factor to either side.
_RANGE = 1e6
# A dimension that moves the tool by less than this part of what the first one does, moves it by rounding only.
_IDLE = 1e-12
# The mean error leaves at least this part of the limit to tolerances.
_ROOM = 1e-6
# The cost is above the least by at most this part, or as found within so many rounds.
_GAP, _ROUNDS = 1e-8, 100
_PRECISION, _STEPS = 1e-14, 1000


class Allocation(NamedTuple):
    """Tolerances of least cost.

    Attributes:
        half_widths: (k,) [m, rad, kg, N]; for a dimension that moves the tool at no pose the most that it may be.
        costs: (k,) of each.
        scaled_cost: of the given tolerances, all multiplied by one factor so that the error just keeps its limit.
        least_cost: no tolerances within the limit cost less.
        bounds: (p,) of the error at each pose with the new tolerances [m].
    """

    half_widths: Array
    costs: Array
    scaled_cost: float
    least_cost: float
    bounds: Array


def error_bounds(error: LinearError, half_widths: Array, rule: Rule, *, exact: bool = True) -> tuple[Array, Array]:
    """Return how long the error at each pose gets within tolerances, and the direction in which it does.

    Args:
        error: linear in the deviations.
        half_widths: (k,) tolerances.
        rule: ``worst-case`` for the longest error of all; ``statistical`` for the longest within the ellipsoid of three
            standard deviations about the mean.
        exact: see ``longest_sum``.

    Returns:
        (p,) bounds and (p, d) unit vectors.
    """
    scaled = error.jacobian * half_widths
    if rule == "statistical":
        # A tolerance is three standard deviations, and so is the ellipsoid.
        covariances = scaled @ np.swapaxes(scaled, -1, -2)
        sums = np.array([farthest_point(*each) for each in zip(error.offset, covariances, strict=True)])
    else:
        found = [
            longest_sum(each, mean if mean.any() else None, exact=exact)[1]
            for mean, each in zip(error.offset, scaled, strict=True)
        ]
        sums = error.offset + np.einsum("pdk,pk->pd", scaled, np.array(found))
    lengths = np.linalg.norm(sums, axis=-1)
    return lengths, sums / np.maximum(lengths, np.finfo(float).tiny)[:, None]


def allocate(tolerances: Sequence[Tolerance], error: LinearError, limit: float, rule: Rule) -> Allocation:
    """Return the tolerances of least cost with which the error at every pose is within a limit.

    Along each direction u the bound is the mean error and a sum of positive terms of the tolerances, so that the
    problem is a geometric program, convex in the logarithms of the tolerances. Directions are added where the error is
    longest, until it is within its limit in all.

    Args:
        tolerances: k of them, with their costs.
        error: linear in deviations within them.
        limit: of the error at every pose [m].
        rule: see ``error_bounds``.

    Raises:
        InvalidValueError: the mean error is beyond the limit at a pose, or no deviation moves the tool.

    Source:
        Boyd et al. (2007), A tutorial on geometric programming; Kelley (1960) for the planes.
    """
    limit = positive(limit, "limit")
    means = np.linalg.norm(error.offset, axis=-1)
    if means.max() > limit * (1 - _ROOM):
        raise InvalidValueError(
            f"limit: expected more than the mean error, {means.max() * 1e3:.4g} mm, which no tolerance makes smaller, "
            f"got {limit * 1e3:g} mm"
        )
    given, cost, exponent, most = (
        np.array([getattr(each, name) for each in tolerances]) for name in ("half_width", "cost", "exponent", "most")
    )
    moves = np.abs(error.jacobian * given).max(axis=(0, 1))
    moving = moves > _IDLE * moves.max()
    if not moving.any():
        raise InvalidValueError("error: no deviation moves the tool, so that no tolerance has a bound")
    start = _scaled(error, np.where(moving, given, 0.0), most, limit, rule)
    start = np.where(moving, start, np.minimum(given, most))
    highest = np.log(np.minimum(most / start, _RANGE))
    start_costs = np.where(moving, cost * (given / start) ** exponent, 0.0)
    power = 2 if rule == "statistical" else 1
    planes, logs = np.zeros((0, len(given))), np.zeros(len(given))
    best, least, exact = start, 0.0, False
    for _ in range(_ROUNDS):
        present = np.where(moving, start * np.exp(logs), 0.0)
        bounds, directions = error_bounds(error, present, rule, exact=exact)
        if not exact and len(planes) and bounds.max() <= limit * (1 + _GAP):
            exact = True
            bounds, directions = error_bounds(error, present, rule)
        # What the planes allow costs less than any tolerances within the limit. Shortened by the excess, it is within.
        least = float((start_costs * np.exp(-exponent * logs)).sum()) if len(planes) else 0.0
        if exact or rule == "statistical":
            # The bound is convex, so that it is within its limit as far along as the limit allows in proportion.
            spare = (limit - means) / np.maximum(bounds - means, np.finfo(float).tiny)
            within = start * np.exp(logs) * min(spare.min(), 1.0)
            best = min(best, within, key=lambda x: float((start_costs * (start / x) ** exponent).sum()))
            if (start_costs * (start / best) ** exponent).sum() <= least * (1 + _GAP):
                break
        over = np.flatnonzero(bounds >= min(limit, bounds.max()) * (1 - 1e-12))
        left = limit - (directions[over] * error.offset[over]).sum(axis=-1, keepdims=True)
        new = np.abs(np.einsum("pd,pdk->pk", directions[over], error.jacobian[over]) * start / left) ** power
        planes = np.concatenate([planes, new])
        logs = _cheapest(start_costs, exponent, planes, power, logs, highest)
    return Allocation(
        np.where(moving, best, most),
        start_costs * (start / best) ** exponent,
        float(start_costs.sum()),
        least,
        error_bounds(error, np.where(moving, best, 0.0), rule)[0],
    )


def _scaled(error: LinearError, given: Array, most: Array, limit: float, rule: Rule) -> Array:
    """Return the tolerances, all multiplied by one factor, none beyond the most it may be, that just keep a limit."""

    def widths(log: float) -> Array:
        return np.asarray(np.minimum(given * np.exp(log), most), dtype=np.float64)

    def excess(log: float) -> float:
        return float(error_bounds(error, widths(log), rule)[0].max()) / limit - 1

    if not error.offset.any() and np.isinf(most).all():
        return np.asarray(given / (1 + excess(0.0)), dtype=np.float64)
    low, high = -np.log(_RANGE), np.log(_RANGE)
    if excess(high) <= 0:
        return widths(high)
    return widths(brentq(excess, low, high, xtol=1e-15, rtol=1e-15)) if excess(low) < 0 else widths(low)


def _cheapest(  # noqa: PLR0917 - the numbers of one program
    cost: Array, exponent: Array, planes: Array, power: int, logs: Array, highest: Array
) -> Array:
    """Return the logarithms x that minimise the sum of cost exp(-exponent x) with planes exp(power x) <= 1 each.

    None of them is above the highest.
    """

    def objective(x: Array) -> tuple[float, Array]:
        terms = cost * np.exp(-exponent * x)
        return float(np.log(terms.sum())), -exponent * terms / terms.sum()

    def slack(x: Array) -> Array:
        return -np.log(planes @ np.exp(power * x))

    def slack_slopes(x: Array) -> Array:
        terms = planes * np.exp(power * x)
        return np.asarray(-power * terms / terms.sum(axis=1, keepdims=True))

    # From within: the last solution, shortened until it is within the new planes too.
    shortest = float(slack(logs).min()) / power
    found = minimize(
        objective,
        logs + min(shortest, 0.0),
        jac=True,
        method="SLSQP",
        bounds=[(-np.log(_RANGE), top) for top in highest],
        constraints=[{"type": "ineq", "fun": slack, "jac": slack_slopes}],
        options={"ftol": _PRECISION, "maxiter": _STEPS},
    )
    return np.asarray(found.x)
