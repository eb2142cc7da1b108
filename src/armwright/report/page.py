"""The page of a run: what it shows, and the one HTML file that shows it.

Everything in here is SI and radians; the page itself turns them into degrees and millimetres. The file carries its
style, its script and its numbers, and asks nothing of any network.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from armwright.report.elements import badge, facts
from armwright.report.markup import asset, page_html
from armwright.report.tracks import axes, check_rows, instants, numbers, path, per_joint, poses, rotations, skeleton

Severity: TypeAlias = Literal["error", "warning", "note"]
StageKind: TypeAlias = Literal["PTP", "LINE", "SPLINE", "BLEND", "JOINT", "HAND"]
TextKind: TypeAlias = Literal["Program", "Poses"]
JointKind: TypeAlias = Literal["revolute", "prismatic"]

# What is said of collisions wherever a motion is reported, until they are looked for.
COLLISIONS = "not looked for"

_SCRIPTS = ("scene.js", "camera.js", "solids.js", "view.js", "charts.js", "joint_charts.js", "lists.js", "run.js")
_SAME = attrs.cmp_using(eq=np.array_equal)


def _all(items: Iterable[Any]) -> tuple[Any, ...]:
    return tuple(items)


def _by_name(items: Mapping[str, Any]) -> dict[str, Any]:
    return dict(items)


@attrs.frozen(kw_only=True)
class Message:
    """A word of the checker or of the run.

    Attributes:
        severity: ``error``, ``warning`` or ``note``.
        text: the message.
        code: such as ``W201``; may be empty.
        line: line of the program, from 1; None where it belongs to none.
    """

    severity: Severity
    text: str
    code: str = ""
    line: int | None = None


@attrs.frozen(kw_only=True)
class Effect:
    """One executed statement.

    Attributes:
        t0: when it began [s].
        t1: when it ended [s]; equal to t0 where it takes no time.
        line: line of the program, from 1.
        text: what it did, such as ``ARM_1 [obj1] MOVE: PTP obj2 @100``.
        process: that did it, such as ``branch 2``; empty where there is only one.
    """

    t0: float
    t1: float
    line: int
    text: str
    process: str = ""


@attrs.frozen(kw_only=True)
class Stage:
    """One piece of motion.

    Attributes:
        t0: when it began [s].
        t1: when it ended [s].
        line: line of the program, from 1.
        arm: name of the arm.
        kind: ``PTP``, ``LINE``, ``SPLINE`` or ``BLEND`` of a program; ``JOINT`` or ``HAND`` of a move through poses.
        to: the frames it goes to, the last one its goal.
        speed: what the program asked for, 100 being normal.
        peak_speed: n largest joint speeds [rad/s] or [m/s].
        peak_effort: n largest torques [N m] or forces [N]; None where no dynamics was computed.
        hand_length: way of the hand [m].
        deviation: largest distance from the straight line [m]; None where there is none to keep.
        note: anything worth a word, such as ``slowed by joint 2 speed``.
    """

    t0: float
    t1: float
    line: int
    arm: str
    kind: StageKind
    to: tuple[str, ...] = attrs.field(converter=_all)
    speed: float
    peak_speed: tuple[float, ...] = attrs.field(converter=_all)
    peak_effort: tuple[float, ...] | None = attrs.field(default=None, converter=attrs.converters.optional(_all))
    hand_length: float
    deviation: float | None = None
    note: str = ""


@attrs.frozen(kw_only=True)
class JointInfo:
    """A joint and its limits, infinite where nothing is known.

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


@attrs.frozen(kw_only=True)
class ArmRecord:
    """What one arm did, at N instants (some 2000 are enough for a screen).

    Attributes:
        name: as the program calls it, such as ``ARM_1``.
        model: what arm it is, such as ``stanford``.
        joints: n joints from base to hand.
        t: (N,) instants [s].
        q: (N, n) positions [rad] or [m].
        qd: (N, n) speeds.
        qdd: (N, n) accelerations.
        tau: (N, n) torques [N m] or forces [N]; None where no dynamics was computed.
        hand: (N, 3) the hand in the world [m].
    """

    name: str
    model: str
    joints: tuple[JointInfo, ...] = attrs.field(converter=_all)
    t: Array = attrs.field(converter=instants, eq=_SAME)
    q: Array = attrs.field(converter=per_joint, eq=_SAME)
    qd: Array = attrs.field(converter=per_joint, eq=_SAME)
    qdd: Array = attrs.field(converter=per_joint, eq=_SAME)
    tau: Array | None = attrs.field(default=None, converter=attrs.converters.optional(per_joint), eq=_SAME)
    hand: Array = attrs.field(converter=path, eq=_SAME)

    def __attrs_post_init__(self) -> None:
        """Refuse records without one row per instant and one column per joint."""
        owner = f"record of '{self.name}'"
        columns = {"positions": self.q, "speeds": self.qd, "accelerations": self.qdd, "efforts": self.tau}
        check_rows(owner, len(self.t), {**columns, "hand path": self.hand})
        for what, track in columns.items():
            if track is not None and track.shape[1] != len(self.joints):
                raise ShapeError(f"{owner}: {len(self.joints)} joints but {track.shape[1]} columns of {what}")


