"""Through frames without a stop, as the report moves: knots on the straight segments, and an X-spline of the joints."""

from __future__ import annotations

import numpy as np

from armwright.arm.positions import single_configuration
from armwright.arrays import Array, ArrayLike
from armwright.motion.certified_motion import CertifiedMotion, slowed_alike, standstill
from armwright.motion.moves import exact_poses
from armwright.motion.obstruction import PathError, check_ends
from armwright.motion.path import NEGLIGIBLE, Path
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.straight import coarse_deviations
from armwright.motion.straight_path import report_path
from armwright.motion.tolerance import tolerance
from armwright.motion.tracking import Task, check_velocities, excess, path_error, too_far, track

# The report's path through several frames turns its corners without a stop, so it must round them; and it is gross
# motion. It may leave the straight segments between its frames by this many times what a line may leave its own.
_CORNERS = 20.0
# How often the steps of the report's rule are halved at most.
_HALVINGS = 6


def through_frames(
    arm: AnyArm, q_start: ArrayLike, frames: ArrayLike, *, deviation: float = 1e-3, speed: float = 100.0
) -> CertifiedMotion:
    """Return the joint motion of the tool through frames, from rest to rest, without a stop at those between.

    Knots lie on the straight segments from frame to frame, as densely as the report's rule asks and the bound needs,
    and one X-spline joins their joint positions. At each frame between it passes exactly, and swings about the straight
    paths beside it: a MOVE with VIA of RLO-2 keeps to closer bounds.

    Args:
        arm: the arm, with n joints, or a compiled one, which plans faster.
        q_start: (n,) joint positions at the start [rad] or [m].
        frames: (k, 4, 4) tool poses in the base frame, two or more; a rotation typed with two digits is made exact.
        deviation: allowed distance of the tool from a single straight segment [m]; twenty times as much about corners.
        speed: 1 to 120, 100 is normal.

    Returns:
        The motion, slowed for the limits of speed and acceleration, for those of effort where that helps; and its
        certificate.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: a shape does not fit, or there are fewer than two frames.
        PathError: a frame is out of reach, a joint passes a limit, or a singularity is in the path.
        InvalidValueError: a frame is no pose; deviation or speed are out of range.

    Source:
        TR-83-008, "continuous motion".
    """
    solver = solver_of(arm)
    q = single_configuration(solver.arm, q_start, "q_start")
    goals = exact_poses(frames)
    path = Path(poses=np.concatenate([np.asarray(solver.forward(q))[None], goals]))
    return through(arm, path, q, deviation=deviation, speed=speed)


def through(arm: AnyArm, path: Path, q_start: Array, *, deviation: float, speed: float) -> CertifiedMotion:
    """Return what ``through_frames`` does, for a path that begins where the tool is at ``q_start``."""
    solver = solver_of(arm)
    allowed = tolerance(_CORNERS * tolerance(deviation).position)
    if path.lengths().max() <= NEGLIGIBLE:
        return standstill(solver, q_start, allowed)
    check_ends(solver, path, q_start)
    motions: list[CertifiedMotion] = []
    for tried in coarse_deviations(deviation):
        try:
            motions.append(_through(arm, path, q_start, deviation=tried, speed=speed))
        except PathError as error:
            last = error
            if error.cause == "reach":  # a pose out of reach is so for every deviation
                break
    if not motions:
        raise last
    return min(motions, key=lambda motion: motion.trajectory.duration)


def _through(arm: AnyArm, path: Path, q_start: Array, *, deviation: float, speed: float) -> CertifiedMotion:
    """Return the motion with as few knots as keep the deviation: those of the report's rule, or two, four ... as many.

    All steps are divided alike, since an X-spline through steps of different lengths asks for larger accelerations.
    """
    solver, allowed = solver_of(arm), tolerance(_CORNERS * deviation)
    for halvings in range(_HALVINGS + 1):
        motion = report_path(solver.arm, path, deviation=deviation, speed=speed, finer=2**halvings)
        task = Task(solver, motion, q_start, allowed, allowed, report_spline=True, clock=np.asarray)
        tracking = track(task, motion.progress.times)
        if excess(tracking.error, allowed).max() <= 1:
            check_velocities(task, tracking)
            return slowed_alike(arm, tracking, allowed)
        obstruction = too_far(task, tracking)
    raise path_error(motion, obstruction)
