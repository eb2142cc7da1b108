"""KRL: lengths in millimetres, angles in degrees, orientations as angles A, B, C about Z, Y, X."""

from collections.abc import Iterable, Iterator

import numpy as np

from armwright.arrays import Array
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
from armwright.export.writers.posture import Posture, postures, status_and_turn
from armwright.export.writers.reserved_words import KRL
from armwright.export.writers.text import decimal, decimals, identifier, plain_lines

# Digits behind the point: 10 nm and 0.2 µrad.
_DIGITS = 5
NAME_LIMIT = 24
# The slowest that motions are written with: part of the axis speed [%], [m/s] and [m/s²], [deg/s]. Of lines without a
# turn the ends differ by rounding, which must not take longer than the line.
LEAST_PERCENT, LEAST_RATE, LEAST_TURN = 0.1, 1e-4, 0.1
# How near knots are passed, as a part of the ways between them [%].
_KNOT_ZONE = 50
# How fast the arm comes to where the program begins, from wherever it is [%].
TO_START = 10
# What would end a text.
REPLACED = '"'


def write(program: ControllerProgram) -> ControllerFile:
    """Return a program in KRL.

    Raises:
        ExportError: it has an output without a number.
    """
    name = identifier(program.name, NAME_LIMIT, KRL)
    tool = program.mapped.X_CT
    lines = ["&ACCESS RVP", f"DEF {name}( )", f"; {heading(program)}", "BAS(#INITMOV,0)", "$BASE=$NULLFRAME"]
    lines += [f"$TOOL={{{frame_text(tool)}}}", "$IPO_MODE=#BASE"]
    lines += [f"BAS(#VEL_PTP,{TO_START})", f"PTP {{{axes_text(program.mapped.joints(program.start))}}}"]
    said = {"BAS(#VEL_PTP,": str(TO_START)}
    ends = iter(postures(program.mapped, program.straight_ends()))
    for statement in program.statements:
        lines += _lines(statement, program, said, ends)
    lines.append("END")
    return ControllerFile(
        name=f"{name}.src", text="\n".join(lines) + "\n", approximations=tuple(_approximations(program))
    )


def _lines(
    statement: Statement, program: ControllerProgram, said: dict[str, str], ends: Iterator[Posture]
) -> Iterator[str]:
    """Give the lines of a statement, without settings that have been said and hold still.

    Args:
        statement: to be written.
        program: that it is part of.
        said: the settings that hold, by what begins their lines.
        ends: the postures at the ends of all straight lines that are still to be written.
    """
    match statement:
        case MoveJoints(q=q, speed_part=part):
            yield from _settings(said, {"BAS(#VEL_PTP,": percent_text(part)})
            yield f"PTP {{{axes_text(program.mapped.joints(q))}}}"
        case MoveLines():
            yield from _straight(statement, program, said, ends)
        case MoveKnots(q=q, speed_part=part):
            yield from _settings(said, {"BAS(#VEL_PTP,": percent_text(part), "$APO.CPTP=": str(_KNOT_ZONE)})
            shown = program.mapped.joints(q)
            yield from (f"PTP {{{axes_text(knot)}}} C_PTP" for knot in shown[:-1])
            yield f"PTP {{{axes_text(shown[-1])}}}"
        case SetOutput(output=output, on=on, device=device):
            if not output.number:
                text = f"the cell file gives the output of {device} no number, or 0, and KRL counts outputs from 1"
                helps = ["write its number as the key `output`"]
                raise refusal(program.source, "E615", text, statement.span, "it is switched here", helps=helps)
            yield f"$OUT[{output.number}]={'TRUE' if on else 'FALSE'}"
        case Wait(seconds=seconds):
            yield f"WAIT SEC {decimal(seconds, 4)}"
        case Say(text=text):
            for line in plain_lines(text, REPLACED):
                yield "WAIT FOR StrClear($LOOP_MSG[])"
                yield "$LOOP_CONT=TRUE"
                yield f'$LOOP_MSG[]="{line}"'


def _straight(
    statement: MoveLines, program: ControllerProgram, said: dict[str, str], ends: Iterator[Posture]
) -> Iterator[str]:
    speed, acceleration = (decimal(max(x, LEAST_RATE), 5) for x in (statement.speed, statement.acceleration))
    turn = decimal(max(float(np.degrees(statement.turn_speed)), LEAST_TURN), 5)
    wanted = {"$VEL.CP=": speed, "$VEL.ORI1=": turn, "$VEL.ORI2=": turn, "$ACC.CP=": acceleration}
    yield from _settings(said, wanted)
    poses = program.mapped.pose(statement.poses)
    for pose, zone in zip(poses, statement.zones, strict=True):
        status, turns = status_and_turn(next(ends))
        if zone:
            yield from _settings(said, {"$APO.CDIS=": decimal(zone * 1e3, 3)})
        yield f"LIN {{{frame_text(pose)},S {status},T {turns}}}{' C_DIS' if zone else ''}"


def _settings(said: dict[str, str], wanted: dict[str, str]) -> Iterator[str]:
    """Give the lines that say what has not been said before, or was said otherwise."""
    for what, value in wanted.items():
        if said.get(what) != value:
            said[what] = value
            yield f"{what}{value}{')' if what.startswith('BAS(') else ''}"


def percent_text(part: float) -> str:
    """Return a part of the axis speeds [%]."""
    return decimal(min(max(part * 100.0, LEAST_PERCENT), 100.0), 3)


def axes_text(q: Iterable[float]) -> str:
    """Return joint positions (6,) as the controller counts them, as the fields of AXIS."""
    angles = decimals(np.degrees(np.asarray(q)), _DIGITS)
    return ",".join(f"A{i} {angle}" for i, angle in enumerate(angles, 1))


def frame_text(X: Array) -> str:
    """Return a pose (4, 4) as the fields of FRAME."""
    numbers = decimals([*(X[:3, 3] * 1e3), *zyx_angles(X[:3, :3])], _DIGITS)
    return ",".join(f"{name} {number}" for name, number in zip("XYZABC", numbers, strict=True))


def _approximations(program: ControllerProgram) -> Iterator[str]:
    yield "the load of the tool is that of the controller: the program does not set it"
    yield "the axis speeds of the controller at 100 % are taken to be the speed limits of the arm"
    yield from common_approximations(program, REPLACED)
    if any(isinstance(one, MoveKnots) for one in program.statements):
        yield "timing and shape between knots: they are passed with C_PTP, at the speed of the controller"
