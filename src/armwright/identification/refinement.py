"""The last digits of bodies that explain measurements: Newton's method from where a semidefinite program has led.

A solver ends where its objective is right to some digits. Measurements are so many that these digits are theirs, and
what only the drawing tells is left rough. Newton's method has no such trouble: the distance from the drawing is smooth,
and grows without bound where a body ceases to be possible.

Source:
    Nesterov & Nemirovskii (1994) for Newton's method with logarithms of determinants; Wright (1997), Primal-Dual
    Interior-Point Methods, for the bounds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arrays import Array

# Parameters of a body.
_TEN = 10
# What is left of the barrier of bounds, by that of bodies, where the method begins and where it ends, and by how much
# it falls from one minimum to the next.
_FIRST_BARRIER, _LAST_BARRIER, _FALL = 1e-2, 1e-10, 0.05
# A minimum is found where another step gains less, or where steps gain no less than before: that is rounding.
_FOUND = 1e-8
# The part of the way to the border of what is possible that a step goes at most.
_INSIDE = 0.9
# How far a start that is not possible is moved towards the drawing.
_TOWARDS = (0.0, *np.geomspace(1e-8, 1.0, 9))
_MAX_STEPS, _HALVINGS = 60, 30
_TINY = float(np.finfo(float).tiny)


class Refinement:
    """Minimise |A x - d|² plus the sum of tr S - log det S over bodies, whose x make S, (4, 4) and 1 at the drawing."""

    def __init__(self, A: Array, d: Array, shapes: Array, bounded: Sequence[int]) -> None:
        """Take the program.

        Args:
            A: (r, p) columns of the parameters, those of bodies first, ten of each.
            d: (r,) what they should make.
            shapes: (m, 10, 4, 4) pseudo-inertias of the m bodies for a unit of each of their parameters.
            bounded: parameters that cannot be negative.
        """
        self._A, self._d, self._shapes, self._bounded = A, d, shapes, np.array(bounded, dtype=np.intp)
        self._twice = 2 * A.T @ A
        self._bodies = slice(0, _TEN * len(shapes))

    def of(self, start: Array) -> Array:
        """Return the best parameters (p,), from some that are near them."""
        x = self._possible(start)
        barrier, last = _FIRST_BARRIER, np.inf
        # What each bound costs.
        cost = barrier / x[self._bounded]
        for _ in range(_MAX_STEPS):
            x, cost, gain = self._step(x, cost, barrier)
            if gain > max(barrier, _FOUND) and gain < last / 2:
                last = gain
            elif barrier > _LAST_BARRIER and len(self._bounded):
                barrier, last = max(_LAST_BARRIER, _FALL * barrier), np.inf
            else:
                break
        return x

    def _possible(self, start: Array) -> Array:
        """Return a start whose bodies are possible and whose bounded parameters are above 0."""
        drawing, one = start.copy(), np.eye(4).ravel()
        for i, shape in enumerate(self._shapes):
            drawing[_TEN * i : _TEN * (i + 1)] = np.linalg.lstsq(shape.reshape(_TEN, 16).T, one, rcond=None)[0]
        for part in _TOWARDS:
            x: Array = (1 - part) * start + part * drawing
            if np.linalg.eigvalsh(self._inertias(x)).min() > _LAST_BARRIER:
                break
        x[self._bounded] = np.maximum(x[self._bounded], _FIRST_BARRIER**2)
        return x

    def _inertias(self, x: Array) -> Array:
        """Return S of all bodies (m, 4, 4)."""
        return np.asarray(np.einsum("ik,ikab->iab", x[self._bodies].reshape(-1, _TEN), self._shapes))

    def _value(self, x: Array, barrier: float) -> float:
        S, bounded = self._inertias(x), x[self._bounded]
        if (np.linalg.eigvalsh(S) <= 0).any() or (bounded <= 0).any():
            return np.inf
        distance = np.einsum("iaa->", S) - np.linalg.slogdet(S)[1].sum() - barrier * np.log(bounded).sum()
        return float(((self._A @ x - self._d) ** 2).sum() + distance)

    def _step(self, x: Array, cost: Array, barrier: float) -> tuple[Array, Array, float]:
        """Return the parameters and costs after a step, and about twice by how much a full step lowers the value."""
        bounded, m = self._bounded, len(self._shapes)
        L = np.linalg.cholesky(self._inertias(x))
        K = np.linalg.inv(L)
        # Changes of S as seen where S is 1.
        seen = (K[:, None] @ self._shapes @ K.transpose(0, 2, 1)[:, None]).reshape(m, _TEN, 16)
        slope = 2 * self._A.T @ (self._A @ x - self._d)
        pull = (L.transpose(0, 2, 1) @ L - np.eye(4)).reshape(m, 16)
        slope[self._bodies] += np.einsum("ikc,ic->ik", seen, pull).ravel()
        slope[bounded] -= barrier / x[bounded]
        H = self._twice.copy()
        for i, own in enumerate(seen):
            rows = slice(_TEN * i, _TEN * (i + 1))
            H[rows, rows] += own @ own.T
        H[bounded, bounded] += cost / x[bounded]
        sizes = 1 / np.sqrt(np.maximum(H.diagonal(), _TINY))
        # A parameter without effect and bound stays where it is.
        scaled = H * np.outer(sizes, sizes) + np.diag(np.where(H.diagonal() > _TINY, 1e-16, 1.0))
        step = -sizes * np.linalg.solve(scaled, sizes * slope)
        gain = -float(slope @ step)
        change = (barrier - cost * step[bounded]) / x[bounded] - cost
        turned = np.einsum("ik,ikc->ic", step[self._bodies].reshape(m, _TEN), seen).reshape(m, 4, 4)
        shrinks = max(-float(np.linalg.eigvalsh(turned).min()), float((-step[bounded] / x[bounded]).max(initial=0.0)))
        part, before = min(1.0, _INSIDE / max(shrinks, _TINY)), self._value(x, barrier)
        for _ in range(_HALVINGS):
            if self._value(x + part * step, barrier) <= before - 1e-4 * part * gain + 1e-13 * abs(before):
                break
            part /= 2
        else:
            return x, cost, 0.0
        cost_part = min(1.0, _INSIDE / max(float((-change / cost).max(initial=0.0)), _TINY))
        return x + part * step, cost + cost_part * change, gain
