"""Whether the poses of a path can be taken at all, asked before anything between them is sampled."""

from __future__ import annotations

from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.chain import chain
from armwright.motion.obstruction import PathError, cause_of
from armwright.motion.path import Path
from armwright.motion.solver import Solver


def check_ends(solver: Solver, path: Path, q_start: Array) -> None:
    """Refuse a path to a pose that no joint configuration reaches, with ``fraction`` 1 of the path that leads there.

    Raises:
        PathError: a pose is out of reach, or has no configuration inside the joint limits.
    """
    arm = solver.arm
    q, failed = chain(solver, path.poses, q_start)
    for segment, X in enumerate(path.poses[1:]):
        if (failed is None or segment + 1 < failed) and not violations(arm, q[segment + 1]):
            continue
        solution = inverse(arm, X)
        if not solution.allowed:
            raise PathError(cause_of(solution), segment, 1.0, solution.explain())
