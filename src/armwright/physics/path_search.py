"""Legs among free configurations from a start to one of several goals: found by RRT-Connect, and shortened.

Coordinates are the joint positions times their levers, so that distances are metres of movement. The same seed gives
the same bits: all random numbers of OMPL come from one generator of the process, which is seeded before each search.

Source:
    Kuffner & LaValle, "RRT-Connect: an efficient approach to single-query path planning" (2000).
"""

from __future__ import annotations

from threading import Lock
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.extras import import_extra
from armwright.physics.joint_space import JointSpace

# So many of the goals are tried by a straight leg before.
_STRAIGHT = 4
# Positions are sought so far beyond those of start and goals [rad] or [m].
_BEYOND = np.pi
# Shortcuts that are tried.
_SHORTCUTS = 200
# Of the one generator of OMPL only one thread may draw.
_LOCK = Lock()


def free_path(space: JointSpace, start: Array, goals: Array, longest: float, seed: int) -> Array | None:
    """Return the corners (k, n) of a free path, with both ends; None where no more may be checked.

    Args:
        space: the configurations.
        start: (n,) joint positions, free.
        goals: (g, n) joint positions, free, of which one is to be reached.
        longest: leg that is tried at once [m].
        seed: of the random numbers, 0 or more.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    for goal in goals[:_STRAIGHT]:
        if space.leg_is_free(start, goal):
            return np.array([start, goal])
    ends = np.concatenate([start[None], goals])
    lowest, highest = ends.min(axis=0), ends.max(axis=0)
    lower = np.minimum(lowest, np.maximum(space.arm.limits.lower, lowest - _BEYOND))
    upper = np.maximum(highest, np.minimum(space.arm.limits.upper, highest + _BEYOND))
    corners = _rrt_connect(space, ends, (lower, upper), longest, seed)
    if corners is None:
        return None
    # The ends are what they were, to the last bit.
    goal = goals[np.abs(goals - corners[-1]).max(axis=1).argmin()]
    return np.concatenate([start[None], corners[1:-1], goal[None]])


def _rrt_connect(
    space: JointSpace, ends: Array, limits: tuple[Array, Array], longest: float, seed: int
) -> Array | None:
    """Return the corners of a path from the first of several ends (k, n) to another, inside bounds (n,)."""
    base, geometric, util = (
        import_extra(f"ompl.{part}", "planning a path", "planning") for part in ("base", "geometric", "util")
    )
    (lower, upper), levers = limits, space.levers
    n = len(lower)

    def to_joints(state: Any) -> Array:
        return np.clip(np.array([state[i] for i in range(n)]) / levers, lower, upper)

    def to_state(q: Array) -> Any:
        state = vectors.allocState()
        for i, x in enumerate((q * levers).tolist()):
            state[i] = x
        return state

    class Legs(base.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, a: Any, b: Any) -> bool:
            return space.leg_is_free(to_joints(a), to_joints(b))

    with _LOCK:
        level = util.getLogLevel()
        util.setLogLevel(util.LOG_NONE)
        try:
            # Seeds of 0 are ignored, and so are more than 32 bits.
            util.RNG.setSeed(1 + seed % (2**32 - 1))
            vectors = base.RealVectorStateSpace(n)
            bounds = base.RealVectorBounds(n)
            for i in range(n):
                bounds.setLow(i, float(lower[i] * levers[i]))
                bounds.setHigh(i, float(upper[i] * levers[i]))
            vectors.setBounds(bounds)
            information = base.SpaceInformation(vectors)
            information.setStateValidityChecker(lambda state: space.is_free(to_joints(state)[None]))
            information.setMotionValidator(Legs(information))
            information.setup()
            problem, goals = base.ProblemDefinition(information), base.GoalStates(information)
            problem.addStartState(to_state(ends[0]))
            for q in ends[1:]:
                goals.addState(to_state(q))
            problem.setGoal(goals)
            planner = geometric.RRTConnect(information)
            planner.setRange(longest)
            planner.setProblemDefinition(problem)
            planner.setup()
            planner.solve(base.PlannerTerminationCondition(lambda: space.left <= 0))
            if not problem.hasExactSolution():
                return None
            return np.array([to_joints(state) for state in problem.getSolutionPath().getStates()])
        finally:
            util.setLogLevel(level)


def shortened(space: JointSpace, corners: Array, seed: int) -> Array:
    """Return a path with shortcuts: straight legs between random points of it, where they are free.

    Args:
        space: the configurations.
        corners: (k, n) of a free path.
        seed: of the random numbers, 0 or more.
    """
    rng = np.random.default_rng(seed)
    corners = _without_needless(space, corners)
    for _ in range(_SHORTCUTS):
        if len(corners) == 2 or space.left <= 0:
            break
        lengths = np.linalg.norm(np.diff(corners, axis=0) * space.levers, axis=1)
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        a, b = np.sort(rng.uniform(0.0, ends[-1], 2))
        i, j = (int(np.searchsorted(ends[1:-1], x, side="right")) for x in (a, b))
        if i == j:
            continue
        p, q = (corners[k] + (x - ends[k]) / lengths[k] * (corners[k + 1] - corners[k]) for k, x in ((i, a), (j, b)))
        if space.leg_is_free(p, q):
            corners = np.concatenate([corners[: i + 1], [p, q], corners[j + 1 :]])
    return _without_needless(space, corners)


def _without_needless(space: JointSpace, corners: Array) -> Array:
    """Return a path without the corners that it can do without."""
    kept, here = [corners[0]], 0
    while here < len(corners) - 1:
        ahead = range(len(corners) - 1, here + 1, -1)
        here = next((k for k in ahead if space.leg_is_free(corners[here], corners[k])), here + 1)
        kept.append(corners[here])
    return np.array(kept)
