"""What pages ask for: commands as JSON objects, checked before anything is done with them."""

from __future__ import annotations

import json
import typing
from typing import Any, Literal, TypeAlias

import attrs

from armwright.errors import ArmwrightError, closest, shown

# Numbers beyond this, and longer names and lists, are refused; texts of programs are bounded by the message itself.
_LARGEST, _LONGEST_NAME, _LONGEST_LIST = 1e6, 200, 64
# Bytes of a message at most.
MAX_MESSAGE = 1 << 20


class MessageError(ArmwrightError, ValueError):
    """A message is no command."""


@attrs.frozen(kw_only=True)
class Got:
    """The page has taken the latest state."""


@attrs.frozen(kw_only=True)
class SetJoint:
    """Bring a joint to a position.

    Attributes:
        arm: name of the arm.
        joint: number, from 1.
        value: [rad] or [m].
    """

    arm: str
    joint: int
    value: float


@attrs.frozen(kw_only=True)
class MoveTool:
    """Bring the tool to a pose in the world, twelve numbers n, o, a, p.

    Attributes:
        arm: name of the arm.
        pose: the pose.
        leaping: whether joints may turn far for it.
    """

    arm: str
    pose: tuple[float, ...]
    leaping: bool = False


@attrs.frozen(kw_only=True)
class Jog:
    """Move an arm steadily, until a moment after the latest of these messages; or by one step.

    Attributes:
        arm: name of the arm.
        frame: ``JOINT``, ``BASE``, ``TOOL``, ``WORLD`` or the name of a frame, whose axes are meant.
        axis: from 0: a joint; or x, y, z, then the rotations about them.
        sign: 1 or -1.
        share: of the full jogging speed, above 0 to 1.
        length: of one step along an axis or of a sliding joint [m]; 0 for steady motion.
        angle: of one step about an axis or of a revolute joint [rad]; 0 for steady motion.
    """

    arm: str
    frame: str
    axis: int
    sign: Literal[1, -1]
    share: float
    length: float = 0.0
    angle: float = 0.0


@attrs.frozen(kw_only=True)
class Halt:
    """Stop jogging."""


@attrs.frozen(kw_only=True)
class TakeSolution:
    """Take another configuration that brings the tool to where it is; its number in the latest state, from 0."""

    arm: str
    number: int


@attrs.frozen(kw_only=True)
class Grip:
    """Open or close a gripper."""

    arm: str
    open: bool


@attrs.frozen(kw_only=True)
class Undo:
    """Take back the latest change of a configuration."""


@attrs.frozen(kw_only=True)
class AskForControl:
    """Ask to be the page that commands."""


@attrs.frozen(kw_only=True)
class AnswerRequest:
    """Hand over control to the page that has asked for it, or keep it."""

    give: bool


@attrs.frozen(kw_only=True)
class Teach:
    """Add a frame to the cell file where the tool is, or give it that pose.

    Attributes:
        arm: name of the arm.
        name: of the frame.
        on: the frame that it hangs on; as before, or WORLD, when left out.
    """

    arm: str
    name: str
    on: str = ""


@attrs.frozen(kw_only=True)
class TeachJoints:
    """Add a joint target to the cell file with the configuration of an arm, or give it that configuration."""

    arm: str
    name: str


@attrs.frozen(kw_only=True)
class Rename:
    """Give a frame or a joint target of the cell file another name."""

    name: str
    to: str


@attrs.frozen(kw_only=True)
class Forget:
    """Take a frame or a joint target out of the cell file."""

    name: str


@attrs.frozen(kw_only=True)
class Unteach:
    """Take back the latest change of the cell file."""


@attrs.frozen(kw_only=True)
class Save:
    """Write the cell file or the program; under a name in the working folder where it has none yet."""

    what: Literal["cell", "program"]
    name: str = ""


@attrs.frozen(kw_only=True)
class Reload:
    """Take the program as its file has it now; what has been changed since is lost."""


@attrs.frozen(kw_only=True)
class GoTo:
    """Bring the tool of an arm to a frame, or the arm to a joint target."""

    arm: str
    name: str


@attrs.frozen(kw_only=True)
class SetText:
    """Take another text of the program.

    Attributes:
        text: the text.
        version: of the text that it was made from.
    """

    text: str
    version: int


