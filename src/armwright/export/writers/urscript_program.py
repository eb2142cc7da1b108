"""Program mode in URScript: variables are global, and poses are rotation vectors in metres and radians."""

import re
from collections.abc import Iterable, Iterator
from typing import assert_never

import numpy as np

from armwright.arrays import Array
from armwright.export.refusals import refusal
from armwright.export.translation.code import (
    Assign,
    Call,
    Choice,
    Count,
    Declaration,
    Halt,
    Loop,
    MoveTo,
    Number,
    Operation,
    Pause,
    Pose,
    Print,
    Procedure,
    ProgramCode,
    Return,
    Signal,
    Statement,
    Switch,
    Value,
    Variable,
    WaitUntil,
)
from armwright.export.writers.controller_file import ControllerFile
from armwright.export.writers.program_text import (
    Names,
    ProgramWriter,
    ValueText,
    chunks_of_text,
    flat_index,
    is_whole,
    number_of,
    program_approximations,
    program_heading,
    scaled,
)
from armwright.export.writers.reserved_words import URSCRIPT
from armwright.export.writers.text import decimal, plain_lines
from armwright.export.writers.urscript import (
    LEAST_SPEED,
    MOST_LINES,
    NAME_LIMIT,
    REPLACED,
    TO_START,
    joints_text,
    pose_text,
)
from armwright.program.language.source import Span
from armwright.program.language.units import NORMAL_SPEED

_ATOM = 9
_ANGLES = {"rotx": 3, "roty": 4, "rotz": 5}
_COORDINATES = {"x": 0, "y": 1, "z": 2}
# Numbers that are added so, so that the last pass of a loop is not lost to rounding; a part of the step.
_HALF_STEP = 0.5


def write(code: ProgramCode) -> ControllerFile:
    """Return a program in URScript.

    Raises:
        ExportError: an output has no number, or the program has more lines than controllers bear.
    """
    return _Writer(code).file()


class _Text(ValueText):
    """Values in URScript."""

    words = {"=": "==", "<>": "!=", "negative": "-"}  # noqa: RUF012 - read alone

    def __init__(self, code: ProgramCode, names: Names) -> None:
        super().__init__(code, names)
        self.uses_angles = False

    def truth(self, truth: bool) -> str:  # noqa: FBT001 - a value
        return str(truth)

    def pose(self, X: Array) -> str:
        return short_pose(X)

    def variable(self, value: Variable) -> str:
        if not value.indices:
            return self.names(value.key)
        sizes = next(one.sizes for one in self.code.declarations if one.key == value.key)
        index = flat_index(value.indices, sizes)
        shown = self.text(index) if is_whole(index, self.whole) else f"floor({self.text(index)} + 0.5)"
        return f"{self.names(value.key)}[{shown}]"

    def signal(self, value: Signal) -> str:
        number = number_of(self.code, value.address, value.name)
        return f"get_standard_digital_{'in' if value.is_input else 'out'}({number})"

    def function(self, name: str, arguments: tuple[Value, ...]) -> tuple[str, int]:  # noqa: PLR0911 - one case per kind
        match name:
            case "compose" | "inverse":
                return self.call("pose_trans" if name == "compose" else "pose_inv", map(self.text, arguments)), _ATOM
            case "xyz":
                lengths = [self.text(scaled(one, self.metres)) for one in arguments]
                return f"p[{', '.join([*lengths, '0', '0', '0'])}]", _ATOM
            case "rotx" | "roty" | "rotz":
                parts = ["0"] * 6
                parts[_ANGLES[name]] = self.text(scaled(arguments[0], self.radians))
                return f"p[{', '.join(parts)}]", _ATOM
            case "rpy":
                self.uses_angles = True
                angles = [self.text(scaled(one, self.radians)) for one in arguments]
                return self.call(self.names("RPY POSE"), angles), _ATOM
            case "dist":
                return self.over(self.call("point_dist", map(self.text, arguments)), self.metres)
            case "x" | "y" | "z":
                return self.over(f"{self.text(arguments[0])}[{_COORDINATES[name]}]", self.metres)
            case "abs":
                return self.call("norm", map(self.text, arguments)), _ATOM
            case "sin" | "cos" | "tan":
                return self.call(name, [self.text(scaled(arguments[0], self.radians))]), _ATOM
            case "atan2":
                return self.over(self.call(name, map(self.text, arguments)), self.radians)
        return self.call(name, map(self.text, arguments)), _ATOM


