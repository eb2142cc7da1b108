"""What a log of a run holds, message by message in the order of time, whatever the format of the file.

Times are those of the cell, from 0. Frames are named ``ARM_1/base``, ``ARM_1/link_1`` to ``ARM_1/tool``, ``part/NAME``,
and as the program spells them; all begin at ``world``.
"""

from __future__ import annotations

import heapq
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.write import toml_text, without_meshes
from armwright.arrays import Array
from armwright.cell.observations import Picture
from armwright.errors import ArmwrightError
from armwright.program.vm.recording import Recording
from armwright.report.animation import Animation, ArmFigure, Body
from armwright.report.arm_figure import Placed, arm_figure
from armwright.report.body_poses import frame_poses, part_poses
from armwright.report.gltf_motion import quaternions
from armwright.report.run_data import run_animation
from armwright.report.shape_table import ShapeTable
from armwright.simulation.result import Simulation
from armwright.spatial.poses import from_noap, homogeneous, inverse, to_noap
from armwright.version import __version__

WORLD_FRAME = "world"
# Poses of frames per second, and instants of a log at most.
_FRAMES_PER_SECOND, _MAX_INSTANTS = 30.0, 20_000
_NANOSECONDS = 1e9

# Roles of motions in the topics of joint states.
Role: TypeAlias = Literal["planned", "measured", "simulated"]


@attrs.frozen(kw_only=True, eq=False)
class JointTrack:
    """The motion of the joints of an arm.

    Attributes:
        arm: its name.
        role: what the motion is.
        names: n names of joints.
        t: (k,) times [s].
        q: (k, n) positions [rad] or [m].
        qd: (k, n) speeds.
        qdd: (k, n) accelerations; None where they are not known.
        tau: (k, n) efforts [N m] or [N].
    """

    arm: str
    role: Role
    names: Sequence[str]
    t: Array
    q: Array
    qd: Array
    qdd: Array | None
    tau: Array

    @property
    def topic(self) -> str:
        """Where its messages are."""
        return f"/{self.arm}/{self.role}/joint_states"


@attrs.frozen(kw_only=True)
class LogEvent:
    """A line of the trace, or an error.

    Attributes:
        t: when [s].
        text: the line.
        process: that did it.
        file: the program.
        line: of the program, from 1.
        is_error: whether it ended the run.
    """

    t: float
    text: str
    process: str
    file: str
    line: int
    is_error: bool = False


@attrs.frozen(kw_only=True, eq=False)
class LogContent:
    """What a log holds.

    Attributes:
        about: what made it, and its arms, as JSON.
        tracks: motions of joints.
        animation: what moves in the world, and how.
        events: in order of time.
        pictures: that cameras took, in order of time.
    """

    about: str
    tracks: Sequence[JointTrack]
    animation: Animation
    events: Sequence[LogEvent] = ()
    pictures: Sequence[Picture] = ()


class JointsPayload(NamedTuple):
    """The state of n joints: positions, speeds, accelerations (None where not known) and efforts."""

    names: Sequence[str]
    q: list[float]
    qd: list[float]
    qdd: list[float] | None
    tau: list[float]


class Transform(NamedTuple):
    """The pose of a frame in its parent: position x, y, z [m] and quaternion x, y, z, w."""

    parent: str
    child: str
    position: list[float]
    rotation: list[float]


class SceneShape(NamedTuple):
    """A shape as of ``shape_table``, its pose as position [m] and quaternion x, y, z, w, and its colour."""

    shape: Mapping[str, Any]
    position: list[float]
    rotation: list[float]
    colour: tuple[float, float, float]


class Entity(NamedTuple):
    """Shapes that move with a frame, under one name."""

    name: str
    frame: str
    shapes: Sequence[SceneShape]


class Frames(NamedTuple):
    """Poses of all frames at one time."""

    transforms: Sequence[Transform]


class Scene(NamedTuple):
    """All that stands and moves in the world."""

    entities: Sequence[Entity]


Payload: TypeAlias = JointsPayload | Frames | Scene | LogEvent | Picture | str


class TimedMessage(NamedTuple):
    """A message: its time [ns], its topic, its content."""

    time: int
    topic: str
    payload: Payload


