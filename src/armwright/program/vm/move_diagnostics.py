"""What stops a motion, and how it goes round, in the words of the program: places, causes, prices."""

from collections.abc import Sequence

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.detour import Detour
from armwright.motion.plan import Obstacle
from armwright.program.language.diagnostic import Diagnostic, Severity
from armwright.program.vm.recording import RunStage

CODES = {"reach": "E401", "limits": "E402", "singular": "E403"}
_ITSELF = {
    "reach": "`{goal}` is out of reach of {arm}",
    "limits": "`{goal}` cannot be reached by {arm} inside its joint limits",
    "singular": "`{goal}` cannot be reached by {arm} on this path: the arm is singular there",
}
_ON_THE_WAY = {
    "reach": "the way to `{goal}` leads out of what {arm} can reach",
    "limits": "the way to `{goal}` leads {joint} of {arm} beyond its limits",
    "singular": "`{goal}` cannot be reached by {arm} on this path: the arm is singular on the way",
}
# Farther away nobody counts tenths [mm].
_FAR = 1e6
_THROUGH_FRAMES = ("SPLINE", "BLEND")
_METHODS = {"via": "by a via pose", "damped": "by damped rates"}


def stopped(obstacle: Obstacle, goal: str, name: str, arm: Arm) -> str:
    """Return the message of an error: what stops an arm, of that name, on its way to a frame."""
    texts = _ITSELF if obstacle.certain else _ON_THE_WAY
    joint = "a joint" if obstacle.joint is None else arm.called(obstacle.joint - 1)
    return texts[obstacle.cause].format(goal=goal, arm=name, joint=joint)


def where_and_why(obstacle: Obstacle, kind: str, to: Sequence[str], arm: str) -> str:
    """Return the place on the path, in space, and the reason.

    Args:
        obstacle: what stops the stage.
        kind: of the stage: ``PTP``, ``LINE``, ``SPLINE`` or ``BLEND``.
        to: the frames it goes to, as the program spells them.
        arm: name of the arm.
    """
    position = f"at {_place(obstacle.place)} mm from the base of {arm}"
    if obstacle.along is None or obstacle.length is None or obstacle.certain:
        return f"{position}: {obstacle.reason}"
    way = f"{obstacle.fraction * 100:.0f} % of the way there"
    if kind in _THROUGH_FRAMES:
        before = "where the hand was" if obstacle.pose == 0 else f"`{to[obstacle.pose - 1]}`"
        way += f" from {before} (way {obstacle.pose + 1} of {len(to)})"
    return f"{way}, {obstacle.along * 1e3:.1f} of {obstacle.length * 1e3:.1f} mm, {position}: {obstacle.reason}"


def ways_round(obstacle: Obstacle, kind: str, around: str | None) -> tuple[str, ...]:
    """Return advice for a way that is stopped: how to look for another, or that there is none.

    Args:
        obstacle: what stops the stage.
        kind: of the stage: ``PTP``, ``LINE``, ``SPLINE`` or ``BLEND``.
        around: how a way round was looked for; None where it was not.
    """
    if obstacle.certain or kind == "PTP":
        return ()
    if kind in _THROUGH_FRAMES:
        advice = "another VIA, or straight moves from frame to frame"
        return (f"a way through several frames is not gone round by `--around`; {advice} may do",)
    if around is None:
        return ("`armwright run --around via` looks for a way round",)
    other = "`--around via` looks further" if around == "damped" else "a VIA of the program may lead farther round"
    return (f"no way round {_METHODS[around]} was found on which the whole MOVE could be made; {other}",)


def _lead(detour: Detour, arm: str) -> str:
    """Return where a way round leads."""
    if detour.via is None:
        return "the hand follows the line by damped rates, and leaves it where the arm is nearly singular"
    return f"the hand stops on its way at a via pose at {_place(detour.via[:3, 3])} mm from the base of {arm}"


def note_of(run: RunStage) -> str:
    """Return what a report has to say beside a stage: where it was stopped, what it goes round, why it is slow."""
    stage = run.stage
    notes = [stage.slowed] if stage.slowed else []
    if run.stopped:
        notes.append(
            f"stopped on its way, after {run.duration:.3f} s and {run.length * 1e3:.1f} mm "
            f"of {stage.trajectory.duration:.3f} s and {stage.length * 1e3:.1f} mm"
        )
    if stage.obstacle is not None and stage.detour is not None:
        why = where_and_why(stage.obstacle, stage.kind, run.to, run.arm)
        notes = [f"the straight way is stopped {why}", f"{_lead(stage.detour, run.arm)}: {stage.detour.price}", *notes]
    elif stage.obstacle is not None:
        notes.append(f"without stops it is stopped {where_and_why(stage.obstacle, stage.kind, run.to, run.arm)}")
    if stage.certificate is not None:
        notes.append(stage.certificate.summary)
    return "; ".join(notes)


def detour_warning(run: RunStage) -> Diagnostic | None:
    """Return the warning that a stage leaves its straight line; None where it does not."""
    obstacle, detour = run.stage.obstacle, run.stage.detour
    if obstacle is None or detour is None:
        return None
    return Diagnostic(
        code="W402",
        severity=Severity.WARNING,
        message=f"{run.arm} leaves the straight way to `{run.to[-1]}`, {_METHODS[detour.method]}: {detour.price}",
        span=run.span,
        label=f"stopped {obstacle.fraction * 100:.0f} % of the way there; begun at {run.t0:.3f} s",
        notes=(
            f"it is stopped {where_and_why(obstacle, run.stage.kind, run.to, run.arm)}",
            _lead(detour, run.arm),
        ),
    )


def stops_warning(run: RunStage) -> Diagnostic | None:
    """Return the warning that a stage stops at all of its frames, where it cannot go past them; None where it can."""
    obstacle = run.stage.obstacle
    if obstacle is None or run.stage.detour is not None:
        return None
    return Diagnostic(
        code="W403",
        severity=Severity.WARNING,
        message=f"{run.arm} stops at every frame on its way to `{run.to[-1]}`: rounded corners cannot be followed",
        span=run.span,
        label=f"begun at {run.t0:.3f} s",
        notes=(f"without stops it is stopped {where_and_why(obstacle, run.stage.kind, run.to, run.arm)}",),
        helps=("a frame farther from that place, or another posture at the start, may do without stops",),
    )


def _place(p: Array) -> str:
    return f"({', '.join(f'{x:.1f}' if abs(x) < _FAR else f'{x:.4g}' for x in (p * 1e3).tolist())})"
