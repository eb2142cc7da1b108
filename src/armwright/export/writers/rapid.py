"""RAPID: lengths in millimetres, angles in degrees, orientations as quaternions."""

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
from armwright.export.writers.orientations import quaternion
from armwright.export.writers.posture import Posture, confdata, postures
from armwright.export.writers.reserved_words import RAPID
from armwright.export.writers.text import decimal, decimals, identifier, plain_lines

# Digits behind the point: 0.1 µm, of angles 2 µrad to 0.2 µrad, of quaternions 10 nrad.
_LENGTH_DIGITS, _ANGLE_DIGITS, _QUATERNION_DIGITS = 4, 5, 8
NAME_LIMIT = 32
NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOL = "tool_1"
# Of speeds: that of external axes [mm/s], [deg/s]; the slowest of the tool [mm/s], [deg/s].
EXTERNAL, LEAST_SPEED = "5000,1000", 1e-2
# Where the duration is given, and on the way to where the program begins, from wherever the arm is.
_TIMED, SLOW = "v1000", "v50"


def write(program: ControllerProgram) -> ControllerFile:
    """Return a program in RAPID.

    Raises:
        ExportError: it has an output without a name.
    """
    name = identifier(program.name, NAME_LIMIT, RAPID)
    lines = [
        f"MODULE {name}",
        f"  ! {heading(program)}",
        f"  PERS tooldata {TOOL}:=[TRUE,[{frame_text(program.mapped.X_CT)}],[1,[0,0,1],[1,0,0,0],0,0,0]];",
        "  PROC main()",
        "    ConfL\\Off;",
        f"    {absolute(program.mapped.joints(program.start), SLOW, 'fine')};",
    ]
    ends = iter(postures(program.mapped, program.straight_ends()))
    for statement in program.statements:
        lines += [f"    {line};" for line in _lines(statement, program, ends)]
    lines += ["  ENDPROC", "ENDMODULE"]
    return ControllerFile(
        name=f"{name}.mod", text="\n".join(lines) + "\n", approximations=tuple(_approximations(program))
    )


def _lines(statement: Statement, program: ControllerProgram, ends: Iterator[Posture]) -> Iterator[str]:
    """Give the instructions of a statement; ``ends`` are the postures at the ends of all lines still to be written."""
    match statement:
        case MoveJoints(q=q, duration=duration):
            yield absolute(program.mapped.joints(q), within(duration), "fine")
        case MoveLines():
            yield from _straight(statement, program, ends)
        case MoveKnots(q=q, times=times):
            shown, parts = program.mapped.joints(q), np.diff(times, prepend=0.0)
            for i, (knot, part) in enumerate(zip(shown, parts, strict=True), 1):
                yield absolute(knot, within(float(part)), "fine" if i == len(shown) else "z1")
        case SetOutput(output=output, on=on, device=device):
            if output.signal is None:
                text = f"the cell file gives the output of {device} a number, and RAPID knows signals by names"
                helps = ['write the name of the signal as the key `signal`, as in `signal = "doLamp"`']
                raise refusal(program.source, "E615", text, statement.span, "it is switched here", helps=helps)
            yield f"SetDO {output.signal},{int(on)}"
        case Wait(seconds=seconds):
            yield f"WaitTime {decimal(seconds, 4)}"
        case Say(text=text):
            for line in plain_lines(text):
                escaped = line.replace("\\", "\\\\").replace('"', '""')
                yield f'TPWrite "{escaped}"'


def absolute(q: Array, speed: str, zone: str) -> str:
    """Return a motion to joint positions (6,) as the controller counts them [rad]."""
    angles = ",".join(decimals(np.degrees(q), _ANGLE_DIGITS))
    return f"MoveAbsJ [[{angles}],{NO_AXES}],{speed},{zone},{TOOL}"


def within(duration: float) -> str:
    """Return the speed of a motion that is to take a time [s]."""
    return f"{_TIMED}\\T:={decimal(duration, 4)}"


def _straight(statement: MoveLines, program: ControllerProgram, ends: Iterator[Posture]) -> Iterator[str]:
    poses = program.mapped.pose(statement.poses)
    speed = [max(statement.speed * 1e3, LEAST_SPEED), max(float(np.degrees(statement.turn_speed)), LEAST_SPEED)]
    for pose, zone in zip(poses, statement.zones, strict=True):
        configuration = ",".join(map(str, confdata(next(ends))))
        target = f"[{frame_text(pose)},[{configuration}],{NO_AXES}]"
        how = within(statement.duration) if len(poses) == 1 else f"[{','.join(decimals(speed, 3))},{EXTERNAL}]"
        yield f"MoveL {target},{how},{zone_text(zone)},{TOOL}\\WObj:=wobj0"


def zone_text(distance: float) -> str:
    """Return a corner zone: the tool point leaves its line no farther from the corner than a distance [m]."""
    if not distance:
        return "fine"
    path = decimal(distance * 1e3, 3)
    return f"[FALSE,{path},{path},{path},10,{path},10]"


def frame_text(X: Array) -> str:
    """Return place and orientation of a pose (4, 4)."""
    position = ",".join(decimals(X[:3, 3] * 1e3, _LENGTH_DIGITS))
    return f"[{position}],[{_numbers(quaternion(X[:3, :3]))}]"


def _numbers(values: Iterable[float]) -> str:
    return ",".join(decimals(values, _QUATERNION_DIGITS))


def _approximations(program: ControllerProgram) -> Iterator[str]:
    yield "the tool is written with a load of 1 kg, 1 mm from the flange: put in that of the tool"
    yield from common_approximations(program, "")
    if any(isinstance(one, MoveKnots) for one in program.statements):
        yield "shape between knots: they are passed with zone z1"
