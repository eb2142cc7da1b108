"""MOVEs to frames that move by themselves: planning them, and the arms that follow such frames when they are over."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from armwright.arm.reach import tool_speed_of
from armwright.arrays import Array, Flags
from armwright.cell.hardware import Mishap
from armwright.cell.moving_frames import MovingFrame
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.moving_goal import CarriedPose, MovingGoalError, Start, Way, pursue
from armwright.motion.plan import PlannedStage, tool_path_length
from armwright.motion.solver import AnyArm
from armwright.motion.trajectory import Trajectory
from armwright.program.language.source import Span
from armwright.program.language.units import HIGHEST_SPEED
from armwright.program.vm.contact import stop_arm
from armwright.program.vm.machine import Machine
from armwright.program.vm.move_diagnostics import collision_advice, collision_message
from armwright.program.vm.move_request import MoveRequest
from armwright.program.vm.process import Motion, Process, Tracking
from armwright.program.vm.recording import peak_efforts
from armwright.spatial.poses import inverse

# How far ahead a moving frame is looked at, and how closely [s]; halvings of that until a time is exact.
_AHEAD, _STEP, _HALVINGS = 600.0, 0.01, 40
# A place this far beyond the end of the window is in it [m].
_AT_END = 1e-9
# A quintic is so many times as fast as an even motion.
_QUINTIC = 1.875


def plan_tracking(
    machine: Machine, process: Process, request: MoveRequest, arm_moved: tuple[str, str], planner: AnyArm
) -> tuple[PlannedStage, Tracking]:
    """Return the stage of a MOVE to a goal that goes with a moving frame, and how the arm follows that.

    Args:
        machine: that runs the program.
        process: that makes the MOVE.
        request: the MOVE.
        arm_moved: the arm, and what it moves.
        planner: the functions of the arm.

    Raises:
        RunError: the goal is not in the window of the frame, or the arm cannot come to it there.
    """
    assert request.tracked is not None  # noqa: S101 - asked for only then
    arm, moved = arm_moved
    name, goal, now = request.tracked, request.goals[request.form.goal], machine.now
    frame, model, base = machine.cell.moving_frames[name], machine.cell.arms[arm].arm, machine.base_pose(arm)
    X_BW = inverse(base)
    X_WG = machine.read_pose(process, goal.operand, goal.span)
    X_WT = X_WG @ inverse(machine.state.tree.relation(moved, arm))
    wait, end = _in_window(machine, process, request, frame, frame.place(X_WG[:3, 3]))
    target = _carried(frame, X_BW @ X_WT, X_BW, now)
    start = _start(machine, arm, X_BW)
    distance = float(np.linalg.norm(target.pose[:3, 3] - start.carried.pose[:3, 3]))
    rests = end is None
    stands = frame.rests_from
    last = max(0.0, (stands or 0.0) - now) if end is None else end
    way = Way(
        wait=wait,
        end=last,
        rests=rests,
        cuts=frame.joints - now,
        shortest=_QUINTIC * distance / tool_speed_of(model),
        slower=HIGHEST_SPEED / request.speed,
        period=machine.cell.period,
        fixed=request.duration,
    )
    try:
        found = pursue(planner, start, target, way)
    except MovingGoalError as error:
        text = f"{arm} cannot track `{goal.label}` on `{machine.spelling(name)}`"
        helps = ["move the arm nearer to where the frame comes first, or make the window longer"]
        raise machine.error(
            process, "E409", text, goal.span, "cannot be come to", notes=[str(error)], helps=helps
        ) from None
    period = machine.cell.period
    length = tool_path_length(planner, found.trajectory)
    stage = PlannedStage(kind="TRACK", trajectory=found.trajectory, length=length)
    follows = None if rests and not found.cut else round(found.end / period)
    X_FT = inverse(frame.pose_at(now)) @ X_WT
    cut = found.cut or (f"it has done so for {_AHEAD:g} s" if end == _AHEAD else "")
    return stage, Tracking(name, X_FT, round(found.reached / period), follows, cut)


def _start(machine: Machine, arm: str, X_BW: Array) -> Start:
    """Return what an arm does now: it rests, or follows a frame."""
    q = machine.hardware.sent_configuration(arm, machine.now)
    motion = machine.state.following.get(arm)
    if motion is None or motion.tracking is None:
        X_BT = forward(machine.cell.arms[arm].arm, q)
        return Start(q, np.zeros_like(q), CarriedPose.at_rest(X_BT))
    frame, run = machine.cell.moving_frames[motion.tracking.frame], machine.state.segments[arm][-1]
    X_BT = X_BW @ frame.pose_at(machine.now) @ motion.tracking.X_FT
    return Start(q, run.trajectory(machine.now - run.t0, 1), _carried(frame, X_BT, X_BW, machine.now))


def _carried(frame: MovingFrame, X_BT: Array, X_BW: Array, now: float) -> CarriedPose:
    """Return a pose that goes with a frame from now on."""
    come = frame.travel(np.array([now]))
    return CarriedPose(X_BT, X_BW[:3, :3] @ frame.direction, lambda t: frame.travel(now + t) - come)


def _in_window(
    machine: Machine, process: Process, request: MoveRequest, frame: MovingFrame, place: float
) -> tuple[float, float | None]:
    """Return from when until when a place along a moving frame is in its window [s], from now on.

    The end is None where it stands in there at last.

    Raises:
        RunError: it never is.
    """
    now, (low, high) = machine.now, frame.window
    come = frame.travel(np.array([now]))

    def inside(t: Array) -> Flags:
        places = place + frame.travel(now + t) - come
        return np.asarray((places >= low - _AT_END) & (places <= high + _AT_END))

    t = np.arange(0.0, _AHEAD, _STEP)
    is_inside = inside(t)
    if not is_inside.any():
        goal, spelled = request.goals[request.form.goal], machine.spelling(request.tracked or "")
        where = f"it is at {place * 1e3:.1f} mm, the window from {low * 1e3:g} to {high * 1e3:g} mm along the motion"
        text = f"`{goal.label}` does not come into the window of `{spelled}`"
        raise machine.error(process, "E408", text, goal.span, "not to be tracked", notes=[where])
    first = int(is_inside.argmax())
    begin = 0.0 if first == 0 else _change(inside, t[first - 1], t[first])
    outside = np.flatnonzero(~is_inside[first:])
    if len(outside):
        last = first + int(outside[0])
        return begin, _change(inside, t[last], t[last - 1])
    stands = frame.rests_from
    return begin, None if stands is not None and stands - now < _AHEAD else _AHEAD


def _change(inside: Callable[[Array], Flags], out: float, within: float) -> float:
    """Return the time in the window next to one outside of it."""
    for _ in range(_HALVINGS):
        middle = (out + within) / 2
        out, within = (out, middle) if inside(np.array([middle]))[0] else (middle, within)
    return within


def follow(machine: Machine, motion: Motion) -> None:
    """Let an arm follow the frame that its MOVE, which is over, has come to."""
    if motion.tracking is not None and motion.early_end is None:
        machine.state.following[motion.arm] = motion


def leave_frame(machine: Machine, arm: str) -> bool:
    """Let an arm follow a frame, or its queue, no more, since it begins another motion on the way.

    Returns:
        Whether what it did began only now.
    """
    motion = machine.state.following.pop(arm, None)
    if motion is None:
        return False
    runs = machine.state.segments[arm]
    local = min(machine.now - runs[-1].t0, runs[-1].duration)
    if local == 0:
        return True
    done = runs[-1].trajectory.until(local)
    runs[-1] = attrs.evolve(runs[-1], duration=local)
    stage, model = machine.state.stages[motion.stage_index], machine.cell.arms[arm].arm
    length, tau = tool_path_length(model, done), runs[-1].tau
    if tau is not None:
        peak, when = peak_efforts(model, tau[: round(local / machine.cell.period) + 1], machine.cell.period)
        stage = attrs.evolve(stage, peak_effort=peak, peak_time=when)
    machine.state.stages[motion.stage_index] = attrs.evolve(stage, motion=done, length=length)
    return False


def rest_of_following(machine: Machine, arm: str) -> Trajectory | None:
    """Return how an arm goes on that follows a frame; None where it follows none."""
    if arm not in machine.state.following:
        return None
    run = machine.state.segments[arm][-1]
    return run.trajectory.after(machine.now - run.t0)


def stop_following(machine: Machine, process: Process, arm: str, span: Span) -> int:
    """Stop an arm that follows a frame, on its path; return when it is at rest [ticks]."""
    motion = machine.state.following.pop(arm)
    process.motion, kept = motion, process.motion
    end = stop_arm(machine, process, span)
    process.motion = kept
    machine.record_effect(process, "STOP", f"{arm} stops", span, until=end, arm=arm)
    return end


def stop_all_following(machine: Machine, process: Process, span: Span) -> int:
    """Stop the arms of a process that follow frames; return when they are at rest [ticks]."""
    following, queues = machine.state.following, machine.state.queues
    mine = [arm for arm in following if process in machine.state.owners.get(arm, ())]
    # A branch may put frames into a queue that another process has opened, and that goes on.
    arms = [arm for arm in mine if arm in process.queues or arm not in queues]
    return max((stop_following(machine, process, arm, span) for arm in arms), default=machine.state.ticks)


def next_loss(machine: Machine) -> tuple[int, str] | None:
    """Return when the next arm can follow its frame or queue no longer [ticks], and which; None where all can."""
    losses = []
    for arm, motion in machine.state.following.items():
        if motion.threat is not None:
            losses.append((motion.threat.tick, arm))
        if motion.tracking is not None and motion.tracking.end is not None:
            losses.append((motion.stage_start_tick + motion.tracking.end, arm))
    return min(losses, default=None)


def lose_frame(machine: Machine, process: Process, arm: str) -> Mishap:
    """Stop an arm whose frame or queue can be followed no longer, and say so."""
    motion = machine.state.following[arm]
    if (threat := motion.threat) is not None:
        stop_following(machine, process, arm, motion.span)
        text = collision_message(threat.collision, machine.spelling(motion.goal), arm)
        label = f"{threat.stopped} was to be elsewhere by then, but it has been stopped"
        return Mishap(machine.now, arm, "E406", text, label, tuple(collision_advice(threat.collision, arm)))
    assert motion.tracking is not None  # noqa: S101 - it follows a frame
    frame, cut, goal = machine.spelling(motion.tracking.frame), motion.tracking.cut, machine.spelling(motion.goal)
    stop_following(machine, process, arm, motion.span)
    time, helps = (
        machine.now,
        ("track with the next MOVE, or go away, before that", "RECOVER (MOTION) goes on from there"),
    )
    if cut:
        text = f"{arm} cannot follow `{goal}` on `{frame}` any further: {cut}"
        return Mishap(time, arm, "E409", text, "the arm stops meanwhile", helps)
    text = f"`{goal}` has left the window of `{frame}` while {arm} follows it"
    return Mishap(time, arm, "E408", text, "the arm stops meanwhile", helps)
