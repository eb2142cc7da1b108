"""Redundancy resolution within the joint limits: which swivels an arm of seven joints may have, and which is taken."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal, TypeAlias, get_args

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions, single_configuration
from armwright.arrays import Array, ArrayLike, Flags
from armwright.errors import InvalidValueError, UnsupportedArmError, shown
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.kinematics.inverse_kinematics.candidates import POSE_TOLERANCE, Candidate, exact_pose, pose_errors
from armwright.kinematics.inverse_kinematics.closed_forms import find_closed_form
from armwright.kinematics.inverse_kinematics.redundant import Locked, Redundant, Swivelling
from armwright.kinematics.inverse_kinematics.revolutions import joint_distances, mid_range, nearest_equivalent
from armwright.kinematics.inverse_kinematics.self_motion import INSIDE, excess
from armwright.kinematics.inverse_kinematics.subproblems import rotated
from armwright.tracing.vectors import product, transpose

Choice: TypeAlias = Literal["nearest", "middle", "farthest"]

_TURN = 2 * math.pi
# Without equations for its ends an interval is found by looking at so many values of the parameter, and its ends by
# so many halvings. Between two values the least of what is outside is sought, each time so many times closer.
_LOOKED_AT, _HALVINGS = 721, 48
_CLOSER, _FINER = 3, 16
# Values of an interval looked at for the one farthest from all limits, and how often closer.
_SPREAD, _REFINED = 33, 8
# A slide without limits is tried so far either way [m].
_ENDLESS = 10.0
# A branch whose tool misses the pose by more than this does not exist [m], [rad].
_MET = 1e-8


@attrs.frozen(kw_only=True)
class SwivelInterval:
    """Swivels at which one branch of a pose is inside the joint limits.

    Attributes:
        label: the name of the branch.
        lower: the least one [rad] or [m].
        upper: the largest one; past 180 deg where the interval goes on there.
    """

    label: str
    lower: float
    upper: float


def swivel_of(arm: Arm, q: ArrayLike) -> Array:
    """Return the swivel of configurations of an arm of seven joints.

    With a spherical shoulder and a spherical wrist it is the angle of the elbow about the line from shoulder to wrist:
    0 where the elbow is in the plane of that line and the axis of joint 1, on the side to which the axis points,
    positive about the line towards the wrist. Of other arms it is the position of the joint that is held while the
    others are solved: of a Panda joint 7, of an arm on a rail the rail.

    Args:
        arm: an arm of seven joints with a closed form: see ``find_closed_form``.
        q: (..., 7) joint positions [rad] or [m].

    Returns:
        (...) swivels [rad] or [m].

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        UnsupportedArmError: the arm has no swivel.
        ShapeError: the last axis of ``q`` is not 7 long.
        InvalidValueError: a number is NaN or infinite.
    """
    form = _redundant_form(arm)
    q = positions(arm, q)
    return np.asarray(form.parameter_of(per_joint(q)), dtype=np.float64) + np.zeros(q.shape[:-1])


def swivel_intervals(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> tuple[SwivelInterval, ...]:
    """Return the swivels at which an arm of seven joints can hold a pose within its joint limits.

    With a spherical shoulder and a spherical wrist the ends of the intervals are known in closed form: at each a joint
    is at a limit, or shoulder or wrist are straight. Of other arms they are found by looking at 720 steps of the
    joint that is held, and between the steps where a branch comes near its limits; intervals narrower than about a
    thousandth of a step may be missed.

    Args:
        arm: an arm of seven joints with a closed form: see ``find_closed_form``.
        X_BT: (4, 4) tool pose in the base frame.
        near: (7,) joint positions, for what a singular pose leaves open; the middle of the limits when left out.

    Returns:
        The intervals, branch by branch; none where the pose cannot be held.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        UnsupportedArmError: the arm has no swivel.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or the pose is none.

    Source:
        Shimizu et al. (2008) for the influence of each limit on the swivel.
    """
    form = _redundant_form(arm)
    X = exact_pose(X_BT)
    reference = mid_range(arm) if near is None else single_configuration(arm, near, "near")
    family = _Family(arm, form, X, reference)
    result = []
    for branch in range(len(form.signs)):
        for lower, upper in family.intervals(branch):
            q = family.at(branch, np.array([(lower + upper) / 2]))[0]
            result.append(SwivelInterval(label=form.label(branch, q), lower=lower, upper=upper))
    return tuple(result)


def redundant_candidates(arm: Arm, form: Redundant, X: Array, near: Array, swivel: float | Choice) -> list[Candidate]:
    """Return one configuration of each branch of an arm of seven joints that holds a pose, at a swivel that is chosen.

    Args:
        arm: the arm.
        form: its closed form.
        X: (4, 4) the pose.
        near: (7,) where the arm is.
        swivel: a value, or which of the values inside the limits: see ``inverse``. A branch that has none keeps the
            one that ``near`` has, if it exists there.

    Raises:
        InvalidValueError: ``swivel`` is neither a finite number nor a word for one.
    """
    family = _Family(arm, form, X, near)
    here = float(np.asarray(form.parameter_of(near.tolist())))
    if isinstance(swivel, str):
        if swivel not in get_args(Choice):
            words = ", ".join(get_args(Choice))
            raise InvalidValueError(f"swivel: expected a number or one of {words}, got {shown(swivel)}")
    elif not math.isfinite(swivel):
        raise InvalidValueError(f"swivel: expected a finite number, got {shown(swivel)}")
    candidates = []
    for branch in range(len(form.signs)):
        value = here if isinstance(swivel, str) else float(swivel)
        if isinstance(swivel, str) and (intervals := family.intervals(branch)):
            value = family.chosen(branch, intervals, swivel, here)
        q = family.at(branch, np.array([value]))[0]
        if max(pose_errors(arm, q, X)) <= POSE_TOLERANCE:
            q = nearest_equivalent(arm, q, near)
            if isinstance(form, Swivelling):
                value = math.remainder(value, _TURN)
            candidates.append(Candidate(q, form.label(branch, q), swivel=value))
    return candidates


def _redundant_form(arm: Arm) -> Redundant:
    form = find_closed_form(known_arm(arm))
    if not isinstance(form, Redundant):
        raise UnsupportedArmError(
            f"arm '{arm.name}' has no swivel; expected an arm of 7 joints with a closed-form inverse"
        )
    return form


@attrs.frozen(eq=False)
class _Family:
    """The configurations of one pose, branch by branch, as the parameter goes on."""

    arm: Arm
    form: Redundant
    X: Array
    near: Array

    def at(self, branch: int, values: Array) -> Array:
        """Return the configurations (k, 7) of a branch at values (k,) of the parameter."""
        R, p = self.X[:3, :3].tolist(), self.X[:3, 3].tolist()
        near = [np.full(len(values), x) for x in self.near]
        return stack(self.form.solve_at(R, p, near, self.form.signs[branch], values).q, values.shape)

    def missing(self, branch: int, values: Array) -> Array:
        """Return how far (k,) a branch is outside the limits, or from the pose; 0 where neither."""
        q = self.at(branch, values)
        beyond = excess(self.arm, q)
        distance, angle = pose_errors(self.arm, q, self.X)
        missed = np.maximum(distance, angle)
        return np.where(missed > _MET, missed, 0.0) + np.where(beyond > INSIDE, beyond, 0.0)

    def intervals(self, branch: int) -> list[tuple[float, float]]:
        """Return the values of the parameter (lower, upper) at which a branch is inside the limits."""
        if isinstance(self.form, Swivelling):
            return self._between_limits(branch)
        return self._looked_for(branch)

    def chosen(self, branch: int, intervals: Sequence[tuple[float, float]], choice: str, here: float) -> float:
        """Return one value of the parameter out of intervals."""
        if choice == "middle":
            lower, upper = max(intervals, key=lambda interval: interval[1] - interval[0])
            return (lower + upper) / 2
        if choice == "farthest":
            return self._farthest(branch, intervals)
        # Of the nearest value of each interval that which the joints reach soonest: some are a whole turn away.
        images = [here + turn for turn in ((-_TURN, 0.0, _TURN) if isinstance(self.form, Swivelling) else (0.0,))]
        ends = [
            min((min(max(x, low), high) for x in images), key=lambda end: min(abs(end - x) for x in images))
            for low, high in intervals
        ]
        rows = [nearest_equivalent(self.arm, q, self.near) for q in self.at(branch, np.array(ends))]
        return ends[int(joint_distances(self.arm, self.near, np.array(rows)).argmin())]

    def _farthest(self, branch: int, intervals: Sequence[tuple[float, float]]) -> float:
        """Return the value at which the joint nearest to a limit, in parts of its range, is farthest from it."""
        best = (-math.inf, intervals[0][0])
        for lower, upper in intervals:
            values = np.linspace(lower, upper, _SPREAD)
            for _ in range(_REFINED):
                room = self._room(branch, values)
                k = int(room.argmax())
                best = max(best, (float(room[k]), float(values[k])))
                values = np.linspace(values[max(k - 1, 0)], values[min(k + 1, len(values) - 1)], _SPREAD)
        return best[1]

    def _room(self, branch: int, values: Array) -> Array:
        """Return the least distance (k,) of a joint from its limits, in parts of half its range."""
        room = np.full(len(values), np.inf)
        for joint, x in zip(self.arm.joints, self.at(branch, values).T, strict=True):
            lower, upper = joint.limits.lower, joint.limits.upper
            if not math.isfinite(upper - lower):
                continue
            half = (upper - lower) / 2
            aside = x - (lower + upper) / 2
            if joint.revolute:
                aside = np.remainder(aside + math.pi, _TURN) - math.pi
            room = np.minimum(room, (half - np.abs(aside)) / half)
        return room

    # ---- intervals between limits, of a swivel --------------------------------------------------------------------

    def _between_limits(self, branch: int) -> list[tuple[float, float]]:
        """Return the intervals of the swivel: between two values at which anything changes, the middle tells."""
        ends = np.unique(np.remainder(np.array([*self._changes(branch), -math.pi]) + math.pi, _TURN) - math.pi)
        ends = np.append(ends, ends[0] + _TURN)
        inside = self.missing(branch, (ends[:-1] + ends[1:]) / 2) == 0
        if inside.all():
            return [(-math.pi, math.pi)]
        return _joined(ends, inside)

    def _changes(self, branch: int) -> Iterator[float]:
        """Go through the swivels at which a joint of the shoulder or the wrist may be at a limit, or is straight.

        The rotations that shoulder and wrist make are linear in cosine and sine of the swivel. A joint at a limit is
        one linear equation more.
        """
        form = self.form
        assert isinstance(form, Swivelling)  # noqa: S101 - only of these are there such equations
        R, p = form.displacement(self.X[:3, :3].tolist(), self.X[:3, 3].tolist())
        fourth, _ = form.elbow_angle(R, p, form.signs[branch][0], float(self.near[3]))
        shoulder = form.shoulder_rotations(R, p, fourth)
        h_4 = form.h[3]
        R_4 = transpose([rotated(h_4, fourth, e) for e in np.eye(3).tolist()])
        wrist = [product(transpose(R_4), product(transpose(A), R)) for A in shoulder]
        for first, parts in ((0, shoulder), (4, wrist)):
            yield from self._changes_of(first, [np.array(A, dtype=np.float64) for A in parts])

    def _changes_of(self, first: int, parts: Sequence[Array]) -> Iterator[float]:
        """Go through the swivels at which three joints that make a rotation are at a limit or straight.

        Args:
            first: number of the first of them, from 0.
            parts: (3, 3) what of the rotation is constant, goes with cosine and with sine of the swivel.
        """
        h = [np.array(axis) for axis in self.form.h[first : first + 3]]  # type: ignore[attr-defined]
        limits = [joint.limits for joint in self.arm.joints[first : first + 3]]
        ends = [[x for x in (one.lower, one.upper) if math.isfinite(x)] for one in limits]
        # The middle joint: the angle between the outer axes.
        outer = [float(h[0] @ A @ h[2]) for A in parts]
        for x in ends[1]:
            yield from _angles(outer, float(h[0] @ _turned(h[1], x, h[2])))
        level = float((h[0] @ h[1]) * (h[1] @ h[2]))
        swing = float(np.linalg.norm(np.cross(h[0], h[1])) * np.linalg.norm(np.cross(h[1], h[2])))
        for extreme in (level - swing, level + swing):
            yield from _angles(outer, extreme)
        # The first and the last: with them undone the middle axis keeps its angle to the outer one.
        for x in ends[0]:
            yield from _angles([float(_turned(h[0], x, h[1]) @ A @ h[2]) for A in parts], float(h[1] @ h[2]))
        for x in ends[2]:
            yield from _angles([float(h[0] @ A @ _turned(h[2], -x, h[1])) for A in parts], float(h[0] @ h[1]))

    # ---- intervals looked for, of a joint that is held ------------------------------------------------------------

    def _looked_for(self, branch: int) -> list[tuple[float, float]]:
        """Return the intervals that steps of the parameter show, and those that lie between two steps."""
        assert isinstance(self.form, Locked)  # noqa: S101 - the only other kind
        limits = self.arm.joints[self.form.joint - 1].limits
        reach = math.pi if self.form.kind == "R" else _ENDLESS
        here = float(self.near[self.form.joint - 1])
        lower = limits.lower if math.isfinite(limits.lower) else min(here, limits.upper) - reach
        upper = limits.upper if math.isfinite(limits.upper) else max(here, limits.lower) + reach
        values = np.linspace(lower, upper, _LOOKED_AT)
        width = (upper - lower) / (_LOOKED_AT - 1)
        missing = self.missing(branch, values)
        for _ in range(_CLOSER):
            around = np.pad(missing, 1, constant_values=np.inf)
            low = np.flatnonzero((missing > 0) & (missing <= around[:-2]) & (missing <= around[2:]))
            fan = np.linspace(-width, width, 2 * _FINER + 1)
            more = np.clip(values[low][:, None] + fan, lower, upper).ravel()
            values, first = np.unique(np.concatenate([values, more]), return_index=True)
            missing, width = np.concatenate([missing, self.missing(branch, more)])[first], width / _FINER
        ends = self._ends(branch, values, missing == 0)
        return [(a, b) for a, b in ends if b > a]

    def _ends(self, branch: int, values: Array, inside: Flags) -> list[tuple[float, float]]:
        """Return where runs of values inside begin and end, to the last digit."""
        change = np.flatnonzero(np.diff(inside.astype(int)))
        good = np.where(inside[change], values[change], values[change + 1])
        bad = np.where(inside[change], values[change + 1], values[change])
        for _ in range(_HALVINGS if len(change) else 0):
            middle = (good + bad) / 2
            holds = self.missing(branch, middle) == 0
            good, bad = np.where(holds, middle, good), np.where(holds, bad, middle)
        ends = [float(x) for x in good]
        if inside[0]:
            ends.insert(0, float(values[0]))
        if inside[-1]:
            ends.append(float(values[-1]))
        return list(zip(ends[::2], ends[1::2], strict=True))


def _joined(ends: Array, inside: Flags) -> list[tuple[float, float]]:
    """Join the parts of a circle (k,) that are inside, given their ends (k + 1,)."""
    count = len(inside)
    result = []
    for k in np.flatnonzero(inside & ~np.roll(inside, 1)):
        last = int(k)
        while inside[(last + 1) % count]:
            last += 1
        upper = ends[last % count + 1] + (_TURN if last >= count else 0.0)
        result.append((float(ends[k]), float(upper)))
    return result


def _angles(parts: Sequence[float], value: float) -> list[float]:
    """Return the angles at which constant + cosine part + sine part has a value; the nearest where none has."""
    constant, cosine, sine = parts
    size = math.hypot(cosine, sine)
    if size == 0.0:
        return []
    middle = math.atan2(sine, cosine)
    aside = math.acos(min(max((value - constant) / size, -1.0), 1.0))
    return [middle - aside, middle + aside]


def _turned(axis: Array, angle: float, v: Array) -> Array:
    return np.array(rotated(axis.tolist(), angle, v.tolist()))
