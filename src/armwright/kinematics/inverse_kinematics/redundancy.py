"""Redundancy resolution within the joint limits: which swivels an arm of seven joints may have, and which is taken."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import attrs
import numpy as np
from numpy.typing import NDArray

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions, single_configuration
from armwright.arrays import Array, ArrayLike, Flags, number
from armwright.errors import InvalidValueError, UnsupportedArmError, shown
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.kinematics.inverse_kinematics.candidates import POSE_TOLERANCE, Candidate, exact_pose, pose_errors
from armwright.kinematics.inverse_kinematics.closed_forms import find_closed_form
from armwright.kinematics.inverse_kinematics.geometry import Sign
from armwright.kinematics.inverse_kinematics.redundant import Locked, Redundant, Swivelling
from armwright.kinematics.inverse_kinematics.revolutions import joint_distances, mid_range, nearest_equivalent
from armwright.kinematics.inverse_kinematics.self_motion import INSIDE, excess
from armwright.kinematics.inverse_kinematics.subproblems import rotated
from armwright.tracing.vectors import product, transpose

Choice: TypeAlias = Literal["nearest", "middle", "farthest"]
CHOICES: tuple[Choice, ...] = get_args(Choice)

_TURN = 2 * math.pi
# Without equations for its ends an interval is found by looking at so many values of the parameter, and its ends by
# coming so often so many times closer. Between two values the least of what is outside is sought likewise.
_LOOKED_AT, _CLOSINGS = 721, 9
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
    is at a limit, or shoulder or wrist are straight. Of other arms, and of arms whose coupled drives have limits, they
    are found by looking at 720 steps of the swivel, and between the steps where a branch comes near its limits;
    intervals narrower than about a thousandth of a step may be missed, and one that goes on past 180 deg is two.

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
    intervals = family.intervals()
    middles = np.array([(one.lower + one.upper) / 2 for one in intervals])
    rows = family.at(np.array([one.branch for one in intervals], dtype=np.intp), middles[:, None])[:, 0]
    return tuple(
        SwivelInterval(label=form.label(one.branch, q), lower=one.lower, upper=one.upper)
        for one, q in zip(intervals, rows, strict=True)
    )


def swivel_unit(arm: Arm) -> tuple[str, float]:
    """Return the unit in which people read the swivel of an arm, and how large it is: deg [rad] or mm [m]."""
    form = find_closed_form(arm)
    slides = isinstance(form, Locked) and form.kind == "P"
    return ("mm", 1e-3) if slides else ("deg", math.radians(1.0))


def checked_swivel(swivel: float | Choice) -> float | Choice:
    """Return a swivel, or a word for one, that has been checked.

    Raises:
        KindError: it is neither a number nor a text.
        InvalidValueError: it is not finite, or another word.
    """
    if isinstance(swivel, str):
        if swivel not in CHOICES:
            words = ", ".join(CHOICES)
            raise InvalidValueError(f"swivel: expected a number or one of {words}, got {shown(swivel)}")
        return swivel
    value = number(swivel, "swivel")
    if not math.isfinite(value):
        raise InvalidValueError(f"swivel: expected a finite number, got {value}")
    return value


def redundant_candidates(arm: Arm, form: Redundant, X: Array, near: Array, swivel: float | Choice) -> list[Candidate]:
    """Return one configuration of each branch of an arm of seven joints that holds a pose, at a swivel that is chosen.

    Args:
        arm: the arm.
        form: its closed form.
        X: (4, 4) the pose.
        near: (7,) where the arm is.
        swivel: a value, or which of the values inside the limits: see ``inverse``. A branch that has none keeps the
            one that ``near`` has, if it exists there.
    """
    family = _Family(arm, form, X, near)
    here = float(np.asarray(form.parameter_of(near.tolist())))
    values = np.full(len(form.signs), here if isinstance(swivel, str) else swivel)
    if isinstance(swivel, str):
        for branch, value in family.chosen(swivel, here):
            values[branch] = value
    rows = family.at(np.arange(len(values)), values[:, None])[:, 0]
    distances, angles = pose_errors(arm, rows, X)
    met = np.flatnonzero(np.maximum(distances, angles) <= POSE_TOLERANCE)
    if not isinstance(swivel, str) and not met.size:
        met = np.array([np.hypot(distances, angles).argmin()])
    candidates = []
    for branch in met.tolist():
        q = nearest_equivalent(arm, rows[branch], near)
        value = math.remainder(values[branch], _TURN) if isinstance(form, Swivelling) else float(values[branch])
        candidates.append(Candidate(q, form.label(branch, q), swivel=value))
    return candidates


def _redundant_form(arm: Arm) -> Redundant:
    form = find_closed_form(known_arm(arm))
    if not isinstance(form, Redundant):
        raise UnsupportedArmError(
            f"arm '{arm.name}' has no swivel; expected an arm of 7 joints with a closed-form inverse"
        )
    return form


class _Interval(NamedTuple):
    branch: int
    lower: float
    upper: float


@attrs.frozen(eq=False)
class _Family:
    """The configurations of one pose, branch by branch, as the parameter goes on."""

    arm: Arm
    form: Redundant
    X: Array
    near: Array

    def at(self, branches: NDArray[np.intp], values: Array) -> Array:
        """Return the configurations (m, k, 7) of branches (m,), each at values (m, k) of the parameter."""
        R, p = self.X[:3, :3].tolist(), self.X[:3, 3].tolist()
        signs: Any = [np.array(side)[:, None] for side in zip(*(self.form.signs[i] for i in branches), strict=True)]
        if not len(branches):
            return np.empty((*values.shape, self.arm.n))
        return stack(self.form.solve_at(R, p, self.near.tolist(), signs, values).q, values.shape)

    def missing(self, branches: NDArray[np.intp], values: Array) -> Array:
        """Return how far (m, k) branches (m,) are outside the limits, or from the pose; 0 where neither."""
        q = self.at(branches, values)
        beyond = excess(self.arm, q)
        missed = np.maximum(*pose_errors(self.arm, q, self.X))
        return np.where(missed > _MET, missed, 0.0) + np.where(beyond > INSIDE, beyond, 0.0)

    def intervals(self) -> list[_Interval]:
        """Return the values of the parameter at which branches are inside the limits, branch by branch."""
        # Where a drive that moves several joints is at a limit, is no linear equation.
        linear = self.arm.coupling is None or not self.arm.coupling.limits
        return self._between_limits() if linear and isinstance(self.form, Swivelling) else self._looked_for()

    def chosen(self, choice: str, here: float) -> list[tuple[int, float]]:
        """Return one value of the parameter for each branch that has one inside the limits: (branch, value).

        Args:
            choice: which.
            here: the value where the arm is.
        """
        intervals = self.intervals()
        if choice == "farthest":
            values, merit = self._farthest(intervals)
        elif choice == "middle":
            values = np.array([(one.lower + one.upper) / 2 for one in intervals])
            merit = np.array([one.upper - one.lower for one in intervals])
        else:
            # Of the nearest value of each interval that which the joints reach soonest: some are a whole turn away.
            images = here + (np.array((-_TURN, 0.0, _TURN)) if isinstance(self.form, Swivelling) else np.zeros(1))
            ends = [np.clip(images, one.lower, one.upper) for one in intervals]
            values = np.array([end[np.abs(end - images).argmin()] for end in ends])
            rows = self.at(np.array([one.branch for one in intervals], dtype=np.intp), values[:, None])[:, 0]
            nearest = [nearest_equivalent(self.arm, q, self.near) for q in rows]
            merit = -joint_distances(self.arm, self.near, np.array(nearest).reshape(-1, self.arm.n))
        best: dict[int, int] = {}
        for k in np.argsort(merit, kind="stable").tolist():
            best[intervals[k].branch] = k
        return [(branch, float(values[k])) for branch, k in best.items()]

    def _farthest(self, intervals: Sequence[_Interval]) -> tuple[Array, Array]:
        """Return the values (m,) at which the joint nearest to a limit has most room, and how much room (m,)."""
        branches = np.array([one.branch for one in intervals], dtype=np.intp)
        low, high = np.array([(one.lower, one.upper) for one in intervals]).reshape(-1, 2).T
        each, best = np.arange(len(intervals)), low
        room = np.empty(len(intervals))
        for _ in range(_REFINED):
            values = np.linspace(low, high, _SPREAD, axis=-1)
            all_room = self._room(branches, values)
            k = all_room.argmax(axis=-1)
            best, room = values[each, k], all_room[each, k]
            low, high = values[each, np.maximum(k - 1, 0)], values[each, np.minimum(k + 1, _SPREAD - 1)]
        return best, room

    def _room(self, branches: NDArray[np.intp], values: Array) -> Array:
        """Return the least distance (m, k) of a joint from its limits, in parts of half its range."""
        room = np.full(values.shape, np.inf)
        q = self.at(branches, values)
        for i, joint in enumerate(self.arm.joints):
            lower, upper = joint.limits.lower, joint.limits.upper
            if not math.isfinite(upper - lower):
                continue
            half = (upper - lower) / 2
            aside = q[..., i] - (lower + upper) / 2
            if joint.revolute:
                aside = np.remainder(aside + math.pi, _TURN) - math.pi
            room = np.minimum(room, (half - np.abs(aside)) / half)
        return room

    # ---- intervals between limits, of a swivel --------------------------------------------------------------------

    def _between_limits(self) -> list[_Interval]:
        """Return the intervals of the swivel: between two values at which anything changes, the middle tells."""
        changes = [*self._changes(1), *self._changes(-1), -math.pi]
        ends = np.unique(np.remainder(np.array(changes) + math.pi, _TURN) - math.pi)
        ends = np.append(ends, ends[0] + _TURN)
        every = np.arange(len(self.form.signs))
        middles = np.broadcast_to((ends[:-1] + ends[1:]) / 2, (len(every), len(ends) - 1))
        inside = self.missing(every, middles) == 0
        return [_Interval(branch, *ends_) for branch in every.tolist() for ends_ in _joined(ends, inside[branch])]

    def _changes(self, elbow: Sign) -> Iterator[float]:
        """Go through the swivels at which a joint of the shoulder or the wrist may be at a limit, or is straight.

        The rotations that shoulder and wrist make are linear in cosine and sine of the swivel. A joint at a limit is
        one linear equation more.
        """
        form = self.form
        assert isinstance(form, Swivelling)  # noqa: S101 - only of these are there such equations
        R, p = form.displacement(self.X[:3, :3].tolist(), self.X[:3, 3].tolist())
        fourth, _ = form.elbow_angle(R, p, elbow, float(self.near[3]))
        shoulder = form.shoulder_rotations(R, p, fourth)
        R_4 = transpose([rotated(form.h[3], fourth, e) for e in np.eye(3).tolist()])
        wrist = [product(transpose(R_4), product(transpose(A), R)) for A in shoulder]
        for first, parts in ((0, shoulder), (4, wrist)):
            h = [np.array(axis) for axis in form.h[first : first + 3]]
            yield from self._changes_of(first, h, [np.array(A, dtype=np.float64) for A in parts])

    def _changes_of(self, first: int, h: Sequence[Array], parts: Sequence[Array]) -> Iterator[float]:
        """Go through the swivels at which three joints that make a rotation are at a limit or straight.

        Args:
            first: number of the first of them, from 0.
            h: (3,) their axes.
            parts: (3, 3) what of the rotation is constant, goes with cosine and with sine of the swivel.
        """
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

    # ---- intervals looked for, of a joint that is held, or of coupled drives --------------------------------------

    def _looked_for(self) -> list[_Interval]:
        """Return the intervals that steps of the parameter show, and those that lie between two steps."""
        lower, upper = self._range()
        every = np.arange(len(self.form.signs))
        steps, width = np.linspace(lower, upper, _LOOKED_AT, retstep=True)
        at_steps = self.missing(every, np.broadcast_to(steps, (len(every), _LOOKED_AT)))
        values, missing = [steps] * len(every), list(at_steps)
        for _ in range(_CLOSER):
            # Where a branch is outside, but less so than on either side, it may come inside between.
            low = [(branch, values[branch][k]) for branch in every.tolist() for k in _least(missing[branch])]
            if not low:
                break
            fan = np.linspace(-width, width, 2 * _FINER + 1)
            branches, middle = np.array([branch for branch, _ in low]), np.array([x for _, x in low])
            more = np.clip(middle[:, None] + fan, lower, upper)
            found = self.missing(branches, more)
            for branch in np.unique(branches).tolist():
                rows = branches == branch
                all_values = np.concatenate([values[branch], more[rows].ravel()])
                values[branch], first = np.unique(all_values, return_index=True)
                missing[branch] = np.concatenate([missing[branch], found[rows].ravel()])[first]
            width /= _FINER
        return self._ends(values, missing)

    def _range(self) -> tuple[float, float]:
        """Return between what the parameter is looked at."""
        if not isinstance(self.form, Locked):
            return -math.pi, math.pi
        limits = self.arm.joints[self.form.joint - 1].limits
        reach = math.pi if self.form.kind == "R" else _ENDLESS
        here = float(self.near[self.form.joint - 1])
        lower = limits.lower if math.isfinite(limits.lower) else min(here, limits.upper) - reach
        upper = limits.upper if math.isfinite(limits.upper) else max(here, limits.lower) + reach
        return lower, upper

    def _ends(self, values: Sequence[Array], missing: Sequence[Array]) -> list[_Interval]:
        """Return where runs of values inside begin and end, branch by branch, to the last digit."""
        edges = [
            (branch, *((x[k], x[k + 1]) if m[k] == 0 else (x[k + 1], x[k])))
            for branch, (x, m) in enumerate(zip(values, missing, strict=True))
            for k in np.flatnonzero(np.diff((m == 0).astype(int))).tolist()
        ]
        branches = np.array([branch for branch, _, _ in edges], dtype=np.intp)
        good, bad = (np.array([edge[i] for edge in edges], dtype=np.float64) for i in (1, 2))
        each = np.arange(len(edges))
        for _ in range(_CLOSINGS if edges else 0):
            # The last value inside on the way from inside to outside.
            between = np.linspace(good, bad, _FINER + 1, axis=-1)
            outside = self.missing(branches, between[:, 1:]) > 0
            k = np.where(outside.any(axis=-1), outside.argmax(axis=-1), _FINER - 1)
            good, bad = between[each, k], between[each, k + 1]
        result = []
        for branch, (x, m) in enumerate(zip(values, missing, strict=True)):
            ends = good[branches == branch].tolist()
            ends = [*([float(x[0])] if m[0] == 0 else []), *ends, *([float(x[-1])] if m[-1] == 0 else [])]
            result += [_Interval(branch, a, b) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]
        return result


def _least(missing: Array) -> list[int]:
    """Return where values (k,) above 0 are no larger than those on either side."""
    around = np.pad(missing, 1, constant_values=np.inf)
    return np.flatnonzero((missing > 0) & (missing <= around[:-2]) & (missing <= around[2:])).tolist()


def _joined(ends: Array, inside: Flags) -> list[tuple[float, float]]:
    """Join the parts of a circle (k,) that are inside, given their ends (k + 1,)."""
    count = len(inside)
    if inside.all():
        return [(-math.pi, math.pi)]
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
