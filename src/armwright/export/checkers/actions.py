"""What the program of a controller does, as a checker has read it."""

from collections.abc import Mapping
from typing import TypeAlias

import attrs

from armwright.arrays import Array


@attrs.frozen(kw_only=True, eq=False)
class JointAction:
    """All joints to positions.

    Attributes:
        line: of the file.
        q: (n,) joint positions as the controller counts them [rad].
        duration: that is asked for [s]; None where a speed is.
        speed_part: part of the axis speeds of the controller, 1 for all; None where it is not said.
        passes: whether the next motion may begin before the end.
        streamed: whether it is one sample of a stream.
        X: (4, 4) tool to be reached in the place of ``q``, seen from the base frame of the controller; of the joint
            positions that do so, those with the words of ``configuration``, and of them the nearest ones.
        near: (n,) to what they are nearest, as the controller counts; None for where the arm is.
        configuration: words of the controller for a posture, by name; empty where it is free.
        kept: names of such words that are those of where the arm is.
        joint_speed: of the joint that has the longest way that is asked for [rad/s]; None where it is not said.
        rounding: by how much the duration may be rounded up, for the digits of the language [s].
    """

    line: int
    q: Array
    duration: float | None = None
    speed_part: float | None = None
    passes: bool = False
    streamed: bool = False
    rounding: float = 0.0
    X: Array | None = None
    near: Array | None = None
    configuration: Mapping[str, int] = attrs.field(factory=dict)
    kept: tuple[str, ...] = ()
    joint_speed: float | None = None


@attrs.frozen(kw_only=True, eq=False)
class LineAction:
    """The tool along a straight line.

    Attributes:
        line: of the file.
        X: (4, 4) tool at the end, seen from the base frame of the controller; None where joint positions are given.
        q: (n,) joint positions at the end as the controller counts them [rad]; None where a pose is given.
        configuration: words of the controller for the posture at the end, by name; empty where it has none.
        duration: that is asked for [s]; None where a speed is.
        speed: of the tool point that is asked for [m/s].
        turn_speed: of the rotation that is asked for [rad/s]; None where the language has none.
        zone: how far from the end the next motion may begin [m].
        rounding: by how much the duration may be rounded up, for the digits of the language [s].
    """

    line: int
    X: Array | None = None
    q: Array | None = None
    configuration: Mapping[str, int] = attrs.field(factory=dict)
    duration: float | None = None
    speed: float | None = None
    turn_speed: float | None = None
    zone: float = 0.0
    rounding: float = 0.0


@attrs.frozen(kw_only=True)
class OutputAction:
    """A digital output, by number or name, is switched."""

    line: int
    output: int | str
    on: bool


@attrs.frozen(kw_only=True)
class PulseAction:
    """A digital output, by number or name, is on for a time [s]."""

    line: int
    output: int | str
    seconds: float


@attrs.frozen(kw_only=True)
class WaitAction:
    """Nothing happens for a time [s], which may be rounded up by some of it."""

    line: int
    seconds: float
    rounding: float = 0.0


@attrs.frozen(kw_only=True)
class TextAction:
    """A text is shown."""

    line: int
    text: str


Action: TypeAlias = JointAction | LineAction | OutputAction | PulseAction | WaitAction | TextAction


@attrs.frozen(kw_only=True, eq=False)
class ReadProgram:
    """A program of a controller.

    Attributes:
        name: it is called by.
        X_CT: (4, 4) tool, seen from the flange frame of the controller.
        actions: in order.
    """

    name: str
    X_CT: Array
    actions: tuple[Action, ...]


class CheckError(ValueError):
    """A file says what its checker does not understand; the text has the line."""
