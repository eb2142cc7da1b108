"""Programs of FANUC's pendant as ASCII files: positions as joints in degrees, behind the statements that use them."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from armwright.arrays import Array
from armwright.export.conventions import ControllerArm
from armwright.export.refusals import refusal
from armwright.export.statements import (
    ControllerProgram,
    MoveJoints,
    MoveKnots,
    MoveLines,
    Say,
    SetOutput,
    Statement,
    Wait,
)
from armwright.export.writers.controller_file import ControllerFile, common_approximations, heading
from armwright.export.writers.orientations import zyx_angles
from armwright.export.writers.reserved_words import FANUC
from armwright.export.writers.text import decimal, decimals, identifier, plain_lines

# Digits behind the point: 10 nm and 0.2 µrad.
_DIGITS = 5
# What older controllers bear: characters of a name and of a text, and lines.
NAME_LIMIT, TEXT_LIMIT = 8, 20
MOST_LINES = 9_999
# Times are written in whole parts of a second: those of motions, of motions that are longer than the most
# milliseconds, and of waits.
_MOTION, _LONG_MOTION, _WAIT = 1_000, 10, 100
_MOST_MILLISECONDS = 32_000
# A part of such a part that is rounding.
_ROUNDING = 1e-6
# The registers that the program sets: a tool, and the position register that it is put together in.
_REGISTER = 9
# How fast the arm comes to where the program begins, from wherever it is.
TO_START = "10%"
# What would end a text.
REPLACED = "[];"

# What differs from the run in every program.
COMMON = (
    "the load of the tool is that of the controller: the program does not set it",
    f"tool {_REGISTER} and position register {_REGISTER} of the controller are overwritten",
    "times are whole milliseconds, above 32 s tenths of a second, and hundredths where the arm waits: rounded up",
)

_HEAD = """\
/PROG  {name}
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "armwright";
PROG_SIZE\t= 0;
CREATE\t\t= DATE 00-01-01  TIME 00:00:00;
MODIFIED\t= DATE 00-01-01  TIME 00:00:00;
FILE_NAME\t= ;
VERSION\t\t= 0;
LINE_COUNT\t= {lines};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN
"""


def write(program: ControllerProgram) -> ControllerFile:
    """Return a program of the pendant.

    Raises:
        ExportError: it has more lines than controllers bear, or an output without a number.
    """
    name = identifier(program.name, NAME_LIMIT, FANUC).upper()
    comments = (plain_lines(part, REPLACED, TEXT_LIMIT) for part in heading(program).split(", "))
    lines = [f"  !{line}" for part in comments for line in part]
    lines += tool_lines(program.mapped)
    positions: list[str] = []
    lines.append(f"J {position(program.mapped.joints(program.start), positions)} {TO_START} FINE")
    for statement in program.statements:
        lines += _lines(statement, program, positions)
        if len(lines) > MOST_LINES:
            text = f"the program takes more than {MOST_LINES:,} lines, which controllers of FANUC do not bear"
            helps = ["export parts of the program one by one, or by `armwright export ros2`"]
            raise refusal(program.source, "E617", text, statement.span, "too many lines from here on", helps=helps)
    return ControllerFile(
        name=f"{name}.ls",
        text=file_text(name, lines, positions),
        approximations=tuple(_approximations(program)),
    )


def file_text(name: str, lines: Sequence[str], positions: Sequence[str]) -> str:
    """Return the text of a program with numbered lines and the positions behind them."""
    body = "\n".join(f"{i:4d}:{line} ;" for i, line in enumerate(lines, 1))
    return _HEAD.format(name=name, lines=len(lines)) + "\n".join([body, "/POS", *positions, "/END"]) + "\n"


def tool_lines(mapped: ControllerArm) -> list[str]:
    """Return the lines that choose the base frame and set the tool."""
    tool = mapped.X_CT
    numbers = decimals([*(tool[:3, 3] * 1e3), *reversed(zyx_angles(tool[:3, :3]))], _DIGITS)
    # A position register that was recorded in joints would take the numbers of the tool as joints.
    lines = ["  UFRAME_NUM=0", f"  PR[{_REGISTER}]=LPOS"]
    lines += [f"  PR[{_REGISTER},{i}]={number}" for i, number in enumerate(numbers, 1)]
    return [*lines, f"  UTOOL[{_REGISTER}]=PR[{_REGISTER}]", f"  UTOOL_NUM={_REGISTER}"]


def _lines(statement: Statement, program: ControllerProgram, positions: list[str]) -> Iterator[str]:
    match statement:
        case MoveJoints(q=q, duration=duration):
            yield f"J {position(program.mapped.joints(q), positions)} {time_text(duration)} FINE"
        case MoveLines(q=q, duration=duration):
            yield f"L {position(program.mapped.joints(q[-1]), positions)} {time_text(duration)} FINE"
        case MoveKnots(q=q, times=times):
            shown, parts = program.mapped.joints(q), np.diff(times, prepend=0.0)
            for i, (knot, part) in enumerate(zip(shown, parts, strict=True), 1):
                end = "FINE" if i == len(shown) else "CNT100"
                yield f"J {position(knot, positions)} {time_text(float(part))} {end}"
        case SetOutput(output=output, on=on, device=device):
            if not output.number:
                text = f"the cell file gives the output of {device} no number, or 0, and FANUC counts outputs from 1"
                helps = ["write its number as the key `output`"]
                raise refusal(program.source, "E615", text, statement.span, "it is switched here", helps=helps)
            yield f"  DO[{output.number}]={'ON' if on else 'OFF'}"
        case Wait(seconds=seconds):
            yield f"  WAIT {wait_text(seconds)}(sec)"
        case Say(text=text):
            yield from (f"  MESSAGE[{line}]" for line in plain_lines(text, REPLACED, TEXT_LIMIT))


def position(shown: Array, positions: list[str]) -> str:
    """Put joint positions (6,) behind the program, and return their name."""
    name = f"P[{len(positions) + 1}]"
    angles = [f"J{i}= {angle} deg" for i, angle in enumerate(decimals(np.degrees(shown), _DIGITS), 1)]
    first, second = ",\t".join(angles[:3]), ",\t".join(angles[3:])
    positions.append(f"{name}{{\n   GP1:\n\tUF : 0, UT : {_REGISTER},\n\t{first},\n\t{second}\n}};")
    return name


def time_text(seconds: float) -> str:
    """Return the time of a motion."""
    milliseconds = _parts(seconds, _MOTION)
    if milliseconds <= _MOST_MILLISECONDS:
        return f"{milliseconds}msec"
    return f"{decimal(_parts(seconds, _LONG_MOTION) / _LONG_MOTION, 1)}sec"


def wait_text(seconds: float) -> str:
    """Return the time of a wait."""
    return decimal(_parts(seconds, _WAIT) / _WAIT, 2)


def _parts(seconds: float, parts: int) -> int:
    """Return a time in whole parts of a second, rounded up."""
    return max(math.ceil(seconds * parts - _ROUNDING), 1)


def _approximations(program: ControllerProgram) -> Iterator[str]:
    yield from COMMON
    yield from common_approximations(program, REPLACED, TEXT_LIMIT)
    if any(isinstance(one, MoveKnots) for one in program.statements):
        yield "timing and shape between knots, rounded corners among them: they are passed with CNT100"