def run_log_content(recording: Recording) -> LogContent:
    """Return what a log of a run holds: planned and measured motions, frames, scene, trace and pictures."""
    source, cell = recording.code.source, recording.cell
    names = {name: joint_names(arm.arm) for name, arm in cell.arms.items()}
    planned = [
        JointTrack(arm=s.arm, role="planned", names=names[s.arm], t=s.t, q=s.q, qd=s.qd, qdd=s.qdd, tau=s.tau)
        for s in recording.streams
    ]
    measured = [
        JointTrack(arm=s.arm, role="measured", names=names[s.arm], t=s.t, q=s.q, qd=s.qd, qdd=None, tau=s.tau)
        for s in recording.measured
        if len(s.t)
    ]
    events = [
        LogEvent(
            t=e.t0, text=e.text, process=e.process, file=source.name_at(e.span.start), line=source.line(e.span.start)
        )
        for e in recording.traced_effects()
    ]
    if (failure := recording.failure) is not None:
        where = source.line(failure.diagnostic.span.start)
        text = f"{failure.diagnostic.code}: {failure.diagnostic.message}"
        error = LogEvent(
            t=failure.time,
            text=text,
            process=failure.process,
            file=source.name_at(failure.diagnostic.span.start),
            line=where,
            is_error=True,
        )
        events = sorted([*events, error], key=lambda event: event.t)
    animation, _ = run_animation(recording, _FRAMES_PER_SECOND, _MAX_INSTANTS)
    arms = {name: (arm.arm, arm.base) for name, arm in cell.arms.items()}
    return LogContent(
        about=_about(arms, program=source.name, text=source.main.text, cell=cell.name),
        tracks=[*planned, *measured],
        animation=animation,
        events=events,
        pictures=sorted(recording.pictures, key=lambda picture: picture.time),
    )


def simulation_log_content(simulation: Simulation) -> LogContent:
    """Return what a log of a simulated motion holds: the motion, and the moving arm."""
    arm, t = simulation.arm, simulation.t
    count = min(max(2, round((t[-1] - t[0]) * _FRAMES_PER_SECOND) + 1), _MAX_INSTANTS)
    instants = np.linspace(t[0], t[-1], count)
    q = np.stack([np.interp(instants, t, column) for column in simulation.q.T], axis=1)
    shapes = ShapeTable()
    figure = arm_figure(arm.name, Placed(arm), q, None, shapes)
    track = JointTrack(
        arm=arm.name,
        role="simulated",
        names=joint_names(arm),
        t=t,
        q=simulation.q,
        qd=simulation.qd,
        qdd=simulation.qdd,
        tau=simulation.tau,
    )
    return LogContent(
        about=_about({arm.name: (arm, np.eye(4))}),
        tracks=[track],
        animation=Animation(fps=_FRAMES_PER_SECOND, t=instants, arms={arm.name: figure}, shapes=shapes.as_data()),
    )


def joint_names(arm: Arm) -> list[str]:
    """Return the names of the joints of an arm in a log: their own, or ``joint_1`` and so on."""
    return [joint.name or f"joint_{i}" for i, joint in enumerate(arm.joints, 1)]


def timed_messages(content: LogContent) -> Iterator[TimedMessage]:
    """Give the messages of a log in the order of time; of the same time first what describes the run and its scene."""
    start = _nanoseconds(float(content.animation.t[0]))
    first = [
        TimedMessage(start, "/armwright/run", content.about),
        TimedMessage(start, "/scene", Scene(list(scene_entities(content.animation)))),
    ]
    events = (TimedMessage(_nanoseconds(event.t), "/log", event) for event in content.events)
    pictures = (TimedMessage(_nanoseconds(one.time), f"/cameras/{one.camera}", one) for one in content.pictures)
    streams: list[Iterable[TimedMessage]] = [first, _transforms(content.animation)]
    streams += [_joint_messages(track) for track in content.tracks]
    yield from heapq.merge(*streams, events, pictures, key=lambda message: message.time)


def _nanoseconds(t: float) -> int:
    return round(t * _NANOSECONDS)


def _joint_messages(track: JointTrack) -> Iterator[TimedMessage]:
    topic, names = track.topic, track.names
    for i, t in enumerate(track.t.tolist()):
        qdd = None if track.qdd is None else track.qdd[i].tolist()
        payload = JointsPayload(names, track.q[i].tolist(), track.qd[i].tolist(), qdd, track.tau[i].tolist())
        yield TimedMessage(_nanoseconds(t), topic, payload)


# ---- frames ----------------------------------------------------------------------------------------------------------


class _Track(NamedTuple):
    parent: str
    child: str
    poses: Array  # (M, 4, 4)
    first: int = 0


