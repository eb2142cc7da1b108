"""An arm that is moved by hand: where it is, where it can go, and what is wrong with that."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.reach import stretched_length
from armwright.arrays import Array, Flags
from armwright.cell.model import CellArm
from armwright.compiled.arm import CompiledArm, planning_arm
from armwright.errors import ArmwrightError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.branches import ClosedForm
from armwright.kinematics.inverse_kinematics.builds import BRANCHES, OfBuild
from armwright.kinematics.inverse_kinematics.closed_forms import find_closed_form
from armwright.kinematics.inverse_kinematics.revolutions import joint_distances
from armwright.kinematics.inverse_kinematics.solution import violations_of
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.manipulability_index import scaled_rows
from armwright.kinematics.singularity_analysis import determinant_factors, singularities
from armwright.spatial.poses import homogeneous, inverse_pose
from armwright.spatial.rotations import rotation_from_vector, rotation_vector

# A solution is one if its tool is as near to the pose [m], [rad].
_MET = 1e-6
# Joints do not leap while a tool is dragged: a step changes none by more [rad], [m].
_LEAP_ANGLE, _LEAP_LENGTH = math.radians(30.0), 0.1
# Nearer to a limit than this a joint is called near it [rad], [m].
_NEAR_ANGLE, _NEAR_LENGTH = math.radians(5.0), 0.01
# Below this part of the largest, a singular value of the Jacobian is called small.
_SMALL = 0.03
# Below this part the arm is said to be at a singularity.
_AT_SINGULARITY = 1e-3
# Joints that have at least this part in a motion that does not move the tool are named.
_PART_OF_IDLE = 0.1
# Steps of the numeric solution, and the damping in them [m], and at least.
_STEPS, _DAMPING, _LEAST_DAMPING = 40, 0.02, 1e-12
# Numbers that describe a pose.
_POSE = 6
# A tool that is dragged far at once is led there in at most so many steps.
_MOST_STRIDES = 16
# A stride is no shorter than this [m], [rad]: what leaps in one leaps.
_STRIDE, _TURN = 0.03, math.radians(10.0)
# A joint that is beyond its limit by no more than this is on it [rad], [m].
_SAME = 1e-9

Level: TypeAlias = Literal["warning", "error"]


class UnreachableError(ArmwrightError, ValueError):
    """The tool cannot be brought to a pose from where the arm is; the arm stays."""


class Solution(NamedTuple):
    """A configuration that brings the tool to where it is.

    Attributes:
        q: (n,) joint positions.
        label: such as ``left, up, no-flip``.
        fault: why it cannot be taken; empty where it can.
        here: whether the arm is in it.
    """

    q: Array
    label: str
    fault: str
    here: bool


class Remark(NamedTuple):
    """What is to be said of a configuration.

    Attributes:
        kind: ``limit`` or ``singular``.
        level: how bad it is.
        text: in words.
        joints: numbers of the joints concerned, from 1.
    """

    kind: Literal["limit", "singular"]
    level: Level
    text: str
    joints: tuple[int, ...] = ()


class LiveArm:
    """An arm of a cell, at a configuration that is changed by hand.

    Attributes:
        name: of the arm in the cell.
        placed: the arm, with its base.
        q: (n,) joint positions.
    """

    def __init__(self, name: str, placed: CellArm) -> None:
        """Take an arm, at the start of its cell."""
        self.name, self.placed = name, placed
        self.q = np.array(placed.start)
        limits = placed.arm.limits
        # An arm with fewer joints than a pose has numbers is led by the position of its tool alone.
        self._rows = slice(0, 6 if placed.arm.n >= _POSE else 3)
        self.lower, self.upper = limits.lower, limits.upper
        revolute = placed.arm.revolute
        self._leap = np.where(revolute, _LEAP_ANGLE, _LEAP_LENGTH)
        self._near = np.where(revolute, _NEAR_ANGLE, _NEAR_LENGTH)
        self._form = find_closed_form(placed.arm)
        self._X_BW = inverse_pose(placed.base)
        # The configurations that bring the tool to where it was asked for last.
        self._latest = np.empty((0, placed.arm.n))

    @cached_property
    def equations(self) -> CompiledArm | None:
        """The compiled arm; None where nothing can be compiled."""
        compiled = planning_arm(self.placed.arm)
        return compiled if isinstance(compiled, CompiledArm) else None

    @property
    def closed(self) -> bool:
        """Whether a closed form finds all configurations of a pose: of six joints, neither more nor fewer."""
        return self._form is not None and self.placed.arm.n == _POSE

    @cached_property
    def reach(self) -> float:
        """How far from its base the tool could be if the arm were straight [m]."""
        return stretched_length(self.placed.arm)

    def warm_up(self) -> None:
        """Compile what moving the arm needs."""
        self.tool_at(self.q)
        self.jacobian_at(self.q)
        if self._form is not None:
            self.solutions()

    # ---- where it is ---------------------------------------------------------------------------------------------

    def tool_at(self, q: Array) -> Array:
        """Return the pose (4, 4) of the tool in the world at joint positions (n,)."""
        X_BT = forward(self.placed.arm, q) if self.equations is None else self.equations.forward(q)
        return np.asarray(self.placed.base @ X_BT)

    @property
    def tool(self) -> Array:
        """The pose (4, 4) of the tool in the world."""
        return self.tool_at(self.q)

    def solutions(self) -> list[Solution]:
        """Return all configurations that bring the tool to where it is; of an arm without a closed form the present."""
        if self._form is None or self.equations is None:
            return [Solution(self.q, "numeric", "", here=True)]
        # Where a tool has been dragged, the arm is in one of the configurations that were found for that.
        rows = self._latest if (self._latest == self.q).all(axis=1).any() else self._branches(self.tool)
        here = int(joint_distances(self.placed.arm, self.q, rows).argmin()) if len(rows) else -1
        labels, allowed = _labels(self.placed.arm, self._form, rows), self.is_allowed(rows).tolist()
        return [
            Solution(q, labels[i], "" if allowed[i] else self._limits_text(q), here=i == here)
            for i, q in enumerate(rows)
        ]

    def _limits_text(self, q: Array) -> str:
        """Return what is wrong with a configuration (n,) beyond the limits."""
        return "; ".join(map(str, violations_of(self.placed.arm, q.tolist())))

    def _branches(self, X_WT: Array) -> Array:
        """Return the configurations (k, n) that bring the tool to a pose."""
        q, met = self.every_branch(X_WT, self.q)
        q = q[met]
        # A branch that a pose does not have repeats another.
        same = np.abs(q[:, None] - q).max(axis=2, initial=0.0) < _MET
        self._latest = np.asarray(q[~np.tril(same, -1).any(axis=1)])
        return self._latest

    def every_branch(self, X_WT: Array, near: Array) -> tuple[Array, Flags]:
        """Return the configurations of all branches for poses, and which of them bring the tool there.

        Args:
            X_WT: (..., 4, 4) poses of the tool in the world.
            near: (..., n) configurations, for what a singular pose leaves open.

        Returns:
            (..., k, n) and (..., k).
        """
        assert self.equations is not None  # noqa: S101 - asked for only where there is a closed form
        X_BT = self._X_BW @ X_WT
        q, _ = self.equations.inverse_branches(X_BT, near, threads=1)
        missed = np.abs(self.equations.forward(q, threads=1) - X_BT[..., None, :, :])
        return self._turned(q), np.asarray(missed.max(axis=(-2, -1)) < _MET)

    def _turned(self, q: Array) -> Array:
        """Return configurations (..., n) with every angle turned by a revolution into its limits, where possible."""
        # An angle on its limit stays there, whatever rounding says.
        below, above = q < self.lower - _SAME, q > self.upper + _SAME
        turn = 2 * math.pi * (below.astype(float) - above)
        better = (below | above) & (q + turn >= self.lower) & (q + turn <= self.upper) & self.placed.arm.revolute
        return np.where(better, q + turn, q)

    def is_allowed(self, q: Array) -> Flags:
        """Return which configurations (..., n) are within the limits."""
        return np.asarray(((q >= self.lower - _SAME) & (q <= self.upper + _SAME)).all(axis=-1))

    # ---- moving --------------------------------------------------------------------------------------------------

    def set_joints(self, q: Array) -> None:
        """Bring the joints to positions (n,), as far as their limits allow."""
        self.q = np.clip(q, self.lower, self.upper)

    def move_tool(self, X_WT: Array, *, leaping: bool = False) -> None:
        """Bring the tool to a pose (4, 4) in the world.

        Args:
            X_WT: the pose.
            leaping: whether joints may turn far for it, as for a goal that is typed; dragging goes on steadily.

        Raises:
            UnreachableError: no configuration within the limits does that, or only one far from the present.
        """
        q = self.configuration_for(X_WT)
        if not leaping and (np.abs(q - self.q) > self._leap).any():
            q = self._led_to(X_WT)
        self.q = q

    def _led_to(self, X_WT: Array) -> Array:
        """Return the configuration (n,) to which the tool is led on the straight line to a pose (4, 4), in strides.

        Raises:
            UnreachableError: a joint would leap on the line, or it leaves what can be reached.
        """
        start, before = self.tool, self.q
        turn = rotation_vector(X_WT[:3, :3] @ start[:3, :3].T)
        try:
            far_away = max(np.linalg.norm(X_WT[:3, 3] - start[:3, 3]) / _STRIDE, np.linalg.norm(turn) / _TURN)
            strides = min(max(1, math.ceil(far_away)), _MOST_STRIDES)
            for share in np.linspace(0.0, 1.0, strides + 1)[1:]:
                R = rotation_from_vector(share * turn) @ start[:3, :3]
                X = homogeneous(R, start[:3, 3] + share * (X_WT[:3, 3] - start[:3, 3]))
                q = self.configuration_for(X_WT if share == 1.0 else X)
                far = np.abs(q - self.q) > self._leap
                if far.any():
                    joints = ", ".join(str(i + 1) for i in np.flatnonzero(far))
                    raise UnreachableError(
                        f"{self.name} would have to change its branch there: joint {joints} would leap; "
                        "choose a solution"
                    )
                self.q = q
            return self.q
        finally:
            self.q = before

    def configuration_for(self, X_WT: Array) -> Array:
        """Return the configuration (n,) nearest to the present one that brings the tool to a pose (4, 4) in the world.

        Raises:
            UnreachableError: none within the limits does.
        """
        if self._form is None or self.equations is None:
            return self.stepped_to(X_WT, self.q)
        rows = self._branches(X_WT)
        allowed = self.is_allowed(rows)
        # Fewer joints are led by the position alone, and of more the one that the closed form leaves moves too.
        if not self.closed and not allowed.any():
            return self.stepped_to(X_WT, self.q)
        if not len(rows):
            raise UnreachableError(f"out of reach of {self.name}")
        distances = joint_distances(self.placed.arm, self.q, rows)
        if not allowed.any():
            nearest = rows[distances.argmin()]
            raise UnreachableError(self._limits_text(nearest))
        return np.asarray(np.clip(rows[np.where(allowed, distances, np.inf).argmin()], self.lower, self.upper))

    def stepped_to(self, X_WT: Array, q: Array) -> Array:
        """Return the configuration (n,) to which damped steps lead from one (n,), with the tool at a pose (4, 4).

        Raises:
            UnreachableError: they lead nowhere.
        """
        X_BT = self._X_BW @ X_WT
        for _ in range(_STEPS):
            X = self._X_BW @ self.tool_at(q)
            error = np.concatenate([X_BT[:3, 3] - X[:3, 3], rotation_vector(X_BT[:3, :3] @ X[:3, :3].T)])
            error = error[self._rows]
            if np.abs(error).max() < _MET / 10:
                return q
            J = self.jacobian_at(q)[self._rows]
            damping = _DAMPING**2 * min(1.0, float(error @ error)) + _LEAST_DAMPING
            step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(error)), error)
            q = np.clip(q + step, self.lower, self.upper)
        raise UnreachableError(f"{self.name} finds no configuration there: out of reach, or beyond a limit")

    def jacobian_at(self, q: Array) -> Array:
        """Return the Jacobian (6, n) at joint positions (n,), axes of the base."""
        return np.asarray(jacobian(self.placed.arm, q) if self.equations is None else self.equations.jacobian(q))

    def scaled_jacobian(self, J: Array) -> Array:
        """Return Jacobians (..., 6, n) with rows of one unit: an arm of another size has the same singular values."""
        return scaled_rows(J, self.reach)

    # ---- what is wrong -------------------------------------------------------------------------------------------

    def remarks(self) -> list[Remark]:
        """Return what is to be said of the present configuration: joints near their limits, singular directions."""
        near = (self.q - self.lower < self._near) | (self.upper - self.q < self._near)
        found = [Remark("limit", "warning", self._limit_text(i), (i + 1,)) for i in np.flatnonzero(near).tolist()]
        if self.placed.arm.n < _POSE:
            return found
        J = self.scaled_jacobian(self.jacobian_at(self.q))
        sigma = np.linalg.svd(J, compute_uv=False)
        if sigma[-1] < _SMALL * sigma[0]:
            U, _, Vt = np.linalg.svd(J)
            found.append(self._singular(float(sigma[-1] / sigma[0]), U[:, len(sigma) - 1], Vt[len(sigma) - 1]))
        return found

    def _limit_text(self, i: int) -> str:
        joint, q = self.placed.arm.joints[i], self.q[i]
        left = min(q - self.lower[i], self.upper[i] - q)
        amount = f"{math.degrees(left):.1f}°" if joint.revolute else f"{left * 1e3:.1f} mm"
        return f"joint {i + 1} is {amount} from its limit" if left > 0 else f"joint {i + 1} is at its limit"

    def _singular(self, ratio: float, lost: Array, idle: Array) -> Remark:
        """Return what is said near a singularity.

        Args:
            ratio: of the smallest singular value to the largest.
            lost: (6,) the twist that is hardly made.
            idle: (n,) the joint motion that hardly moves the tool.
        """
        factors = singularities(self.placed.arm, self.q).factors
        nearest = min(factors, key=lambda factor: abs(factor.value) / factor.scale)
        cause = "" if nearest.name.startswith("singular value") else f" of the {nearest.name}"
        near = "at" if ratio < _AT_SINGULARITY else "near"
        joints = tuple(i + 1 for i in np.flatnonzero(np.abs(idle) > _PART_OF_IDLE).tolist())
        text = f"{near} a singularity{cause}: the tool {_direction_text(lost)}"
        return Remark("singular", "error" if near == "at" else "warning", text, joints)


def _labels(arm: Arm, form: ClosedForm, q: Array) -> list[str]:
    """Return the names of the branches that configurations (k, n) are in.

    Branches of a build meet where a factor of the determinant of the Jacobian vanishes: they differ in its signs.
    """
    if not isinstance(form, OfBuild):
        return form.labels(arm, q)
    geometry = form.geometry
    angles = geometry.angles(list(q.T))
    side, second, flip = (np.where(factor >= 0, 1, -1).tolist() for factor in determinant_factors(geometry, angles))
    # The factor of an elbow falls where its angle grows.
    sign = 1 if geometry.family == "stanford" else -1
    numbers = [BRANCHES.index((side[i], sign * second[i], flip[i])) for i in range(len(q))]
    return [form.label(number, row) for number, row in zip(numbers, q, strict=True)]


def _direction_text(twist: Array) -> str:
    """Return what a tool cannot do along a twist (6,), axes of the base."""
    linear, angular = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
    what, axis = ("hardly moves along", twist[:3]) if linear >= angular else ("hardly turns about", twist[3:])
    axis = axis / np.linalg.norm(axis)
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    return "{} ({:.2f}, {:.2f}, {:.2f}) of its base".format(what, *(axis + 0.0))