def short_pose(X: Array) -> str:
    """Return a pose (4, 4) without zeros at the ends of its numbers."""
    return re.sub(r"\.?0+(?=[,\]])", "", pose_text(X))


class _Writer(ProgramWriter):
    """A program while it is written."""

    empty = ("pass",)

    def __init__(self, code: ProgramCode) -> None:
        super().__init__(code, NAME_LIMIT, URSCRIPT)
        self._values = _Text(code, self._names)
        self._threads: list[str] = []
        self._locals: frozenset[str] = frozenset()
        self._world = None if np.allclose(code.X_CW, np.eye(4), rtol=0, atol=1e-15) else self._names.fresh("WORLD")

    def file(self) -> ControllerFile:
        """Return the file."""
        code = self._code
        start = joints_text(code.mapped.joints(code.placed.start))
        body = [f"set_tcp({short_pose(code.mapped.X_CT)})", f"movej({start}, a={TO_START}, v={TO_START})"]
        body += self._block(code.statements)
        body += self._outputs_off()
        procedures = [line for one in code.procedures for line in self._procedure(one)]
        helpers = _ANGLE_POSE.format(name=self._names("RPY POSE")).splitlines() if self._values.uses_angles else []
        world = [f"global {self._world} = {short_pose(code.X_CW)}"] if self._world is not None else []
        declared = [self._declaration(one) for one in code.declarations]
        inside = [*world, *declared, *helpers, *self._threads, *procedures, *body]
        lines = [f"# {program_heading(code)}", f"def {self.name}():", *(f"  {line}" for line in inside), "end"]
        lines.append(f"{self.name}()")
        if len(lines) > MOST_LINES:
            text = f"the program takes more than {MOST_LINES:,} lines of URScript, which controllers do not bear"
            raise refusal(code.source, "E617", text, Span(0, 0), "too long", helps=["split it"])
        approximations = ["the load of the tool is that of the installation: the program does not set it"]
        approximations += program_approximations(code)
        text = "\n".join(lines) + "\n"
        return ControllerFile(name=f"{self.name}.script", text=text, approximations=tuple(approximations))

    def _declaration(self, one: Declaration) -> str:
        initial = self._values.text(one.initial)
        if one.sizes:
            initial = f"[{', '.join([initial] * one.count)}]"
        return f"global {self._names(one.key)} = {initial}"

    def _procedure(self, one: Procedure) -> list[str]:
        self._locals = frozenset(key for key, _ in one.parameters)
        parameters = ", ".join(self._names(key) for key, _ in one.parameters)
        body = [f"  {line}" for line in self._block(one.body) or ["pass"]]
        self._locals = frozenset()
        return [f"def {self._names(one.key)}({parameters}):", *body, "end"]

    def _outputs_off(self) -> list[str]:
        return [
            f"set_standard_digital_out({number_of(self._code, address, name)}, False)"
            for name, address in self._code.outputs
        ]

    # ---- statements ------------------------------------------------------------------------------------------------

    def _set(self, target: Variable, text: str) -> str:
        scope = "" if target.key in self._locals or target.indices else "global "
        return f"{scope}{self._values.text(target)} = {text}"

    def _lines(self, statement: Statement) -> Iterator[str]:  # noqa: C901, PLR0912 - one case per kind
        text = self._values.text
        match statement:
            case Assign(target=target, value=value):
                yield self._set(target, text(value))
            case MoveTo():
                yield from self._move(statement)
            case Switch(name=name, address=address, on=on, pulse=pulse):
                number = number_of(self._code, address, name, statement.span)
                yield f"set_standard_digital_out({number}, {on})"
                if pulse is not None:
                    yield f"run {self._pulse(number, text(pulse))}()"
            case Pause(seconds=seconds):
                yield f"sleep({text(seconds)})"
            case Print(items=items):
                yield from self._print(items)
            case WaitUntil():
                yield from self._wait(statement)
            case Choice(condition=condition, then=then, otherwise=otherwise):
                yield f"if {text(condition)}:"
                yield from self._inner(then)
                if otherwise:
                    yield "else:"
                    yield from self._inner(otherwise)
                yield "end"
            case Loop(condition=condition, body=body, at_end=at_end):
                yield f"while {'True' if at_end else text(condition)}:"
                yield from self._inner(body)
                if at_end:
                    yield from (f"  if not ({text(condition)}):", "    break", "  end")
                yield "end"
            case Count():
                yield from self._count(statement)
            case Call(procedure=key, arguments=arguments):
                yield self._values.call(self._names(key), map(text, arguments))
            case Return(value=value):
                yield f"return {text(value)}"
            case Halt():
                yield from self._outputs_off()
                yield "halt"
            case _:
                assert_never(statement)

    def _count(self, one: Count) -> Iterator[str]:
        text, counter = self._values.text, self._values.text(one.counter)
        yield self._set(one.counter, text(one.first))
        last: Value = one.last
        if one.limit is not None:
            yield self._set(one.limit, text(one.last))
            last = one.limit
        slack = Number(one.step * _HALF_STEP)
        end = Number(last.value + slack.value) if isinstance(last, Number) else Operation("+", (last, slack))
        yield f"while {counter} {'<' if one.step > 0 else '>'} {text(end)}:"
        yield f"  {self._set(one.variable, counter)}"
        yield from (f"  {line}" for line in self._block(one.body))
        yield f"  {self._set(one.counter, text(Operation('+', (one.counter, Number(one.step)))))}"
        yield "end"

    def _wait(self, one: WaitUntil) -> Iterator[str]:
        condition = self._values.text(one.condition)
        if one.limit is None:
            yield from (f"while not ({condition}):", "  sync()", "end")
            return
        waited = self._names("WAITED TIME")
        yield f"{waited} = 0"
        yield f"while not ({condition}) and ({waited} < {self._values.text(one.limit)}):"
        yield from ("  sync()", f"  {waited} = {waited} + get_steptime()", "end")
        if one.late:
            yield f"if not ({condition}):"
            yield from self._inner(one.late)
            yield "end"

    def _pulse(self, number: int, seconds: str) -> str:
        """Write the thread that ends a pulse, and return its name."""
        name = self._names.fresh("PULSE")
        self._threads += [
            f"thread {name}():",
            f"  sleep({seconds})",
            f"  set_standard_digital_out({number}, False)",
            "end",
        ]
        return name

    def _print(self, items: Iterable[str | Value]) -> Iterator[str]:
        parts = chunks_of_text(items)
        if all(isinstance(part, str) for part in parts):
            yield from (f'textmsg("{line}")' for line in plain_lines("".join(map(str, parts)), REPLACED))
            return
        shown = ""
        for part in parts:
            piece = (
                f'"{plain_lines(part, REPLACED)[0]}"' if isinstance(part, str) else f"to_str({self._values.text(part)})"
            )
            shown = f"str_cat({shown}, {piece})" if shown else piece
        yield f"textmsg({shown})"

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _move(self, one: MoveTo) -> Iterator[str]:
        known = one.passages
        if not one.straight:
            near = joints_text(self._code.mapped.joints(np.array(known.near)))
            joints = f"get_inverse_kin({self._target(one.targets[0])}, {near})"
            yield f"movej({joints}, {self._rate(one, known.joint_acceleration, known.joint_speed)})"
            return
        rate = self._rate(one, known.acceleration, known.speed)
        for target, zone in zip(one.targets, known.zones, strict=True):
            radius = f", r={decimal(zone, 5)}" if zone else ""
            yield f"movel({self._target(target)}, {rate}{radius})"

    def _rate(self, one: MoveTo, acceleration: float, speed: float) -> str:
        """Return the time, or the largest acceleration and speed, of a motion."""
        known = one.passages
        if len(one.targets) == 1 and known.reached and (one.duration is not None or known.turns_only):
            return f"t={decimal(one.duration or float(known.durations.max()), 4)}"
        asked = scaled(one.speed, speed / NORMAL_SPEED)
        if isinstance(asked, Number):
            return f"a={decimal(max(acceleration, LEAST_SPEED), 4)}, v={decimal(max(asked.value, LEAST_SPEED), 4)}"
        return f"a={decimal(max(acceleration, LEAST_SPEED), 4)}, v={self._values.text(asked)}"

    def _target(self, value: Value) -> str:
        if self._world is None:
            return self._values.text(value)
        if isinstance(value, Pose):
            return short_pose(self._code.X_CW @ value.X)
        return f"pose_trans({self._world}, {self._values.text(value)})"


_ANGLE_POSE = """\
def {name}(roll, pitch, yaw):
  turn = rpy2rotvec([roll, pitch, yaw])
  return p[0, 0, 0, turn[0], turn[1], turn[2]]
end"""
