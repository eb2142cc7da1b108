"""Which part of its limits a motion uses, and how much slower it must run to keep them all."""

from __future__ import annotations

from armwright.arrays import Array
from armwright.motion.certificate import BindingLimit, LimitName, slowing
from armwright.motion.certified_motion import limit_peaks
from armwright.motion.efforts import checked, slowing_for_efforts
from armwright.motion.limited import by_joint
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.trajectory import Trajectory

# Relative excess over a limit that is rounding.
ROUNDING = 1e-9


def limit_use(arm: AnyArm, trajectory: Trajectory) -> dict[LimitName, Array]:
    """Return which part of its limits of speed, acceleration and effort each joint, or its drive, uses at most.

    Args:
        arm: the arm, or a compiled one, which is faster.
        trajectory: of its n joints.

    Returns:
        (n,) by the name of the limit, 1 for all of it, 0 where there is none. Speeds and accelerations exactly, efforts
        as ``effort_peaks`` finds them.

    Raises:
        KindError: ``trajectory`` is no trajectory.
        ShapeError: it is of another number of joints.
    """
    model = solver_of(arm).arm
    checked(model, trajectory)
    uses = {name: peaks / getattr(model.all_limits, name) for name, peaks in limit_peaks(arm, trajectory).items()}
    return {name: by_joint(model, parts) for name, parts in uses.items()}


def slowing_for_limits(arm: AnyArm, trajectory: Trajectory) -> tuple[float, BindingLimit | None]:
    """Return how many times slower a motion must run to keep its limits of speed, acceleration and effort.

    Args:
        arm: the arm, or a compiled one, which is faster.
        trajectory: of its n joints.

    Returns:
        The factor, 1 where it keeps them as it is; and the limit and the joint, from 0, that it is for, None for none.

    Raises:
        KindError: ``trajectory`` is no trajectory.
        ShapeError: it is of another number of joints.
        IncapableArmError: gravity and dry friction alone take more than a joint may give, so that no slowing helps.
    """
    model = solver_of(arm).arm
    checked(model, trajectory)
    factor, because = slowing(model, trajectory)
    efforts = slowing_for_efforts(arm, trajectory.slowed(factor))
    if efforts.joint is None:
        return factor, because
    return factor * efforts.factor, ("effort", efforts.joint)
