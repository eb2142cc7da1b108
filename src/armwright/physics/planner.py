"""Joint paths past the bodies of a cell, where the straight one would collide.

A path is found by RRT-Connect of OMPL among configurations that are checked one by one, each distance in metres that
the joints move the arm by. Then it is shortened, its corners are rounded, and it is timed within all limits. What comes
out is checked along the whole path by ``ClearanceChecker.first_contact``; where that finds a contact the corner is
drawn tighter, or the path is found again with closer checks. The budget is counted in checked configurations and all
random numbers come from a seed, so the same question always has the same answer, to the last bit.

Source:
    Kuffner & LaValle, "RRT-Connect: an efficient approach to single-query path planning" (2000).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, integer, joint_array, read_only
from armwright.compiled.arm import CompiledArm
from armwright.errors import ArmwrightError, ShapeError, counted
from armwright.motion.rounded_joint_path import rounded_run
from armwright.motion.solver import AnyArm
from armwright.motion.trajectory import Trajectory, whole_ticks
from armwright.physics.clearance import ClearanceChecker, Closest, Window
from armwright.physics.joint_space import JointSpace, Margins
from armwright.physics.path_search import free_path, shortened

Cause: TypeAlias = Literal["start", "goal", "not found"]
Certify: TypeAlias = Callable[[Trajectory], Closest | None]

# How a path is sought, round by round until one stands the test: how far bodies are kept apart, or half of what they
# are apart at its ends where that is less [m]; by how much the arm moves at most from one checked configuration of a
# straight leg to the next [m], and on a leg of the search [m]; and which part of what is left of the budget is spent.
# Short legs find their way out of tight places, long ones through gaps.
_ROUNDS = ((0.01, 0.04, 0.3, 0.15), (1e-3, 0.05, 1.0, 0.65), (5e-4, 0.04, 0.3, 0.75), (5e-4, 0.01, 0.3, 1.0))
# Of more solutions of the goal the nearest are planned to.
_MOST_GOALS = 32
# Shortening may check so many configurations more, by those of the search.
_SHORTENING = 0.25
# How often corners are rounded less, each time by half.
_TIGHTER = 12


@attrs.frozen(kw_only=True, eq=False)
class PlannedPath:
    """A path past the bodies of a cell.

    Attributes:
        trajectory: of the joints, at rest at both ends, within all limits; no bodies meet on it.
        waypoints: (k, n) joint positions at the corners, with both ends; the corners between are rounded.
        goal: which of the goals it leads to, from 0.
        checked: number of configurations that were checked.
        seed: of the random numbers.
    """

    trajectory: Trajectory
    waypoints: Array = attrs.field(converter=read_only)
    goal: int
    checked: int
    seed: int

    def as_data(self) -> dict[str, Any]:
        """Return how it was planned, as plain data in SI units."""
        return {"waypoints": self.waypoints.tolist(), "checked": self.checked, "seed": self.seed}


class Overlap(NamedTuple):
    """Two bodies that are too near at a configuration.

    Attributes:
        bodies: their names.
        distance: between them [m]; below 0 where they overlap.
        goal: the goal, from 0; None for the start.
    """

    bodies: tuple[str, str]
    distance: float
    goal: int | None = None

    def __str__(self) -> str:
        """Say it."""
        if self.distance < 0:
            return f"{self.bodies[0]} overlaps {self.bodies[1]} by {-self.distance * 1e3:.1f} mm"
        return f"{self.bodies[0]} is {self.distance * 1e3:.1f} mm from {self.bodies[1]}"


class PlanningError(ArmwrightError, ValueError):
    """No path was planned.

    Attributes:
        cause: the ``start`` is in collision, every IK solution of the ``goal`` is, or a path was ``not found``.
        overlaps: of the start, or of each goal.
        checked: number of configurations that were checked.
    """

    def __init__(self, cause: Cause, message: str, checked: int, overlaps: Sequence[Overlap] = ()) -> None:
        """Keep the attributes."""
        self.cause, self.checked, self.overlaps = cause, checked, tuple(overlaps)
        super().__init__(message)


def plan_path(
    checker: ClearanceChecker,
    arm: str,
    q_start: ArrayLike,
    goals: ArrayLike,
    *,
    others: Mapping[str, Trajectory] | None = None,
    certify: Certify | None = None,
    speed: float = 100.0,
    period: float = 1e-3,
    seed: int = 0,
    checks: int = 20_000,
    margin: float | Margins = 0.0,
) -> PlannedPath:
    """Return a joint path to one of several goals on which no bodies meet.

    Args:
        checker: the bodies of the cell.
        arm: name of the arm that moves, with n joints.
        q_start: (n,) its joint positions.
        goals: (k, n), one or more: IK solutions of where it is to go, the best first.
        others: what all other arms do from the same time on. The path leads past where they come to stand, and is
            certified while they move.
        certify: decides whether bodies meet on a trajectory of the arm, and where; ``first_contact`` when left out.
        speed: 1 to 120; 120 is the fastest the limits of speed and acceleration allow.
        period: of the servo [s]; the trajectory takes a whole number of periods.
        seed: of the random numbers, 0 or more.
        checks: number of configurations that are checked at most; to shorten the path a quarter more.
        margin: of distance that bodies keep [m], all of them the same or each pair its own. It counts for ``certify``
            only where that is left out.

    Raises:
        PlanningError: there is none, with the cause.
        IncapableArmError: gravity alone takes more than a joint may give on the path.
        InvalidValueError: the seed, the number of checks, the speed or the period is out of range.
        MissingExtraError: OMPL is not installed.
    """
    others, seed = others or {}, integer(seed, "seed", least=0)
    left = integer(checks, "checks", least=1)
    placed = checker.arms[arm].arm
    model = placed if isinstance(placed, CompiledArm) else placed.arm
    start = joint_array(q_start, placed.arm.n, "q_start")
    ends = joint_array(goals, len(start), "goals")
    if ends.ndim != 2 or not len(ends):
        raise ShapeError(f"goals: expected one or more of {len(start)} joint positions, got shape {ends.shape}")
    space = JointSpace(checker, arm, others, margin)
    free = _free_goals(space, checker, start, ends)
    nearest = ends[free[:_MOST_GOALS]]
    if certify is None:
        certify = partial(_first_contact, checker, arm, others, margin)
    contact: Closest | None = None
    for room, step, longest, part in _ROUNDS:
        space.set_ends(np.concatenate([start[None], nearest]), room)
        space.step, space.left = step, math.ceil(part * left)
        left -= space.left
        points = free_path(space, start, nearest, longest, seed)
        left += space.left
        if points is None:
            continue
        space.left = math.ceil(_SHORTENING * checks)
        points = shortened(space, points, seed)
        motion, contact = _certified(model, points, certify, speed, period)
        if contact is None:
            goal = free[int(np.abs(nearest - points[-1]).max(axis=1).argmin())]
            return PlannedPath(trajectory=motion, waypoints=points, goal=goal, checked=space.checked, seed=seed)
    text = f"no path was found within {counted(space.checked, 'checked configuration')}"
    if contact is not None:
        a, b = _overlap(checker, contact.bodies, contact.distance).bodies
        text += f"; on the last one that seemed free {a} would still meet {b}"
    text += f"; not in collision at the goal: {len(free)} of {counted(len(ends), 'IK solution')}"
    raise PlanningError("not found", text, space.checked)


def _free_goals(space: JointSpace, checker: ClearanceChecker, start: Array, ends: Array) -> list[int]:
    """Return which goals are free.

    Raises:
        PlanningError: none is, or the start is not.
    """
    here = [_overlap(checker, it.bodies, it.distance) for it in space.overlaps(start, start=True)]
    if here:
        text = f"the arm is in collision where it starts: {'; '.join(map(str, here))}"
        raise PlanningError("start", text, space.checked, here)
    # Solutions that differ by whole turns are in the same collisions.
    turns = np.where(space.arm.revolute, np.round(ends / (2 * np.pi)), 0.0)
    _, first, which = np.unique(np.round(ends - 2 * np.pi * turns, 6), axis=0, return_index=True, return_inverse=True)
    overlaps = {number: space.overlaps(ends[number], start=False) for number in sorted(first.tolist())}
    free = [number for number, of in enumerate(first[which.ravel()].tolist()) if not overlaps[of]]
    if free:
        return free
    found = [_overlap(checker, all_[0].bodies, all_[0].distance, number) for number, all_ in overlaps.items()]
    several = f"all {len(found)} IK solutions of the goal are" if len(found) > 1 else "the IK solution of the goal is"
    text = f"{several} in collision: {'; '.join(map(str, found))}"
    raise PlanningError("goal", text, space.checked, found)


def _overlap(checker: ClearanceChecker, bodies: tuple[int, int], distance: float, goal: int | None = None) -> Overlap:
    a, b = (checker.bodies[number].name for number in bodies)
    return Overlap((a, b), distance, goal)


def _first_contact(
    checker: ClearanceChecker, arm: str, others: Mapping[str, Trajectory], margin: float | Margins, motion: Trajectory
) -> Closest | None:
    motions = {**others, arm: motion}
    if not isinstance(margin, Margins):
        return checker.first_contact(motions, margin)
    counting = np.flatnonzero(margin.between > -np.inf)
    windows = [Window(0.0, max(each.duration for each in motions.values()), counting, margin.between[counting])]
    return checker.first_contact(motions, windows=windows)


def _certified(
    arm: AnyArm, points: Array, certify: Certify, speed: float, period: float
) -> tuple[Trajectory, Closest | None]:
    """Return the run through configurations (k, n), its corners rounded as widely as can be, and a contact on it.

    There is one where it would be on a straight leg, or whatever the rounding.
    """
    rounding = np.ones(len(points) - 2)
    for _ in range(_TIGHTER):
        run = rounded_run(arm, points, rounding, speed)
        motion = whole_ticks(run.trajectory, period)
        contact = certify(motion)
        if contact is None:
            break
        time = contact.time / motion.duration * run.trajectory.duration
        corner = np.flatnonzero((run.begins <= time) & (time <= run.ends))
        if not len(corner):
            break
        rounding[corner] /= 2
    return motion, contact