@attrs.frozen(kw_only=True)
class InsertMove:
    """Teach a frame where the tool is, and insert a MOVE to it into the program.

    Attributes:
        arm: name of the arm.
        frame: name of the frame.
        line: behind which the MOVE is inserted, from 0.
        straight: whether along a straight line.
        approach: length of the straight line along the z axis of the goal that ends there [m]; 0 for none.
        departure: length of the straight line against the z axis of the tool by which it begins [m]; 0 for none.
        speed: 100 being normal.
        teach: whether the frame is taught; otherwise the MOVE goes to where it is already.
    """

    arm: str
    frame: str
    line: int
    teach: bool = True
    straight: bool = False
    approach: float = 0.0
    departure: float = 0.0
    speed: float = 100.0


@attrs.frozen(kw_only=True)
class InsertVia:
    """Teach a frame where the tool is, and let the MOVE in a line go past it.

    Attributes:
        arm: name of the arm.
        frame: name of the frame.
        line: from 1.
        blend: how far before the frame the corner may begin [m]; 0 for as far as the cell allows.
    """

    arm: str
    frame: str
    line: int
    blend: float = 0.0


@attrs.frozen(kw_only=True)
class TouchUp:
    """Give the goal of the MOVE in a line the pose of the tool."""

    line: int


@attrs.frozen(kw_only=True)
class Break:
    """Set or remove a breakpoint.

    Attributes:
        line: from 1.
        on: whether it is set.
        file: path of the module that the line is in, beside the program; empty for the program itself.
    """

    line: int
    on: bool
    file: str = ""


@attrs.frozen(kw_only=True)
class Run:
    """Run the program.

    Attributes:
        line: only from the statement in this line on, from where the arms are; 0 for all, from the start of the cell.
        only: whether only that statement is run.
        physics: whether in a world with physics.
        entry: whether it stands in front of the first statement.
        rate: how fast it is shown, 1 being real time.
    """

    line: int = 0
    only: bool = False
    physics: bool = False
    entry: bool = False
    rate: float = 1.0


@attrs.frozen(kw_only=True)
class Go:
    """Go on with a run, or a step on or back.

    Attributes:
        step: which.
        process: the name of the process that steps; the one that stands when left out.
    """

    step: Literal["continue", "next", "in", "out", "stage", "tick", "back"]
    process: str = ""


@attrs.frozen(kw_only=True)
class Pause:
    """Let a run stand."""


@attrs.frozen(kw_only=True)
class Stop:
    """End a run; the arms stay where they are."""


@attrs.frozen(kw_only=True)
class Reset:
    """Put arms and parts to where they are at the start of the cell."""


@attrs.frozen(kw_only=True)
class Pace:
    """How fast a run is shown, 1 being real time."""

    rate: float


@attrs.frozen(kw_only=True)
class Map:
    """Show where in a plane through the tool an arm can bring it, or show that no more."""

    arm: str
    plane: Literal["xy", "xz", "yz", "none"]


@attrs.frozen(kw_only=True)
class Preview:
    """Show where an arm would be at a frame or a joint target; without a name, show that no more."""

    arm: str
    name: str


@attrs.frozen(kw_only=True)
class Keep:
    """Send a file of the run: its page, a 3-D file that moves, or a film."""

    what: Literal["page", "gltf", "gif"]


@attrs.frozen(kw_only=True)
class Operate:
    """Switch a device of the cell."""

    device: str
    on: bool


@attrs.frozen(kw_only=True)
class SetInput:
    """Set an input of the cell by hand."""

    input: str
    value: float


@attrs.frozen(kw_only=True)
class Look:
    """Send what a camera sees."""

    camera: str


@attrs.frozen(kw_only=True)
class KeepMotion:
    """Keep the motion of the run, to be compared with another one."""


@attrs.frozen(kw_only=True)
class Complete:
    """Send what can be written at a position.

    Attributes:
        text: the program as it is being written.
        offset: of the position, in characters.
    """

    text: str
    offset: int


@attrs.frozen(kw_only=True)
class Describe:
    """Send what there is to say about what stands at a position of the program, in characters."""

    offset: int


