"""Arms that are stopped on their path: within their limits, along their paths, and what they press on meanwhile."""

import math
from typing import NoReturn

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import Press
from armwright.cell.model import base_name
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.controlled_stop import brake
from armwright.motion.plan import hand_length
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.program.language.source import Span
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Motion, Process
from armwright.program.vm.recording import Push, Run, efforts, peaks_of

# A duration so little too short is rounding.
_ROUNDING = 1e-9
# A speed that is advised leaves this part of the depth in hand.
_IN_HAND = 0.8
_SLOWEST = 1.0


def stop(machine: Machine, process: Process, span: Span) -> int:
    """Stop the arm of a process under control; return when it is at rest [ticks].

    The frame table holds the pose where it comes to rest from now on. An arm that is being stopped already is left to
    it.
    """
    motion, period = process.motion, machine.cell.period
    assert motion is not None  # noqa: S101 - asked for only then
    if motion.rest is None:
        note_contact(machine, motion)
        runs = machine.state.runs[motion.arm]
        local = machine.now - runs[-1].t0 if runs else 0.0
        motion.rest = machine.state.ticks
        if runs and local < runs[-1].duration - _ROUNDING:
            motion.rest += _stop_on_the_way(machine, motion, local)
        else:
            _begin(machine, motion, hold(machine.hardware.configuration(motion.arm, machine.now), period))
    end = max(motion.rest, machine.state.ticks)
    machine.set_hand(motion.arm, span, at=end)
    return end


def _stop_on_the_way(machine: Machine, motion: Motion, local: float) -> int:
    """Stop an arm in the middle of its stage; return how many ticks it takes."""
    arm, runs, period = machine.cell.arms[motion.arm].arm, machine.state.runs[motion.arm], machine.cell.period
    last = runs[-1]
    braking = brake(last.trajectory, local, arm.limit("acceleration"), period=period)
    tau = efforts(arm, braking, period, _begin(machine, motion, braking))
    runs[-1] = attrs.evolve(last, duration=local)
    runs.append(Run(t0=machine.now, trajectory=braking, duration=braking.duration, tau=tau))
    if motion.record >= 0:
        done = join([last.trajectory.until(local), braking])
        before = [] if last.tau is None else [last.tau[: round(local / period)]]
        peak, when = peaks_of(np.concatenate([*before, tau]), period)
        machine.state.stages[motion.record] = attrs.evolve(
            machine.state.stages[motion.record],
            motion=done,
            length=hand_length(arm, done),
            peak_effort=peak,
            peak_time=when,
            stopped=True,
        )
    return math.ceil(braking.duration / period - _ROUNDING)


def _begin(machine: Machine, motion: Motion, trajectory: Trajectory) -> Push:
    push = send(machine, motion, trajectory)
    look_out(machine, motion)
    return push


def send(machine: Machine, motion: Motion, trajectory: Trajectory) -> Push:
    """Let the arm of a motion follow a trajectory instead of what it does now; return what will push on its hand."""
    machine.hardware.begin(motion.arm, trajectory, machine.now, motion.tip)
    return _pushed(machine, motion.arm)


def _pushed(machine: Machine, arm: str) -> Push:
    """Check what pushes on the gripper of an arm from now on, and remember it."""
    push = Push(machine.now, machine.hardware.wrenches(arm, machine.now))
    machine.state.pushes[arm].append(push)
    return push


def pushed_otherwise(machine: Machine, arm: str, record: int | None) -> None:
    """Work out anew what the motors of an arm give from now on: what it pressed with may have been released.

    Args:
        machine: that runs the program.
        arm: its name.
        record: number of the stage that it is on; None where it is on none.
    """
    if not any(push.wrenches.any() for push in machine.state.pushes[arm]):
        return
    push, period, last = _pushed(machine, arm), machine.cell.period, machine.state.runs[arm][-1]
    done = round((machine.now - last.t0) / period)
    if last.tau is None or done >= len(last.tau):
        return
    later = Push(last.t0, np.concatenate([np.zeros((done, 6)), push.wrenches]))
    tau = efforts(machine.cell.arms[arm].arm, last.trajectory, period, later, len(last.tau) - 1)
    tau[:done] = last.tau[:done]
    machine.state.runs[arm][-1] = attrs.evolve(last, tau=tau)
    peak, when = peaks_of(tau, period)
    if record is not None:
        machine.state.stages[record] = attrs.evolve(machine.state.stages[record], peak_effort=peak, peak_time=when)


