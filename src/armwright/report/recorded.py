"""From the recording of a run to what its page shows: thinned for a screen, with the arm as a figure of sticks."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.model import Cell, CellArm, base_name
from armwright.kinematics.forward import link_poses
from armwright.program.intermediate.code import Code
from armwright.program.messages.diagnostics import Diagnostic
from armwright.program.running.obstacles import note_of
from armwright.program.running.recording import Effect as RunEffect
from armwright.program.running.recording import Recording, RunStage, Stream
from armwright.report.page import (
    Animation,
    ArmRecord,
    Effect,
    FrameTrack,
    Message,
    RunPage,
    Stage,
    TreeChange,
)
from armwright.report.sticks import joints_of, sticks, thinned
from armwright.spatial.poses import to_noap
from armwright.version import __version__

# Enough for a screen: instants of the animation.
_FRAMES_PER_SECOND = 30.0
_MOST_INSTANTS = 1200
# What a browser can list without delay.
_MOST_ITEMS = 4000
_T = TypeVar("_T")


def page_of(
    recording: Recording,
    code: Code,
    diagnostics: Sequence[Diagnostic],
    command: str,
    left_out: Sequence[str] = (),
) -> RunPage:
    """Return the page of a run; of one that failed it says so first.

    Args:
        recording: what happened.
        code: the program that ran.
        diagnostics: warnings of translation and run.
        command: the command line, as shown on the page.
        left_out: what other files leave out, as it is said there.
    """
    source, cell, failure = code.source, recording.cell, recording.failure
    effects, fewer = _fewer(recording.effects, "lines of what happened")
    processes = recording.processes
    stages, fewer_stages = _fewer(recording.stages, "stages")
    status = "finished" if failure is None else f"failed: {failure.diagnostic.code} at {failure.time:.3f} s"
    why = () if failure is None else (*failure.diagnostic.notes, *failure.diagnostic.helps)
    said = sorted(diagnostics, key=lambda one: not one.is_error)
    return RunPage(
        title=f"{source.name} in {cell.name}" + ("" if failure is None else ": failed"),
        status=status,
        program_name=source.name,
        program_text=source.text,
        cell_name=cell.name,
        generated_by=f"armwright {__version__}",
        command=command,
        duration=recording.duration,
        messages=[
            Message(severity=one.severity.value, code=one.code, line=source.line(one.span.start), text=one.message)
            for one in said
        ]
        + [Message(severity="note", text=text) for text in (*why, *left_out, *fewer, *fewer_stages)],
        effects=[
            Effect(
                t0=one.t0,
                t1=one.t1,
                line=source.line(one.span.start),
                text=one.text,
                process=one.process if len(processes) > 1 else "",
            )
            for one in effects
        ],
        stages=[_stage(one, source.line(one.span.start)) for one in stages],
        arms=[_record(one, cell) for one in recording.streams],
        animation=_animation(recording, code),
    )


def _fewer(items: Sequence[_T], what: str) -> tuple[Sequence[_T], list[str]]:
    """Return as many as a page can hold, the first and the last, and a note where that is not all."""
    if len(items) <= _MOST_ITEMS:
        return items, []
    half = _MOST_ITEMS // 2
    text = f"this page shows the first and the last {half} of {len(items)} {what}; events.jsonl and run.json have all"
    return (*items[:half], *items[-half:]), [text]


def _stage(run: RunStage, line: int) -> Stage:
    return Stage(
        t0=run.t0,
        t1=run.t1,
        line=line,
        arm=run.arm,
        kind=run.stage.kind,
        to=run.to,
        speed=run.speed,
        peak_speed=run.motion.peaks(1).tolist(),
        peak_effort=run.peak_effort.tolist(),
        hand_length=run.length,
        deviation=run.stage.deviation,
        note=note_of(run),
    )


def _record(stream: Stream, cell: Cell) -> ArmRecord:
    place = cell.arms[stream.arm]
    rows = thinned(len(stream.t))
    return ArmRecord(
        name=stream.arm,
        model=place.arm.name,
        joints=joints_of(place.arm),
        t=stream.t[rows],
        q=stream.q[rows],
        qd=stream.qd[rows],
        qdd=stream.qdd[rows],
        tau=stream.tau[rows],
        hand=_poses_in_world(place, stream.q[rows])[:, -1, :3, 3],
    )


def _animation(recording: Recording, code: Code) -> Animation:
    fps = min(_FRAMES_PER_SECOND, _MOST_INSTANTS / max(recording.duration, 1e-9))
    t = np.append(np.arange(math.ceil(recording.duration * fps)) / fps, recording.duration)
    arms = recording.cell.arms
    links = {one.arm: _poses_in_world(arms[one.arm], _sampled(one, t)) for one in recording.streams}
    hands = {name: poses[:, -1] for name, poses in links.items()}
    return Animation(
        fps=fps,
        t=t,
        arms={name: sticks(arms[name].arm, poses, _grip(recording.effects, name, t)) for name, poses in links.items()},
        frames=_tracks(recording, code, t, hands),
        tree=_tree_changes(recording, code),
    )


def _sampled(stream: Stream, t: Array) -> Array:
    period = stream.t[1] - stream.t[0] if len(stream.t) > 1 else 1.0
    return np.asarray(stream.q[np.clip(np.round(t / period).astype(int), 0, len(stream.t) - 1)])


def _poses_in_world(place: CellArm, q: Array) -> Array:
    return np.asarray(place.base @ link_poses(place.arm, q))


def _grip(effects: Sequence[RunEffect], arm: str, t: Array) -> Array:
    """Return how far the fingers are open at each instant, 0 to 1; they begin closed."""
    times, values = [0.0], [0.0]
    for effect in effects:
        if effect.arm == arm and effect.kind in ("OPEN", "GRASP"):
            times += [effect.t0, effect.t1]
            values += [values[-1], 1.0 if effect.kind == "OPEN" else 0.0]
    return np.interp(t, times, values)


def _tracks(recording: Recording, code: Code, t: Array, hands: dict[str, Array]) -> Iterator[FrameTrack]:
    names = [name for name in recording.tree if _shown(name, recording.cell) and recording.tree.has_value(name)]
    poses = {name: np.tile(np.eye(4), (len(t), 1, 1)) for name in names}
    first: dict[str, int] = {}
    for rows, tree in _reigns(recording, t):
        # Parents come before children, so each place is the parent's and one step more.
        places: dict[str, Array] = {WORLD: np.eye(4), **{arm: hand[rows] for arm, hand in hands.items()}}
        for name in tree:
            node = tree.nodes.get(name)
            if name in places or node is None or node.relation is None or node.parent not in places:
                continue
            places[name] = places[node.parent] @ node.relation
            if name in poses:
                poses[name][rows] = places[name]
                first.setdefault(name, rows.start)
    for name in names:
        if name in first:
            yield FrameTrack(name=code.spelled(name), poses=to_noap(poses[name]), visible_from=first[name])


def _reigns(recording: Recording, t: Array) -> Iterator[tuple[slice, FrameTree]]:
    """Give the rows of ``t`` during which each frame tree holds, and the tree."""
    starts = [time for time, _ in recording.trees]
    rows = [int(np.searchsorted(t, time - 1e-9)) for time in starts] + [len(t)]
    for i, (_, tree) in enumerate(recording.trees):
        if rows[i] < rows[i + 1]:
            yield slice(rows[i], rows[i + 1]), tree


def _tree_changes(recording: Recording, code: Code) -> Iterator[TreeChange]:
    before: Mapping[str, Node] = {}
    shown: dict[str, str] = {}
    for time, tree in recording.trees:
        for name, node in tree.nodes.items():
            if node is before.get(name) or node.relation is None or name.endswith(".BASE"):
                continue
            parent = WORLD if node.parent == base_name(name) else node.parent
            if shown.get(name) != parent:
                shown[name] = parent
                yield TreeChange(t=time, child=code.spelled(name), parent=code.spelled(parent))
        before = tree.nodes


def _shown(name: str, cell: Cell) -> bool:
    return name != WORLD and name not in cell.arms and not any(name == base_name(arm) for arm in cell.arms)
