"""The page of a run: its data, and the HTML file that shows them.

All data are in SI units and radians; the scripts convert them to degrees and millimetres. The file includes its style,
its scripts and its data, and uses no network.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import attrs

from armwright.arm.model import JointKind
from armwright.arrays import Array
from armwright.report.collision_text import NOT_CHECKED
from armwright.report.elements import badge, facts
from armwright.report.markup import asset, page_html

_SCRIPTS = ("scene.js", "camera.js", "solids.js", "view.js", "charts.js", "joint_charts.js", "lists.js", "run.js")


@attrs.frozen(kw_only=True)
class Message:
    """A message of the compiler or of the run.

    Attributes:
        severity: ``error``, ``warning`` or ``note``.
        text: the message.
        code: such as ``W201``; may be empty.
        line: line of the program, from 1; None without a line.
    """

    severity: Literal["error", "warning", "note"]
    text: str
    code: str = ""
    line: int | None = None


@attrs.frozen(kw_only=True)
class Effect:
    """An executed statement.

    Attributes:
        t0: when it began [s].
        t1: when it ended [s]; equal to t0 if it takes no time.
        line: line of the program, from 1.
        text: its effect, such as ``ARM_1 [obj1] MOVE: PTP obj2 @100``.
        process: its process, such as ``branch 2``; empty where there is only one process.
    """

    t0: float
    t1: float
    line: int
    text: str
    process: str = ""


@attrs.frozen(kw_only=True)
class StageRow:
    """A stage of a motion.

    Attributes:
        t0: when it began [s].
        t1: when it ended [s].
        line: line of the program, from 1.
        arm: name of the arm.
        kind: ``PTP``, ``LINE``, ``SPLINE`` or ``BLEND`` of a program; ``JOINT`` or ``HAND`` of a move through poses.
        to: its target frames; the last is the goal.
        speed: the speed in the program, 100 being normal.
        peak_speed: n largest joint speeds [rad/s] or [m/s].
        peak_effort: n largest torques [N m] or forces [N]; None where no dynamics was computed.
        hand_length: length of the path of the tool [m].
        deviation: largest distance from the straight line [m]; None without a line.
        note: a remark, such as ``slowed by joint 2 speed``.
    """

    t0: float
    t1: float
    line: int
    arm: str
    kind: Literal["PTP", "LINE", "SPLINE", "BLEND", "JOINT", "HAND"]
    to: Sequence[str]
    speed: float
    peak_speed: Sequence[float]
    peak_effort: Sequence[float] | None = None
    hand_length: float
    deviation: float | None = None
    note: str = ""


@attrs.frozen(kw_only=True)
class JointInfo:
    """A joint and its limits, infinite where unknown.

    Attributes:
        name: such as ``joint 1``.
        kind: ``revolute`` or ``prismatic``.
        lower: smallest position [rad] or [m].
        upper: largest position [rad] or [m].
        speed: largest speed [rad/s] or [m/s].
        acceleration: largest acceleration [rad/s²] or [m/s²].
        effort: largest torque [N m] or force [N].
    """

    name: str
    kind: JointKind
    lower: float = -math.inf
    upper: float = math.inf
    speed: float = math.inf
    acceleration: float = math.inf
    effort: float = math.inf


@attrs.frozen(kw_only=True, eq=False)
class ArmRecord:
    """The motion of an arm at N instants (some 2000 suffice for a screen).

    Attributes:
        name: its name in the program, such as ``ARM_1``.
        model: its name in the catalogue, such as ``stanford``.
        joints: n joints from base to hand.
        t: (N,) instants [s].
        q: (N, n) positions [rad] or [m].
        qd: (N, n) speeds.
        qdd: (N, n) accelerations.
        tau: (N, n) torques [N m] or forces [N]; None where no dynamics was computed.
        hand: (N, 3) positions of the tool in the world [m].
    """

    name: str
    model: str
    joints: Sequence[JointInfo]
    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array | None = None
    hand: Array


@attrs.frozen(kw_only=True, eq=False)
class ArmFigure:
    """The stick figure of an arm at the M instants of the animation.

    Attributes:
        points: (M, K, 3) the skeleton from the base to the tool, in the world [m]. It may have corners between joint
            origins, and points may coincide.
        hand_axes: (M, 9) columns n, o, a of the tool in the world; the fingers point along a and open along o.
        grip: (M,) 0 closed to 1 open.
        joint_axes: (M, n, 6) a point on the axis of each joint [m] and its direction, drawn as cylinders; None draws
            spheres at the points instead.
        radii: (K-1,) radius of each segment of the skeleton [m]; None lets the page choose.
    """

    points: Array
    hand_axes: Array
    grip: Array
    joint_axes: Array | None = None
    radii: Array | None = None


@attrs.frozen(kw_only=True, eq=False)
class FrameTrack:
    """The poses of a frame at the M instants of the animation.

    Attributes:
        name: its name as the program spells it.
        poses: (M, 12) columns n, o, a, p in the world; rows before ``visible_from`` are finite but not shown.
        visible_from: first row at which the frame has a value.
    """

    name: str
    poses: Array
    visible_from: int = 0


@attrs.frozen(kw_only=True)
class TreeChange:
    """A frame gets another parent; its first parent has t = 0.

    Attributes:
        t: time [s].
        child: the frame.
        parent: its new parent: ``WORLD``, an arm, or a frame.
    """

    t: float
    child: str
    parent: str


@attrs.frozen(kw_only=True, eq=False)
class Animation:
    """The data of the three-dimensional view.

    Attributes:
        fps: instants per second.
        t: (M,) instants [s], at least one.
        arms: figures of the arms by name.
        frames: frames in the order in which they are drawn.
        tree: changes of the frame tree in order of time.
    """

    fps: float
    t: Array
    arms: Mapping[str, ArmFigure] = attrs.field(factory=dict)
    frames: Sequence[FrameTrack] = ()
    tree: Sequence[TreeChange] = ()


@attrs.frozen(kw_only=True, eq=False)
class RunPage:
    """The data of the page of a run.

    Attributes:
        title: heading of the page.
        program_name: such as ``bench.rlo``.
        program_text: the source.
        cell_name: such as ``cell1.json``.
        generated_by: such as ``armwright 0.1.0``.
        command: the command line that made the page.
        duration: simulated time [s].
        status: how the run ended; ``finished`` without an error.
        messages: warnings and notes.
        effects: executed statements, in order.
        stages: stages of the motion, in order.
        arms: records of the arms.
        animation: the data of the view; None without a view.
        text_kind: kind of the text, ``Program`` or ``Poses``.
        collisions: whether they were checked, and how near the arms came to other bodies.
    """

    title: str
    program_name: str
    program_text: str
    cell_name: str
    generated_by: str
    command: str
    duration: float
    status: str = "finished"
    messages: Sequence[Message] = ()
    effects: Sequence[Effect] = ()
    stages: Sequence[StageRow] = ()
    arms: Sequence[ArmRecord] = ()
    animation: Animation | None = None
    text_kind: Literal["Program", "Poses"] = "Program"
    collisions: str = NOT_CHECKED


def run_page(data: RunPage) -> str:
    """Return the text of the page, a single HTML file.

    Args:
        data: the data of the run.

    Returns:
        HTML text; write it as UTF-8.
    """
    return page_html(
        title=data.title,
        badge=badge(data.status, good=data.status == "finished"),
        facts=facts(_facts(data)),
        main=asset("run.html"),
        styles=("run.css",),
        scripts=_SCRIPTS,
        data=data,
        generated=f"Made by {data.generated_by}",
    )


def _facts(data: RunPage) -> Iterator[tuple[str, str]]:
    yield "Duration", f"{data.duration:.2f} s"
    if data.arms:
        yield "Arms", ", ".join(f"{arm.name} ({arm.model})" for arm in data.arms)
    if data.cell_name:
        yield "Cell", data.cell_name
    yield data.text_kind, data.program_name
    yield "Collisions", data.collisions
    yield "Command", data.command
