"""MOVE at work: planning its stages, following them tick by tick, and its guards."""

import math
from collections.abc import Sequence
from typing import NoReturn

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import base_name
from armwright.errors import IncapableArmError
from armwright.kinematics.forward import forward
from armwright.motion.plan import Manner, Obstacle, Stage, StageError, StageGoal, plan
from armwright.motion.trajectory import hold, slowed_together, whole_ticks
from armwright.program.bytecode.instructions import Instruction, MotionKind, StagePlan, stages_of, stages_text
from armwright.program.language.diagnostic import Label
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.language.words import Standard
from armwright.program.vm.contact import comes_down, contact_of, look_out, note_contact, send, stop
from armwright.program.vm.machine import Machine
from armwright.program.vm.move_diagnostics import CODES, stopped, ways_round, where_and_why
from armwright.program.vm.move_request import Goal, MoveRequest, move_request
from armwright.program.vm.process import Activation, Guard, Motion, Process
from armwright.program.vm.recording import Run, RunStage, efforts, peaks_of
from armwright.program.vm.simple_statements import work_out
from armwright.spatial.poses import inverse

# A place this many times farther than the arm reaches was probably typed in another unit.
_OTHER_UNIT = 50.0
# A hand that closed on a frame still stands at it when both are so near [m], and entries of rotations.
_SAME_PLACE = 1e-6
# Planning a MOVE takes as long as so many steps of other kinds, whether it can be made or not.
_STEPS_OF_A_MOVE = 1000


def move(run: Machine, process: Process, step: Instruction) -> None:
    """Plan a MOVE and begin its first stage; in the action of a MOVE, when that one has come to rest."""
    if process.motion is not None and not _made_way(run, process, process.motion, step.span):
        return
    asked = move_request(run, process, step)
    moved = run.name(process, asked.begin.operands[0])
    arm, implied = _carrier(run, process, moved, asked.begin)
    run.claim(process, arm, step.span, moved)
    _one_at_a_time(run, process, arm, step.span)
    run.idle += _STEPS_OF_A_MOVE
    stages = _plan(run, process, asked, arm, moved)
    spelled = run.spelled(moved)
    who = arm if moved == arm else f"{arm} [{spelled}]"
    manner = f"@{asked.speed:g}" if asked.duration is None else f"in {asked.duration:g} s"
    process.motion = Motion(
        arm=arm,
        moved=moved,
        tip=run.tree.relation(moved, arm),
        span=step.span,
        text=f"{who} MOVE: {stages_text(asked.form).replace(' / ', '; ')} {manner}",
        data={"moved": moved, "goal": _goal_name(run, process, asked), "speed": asked.speed, "implied_affix": implied},
        stages=stages,
        speed=asked.speed,
        depth=len(process.stack),
        begun=run.starts(),
        since=run.ticks,
        until=run.ticks,
        guards=asked.guards,
    )
    _start(run, process, process.motion)


def go_on(run: Machine, process: Process) -> None:
    """Follow a motion at a tick at which something may happen: a guard, the end of a stage, the end of the MOVE."""
    motion = process.motion
    assert motion is not None  # noqa: S101 - asked for only then
    for guard in motion.guards:
        if not guard.done and _holds(run, process, motion, guard):
            guard.done = True
            run.set_hand(motion.arm, motion.span)
            now = process.now
            process.stack.append(
                Activation(
                    kind="action",
                    bindings=now.bindings,
                    passing=now.passing,
                    wrote=now.wrote,
                    back=process.at,
                    called=motion.span,
                    locks=len(process.locks),
                )
            )
            process.at = guard.action
            return
    if run.ticks < motion.until:
        process.wake = run.ticks + 1 if any(not guard.done for guard in motion.guards) else motion.until
    elif motion.stages:
        _start(run, process, motion)
    else:
        _finish(run, process, motion)


def halt(run: Machine, process: Process, step: Instruction) -> None:
    """End the motion from inside an action: the arm stops in a controlled way, and the MOVE is over."""
    motion, action = process.motion, process.stack.pop()
    assert action.kind == "action"  # noqa: S101 - procedures that it called have been left
    release(run, process, action.locks)
    process.at = action.back
    if motion is None:
        # An error has stopped the arm before, and a TRY in the action has gone on from there.
        return
    _break_off(run, process, motion, step.span)


def _break_off(run: Machine, process: Process, motion: Motion, span: Span) -> None:
    motion.until = process.wake = stop(run, process, span)
    motion.stages, motion.guards = [], []
    motion.data["halted"] = True
    motion.text += "; halted"


def _made_way(run: Machine, process: Process, motion: Motion, span: Span) -> bool:
    """Whether the MOVE around an action is over, so that another can begin; its arm is brought to rest before."""
    if motion.data.get("halted"):
        _finish(run, process, motion)
        return True
    _break_off(run, process, motion, span)
    # When the arm is at rest the same instruction is looked at again.
    process.at -= 1
    return False