Command: TypeAlias = (
    Got
    | SetJoint
    | MoveTool
    | Jog
    | Halt
    | TakeSolution
    | Grip
    | Undo
    | AskForControl
    | AnswerRequest
    | Teach
    | TeachJoints
    | Rename
    | Forget
    | Unteach
    | Save
    | Reload
    | GoTo
    | SetText
    | InsertMove
    | InsertVia
    | TouchUp
    | Break
    | Run
    | Go
    | Pause
    | Stop
    | Reset
    | Pace
    | Map
    | Preview
    | Keep
    | Operate
    | SetInput
    | Look
    | KeepMotion
    | Complete
    | Describe
)
# By the word in a message.
_COMMANDS: dict[str, type[Any]] = {
    "got": Got,
    "joint": SetJoint,
    "tool": MoveTool,
    "jog": Jog,
    "halt": Halt,
    "solution": TakeSolution,
    "grip": Grip,
    "undo": Undo,
    "ask": AskForControl,
    "answer": AnswerRequest,
    "teach": Teach,
    "teach joints": TeachJoints,
    "rename": Rename,
    "forget": Forget,
    "unteach": Unteach,
    "save": Save,
    "reload": Reload,
    "go to": GoTo,
    "text": SetText,
    "insert": InsertMove,
    "via": InsertVia,
    "touch up": TouchUp,
    "break": Break,
    "run": Run,
    "go": Go,
    "pause": Pause,
    "stop": Stop,
    "reset": Reset,
    "pace": Pace,
    "map": Map,
    "preview": Preview,
    "keep": Keep,
    "operate": Operate,
    "input": SetInput,
    "look": Look,
    "keep motion": KeepMotion,
    "complete": Complete,
    "describe": Describe,
}


_HINTS = {word: typing.get_type_hints(kind) for word, kind in _COMMANDS.items()}


def read_message(text: str | bytes) -> Command:
    """Return the command of a message.

    Raises:
        MessageError: it is none, with what is wrong.
    """
    if isinstance(text, bytes):
        raise MessageError("expected a text, got bytes")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"expected JSON: {error}") from None
    if not isinstance(content, dict):
        raise MessageError(f"expected an object, got {shown(content)}")
    word = content.pop("do", None)
    kind = _COMMANDS.get(word) if isinstance(word, str) else None
    if kind is None:
        near = closest(word, _COMMANDS) if isinstance(word, str) else None
        raise MessageError(f"do: no command {shown(word)}" + (f"; did you mean {near}?" if near else ""))
    return _made(kind, word, content)


def _made(kind: type[Any], word: str, content: dict[str, Any]) -> Command:
    hints = _HINTS[word]
    known = {field.name: field.default for field in attrs.fields(kind)}
    for name in content:
        if name not in known:
            raise MessageError(f"{word}: no field {shown(name)}")
    for name, default in known.items():
        if name not in content and default is attrs.NOTHING:
            raise MessageError(f"{word}: {name} is missing")
    made: Command = kind(**{name: _checked(f"{word}.{name}", value, hints[name]) for name, value in content.items()})
    return made


def _checked(name: str, value: Any, kind: Any) -> Any:
    if typing.get_origin(kind) is tuple:
        if not isinstance(value, list) or len(value) > _LONGEST_LIST:
            raise MessageError(f"{name}: expected a list of at most {_LONGEST_LIST} numbers, got {shown(value)}")
        return tuple(_number(name, item) for item in value)
    if typing.get_origin(kind) is Literal:
        choices = typing.get_args(kind)
        if isinstance(value, bool) or value not in choices:
            raise MessageError(f"{name}: expected {' or '.join(map(str, choices))}, got {shown(value)}")
        return value
    if kind is float:
        return _number(name, value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise MessageError(f"{name}: expected {kind.__name__}, got {shown(value)}")
    if kind is str and len(value) > _LONGEST_NAME and not name.endswith(".text"):
        raise MessageError(f"{name}: longer than {_LONGEST_NAME} characters")
    if kind is int and abs(value) > _LARGEST:
        raise MessageError(f"{name}: beyond {_LARGEST:.0f}, got {shown(value)}")
    return value


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MessageError(f"{name}: expected a number, got {shown(value)}")
    # Whole numbers may be too large for a float, and nan is no number.
    if not abs(value) <= _LARGEST:
        raise MessageError(f"{name}: expected a number within {_LARGEST:.0f}, got {shown(value)}")
    return float(value)