def _transforms(animation: Animation) -> Iterator[TimedMessage]:
    """Give the poses of all frames at each instant of the animation."""
    tracks = [
        (track, np.round(track.poses[:, :3, 3], 9) + 0.0, np.round(quaternions(track.poses[:, :3, :3]), 12) + 0.0)
        for track in _tracks(animation)
    ]
    for i, t in enumerate(animation.t.tolist()):
        frames = [
            Transform(track.parent, track.child, positions[i].tolist(), rotations[i].tolist())
            for track, positions, rotations in tracks
            if i >= track.first
        ]
        if frames:
            yield TimedMessage(_nanoseconds(t), "/tf", Frames(frames))


def _tracks(animation: Animation) -> Iterator[_Track]:
    tools = {}
    for name, figure in animation.arms.items():
        frames = frame_poses(figure)
        tools[name] = frames[-1]
        names = _frame_names(name, figure)
        yield _Track(WORLD_FRAME, names[0], frames[0])
        for i in range(1, len(frames)):
            yield _Track(names[i - 1], names[i], inverse(frames[i - 1]) @ frames[i])
        yield from _fingers(name, figure)
    for frame in animation.frames:
        yield _Track(WORLD_FRAME, frame.name, from_noap(frame.poses), frame.visible_from)
    for part in animation.parts:
        yield _Track(WORLD_FRAME, f"part/{part.name}", part_poses(part, animation.t, tools))


def _frame_names(arm: str, figure: ArmFigure) -> list[str]:
    links = [f"{arm}/link_{i}" for i in range(1, len(figure.joints) + 1)]
    return [f"{arm}/base", *links, f"{arm}/tool"]


def _fingers(arm: str, figure: ArmFigure) -> Iterator[_Track]:
    """Give the frames of the two sides along which fingers slide."""
    if figure.grip is None or not any(body.slide for body in figure.bodies):
        return
    for side in (-1, 1):
        offsets = np.zeros((len(figure.q), 3))
        offsets[:, 1] = side * figure.grip * figure.opening / 2
        poses = homogeneous(np.broadcast_to(np.eye(3), (len(offsets), 3, 3)), offsets)
        yield _Track(f"{arm}/tool", _finger_frame(arm, side), poses)


def _finger_frame(arm: str, side: int) -> str:
    return f"{arm}/finger_{1 if side < 0 else 2}"


# ---- scene -----------------------------------------------------------------------------------------------------------

_COLOURS = {
    "base": (0.36, 0.40, 0.44),
    "link": (0.90, 0.55, 0.16),
    "joint": (0.25, 0.28, 0.32),
    "fixture": (0.72, 0.74, 0.76),
    "part": (0.20, 0.47, 0.75),
}


def scene_entities(animation: Animation) -> Iterator[Entity]:
    """Give what stands and moves in the world, each on its frame.

    What holds a slide and is as long as it is out is left out: shapes of a log do not change.
    """
    for name, figure in animation.arms.items():
        frames = _frame_names(name, figure)
        on: dict[str, list[Body]] = {}
        for body in figure.bodies:
            if not body.stretches:
                frame = _finger_frame(name, body.slide) if body.slide else frames[body.frame]
                on.setdefault(frame, []).append(body)
        for frame, bodies in on.items():
            yield Entity(frame, frame, [_shape(animation, body.shape, body.pose, body.tint) for body in bodies])
    for body in animation.fixtures:
        yield Entity(body.name, WORLD_FRAME, [_shape(animation, body.shape, body.pose, "fixture")])
    for part in animation.parts:
        frame = f"part/{part.name}"
        yield Entity(frame, frame, [_shape(animation, part.shape, to_noap(np.eye(4)), "part")])


def _shape(animation: Animation, number: int, pose: Array, tint: str) -> SceneShape:
    X = from_noap(pose)[None]
    rotation = np.round(quaternions(X[:, :3, :3])[0], 12) + 0.0
    return SceneShape(animation.shapes[number], (X[0, :3, 3] + 0.0).tolist(), rotation.tolist(), _COLOURS[tint])


# ---- about -----------------------------------------------------------------------------------------------------------


def _about(arms: Mapping[str, tuple[Arm, Array]], **more: str) -> str:
    """Return what made a log, and the files of its arms and where they stand, as JSON."""
    described = {}
    for name, (arm, base) in arms.items():
        try:
            text = toml_text(without_meshes(arm)[0])
        except ArmwrightError:  # an arm that no arm file can hold is not described
            continue
        described[name] = {"file": text, "base": (to_noap(base) + 0.0).tolist()}
    return json.dumps({"armwright": __version__, **more, "arms": described}, ensure_ascii=False)