def release(run: Machine, process: Process, keep: int) -> None:
    """Give back the locks that a process took after its first ``keep``; whoever waits for one looks again."""
    for name in process.locks[keep:]:
        if name not in process.locks[:keep]:
            run.locks.pop(name, None)
    del process.locks[keep:]
    for other in run.processes:
        if other.waiting and other.waiting.what == "locks":
            other.waiting, other.wake = None, run.ticks


# ---- planning ------------------------------------------------------------------------------------------------------


def _goal_name(run: Machine, process: Process, asked: MoveRequest) -> str:
    goal = asked.begin.operands[1]
    return run.name(process, goal) if run.names_variable(process, goal) else asked.form.goal


def _carrier(run: Machine, process: Process, moved: str, begin: Instruction) -> tuple[str, bool]:
    """Return the arm that carries what is moved, and whether it hangs there only from now on."""
    if is_arm(moved):
        return moved, False
    run.held(moved, begin, process)
    above = run.tree.ancestors(moved)
    if (arm := next((name for name in above if is_arm(name)), None)) is not None:
        return arm, False
    X_WM = run.tree.world(moved)
    for name, hand in run.hands.items():
        if hand.holds == moved and np.allclose(run.tree.world(name), X_WM, rtol=0, atol=_SAME_PLACE):
            run.grow(run.tree.affix(moved, name), moved, begin.span)
            return name, True
    return _not_carried(run, process, moved, begin, above[0])


def _not_carried(run: Machine, process: Process, moved: str, begin: Instruction, above: str) -> NoReturn:
    spelled = run.spelled(moved)
    where = [Label(run.written[moved], f"{spelled} got its place here")] if moved in run.written else []
    run.fail(
        process,
        "E301",
        f"`{spelled}` cannot be moved: it is not affixed to an arm",
        begin.span,
        f"hangs on {run.spelled(above)}, not on an arm",
        secondary=where,
        helps=[f"grasp it and write `AFFIX {spelled} TO {process.last_arm or min(run.cell.arms, default='ARM_1')}`"],
    )


def _one_at_a_time(run: Machine, process: Process, arm: str, span: Span) -> None:
    """See to it that no process around this one is in the middle of a MOVE of the same arm, with an action of that.

    Raises:
        RunError: one is.
    """
    other = next((one for one in run.processes if one.motion and one.motion.arm == arm), None)
    if other is None or other.motion is None:
        return
    text = f"{arm} cannot begin a MOVE in {process.title} before that of {other.title} is over"
    on_its_way = Label(other.motion.span, f"{arm} is on this way")
    run.fail(process, "E503", text, span, "begins in the middle of the other", secondary=[on_its_way])


def _plan(
    run: Machine, process: Process, asked: MoveRequest, arm: str, moved: str
) -> list[tuple[Stage, tuple[str, ...]]]:
    """Return the stages of a MOVE with the names of where they lead.

    Source:
        TR-83-008, third paper: ARM-1' = Base^-1 f2 f1^-1, where f1 is the relation from the arm to it.
    """
    cell, place = run.cell, run.cell.arms[arm]
    plans = stages_of(asked.form)
    X_BW = inverse(run.tree.world(base_name(arm)))
    X_MH = inverse(run.tree.relation(moved, arm))
    goals = [
        StageGoal(
            kind=one.kind.value,
            poses=np.stack([X_BW @ _pose(run, process, asked.goals[label]) @ X_MH for label in one.frames]),
            blend=asked.blend,
            corner=cell.corner_room if one.kind is MotionKind.SPLINE and run.code.standard is Standard.RLO_2 else None,
        )
        for one in plans
    ]
    manner = Manner(speed=asked.speed, deviation=cell.deviation, period=cell.period, around=cell.around)
    try:
        stages = plan(place.arm, run.hardware.posture(arm, run.now), goals, manner)
    except StageError as error:
        _fail_move(run, process, error.obstacle, asked=asked, stage=plans[error.stage], arm=arm)
    except IncapableArmError as error:
        run.fail(process, "E406", f"{arm} cannot make this MOVE at any speed: {error}", asked.span, "asked for here")
    if asked.duration is not None:
        stages = _timed(run, process, asked, stages)
    return [(stage, one.frames) for stage, one in zip(stages, plans, strict=True)]


def _pose(run: Machine, process: Process, goal: Goal) -> Array:
    return run.pose(process, goal.operand, goal.step)


def _timed(run: Machine, process: Process, asked: MoveRequest, stages: Sequence[Stage]) -> list[Stage]:
    """Return the stages slowed so that the whole MOVE takes as long as was asked for."""
    asked_for, least = asked.duration, sum(stage.trajectory.duration for stage in stages)
    assert asked_for is not None  # noqa: S101 - asked for only then
    if asked_for < least - run.cell.period:
        text = f"this MOVE cannot be done in {asked_for:g} s"
        run.fail(process, "E405", text, asked.span, f"it takes {least:.3f} s or more")
    if not least:
        # Nothing is to be moved: the arm stands still for so long.
        still = hold(stages[0].trajectory(0.0), asked_for)
        return [attrs.evolve(stages[0], trajectory=whole_ticks(still, run.cell.period)), *stages[1:]]
    slow = slowed_together([stage.trajectory for stage in stages], asked_for, run.cell.period)
    # What kept a stage slow does so no more where it is to take longer.
    longer = asked_for > least + run.cell.period
    return [
        attrs.evolve(stage, trajectory=one, slowed="" if longer else stage.slowed)
        for stage, one in zip(stages, slow, strict=True)
    ]


