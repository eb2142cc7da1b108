"""URScript: lengths in metres, angles in radians, orientations as rotation vectors."""

import math
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
from armwright.export.writers.orientations import rotation_vector
from armwright.export.writers.reserved_words import URSCRIPT
from armwright.export.writers.text import decimal, decimals, identifier, plain_lines

# Digits behind the point: 0.1 µm and 0.1 µrad.
_DIGITS = 7
# Controllers become unstable with more lines in one program.
MOST_LINES = 15_000
NAME_LIMIT = 64
# The slowest that a line is written with [m/s], [m/s²].
LEAST_SPEED = 1e-4
_STREAM_PERIOD = 0.008
# What a number of these periods may be off a whole one.
_ROUNDING = 1e-6
# How the arm comes to where the program begins, from wherever it is [rad/s], [rad/s²].
TO_START = 0.2
# What would end a text, or change the meaning of what follows.
REPLACED = '"\\'


def write(program: ControllerProgram) -> ControllerFile:
    """Return a program in URScript.

    Raises:
        ExportError: it has more lines than controllers bear, or an output without a number.
    """
    name = identifier(program.name, NAME_LIMIT, URSCRIPT)
    lines = [f"# {heading(program)}", f"def {name}():", f"  set_tcp({pose_text(program.mapped.X_CT)})"]
    lines.append(f"  movej({joints_text(program.mapped.joints(program.start))}, a={TO_START}, v={TO_START})")
    for statement in program.statements:
        lines += [f"  {line}" for line in _lines(statement, program)]
        if len(lines) > MOST_LINES:
            text = f"the program takes more than {MOST_LINES:,} lines of URScript, which controllers do not bear"
            helps = [
                "export the program by `--mode program`, in which loops stay loops and paths are a line for each frame"
            ]
            raise refusal(program.source, "E617", text, statement.span, "too many lines from here on", helps=helps)
    lines += ["end", f"{name}()"]
    return ControllerFile(
        name=f"{name}.script", text="\n".join(lines) + "\n", approximations=tuple(_approximations(program))
    )


def _lines(statement: Statement, program: ControllerProgram) -> Iterator[str]:
    match statement:
        case MoveJoints(q=q, duration=duration):
            yield f"movej({joints_text(program.mapped.joints(q))}, t={decimal(duration, 4)})"
        case MoveLines():
            yield from _straight(statement, program)
        case MoveKnots(stage=stage):
            period = program.mapped.convention.stream_period or _STREAM_PERIOD
            count = math.ceil(stage.motion.duration / period - _ROUNDING)
            positions = program.mapped.joints(stage.motion(np.linspace(0.0, stage.motion.duration, count + 1)[1:]))
            following = f"t={period:g}, lookahead_time=0.03, gain=500)"
            for q in positions:
                yield f"servoj({joints_text(q)}, 0, 0, {following}"
            yield "stopj(4.0)"
        case SetOutput(output=output, on=on, device=device):
            if output.number is None:
                text = f"the cell file gives the output of {device} a name, and URScript knows outputs by numbers"
                helps = ["write its number as the key `output`"]
                raise refusal(program.source, "E615", text, statement.span, "it is switched here", helps=helps)
            yield f"set_standard_digital_out({output.number}, {on})"
        case Wait(seconds=seconds):
            yield f"sleep({decimal(seconds, 4)})"
        case Say(text=text):
            for line in plain_lines(text, REPLACED):
                yield f'textmsg("{line}")'


def _straight(statement: MoveLines, program: ControllerProgram) -> Iterator[str]:
    poses = program.mapped.pose(statement.poses)
    if len(poses) == 1:
        yield f"movel({pose_text(poses[0])}, t={decimal(statement.duration, 4)})"
        return
    speed, acceleration = (max(x, LEAST_SPEED) for x in (statement.speed, statement.acceleration))
    for pose, zone in zip(poses, statement.zones, strict=True):
        radius = f", r={decimal(zone, 5)}" if zone else ""
        yield f"movel({pose_text(pose)}, a={decimal(acceleration, 4)}, v={decimal(speed, 4)}{radius})"


def joints_text(q: Iterable[float]) -> str:
    """Return joint positions (6,) as the controller counts them [rad]."""
    return f"[{', '.join(decimals(q, _DIGITS))}]"


def pose_text(X: Array) -> str:
    """Return a pose (4, 4)."""
    return f"p[{', '.join(decimals([*X[:3, 3], *rotation_vector(X[:3, :3])], _DIGITS))}]"


def _approximations(program: ControllerProgram) -> Iterator[str]:
    yield "the load of the tool is that of the installation: the program does not set it"
    yield from common_approximations(program, REPLACED)
    if any(isinstance(one, MoveKnots) for one in program.statements):
        yield "streamed stages take up to one period of the stream longer than the plan"
