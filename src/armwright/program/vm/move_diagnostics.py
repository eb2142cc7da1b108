"""Obstacles of motions and their detours, in the words of the program: poses, causes, costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import counted
from armwright.motion.detour import Detour
from armwright.motion.limited import limited_label, limited_motion
from armwright.motion.plan import Obstacle
from armwright.program.language.diagnostic import Diagnostic, Severity
from armwright.program.vm.recording import RunStage

if TYPE_CHECKING:
    from armwright.physics.collisions import Collision
    from armwright.physics.planner import PlannedPath

CODES = {"reach": "E401", "limits": "E402", "singular": "E403"}
_GOAL_MESSAGES = {
    "reach": "`{goal}` is out of reach of {arm}",
    "limits": "`{goal}` cannot be reached by {arm} inside its joint limits",
    "singular": "`{goal}` cannot be reached by {arm} on this path: the arm is singular there",
}
_PATH_MESSAGES = {
    "reach": "the path to `{goal}` leads out of the reach of {arm}",
    "limits": "the path to `{goal}` leads {joint} of {arm} beyond its limits",
    "singular": "`{goal}` cannot be reached by {arm} on this path: the arm is singular on the path",
}
# Farther away nobody counts tenths [mm].
_LARGE_COORDINATE = 1e6
_THROUGH_FRAMES = ("SPLINE", "BLEND", "ARC")
_METHODS = {"via": "by a via pose", "damped": "by damped least squares"}


def obstacle_message(obstacle: Obstacle, goal: str, name: str, arm: Arm) -> str:
    """Return the message of an error: the obstacle of an arm, of that name, on its path to a frame."""
    texts = _GOAL_MESSAGES if obstacle.certain else _PATH_MESSAGES
    joint = "a joint" if obstacle.joint is None else arm.joint_label(obstacle.joint - 1)
    return texts[obstacle.cause].format(goal=goal, arm=name, joint=joint)


def obstacle_location(obstacle: Obstacle, kind: str, goal_names: Sequence[str], arm: str) -> str:
    """Return the location on the path, in space, and the reason.

    Args:
        obstacle: what stops the stage.
        kind: of the stage: ``PTP``, ``LINE``, ``SPLINE``, ``BLEND`` or ``ARC``.
        goal_names: the frames it goes to, as the program spells them.
        arm: name of the arm.
    """
    position = f"{_position(obstacle.place)} mm from the base of {arm}"
    if obstacle.along is None or obstacle.length is None or obstacle.certain:
        return f"at {position}: {obstacle.reason}"
    part = f"{obstacle.fraction * 100:.0f} % of the path"
    if kind in _THROUGH_FRAMES:
        before = "the start" if obstacle.pose == 0 else f"`{goal_names[obstacle.pose - 1]}`"
        part += f" from {before} (segment {obstacle.pose + 1} of {len(goal_names)})"
    return f"{part}, {obstacle.along * 1e3:.1f} of {obstacle.length * 1e3:.1f} mm, at {position}: {obstacle.reason}"


def detour_advice(obstacle: Obstacle, kind: str, around: str | None, *, bypassed: bool = True) -> tuple[str, ...]:
    """Return advice for a path that is stopped: how to search for a detour, or that there is none.

    Args:
        obstacle: what stops the stage.
        kind: of the stage: ``PTP``, ``LINE``, ``SPLINE``, ``BLEND`` or ``ARC``.
        around: method by which a detour was searched for; None where none was.
        bypassed: whether lines of this MOVE have detours.
    """
    if obstacle.certain or kind == "PTP":
        return ()
    if not bypassed:
        return ("a line that is shaped or corrected has no detours; go there by other frames",)
    if kind in _THROUGH_FRAMES:
        advice = "another VIA, or straight moves from frame to frame"
        return (f"`--around` has no detours for a path through several frames; try {advice}",)
    if around is None:
        return ("`armwright run --around via` searches for a detour",)
    other = "`--around via` searches a wider region" if around == "damped" else "try a VIA in the program"
    return (f"no detour {_METHODS[around]} was found on which the whole MOVE is feasible; {other}",)


def collision_message(collision: Collision, goal: str, arm: str) -> str:
    """Return the message of an error: what an arm would run into on its path to a frame."""
    own, other = collision.bodies
    deep = f"{collision.depth * 1e3:.2g} mm deep"
    if collision.at_start:
        return f"`{goal}` cannot be reached by {arm}: {own} touches {other} before it moves, {deep}"
    where = "after it has arrived" if collision.at_rest else f"{collision.fraction * 100:.0f} % of the way there"
    meets = f"{other} would hit {own}" if collision.at_rest else f"{own} would hit {other}"
    if collision.depth <= 0:
        from armwright.physics.clearance import RESOLUTION  # noqa: PLC0415 - of few runs

        near = f"nearer than {RESOLUTION * 1e3:g} mm, which counts as a hit"
        return f"`{goal}` cannot be reached by {arm} on this path: {own} would come to {other} {where}, {near}"
    return f"`{goal}` cannot be reached by {arm} on this path: {meets} {where}, {deep}"


def collision_location(collision: Collision, begin: float) -> list[str]:
    """Return where in the world and when an arm would run into something, and what is known of the solids.

    Args:
        collision: what it would run into.
        begin: when the motion begins that was looked at [s].
    """
    own, other = collision.bodies
    when = "" if collision.at_start else f", at {begin + collision.time:.3f} s"
    notes = [f"at {_position(collision.point)} mm in the world{when}"]
    if collision.guessed:
        notes.append(f"the shape of {own} or {other} is a guess: the arm file has no exact solid of it")
    return notes


def collision_advice(collision: Collision, arm: str) -> list[str]:
    """Return what may help against a collision."""
    own, other = collision.bodies
    if collision.at_start:
        return [f"start {arm} where {own} and {other} are apart, or correct their poses and sizes in the cell"]
    if collision.other_arm is not None:
        return [f"let the arms take turns: WAIT for an EVENT that tells that {collision.other_arm} is out of the way"]
    come, leave = "come from above `WITH APPROACH`", "leave `WITH DEPARTURE`"
    return [f"{come}, {leave}, or go another way by `VIA`; another configuration at the start may help too"]


def clearance_warning(run: RunStage, wanted: float) -> Diagnostic | None:
    """Return the warning about a stage that comes nearer to other bodies than is wanted [m]; None where it does not."""
    clearance = run.clearance
    if clearance is None or clearance.distance is None or clearance.distance >= wanted:
        return None
    own, other = clearance.bodies
    return Diagnostic(
        code="W404",
        severity=Severity.WARNING,
        message=f"{own} of {run.arm} comes within {clearance.distance * 1e3:.1f} mm of {other} on the way to "
        f"`{run.goal_names[-1]}`",
        span=run.span,
        label=f"at {run.t0 + clearance.time:.3f} s; the cell wants {wanted * 1e3:g} mm",
        notes=(f"at {_position(np.array(clearance.point))} mm in the world",),
        helps=("a path farther away, by VIA, or a smaller `clearance_mm` under [motion] of the cell",),
    )


def speed_warning(run: RunStage, arm: Arm) -> Diagnostic | None:
    """Return the warning about a stage whose tool is slower than was asked for; None where the arm could do that."""
    if run.stage.unmet is None:
        return None
    asked, reached = run.stage.unmet
    what, got = f"at {asked.speed * 1e3:g} mm/s", f"{reached.speed * 1e3:.4g} mm/s"
    if not math.isfinite(asked.speed):
        what, got = f"at {np.degrees(asked.rotation):g} deg/s", f"{np.degrees(reached.rotation):.4g} deg/s"
    uses = limited_motion(arm, run.stage.trajectory).peaks(1) / arm.all_limits.speed
    joint = int(uses.argmax())
    limit = f"the speed limit of {limited_label(arm, joint)}"
    if math.isfinite(asked.speed) and asked.speed > arm.tool_speed and run.stage.kind != "PTP":
        limit = f"the largest speed of its tool, {arm.tool_speed * 1e3:.4g} mm/s"
    return Diagnostic(
        code="W405",
        severity=Severity.WARNING,
        message=f"{run.arm} cannot move {what} on the way to `{run.goal_names[-1]}`: it reaches {got}",
        span=run.span,
        label=f"begun at {run.t0:.3f} s",
        notes=(f"its limit is {limit}",),
        helps=("ask for less, or move nearer to the middle of its reach",),
    )


def path_text(path: PlannedPath) -> str:
    """Return how a path past other bodies was planned."""
    corners = len(path.waypoints) - 2
    by = f"by {counted(corners, 'rounded corner')}" if corners else "straight to another configuration"
    return f"a path past other bodies was planned {by}, with {counted(path.checked, 'checked configuration')}"


def detour_course(detour: Detour, arm: str) -> str:
    """Return the course of a detour."""
    if detour.via is None:
        return "the tool follows the line by damped least squares, and deviates where the arm is nearly singular"
    return f"the tool stops at a via pose at {_position(detour.via[:3, 3])} mm from the base of {arm}"


def stage_obstacle(run: RunStage) -> str:
    """Return where a stage could not follow the path that was requested, and why; empty where it did."""
    obstacle = run.stage.obstacle
    return "" if obstacle is None else obstacle_location(obstacle, run.stage.kind, run.goal_names, run.arm)


def obstacle_warning(run: RunStage) -> Diagnostic | None:
    """Return the warning about a stage that could not follow the path that was requested; None where it did.

    Either it leaves its straight line by a detour, or it stops at all of its frames, because it cannot go past them.
    """
    obstacle, detour = run.stage.obstacle, run.stage.detour
    if obstacle is None:
        return None
    goal, where, begun = run.goal_names[-1], stage_obstacle(run), f"begun at {run.t0:.3f} s"
    if detour is None:
        return Diagnostic(
            code="W403",
            severity=Severity.WARNING,
            message=f"{run.arm} stops at every frame on the way to `{goal}`: it cannot follow rounded corners",
            span=run.span,
            label=begun,
            notes=(f"without stops the path is infeasible at {where}",),
            helps=("a frame farther from that position, or another initial configuration, may need no stops",),
        )
    return Diagnostic(
        code="W402",
        severity=Severity.WARNING,
        message=f"{run.arm} leaves the straight line to `{goal}`, {_METHODS[detour.method]}: {detour.price}",
        span=run.span,
        label=f"infeasible at {obstacle.fraction * 100:.0f} % of the path; {begun}",
        notes=(f"the line is infeasible at {where}", detour_course(detour, run.arm)),
    )


def _position(p: Array) -> str:
    return f"({', '.join(f'{x:.1f}' if abs(x) < _LARGE_COORDINATE else f'{x:.4g}' for x in (p * 1e3).tolist())})"
