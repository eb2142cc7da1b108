"""Least squares over the corners in all pictures and the corrections of the arm, for poses of camera and board.

The unknowns of a picture, which are the corrections of its joint positions, are eliminated picture by picture, so that
the systems stay as small as the number of the other unknowns.

Source:
    Triggs et al. (2000), Bundle adjustment: a modern synthesis, for the reduced system.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.calibration.arm_readings import ArmReadings
from armwright.calibration.board import BoardViews
from armwright.calibration.reprojection import moved, moved_points, transformed
from armwright.errors import ContradictionError
from armwright.spatial.lens import Lens
from armwright.spatial.poses import inverse

# Steps of the fit, how often one is halved, and the step in standard errors at which it ends.
_STEPS, _HALVINGS, _SETTLED = 50, 20, 1e-5
# Points of the board are not nearer to the camera [m].
_NEAREST = 1e-3
_TOO_NEAR = "the poses that were found put the board behind the camera: are these the joint positions of the pictures?"


@attrs.frozen(kw_only=True, eq=False)
class HandEyeState:
    """The unknowns of a hand-eye calibration.

    Attributes:
        camera: (4, 4) pose of the camera on the tool, or in the base frame.
        board: (4, 4) pose of the board in the base frame, or on the tool.
        lens: of the camera.
        corrections: (m, k) of the arm in each picture, in standard deviations.
    """

    camera: Array
    board: Array
    lens: Lens
    corrections: Array


class HandEyeFit(NamedTuple):
    """The unknowns that fit best.

    Attributes:
        state: these.
        covariance: (p, p) of a twist of the camera, one of the board, and of the numbers of the lens that are fitted.
        residuals: (c, 2) of the corners, seen minus expected [px].
    """

    state: HandEyeState
    covariance: Array
    residuals: Array


@attrs.frozen(kw_only=True, eq=False)
class HandEyeProblem:
    """Pictures of a board, the arm's readings, and what is known about them.

    Attributes:
        views: m pictures.
        readings: m of the arm.
        eye_in_hand: whether the camera is on the tool and the board beside the arm; otherwise vice versa.
        sigma: standard deviation of a coordinate of a corner [px].
        lens_numbers: numbers of the lens that are fitted: of focal x, y, centre x, y, k1, k2, p1, p2, k3.
    """

    views: BoardViews
    readings: ArmReadings
    eye_in_hand: bool
    sigma: float
    lens_numbers: tuple[int, ...]

    def take(self, numbers: Sequence[int]) -> HandEyeProblem:
        """Return the problem of some of the pictures, by their numbers from 0."""
        return attrs.evolve(self, views=self.views.take(numbers), readings=self.readings.take(numbers))

    def boards(self, state: HandEyeState) -> Array:
        """Return (m, 4, 4) the expected poses of the board in the frame of the camera."""
        return np.asarray(inverse(state.camera) @ self._carried(self.readings.hand(state.corrections)[0]) @ state.board)

    def residuals(self, state: HandEyeState) -> Array | None:
        """Return (c, 2) seen minus expected pixels; None where a corner would be behind the camera [px]."""
        seen = transformed(self.boards(state)[self.views.picture], self.views.points)
        if seen[:, 2].min() < _NEAREST:
            return None
        return self.views.pixels - state.lens.project(seen)

    def fit(self, state: HandEyeState) -> HandEyeFit:
        """Return the unknowns that fit best, by Gauss and Newton's steps from a guess.

        Raises:
            ContradictionError: the guess, or every way on from it, puts the board behind the camera.
        """
        residuals = self.residuals(state)
        if residuals is None:
            raise ContradictionError(_TOO_NEAR)
        cost = self._cost(state, residuals)
        for _ in range(_STEPS):
            step, corrections, information = self._step(state)
            covariance = _inverse(information)
            for halving in range(_HALVINGS):
                part = 0.5**halving
                tried = self._moved(state, part * step, part * corrections)
                new = self.residuals(tried)
                if new is not None and (lower := self._cost(tried, new)) <= cost:
                    state, residuals, cost = tried, new, lower
                    break
            else:
                # No shorter step helps: this is the minimum, to rounding.
                return HandEyeFit(state, covariance, residuals)
            if halving == 0 and np.all(np.abs(step) <= _SETTLED * np.sqrt(np.diag(covariance))):
                return HandEyeFit(state, covariance, residuals)
        return HandEyeFit(state, _inverse(self._step(state)[2]), residuals)

    # ---- inside ----------------------------------------------------------------------------------------------------

    def _carried(self, hand: Array) -> Array:
        """Return the poses that stand between camera and board."""
        return np.asarray(inverse(hand)) if self.eye_in_hand else hand

    def _cost(self, state: HandEyeState, residuals: Array) -> float:
        return float(np.sum((residuals / self.sigma) ** 2) + np.sum(state.corrections**2))

    def _moved(self, state: HandEyeState, step: Array, corrections: Array) -> HandEyeState:
        numbers = state.lens.numbers
        numbers[list(self.lens_numbers)] += step[12:]
        return HandEyeState(
            camera=moved(state.camera, step[:6]),
            board=moved(state.board, step[6:12]),
            lens=state.lens.with_numbers(numbers),
            corrections=state.corrections + corrections,
        )

    def _step(self, state: HandEyeState) -> tuple[Array, Array, Array]:
        """Return the step of the unknowns (p,), that of the corrections (m, k), and the information (p, p)."""
        residuals, J, D = self._linearised(state)
        sizes = self.views.sizes
        ends = np.cumsum(sizes)
        information, right = np.zeros((J.shape[-1],) * 2), np.zeros(J.shape[-1])
        eliminated = []
        for end, size, correction in zip(ends, sizes, state.corrections, strict=True):
            rows = slice(end - size, end)
            G, K, r = J[rows].reshape(2 * size, -1), D[rows].reshape(2 * size, -1), residuals[rows].ravel()
            own, shared, own_right = K.T @ K + np.eye(K.shape[1]), G.T @ K, K.T @ r - correction
            solved = np.linalg.solve(own, np.column_stack([own_right, shared.T]))
            information += G.T @ G - shared @ solved[:, 1:]
            right += G.T @ r - shared @ solved[:, 0]
            eliminated.append(solved)
        scale = 1 / np.sqrt(np.diag(information))
        step = scale * np.linalg.lstsq(information * scale * scale[:, None], right * scale)[0]
        return step, np.array([solved[:, 0] - solved[:, 1:] @ step for solved in eliminated]), information

    def _linearised(self, state: HandEyeState) -> tuple[Array, Array, Array]:
        """Return residuals (c, 2), and their derivatives by unknowns (c, 2, p) and corrections (c, 2, k), in sigmas."""
        hand, twists = self.readings.hand(state.corrections)
        carried, picture = self._carried(hand), self.views.picture
        R_camera = state.camera[:3, :3].T
        on_board = self.views.points
        before = transformed(state.board, on_board)
        behind = transformed(carried[picture], before)
        seen = transformed(inverse(state.camera), behind)
        by_point, by_lens = state.lens.derivatives(seen)
        carried_R = R_camera @ carried[picture, :3, :3]
        camera = -moved_points(seen)
        board = carried_R @ state.board[:3, :3] @ moved_points(on_board)
        arm = -R_camera @ moved_points(behind) if self.eye_in_hand else carried_R @ moved_points(before)
        J = np.concatenate([by_point @ camera, by_point @ board, by_lens[..., list(self.lens_numbers)]], axis=-1)
        D = by_point @ arm @ twists[picture]
        residuals = self.views.pixels - state.lens.project(seen)
        return residuals / self.sigma, J / self.sigma, D / self.sigma


def _inverse(information: Array) -> Array:
    """Return the inverse of a matrix whose rows have different units."""
    scale = 1 / np.sqrt(np.diag(information))
    return np.asarray(np.linalg.pinv(information * scale * scale[:, None], hermitian=True) * scale * scale[:, None])
