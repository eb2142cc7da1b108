"""Where in a plane an arm can bring its tool as it is turned now, and how well it moves there."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.studio.live_arm import LiveArm, UnreachableError

Plane: TypeAlias = Literal["xy", "xz", "yz"]
# Points along either side: of arms with a closed form, whose points are solved a row at once, and of others.
_SIDE, _COARSE_SIDE = 61, 31
# The axes of a plane.
_AXES: dict[Plane, tuple[int, int]] = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
# Of a point that cannot be reached at all, and of one that only a joint beyond its limits reaches.
_OUT_OF_REACH, _BEYOND_LIMITS = 0, 1
# The other values are the dexterity of the best solution, from 2 to this.
_BEST = 255


class ReachMap:
    """A map of a plane through the tool, along two axes of the world; worked out bit by bit.

    Attributes:
        arm: name of the arm.
        plane: its axes.
        done: whether all of it is known.
        known: how many of its points are.
    """

    def __init__(self, arm: LiveArm, plane: Plane) -> None:
        """Take a plane through the tool of an arm, where the arm stands now."""
        self.arm, self.plane, self.done, self.known = arm.name, plane, False, 0
        self._live, self._tool, self._q = arm, arm.tool, arm.q
        self._batched = arm.equations is not None and arm.closed
        self._side = _SIDE if self._batched else _COARSE_SIDE
        reach = arm.reach
        u, v = _AXES[plane]
        centre = arm.placed.base[:3, 3]
        self._offsets = np.linspace(-reach, reach, self._side)
        self._axes, self._corner = (u, v), self._tool[:3, 3].copy()
        self._corner[[u, v]] = centre[[u, v]] - reach
        self._values = np.zeros(self._side**2, dtype=np.uint8)
        self._steps = self._work()

    def step(self) -> None:
        """Work out some more of it."""
        try:
            next(self._steps)
        except StopIteration:
            self.done = True

    def _work(self) -> Iterator[None]:
        u, v = self._axes
        rows, columns = np.divmod(np.arange(self._side**2), self._side)
        poses = np.tile(self._tool, (self._side**2, 1, 1))
        poses[:, :3, 3] = self._corner
        poses[:, u, 3] += self._offsets[columns] - self._offsets[0]
        poses[:, v, 3] += self._offsets[rows] - self._offsets[0]
        batch = self._side if self._batched else 1
        for first in range(0, len(poses), batch):
            part = slice(first, first + batch)
            self._values[part] = self._judged(poses[part])
            self.known = first + batch
            yield

    def _judged(self, X_WT: Array) -> Array:
        """Return the values of poses (k, 4, 4)."""
        live = self._live
        if live.equations is None or not live.closed:
            return np.array([self._by_steps(X) for X in X_WT])
        q, met = live.every_branch(X_WT, np.broadcast_to(self._q, (len(X_WT), len(self._q))))
        allowed = met & live.is_allowed(q)
        sigma = np.linalg.svd(live.scaled_jacobian(live.equations.jacobian(q, threads=1)), compute_uv=False)
        dexterity = np.where(allowed, sigma[..., -1] / sigma[..., 0], 0.0).max(axis=1)
        values = _level(dexterity)
        return np.where(allowed.any(axis=1), values, np.where(met.any(axis=1), _BEYOND_LIMITS, _OUT_OF_REACH))

    def _by_steps(self, X_WT: Array) -> int:
        """Return the value of a pose (4, 4) for an arm without a closed form: what is found from where it stands."""
        try:
            q = self._live.stepped_to(X_WT, self._q)
        except UnreachableError:
            return _OUT_OF_REACH
        sigma = np.linalg.svd(self._live.scaled_jacobian(self._live.jacobian_at(q)), compute_uv=False)
        return int(_level(np.array(sigma[-1] / sigma[0])))

    def state(self) -> dict[str, Any]:
        """Return what a page draws, as plain data: 0 out of reach, 1 beyond a limit, 2 to 255 how well it moves."""
        u, v = (np.eye(3)[axis] for axis in self._axes)
        size = float(self._offsets[-1] - self._offsets[0])
        return {
            "arm": self.arm,
            "plane": self.plane,
            "done": self.done,
            "side": self._side,
            "corner": self._corner.tolist(),
            "u": (u * size).tolist(),
            "v": (v * size).tolist(),
            "values": base64.b64encode(self._values.tobytes()).decode(),
        }


def _level(dexterity: Array) -> Array:
    """Return values from 2 on for ratios of the smallest singular value to the largest, which are rarely above 0.5."""
    return np.round(2 + (_BEST - 2) * np.sqrt(np.clip(dexterity / 0.5, 0.0, 1.0)))
