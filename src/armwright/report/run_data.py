"""The data of the page of a run, from its recording: thinned for a screen, with the arms as stick figures."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.model import base_name
from armwright.cell.observations import MeasuredStream
from armwright.kinematics.forward_kinematics import forward
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.vm.excerpt import EVENT_LOG_HINT, MAX_LIST_ITEMS, excerpt, omission_text, shorten_line
from armwright.program.vm.recording import Effect as RunEffect, Recording, RunStage, Stream
from armwright.report.animation import Animation, FrameTrack, TreeChange
from armwright.report.arm_figure import arm_figure, opening_of
from armwright.report.collision_text import collision_text
from armwright.report.page import ArmRecord, Effect, LeastDistance, Message, RunPage, StageRow
from armwright.report.run_scene import MAX_BODIES, finger_opening, fixture_bodies, has_gripper, moved_parts, placed_arms
from armwright.report.shape_table import ShapeTable
from armwright.report.stage_badges import stage_badges
from armwright.report.stick_figure import arm_record
from armwright.report.tracking import measured_motion, nearest_ticks, physics_text, seen_pictures
from armwright.spatial.poses import to_noap
from armwright.version import __version__

# Instants of the animation at most, which suffice for a screen.
_FRAMES_PER_SECOND = 30.0
_MAX_INSTANTS = 1200
# Frames that the view draws at most: more would hide each other, and each has a pose at every instant.
_MAX_FRAMES = 400
_T = TypeVar("_T")


def run_page_data(
    recording: Recording, diagnostics: Sequence[Diagnostic], command: str, left_out: Sequence[str] = ()
) -> RunPage:
    """Return the page of a run, also of one that failed.

    Args:
        recording: the recording of the run.
        diagnostics: diagnostics of compilation and run.
        command: the command line, as shown on the page.
        left_out: notes on what other files of the run omit.
    """
    source, cell, failure = recording.code.source, recording.cell, recording.failure
    stages, fewer_stages = _limit_items(recording.stages, MAX_LIST_ITEMS, "stages", "all in run.json")
    animation, fewer_frames = run_animation(recording)
    status = "finished" if failure is None else f"failed: {failure.diagnostic.code} at {failure.time:.3f} s"
    reasons = () if failure is None else (*failure.diagnostic.notes, *failure.diagnostic.helps)
    errors_first = sorted(diagnostics, key=lambda diagnostic: not diagnostic.is_error)
    listed, fewer = _limit_items(errors_first, MAX_LIST_ITEMS, "messages", "all in run.json")
    pictures, fewer_pictures = seen_pictures(recording.pictures)
    notes = (*reasons, *left_out, *fewer, *fewer_stages, *fewer_frames, *fewer_pictures)
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
            *(
                Message(severity=d.severity.value, code=d.code, line=source.listing_line(d.span.start), text=d.message)
                for d in listed
            ),
            *(Message(severity="note", text=text) for text in notes),
        ],
        effects=_effects(recording),
        stages=[_stage_row(run, source.listing_line(run.span.start), cell.arms[run.arm].arm) for run in stages],
        arms=_arm_records(recording),
        animation=animation,
        collisions=collision_text(recording),
        physics=_physics(recording),
        pictures=pictures,
        clearance=cell.clearance,
    )


def _physics(recording: Recording) -> str:
    """Return engine, seed and largest errors of a run in a cell with physics; nothing of another one."""
    facts = recording.observations.facts
    return f"{facts['engine']} {facts['version']}, seed {facts['seed']}; {physics_text(recording)}" if facts else ""


def _arm_records(recording: Recording) -> list[ArmRecord]:
    measured = {stream.arm: stream for stream in recording.measured}
    records = []
    for s in recording.streams:
        arm = recording.cell.arms[s.arm]
        # Without masses the efforts are none of the arm.
        tau = None if arm.arm.massless else s.tau
        record = arm_record(s.arm, arm.arm, (s.t, s.q, s.qd, s.qdd, tau), arm.base)
        if s.arm in measured:
            record = attrs.evolve(record, measured=measured_motion(s, measured[s.arm]))
        records.append(record)
    return records


def _limit_items(items: Sequence[_T], most: int, name: str, hint: str = EVENT_LOG_HINT) -> tuple[list[_T], list[str]]:
    """Return the first and last items, as many as a page can hold, and a note if others are omitted."""
    shown = excerpt(items, most)
    text = f"this page shows the first and the last {len(shown.first):,} of {len(items):,} {name}; {hint}"
    return shown.join(), [text] if shown.omitted else []


def _effects(recording: Recording) -> list[Effect]:
    """Return the effects of a run; a line stands for those that a page cannot hold."""
    several = len(recording.processes) > 1
    effects = excerpt(recording.effects, MAX_LIST_ITEMS)

    def shown(effect: RunEffect) -> Effect:
        number, process = recording.code.source.listing_line(effect.span.start), effect.process if several else ""
        text, arm = shorten_line(effect.text), effect.arm or ""
        return Effect(t0=effect.t0, t1=effect.t1, line=number, text=text, process=process, arm=arm)

    omitted = [attrs.evolve(shown(effects.first[-1]), text=omission_text(effects.omitted))] if effects.omitted else []
    return effects.map(shown).join(*omitted)


def _stage_row(run: RunStage, line: int, arm: Arm) -> StageRow:
    return StageRow(
        t0=run.t0,
        t1=run.t1,
        line=line,
        arm=run.arm,
        kind=run.stage.kind,
        to=run.goal_names,
        speed=run.speed,
        peak_speed=run.motion.peaks(1).tolist(),
        peak_effort=None if arm.massless else run.peak_effort[: arm.n].tolist(),
        effort_share=None if arm.massless else run.effort_shares(arm).tolist(),
        hand_length=run.length,
        deviation=run.stage.deviation,
        badges=list(stage_badges(run)),
        clearance=_least_distance(run),
    )


def _least_distance(run: RunStage) -> LeastDistance | None:
    it = run.clearance
    if it is None:
        return None
    return LeastDistance(distance=it.distance, bound=it.bound, bodies=it.bodies, t=run.t0 + it.time)


def run_animation(
    recording: Recording, fps: float = _FRAMES_PER_SECOND, most: int = _MAX_INSTANTS
) -> tuple[Animation, list[str]]:
    """Return the animation of a run, and notes on what it omits.

    Args:
        recording: the recording of the run.
        fps: instants per second.
        most: instants at most; of a long run they are farther apart.
    """
    fps = min(fps, most / max(recording.duration, 1e-9))
    t = np.append(np.arange(math.ceil(recording.duration * fps)) / fps, recording.duration)
    arms, tree = recording.cell.arms, recording.tree
    planned = {s.arm: _rows_at(s, t) for s in recording.streams}
    measured = {s.arm: _rows_at(s, t) for s in recording.measured if len(s.t)}
    q = planned | measured
    tool_poses = {name: arms[name].base @ forward(arms[name].arm, rows) for name, rows in q.items()}
    hidden = {WORLD, *arms, *map(base_name, arms)}
    visible = [name for name in tree if name not in hidden and tree.has_value(name)]
    names, fewer_frames = _limit_items(visible, _MAX_FRAMES, "frames", "all in frames.json")
    changes, fewer_changes = _limit_items([*_tree_changes(recording, t)], MAX_LIST_ITEMS, "changes of the frame tree")
    shapes = ShapeTable()
    placed = placed_arms(recording.cell)
    grips = {
        name: finger_opening(recording, name, t, opening_of(placed[name])) if has_gripper(recording, name) else None
        for name in q
    }
    figures = {
        name: attrs.evolve(
            arm_figure(name, placed[name], rows, grips[name], shapes),
            planned=planned[name] if name in measured else None,
        )
        for name, rows in q.items()
    }
    fixtures, parts = fixture_bodies(recording.cell, shapes), moved_parts(recording, shapes)
    animation = Animation(
        fps=fps,
        t=t,
        arms=figures,
        frames=list(_frame_tracks(recording, t, tool_poses, names)),
        tree=changes,
        fixtures=fixtures,
        parts=parts,
        shapes=shapes.as_data(),
        contact_plane=recording.cell.contact.height,
    )
    all_bodies = {"bodies of the scene": recording.cell.fixtures, "parts": recording.cell.parts}
    fewer = [
        f"this page shows the first {MAX_BODIES} of {len(bodies):,} {name}; all in run.json"
        for name, bodies in all_bodies.items()
        if len(bodies) > MAX_BODIES
    ]
    return animation, [*fewer_frames, *fewer_changes, *fewer]


def _rows_at(stream: Stream | MeasuredStream, t: Array) -> Array:
    """Return the joint positions of a stream at its ticks next to some instants."""
    return np.asarray(stream.q[nearest_ticks(stream.t, t)])


def _frame_tracks(
    recording: Recording, t: Array, tools: dict[str, Array], names: Sequence[str]
) -> Iterator[FrameTrack]:
    moving = {name: np.stack([frame.pose_at(at) for at in t]) for name, frame in recording.cell.moving_frames.items()}
    carriers = tools | moving
    poses = {name: np.tile(np.eye(4), (len(t), 1, 1)) for name in names}
    first: dict[str, int] = {}
    for _, rows, tree in _valid_trees(recording, t):
        known: dict[str, Array] = {WORLD: np.eye(4), **{name: X[rows] for name, X in carriers.items()}}
        for name in names:
            if _add_world_pose(name, tree, known):
                poses[name][rows] = known[name]
                first.setdefault(name, rows.start)
    for name in names:
        if name in first:
            yield FrameTrack(name=recording.code.spelled(name), poses=to_noap(poses[name]), visible_from=first[name])


def _add_world_pose(name: str, tree: FrameTree, poses: dict[str, Array]) -> bool:
    """Add the poses of a frame and of its ancestors; return whether they have values."""
    chain = []
    while name not in poses:
        node = tree.nodes.get(name)
        if node is None or node.relation is None:
            return False
        chain.append((name, node.relation))
        name = node.parent
    X = poses[name]
    for child, relation in reversed(chain):
        poses[child] = X = X @ relation
    return True


def _valid_trees(recording: Recording, t: Array) -> Iterator[tuple[float, slice, FrameTree]]:
    """Yield for each frame tree the time since which it is valid [s], the rows of ``t`` at which it is, and the tree.

    Trees that are valid at none of these instants are skipped.
    """
    starts = [time for time, _ in recording.trees]
    rows = [int(np.searchsorted(t, time - 1e-9)) for time in starts] + [len(t)]
    for i, (start, tree) in enumerate(recording.trees):
        if rows[i] < rows[i + 1]:
            yield start, slice(rows[i], rows[i + 1]), tree


def _tree_changes(recording: Recording, t: Array) -> Iterator[TreeChange]:
    """Yield the changes of the frame tree that are visible at the instants of the view."""
    before: Mapping[str, Node] = {}
    shown: dict[str, str] = {}
    for time, _, tree in _valid_trees(recording, t):
        for name, node in tree.nodes.items():
            if node is before.get(name) or node.relation is None or name.endswith(".BASE"):
                continue
            parent = WORLD if node.parent == base_name(name) else node.parent
            if shown.get(name) != parent:
                shown[name] = parent
                yield TreeChange(t=time, child=recording.code.spelled(name), parent=recording.code.spelled(parent))
        before = tree.nodes
