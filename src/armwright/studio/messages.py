"""What pages ask for: commands as JSON objects, checked before anything is done with them."""

from __future__ import annotations

import json
import math
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
class SetJoints:
    """Bring all joints of an arm to positions [rad] or [m]."""

    arm: str
    q: tuple[float, ...]


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
    """Move an arm steadily, until a moment after the latest of these messages.

    Attributes:
        arm: name of the arm.
        frame: ``JOINT``, ``BASE``, ``TOOL``, ``WORLD`` or the name of a frame, whose axes are meant.
        axis: from 0: a joint; or x, y, z, then the rotations about them.
        way: 1 or -1.
        share: of the full jogging speed, above 0 to 1.
    """

    arm: str
    frame: str
    axis: int
    way: Literal[1, -1]
    share: float


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


Command: TypeAlias = (
    Got
    | SetJoint
    | SetJoints
    | MoveTool
    | Jog
    | Halt
    | TakeSolution
    | Grip
    | Undo
    | AskForControl
    | AnswerRequest
)
# By the word in a message.
_COMMANDS: dict[str, type[Any]] = {
    "got": Got,
    "joint": SetJoint,
    "joints": SetJoints,
    "tool": MoveTool,
    "jog": Jog,
    "halt": Halt,
    "solution": TakeSolution,
    "grip": Grip,
    "undo": Undo,
    "ask": AskForControl,
    "answer": AnswerRequest,
}


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
    hints = typing.get_type_hints(kind)
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
    if kind is str and len(value) > _LONGEST_NAME:
        raise MessageError(f"{name}: longer than {_LONGEST_NAME} characters")
    if kind is int and abs(value) > _LARGEST:
        raise MessageError(f"{name}: beyond {_LARGEST:.0f}, got {shown(value)}")
    return value


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MessageError(f"{name}: expected a number, got {shown(value)}")
    if not math.isfinite(value) or abs(value) > _LARGEST:
        raise MessageError(f"{name}: expected a number within {_LARGEST:.0f}, got {shown(value)}")
    return float(value)