# ---- contact -------------------------------------------------------------------------------------------------------


def look_out(machine: Machine, motion: Motion) -> None:
    """See when an arm presses too deep by what it has begun to do, if it ever does."""
    deep = machine.hardware.too_deep_at(motion.arm)
    motion.alarm = None if deep is None else max(machine.state.ticks, math.ceil(deep / machine.cell.period - _ROUNDING))


def note_contact(machine: Machine, motion: Motion, tick: int | None = None) -> None:
    """Remember how hard an arm has pressed by now, or by a later tick, before it begins something else."""
    pressed = machine.hardware.pressed(motion.arm, machine.now if tick is None else tick * machine.cell.period)
    if pressed.depth > motion.pressed.depth:
        motion.pressed = pressed


def contact_of(motion: Motion) -> tuple[str, dict[str, object]]:
    """Return what the trace says of the contact of a motion, and its facts [m] and [N]; nothing without one."""
    depth, force = motion.pressed
    if depth <= 0:
        return "", {}
    return f"; pressed {_deep(motion.pressed)}", {"contact": {"depth": depth, "force": force}}


def _deep(pressed: Press) -> str:
    return f"{pressed.depth * 1e3:.3g} mm deep, {pressed.force:.3g} N"


def too_deep(machine: Machine, process: Process, motion: Motion) -> NoReturn:
    """Stop an arm that presses deeper than the cell allows, and say so.

    Raises:
        RunError: always.
    """
    motion.alarm = None
    end = stop(machine, process, motion.span)
    note_contact(machine, motion, end)
    # On its path to rest it may come deeper; that is said now.
    motion.alarm = None
    allowed = machine.cell.contact.deepest
    least = _least_depth(machine, motion)
    notes = [f"the arm brakes within its limits; at rest it is pressed {_deep(motion.pressed)}"]
    helps = ["end the MOVE at a smaller force, or use a lower speed"]
    if least is not None and least > allowed:
        text = "at this speed that is unavoidable: even if it brakes from the first contact on, the depth is"
        notes.append(f"{text} {least * 1e3:.3g} mm")
        helps = _slower(motion, allowed / least)
    elif least is not None:
        notes.append(f"if it brakes from the first contact on, the depth is {least * 1e3:.3g} mm")
    raise machine.error(
        process,
        "E404",
        f"`{machine.spelled(motion.moved)}` presses into the plane{_height(machine)} deeper than {allowed * 1e3:g} mm",
        motion.span,
        "this MOVE is stopped there",
        notes=notes,
        helps=helps,
    )


def _slower(motion: Motion, share: float) -> list[str]:
    """Advise a speed for a depth that is this share of the least there is: the depth grows with its square."""
    speed = math.floor(motion.speed * math.sqrt(_IN_HAND * share))
    if speed < _SLOWEST:
        return ["end this MOVE above the plane"]
    return [f"use a lower speed: `WITH SPEED = {speed}`"]


def _least_depth(machine: Machine, motion: Motion) -> float | None:
    """Return how deep a stop from the first servo tick in contact on presses [m]; None where nothing came down."""
    if motion.touch is None or machine.cell.contact.height is None:
        return None
    trajectory, local = motion.touch
    cell_arm, period = machine.cell.arms[motion.arm], machine.cell.period
    tick = min(math.ceil(local / period - _ROUNDING) * period, trajectory.duration)
    braking = brake(trajectory, tick, cell_arm.arm.limit("acceleration"), period=period)
    q: Array = braking(np.arange(round(braking.duration / period) + 1) * period)
    X_WT = machine.state.tree.world(base_name(motion.arm)) @ forward(cell_arm.arm, q) @ motion.tip
    return machine.cell.contact.height - float(X_WT[:, 2, 3].min())


def comes_down(machine: Machine, process: Process, motion: Motion, to: str) -> NoReturn:
    """Refuse a stage that would come down on the plane, or press too deep into it, where no ON looks out for that.

    Raises:
        RunError: always.
    """
    raise machine.error(
        process,
        "E404",
        f"`{machine.spelled(motion.moved)}` would enter the plane{_height(machine)} on its path to `{to}`",
        motion.span,
        "this MOVE has no ON that ends it at the contact",
        helps=["guard the motion: `ON FORCE(Z) > 10 DO HALT`"],
    )


def _height(machine: Machine) -> str:
    plane = machine.cell.contact.height
    return "" if plane is None else f" at z = {plane * 1e3:g} mm"
