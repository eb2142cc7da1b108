"""The page of a run: its data, and the HTML file that shows them.

All data are in SI units and radians; the scripts convert them to degrees and millimetres. The file includes its style,
its scripts and its data, and uses no network.
"""

import math
from collections.abc import Iterator, Sequence
from string import Template
from typing import Literal

import attrs

from armwright.arm.model import JointKind
from armwright.arrays import Array
from armwright.report.animation import Animation
from armwright.report.collision_text import NOT_CHECKED
from armwright.report.elements import badge, facts, headline
from armwright.report.headline import run_headline
from armwright.report.limit_spans import LimitSpan
from armwright.report.markup import asset, page_html

_SCRIPTS = (
    "scene.js",
    "poses.js",
    "camera.js",
    "meshes.js",
    "surface.js",
    "gl.js",
    "labels.js",
    "view.js",
    "charts.js",
    "joint_charts.js",
    "lists.js",
    "stages.js",
    "jog.js",
    "pictures.js",
    "run.js",
)


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
        arm: name of the arm that did it; empty where none did.
    """

    t0: float
    t1: float
    line: int
    text: str
    process: str = ""
    arm: str = ""


@attrs.frozen(kw_only=True)
class LeastDistance:
    """The least distance between two bodies on a stage.

    Attributes:
        distance: [m]; None where nothing comes near.
        bound: it is no less than this anywhere [m].
        bodies: the names of both; empty where nothing comes near.
        t: when they are so near [s].
    """

    distance: float | None
    bound: float
    bodies: Sequence[str]
    t: float


@attrs.frozen(kw_only=True)
class StageBadge:
    """A remark on a stage.

    Attributes:
        text: in a few letters, such as ``acc j4``.
        title: in a sentence.
        mark: ``good``, ``warn`` or ``bad``; empty where it is neither.
        factor: how many times slower the stage is for it; None where it is not.
    """

    text: str
    title: str
    mark: Literal["", "good", "warn", "bad"] = ""
    factor: float | None = None


@attrs.frozen(kw_only=True)
class StageRow:
    """A stage of a motion.

    Attributes:
        t0: when it began [s].
        t1: when it ended [s].
        line: line of the program, from 1.
        arm: name of the arm.
        kind: ``PTP``, ``LINE``, ``ARC``, ``SPLINE`` or ``BLEND`` of a program; ``JOINT`` or ``HAND`` of a move through
            poses.
        to: its target frames; the last is the goal.
        speed: the speed in the program, 100 being normal.
        peak_speed: n largest joint speeds [rad/s] or [m/s].
        peak_effort: n largest torques [N m] or forces [N]; None where no dynamics was computed, or no masses are known.
        effort_share: n largest parts of the limits of effort, of a joint or its drive; 0 without one; None as before.
        hand_length: length of the path of the tool [m].
        deviation: largest distance from the straight line [m]; None without a line.
        badges: remarks.
        clearance: the least distance to other bodies; None where there is nothing to meet.
    """

    t0: float
    t1: float
    line: int
    arm: str
    kind: Literal["PTP", "LINE", "ARC", "SPLINE", "BLEND", "TRACK", "QUEUE", "SENSED", "JOINT", "HAND"]
    to: Sequence[str]
    speed: float
    peak_speed: Sequence[float]
    peak_effort: Sequence[float] | None = None
    effort_share: Sequence[float] | None = None
    hand_length: float
    deviation: float | None = None
    badges: Sequence[StageBadge] = ()
    clearance: LeastDistance | None = None


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
class MeasuredMotion:
    """What was measured of an arm at K instants.

    Attributes:
        t: (K,) instants [s].
        q: (K, n) positions [rad] or [m].
        qd: (K, n) speeds.
        tau: (K, n) torques [N m] or forces [N].
        error: (K, n) the tracking error, measured less planned, that is largest until the next instant [rad] or [m].
        worst: (n,) the largest tracking error of each joint in the whole run, without its sign.
        worst_t: (n,) when it occurred [s].
    """

    t: Array
    q: Array
    qd: Array
    tau: Array
    error: Array
    worst: Array
    worst_t: Array


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
        measured: what was measured; None where nothing was.
        at_limits: when joints are at their limits.
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
    measured: MeasuredMotion | None = None
    at_limits: Sequence[LimitSpan] = ()


@attrs.frozen(kw_only=True)
class SeenPicture:
    """A picture that a camera took.

    Attributes:
        t: when [s].
        camera: its name.
        frame: that it was to find.
        found: whether it was found.
        text: what was found, or why nothing was.
        png: the file as base64.
    """

    t: float
    camera: str
    frame: str
    found: bool
    text: str
    png: str


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
        pictures: that cameras took, in order.
        clearance: smaller distances of stages are marked [m].
        text_kind: kind of the text, ``Program``, ``Poses``, or ``Topics`` of a log.
        collisions: whether they were checked, and how near the arms came to other bodies.
        physics: the engine with its seed, and the largest errors, in a cell with physics; empty in one without.
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
    pictures: Sequence[SeenPicture] = ()
    clearance: float = 0.0
    text_kind: Literal["Program", "Poses", "Topics"] = "Program"
    collisions: str = NOT_CHECKED
    physics: str = ""


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
        main=Template(asset("run.html")).substitute(headline=headline(run_headline(data))),
        styles=("view.css", "run.css"),
        scripts=_SCRIPTS,
        data=data,
        generated=f"{data.generated_by}: {data.command}" if data.command else data.generated_by,
    )


def _facts(data: RunPage) -> Iterator[tuple[str, str]]:
    if data.arms:
        yield "Arms", ", ".join(f"{arm.name} ({arm.model})" for arm in data.arms)
    if data.cell_name:
        yield "Cell", data.cell_name
    yield data.text_kind, data.program_name
    if data.physics:
        yield "Physics", data.physics
    yield "Collisions", data.collisions