@attrs.frozen(kw_only=True)
class ArmFigure:
    """How an arm looks at the M instants of the animation.

    Attributes:
        points: (M, K, 3) the skeleton from the base to the hand, in the world [m]. Corners between joint origins may
            be put in; coinciding points do no harm.
        hand_axes: (M, 9) columns n, o, a of the hand in the world; the fingers point along a and open along o.
        grip: (M,) 0 closed to 1 open.
        joint_axes: (M, n, 6) a point on the axis of each joint [m] and its direction, drawn as drums; None to
            draw balls at the points instead.
        radii: (K-1,) radius of each piece of the skeleton [m]; None to let the page choose.
    """

    points: Array = attrs.field(converter=skeleton, eq=_SAME)
    hand_axes: Array = attrs.field(converter=rotations, eq=_SAME)
    grip: Array = attrs.field(converter=numbers, eq=_SAME)
    joint_axes: Array | None = attrs.field(default=None, converter=attrs.converters.optional(axes), eq=_SAME)
    radii: Array | None = attrs.field(default=None, converter=attrs.converters.optional(numbers), eq=_SAME)

    def __attrs_post_init__(self) -> None:
        """Refuse radii that do not fit the pieces of the skeleton."""
        pieces = self.points.shape[1] - 1
        if self.radii is not None and len(self.radii) != pieces:
            raise ShapeError(f"arm figure: {pieces} pieces between the points but {len(self.radii)} radii")


@attrs.frozen(kw_only=True)
class FrameTrack:
    """Where a frame was at the M instants of the animation.

    Attributes:
        name: as the program spells it.
        poses: (M, 12) columns n, o, a, p in the world; rows before ``visible_from`` are finite but not shown.
        visible_from: first row at which the frame has a value.
    """

    name: str
    poses: Array = attrs.field(converter=poses, eq=_SAME)
    visible_from: int = 0


@attrs.frozen(kw_only=True)
class TreeChange:
    """A frame begins to hang on another one; what hangs there from the start has t = 0.

    Attributes:
        t: when [s].
        child: the frame that is hung up.
        parent: what it hangs on: ``WORLD``, an arm, or a frame.
    """

    t: float
    child: str
    parent: str


@attrs.frozen(kw_only=True)
class Animation:
    """What the three-dimensional view shows.

    Attributes:
        fps: instants per second.
        t: (M,) instants [s], at least one.
        arms: by name.
        frames: in the order in which they are drawn.
        tree: changes in order of time.
    """

    fps: float
    t: Array = attrs.field(converter=instants, eq=_SAME)
    arms: Mapping[str, ArmFigure] = attrs.field(factory=dict, converter=_by_name)
    frames: tuple[FrameTrack, ...] = attrs.field(default=(), converter=_all)
    tree: tuple[TreeChange, ...] = attrs.field(default=(), converter=_all)

    def __attrs_post_init__(self) -> None:
        """Refuse figures and frames without one row per instant."""
        rows = len(self.t)
        if not rows:
            raise ShapeError("animation: expected at least one instant")
        if not self.fps > 0:
            raise InvalidValueError(f"animation: fps must be above 0, got {self.fps}")
        for name, arm in self.arms.items():
            tracks = {"points": arm.points, "hand axes": arm.hand_axes, "grip": arm.grip, "joint axes": arm.joint_axes}
            check_rows(f"figure of '{name}'", rows, tracks)
        for frame in self.frames:
            check_rows(f"frame '{frame.name}'", rows, {"poses": frame.poses})


@attrs.frozen(kw_only=True)
class RunPage:
    """Everything the page of a run shows.

    Attributes:
        title: heading of the page.
        program_name: such as ``bench.rlo``.
        program_text: the source as written.
        cell_name: such as ``cell1.json``.
        generated_by: such as ``armwright 0.1.0``.
        command: the command line that made the page.
        duration: simulated time [s].
        status: how it ended, ``finished`` where all went well.
        messages: warnings and notes.
        effects: executed statements, in order.
        stages: pieces of motion, in order.
        arms: records of the arms.
        animation: what the view shows; None where there is nothing to see.
        text_kind: what the text is, ``Program`` or ``Poses``.
    """

    title: str
    program_name: str
    program_text: str
    cell_name: str
    generated_by: str
    command: str
    duration: float
    status: str = "finished"
    messages: tuple[Message, ...] = attrs.field(default=(), converter=_all)
    effects: tuple[Effect, ...] = attrs.field(default=(), converter=_all)
    stages: tuple[Stage, ...] = attrs.field(default=(), converter=_all)
    arms: tuple[ArmRecord, ...] = attrs.field(default=(), converter=_all)
    animation: Animation | None = None
    text_kind: TextKind = "Program"

    def __attrs_post_init__(self) -> None:
        """Refuse a duration that is none, and stages of arms or joints that are not there."""
        if not 0 <= self.duration < math.inf:
            raise InvalidValueError(f"run: duration must be 0 s or more, got {self.duration}")
        joints = {arm.name: len(arm.joints) for arm in self.arms}
        for stage in self.stages:
            if stage.arm not in joints:
                raise UnknownNameError("arm", stage.arm, joints)
            for what, peaks in (("speeds", stage.peak_speed), ("efforts", stage.peak_effort)):
                if peaks is not None and len(peaks) != joints[stage.arm]:
                    raise ShapeError(
                        f"stage on line {stage.line}: {joints[stage.arm]} joints but {len(peaks)} peak {what}"
                    )


def run_page(data: RunPage) -> str:
    """Return the whole text of the page, one HTML file that needs no other.

    Args:
        data: what happened.

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
    yield "Collisions", COLLISIONS
    yield "Command", data.command