def _fail_move(
    run: Machine, process: Process, obstacle: Obstacle, *, asked: MoveRequest, stage: StagePlan, arm: str
) -> NoReturn:
    label = stage.frames[min(obstacle.pose, len(stage.frames) - 1)]
    goal, kind = asked.goals[label], stage.kind.value
    secondary = []
    if run.names_variable(process, goal.operand) and (name := run.name(process, goal.operand)) in run.written:
        secondary.append(Label(run.written[name], f"`{label}` got its place here"))
    run.fail(
        process,
        CODES[obstacle.cause],
        stopped(obstacle, label, arm, run.cell.arms[arm].arm),
        goal.step.span,
        "cannot be reached",
        secondary=secondary,
        notes=(where_and_why(obstacle, kind, stage.frames, arm),),
        helps=(*_other_unit(run, process, goal, arm), *ways_round(obstacle, kind, run.cell.around)),
    )


def _other_unit(run: Machine, process: Process, goal: Goal, arm: str) -> tuple[str, ...]:
    """Say what lengths are counted in, where a place so far off can only be meant in another unit."""
    X_BW = inverse(run.tree.world(base_name(arm)))
    away = np.linalg.norm((X_BW @ _pose(run, process, goal))[:3, 3])
    if away <= _OTHER_UNIT * run.cell.arms[arm].arm.reach:
        return ()
    unit = {"M": "metres", "MM": "millimetres", "CM": "centimetres", "IN": "inches"}[run.code.units.length]
    return (f"`{goal.label}` is {away:.4g} m away: lengths in this program are {unit}",)


# ---- on the way ----------------------------------------------------------------------------------------------------


def _start(run: Machine, process: Process, motion: Motion) -> None:
    """Begin the next stage of a motion."""
    stage, to = motion.stages.pop(0)
    arm, period = run.cell.arms[motion.arm].arm, run.cell.period
    trajectory = stage.trajectory
    ticks = round(trajectory.duration / period)
    # A run that lasts longer comes to its end before.
    counted = min(ticks, math.ceil(max(0.0, run.limits.time - run.now) / period))
    if motion.record >= 0:
        note_contact(run, motion)
    push = send(run, motion, trajectory)
    tau = efforts(arm, trajectory, period, push, counted)
    look_out(run, motion)
    touch = run.hardware.touches_at(motion.arm)
    if not motion.guards and (touch is not None or motion.alarm is not None):
        send(run, motion, hold(trajectory(0.0), period))
        motion.alarm = None
        comes_down(run, process, motion, to[-1])
    if touch is not None:
        motion.touch = (trajectory, touch - run.now)
    motion.record, (peak, when) = len(run.stages), peaks_of(tau, period)
    run.stages.append(
        RunStage(
            t0=run.now,
            arm=motion.arm,
            span=motion.span,
            to=to,
            speed=motion.speed,
            stage=stage,
            motion=trajectory,
            length=stage.length,
            peak_effort=peak,
            peak_time=when,
        )
    )
    run.runs[motion.arm].append(Run(t0=run.now, trajectory=trajectory, duration=trajectory.duration, tau=tau))
    motion.since, motion.until = run.ticks, run.ticks + ticks
    if any(guard.looks for guard in motion.guards):
        looks = np.arange(counted + 1) * period
        X_WB = run.tree.world(base_name(motion.arm))
        motion.hands = X_WB @ forward(arm, trajectory(looks))
    process.wake = run.ticks if motion.guards else motion.until


def _holds(run: Machine, process: Process, motion: Motion, guard: Guard) -> bool:
    """Whether the condition of a guard holds now, with the arm where it is now."""
    tree, now = run.tree, process.now
    if guard.looks and len(motion.hands):
        at = min(run.ticks - motion.since, len(motion.hands) - 1)
        run.tree = tree.place(motion.arm, motion.hands[at])
    process.stack.append(Activation(kind="condition", bindings=now.bindings, passing=now.passing, wrote=now.wrote))
    work_out(run, process, run.code.instructions, guard.condition)
    process.stack.pop()
    run.tree = tree
    return bool(now.passing[guard.truth])


def _finish(run: Machine, process: Process, motion: Motion) -> None:
    """The MOVE is over: the frame table and the trace know where the arm is."""
    arm = motion.arm
    run.set_hand(arm, motion.span)
    hand = run.hands[arm]
    goal = str(motion.data["goal"])
    reached = not motion.data.get("halted") and run.has_place(goal)
    hand.at = motion.moved if motion.moved != arm else goal if reached else None
    if hand.holds and hand.holds != hand.at and arm not in run.tree.ancestors(hand.holds):
        hand.holds = None
    note_contact(run, motion)
    words, contact = contact_of(motion)
    data = {**motion.data, **contact}
    run.effect(process, "MOVE", motion.text + words, motion.span, since=motion.begun, arm=arm, data=data)
    process.motion = None
