"""Program mode in RAPID: variables of the module, and targets seen from a work object that is the world."""

import re
from collections.abc import Iterable, Iterator
from typing import assert_never

import numpy as np

from armwright.arrays import Array
from armwright.cell.outputs import Output
from armwright.export.refusals import refusal
from armwright.export.translation.code import (
    Assign,
    Call,
    Choice,
    Count,
    Declaration,
    Halt,
    Kind,
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
from armwright.export.writers.posture import confdata, postures
from armwright.export.writers.program_text import (
    MILLIMETRES,
    ProgramWriter,
    TextInDegrees,
    chunks_of_text,
    is_whole,
    program_approximations,
    program_heading,
    scaled,
)
from armwright.export.writers.rapid import (
    EXTERNAL,
    LEAST_SPEED,
    NAME_LIMIT,
    NO_AXES,
    SLOW,
    TOOL,
    absolute,
    frame_text,
    within,
    zone_text,
)
from armwright.export.writers.reserved_words import RAPID
from armwright.export.writers.text import decimal, plain_lines
from armwright.program.language.source import Span
from armwright.program.language.units import NORMAL_SPEED

_ATOM = 9
_TYPES: dict[Kind, str] = {"number": "num", "truth": "bool", "pose": "pose"}
_WORLD = "world"


def write(code: ProgramCode) -> ControllerFile:
    """Return a program in RAPID.

    Raises:
        ExportError: an input or output has no name, or a target is reached in several postures.
    """
    return _Writer(code).file()


def short_pose(X: Array) -> str:
    """Return a pose (4, 4) without zeros at the ends of its numbers."""
    short = re.sub(r"\.?0+(?=[,\]])", "", frame_text(X))
    return f"[{short}]"


class _Text(TextInDegrees):
    """Values in RAPID."""

    words = {"negative": "-", "and": "AND", "or": "OR", "not": "NOT"}  # noqa: RUF012 - read alone

    def pose(self, X: Array) -> str:
        return short_pose(X)

    def variable(self, value: Variable) -> str:
        name = self.names(value.key)
        return f"{name}{{{','.join(map(self._index, value.indices))}}}" if value.indices else name

    def _index(self, value: Value) -> str:
        text = self.text(value)
        return text if is_whole(value, self.whole) else f"Round({text})"

    def signal(self, value: Signal) -> str:
        name = signal_name(self.code, value.address, value.name)
        return f"({'DInput' if value.is_input else 'DOutput'}({name}) = 1)"

    def function(self, name: str, arguments: tuple[Value, ...]) -> tuple[str, int]:  # noqa: PLR0911 - one case per kind
        match name:
            case "compose" | "inverse":
                return self.call("PoseMult" if name == "compose" else "PoseInv", map(self.text, arguments)), _ATOM
            case "xyz":
                lengths = [self.millimetres(one) for one in arguments]
                return f"[[{','.join(lengths)}],[1,0,0,0]]", _ATOM
            case "rotx" | "roty" | "rotz" | "rpy":
                angle = [self.degrees(one) for one in arguments]
                angles = {"rotx": ("0", "0", angle[0]), "roty": ("0", angle[0], "0"), "rotz": (angle[0], "0", "0")}
                return f"[[0,0,0],OrientZYX({','.join(angles.get(name, tuple(reversed(angle))))})]", _ATOM
            case "dist":
                return self.over_millimetres(self.call(self.helper("DISTANCE OF"), map(self.text, arguments)))
            case "x" | "y" | "z":
                if isinstance(arguments[0], Variable):
                    return self.over_millimetres(f"{self.text(arguments[0])}.trans.{name}")
                return self.over_millimetres(self.call(self.helper(f"{name} OF"), [self.text(arguments[0])]))
            case "sin" | "cos" | "tan":
                return self.call(name.capitalize(), [self.degrees(arguments[0])]), _ATOM
            case "atan2":
                return self.over(self.call("ATan2", map(self.text, arguments)), float(np.degrees(self.radians)))
        return self.call(name.capitalize(), map(self.text, arguments)), _ATOM


class _Writer(ProgramWriter):
    """A program while it is written."""

    def __init__(self, code: ProgramCode) -> None:
        super().__init__(code, NAME_LIMIT, RAPID, _WORLD)
        self._values = _Text(code, self._names)
        self._flags: dict[str, None] = {}

    def file(self) -> ControllerFile:
        """Return the file."""
        code = self._code
        start = absolute(code.mapped.joints(code.placed.start), SLOW, "fine")
        initial = [
            f"{self._names(one.key)}:={self._values.text(one.initial)};" for one in code.declarations if not one.sizes
        ]
        body = ["ConfL\\Off;", f"{start};", *initial, *self._block(code.statements), *self._outputs_off()]
        routines = [line for one in code.procedures for line in ("", *self._procedure(one))]
        helpers = [
            line
            for name in self._values.helpers
            for line in ("", *_HELPERS[name].format(name=self._names(name), no_axes=NO_AXES).splitlines())
        ]
        tool = f"[TRUE,[{frame_text(code.mapped.X_CT)}],[1,[0,0,1],[1,0,0,0],0,0,0]]"
        declared = [f"PERS tooldata {TOOL}:={tool};"]
        declared.append(f'PERS wobjdata {_WORLD}:=[FALSE,TRUE,"",{short_pose(code.X_CW)},[[0,0,0],[1,0,0,0]]];')
        declared += [*map(self._declaration, code.declarations), *(f"VAR bool {flag};" for flag in self._flags)]
        main = ["PROC main()", *(f"  {line}" for line in body), "ENDPROC"]
        lines = [f"! {program_heading(code)}", *declared, "", *main, *routines, *helpers]
        text = "\n".join([f"MODULE {self.name}", *(f"  {line}".rstrip() for line in lines), "ENDMODULE"]) + "\n"
        approximations = ["the tool is written with a load of 1 kg, 1 mm from the flange: put in that of the tool"]
        approximations += ["poses are computed by the controller in single precision, where they are not constant"]
        approximations += program_approximations(code)
        return ControllerFile(name=f"{self.name}.mod", text=text, approximations=tuple(approximations))

    def _declaration(self, one: Declaration) -> str:
        sizes = f"{{{','.join(map(str, one.sizes))}}}" if one.sizes else ""
        return f"VAR {_TYPES[one.kind]} {self._names(one.key)}{sizes};"

    def _flag(self, name: str) -> str:
        """Return a condition of the writer's own."""
        flag = self._names(f"{name} OWN")
        self._flags[flag] = None
        return flag

    def _procedure(self, one: Procedure) -> list[str]:
        listed = ",".join(f"{_TYPES[kind]} {self._names(key)}" for key, kind in one.parameters)
        head = f"{self._names(one.key)}({listed})"
        body = [f"  {line}" for line in self._block(one.body)]
        if one.result is None:
            return [f"PROC {head}", *body, "ENDPROC"]
        return [f"FUNC {_TYPES[one.result]} {head}", *body, "ENDFUNC"]

    def _outputs_off(self) -> list[str]:
        return [f"SetDO {signal_name(self._code, address, name)},0;" for name, address in self._code.outputs]

    # ---- statements ------------------------------------------------------------------------------------------------

    def _lines(self, statement: Statement) -> Iterator[str]:  # noqa: C901, PLR0912 - one case per kind
        text = self._values.text
        match statement:
            case Assign(target=target, value=value):
                yield f"{text(target)}:={text(value)};"
            case MoveTo():
                yield from self._move(statement)
            case Switch(name=name, address=address, on=on, pulse=pulse):
                signal = signal_name(self._code, address, name, statement.span)
                yield f"SetDO {signal},{int(on)};" if pulse is None else f"PulseDO\\PLength:={text(pulse)},{signal};"
            case Pause(seconds=seconds):
                yield f"WaitTime {text(seconds)};"
            case Print(items=items):
                yield from self._print(items)
            case WaitUntil():
                yield from self._wait(statement)
            case Choice(condition=condition, then=then, otherwise=otherwise):
                yield f"IF {text(condition)} THEN"
                yield from self._inner(then)
                if otherwise:
                    yield "ELSE"
                    yield from self._inner(otherwise)
                yield "ENDIF"
            case Loop(condition=condition, body=body, at_end=True):
                again = self._flag("AGAIN")
                yield from (f"{again}:=TRUE;", f"WHILE {again} DO", *self._inner(body))
                yield from (f"  {again}:={text(condition)};", "ENDWHILE")
            case Loop(condition=condition, body=body):
                yield from (f"WHILE {text(condition)} DO", *self._inner(body), "ENDWHILE")
            case Count():
                yield from self._count(statement)
            case Call(procedure=key, arguments=arguments):
                listed = ",".join(map(text, arguments))
                yield f"{self._names(key)}{' ' if listed else ''}{listed};"
            case Return(value=value):
                yield f"RETURN {text(value)};"
            case Halt():
                yield from (*self._outputs_off(), "EXIT;")
            case _:
                assert_never(statement)

    def _count(self, one: Count) -> Iterator[str]:
        text, counter = self._values.text, self._values.text(one.counter)
        body = [f"  {text(one.variable)}:={counter};", *self._inner(one.body)]
        if all(is_whole(value, self._values.whole) for value in (one.first, one.last, Number(one.step))):
            yield f"FOR {counter} FROM {text(one.first)} TO {text(one.last)} STEP {text(Number(one.step))} DO"
            yield from (*body, "ENDFOR")
            return
        yield f"{counter}:={text(one.first)};"
        last: Value = one.last
        if one.limit is not None:
            yield f"{text(one.limit)}:={text(one.last)};"
            last = one.limit
        end = Operation("+", (last, Number(one.step / 2)))
        yield f"WHILE {counter} {'<' if one.step > 0 else '>'} {text(end)} DO"
        yield from (*body, f"  {counter}:={text(Operation('+', (one.counter, Number(one.step))))};", "ENDWHILE")

    def _wait(self, one: WaitUntil) -> Iterator[str]:
        condition = self._values.text(one.condition)
        if one.limit is None:
            yield f"WaitUntil {condition};"
            return
        late = self._flag("LATE")
        yield f"WaitUntil {condition}\\MaxTime:={self._values.text(one.limit)}\\TimeFlag:={late};"
        if one.late:
            yield from (f"IF {late} THEN", *self._inner(one.late), "ENDIF")

    def _print(self, items: Iterable[str | Value]) -> Iterator[str]:
        parts = chunks_of_text(items)
        if all(isinstance(part, str) for part in parts):
            yield from (f"TPWrite {quoted(line)};" for line in plain_lines("".join(map(str, parts))))
            return
        shown = [
            quoted(plain_lines(part)[0]) if isinstance(part, str) else f"ValToStr({self._values.text(part)})"
            for part in parts
        ]
        yield f"TPWrite {'+'.join(shown)};"

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _move(self, one: MoveTo) -> Iterator[str]:
        known = one.passages
        motion = "MoveL" if one.straight else "MoveJ"
        for leg, (value, zone) in enumerate(zip(one.targets, known.zones, strict=True)):
            words = list(dict.fromkeys(confdata(posture) for posture in postures(self._code.mapped, known.q[:, leg])))
            free = not one.straight and len(words) > 1
            if free and len({word[-1] for word in words}) > 1:
                text = "this MOVE ends in several postures of the arm, and its target is to have one configuration"
                helps = ["write it for each of them"]
                raise refusal(self._code.source, "E620", text, one.span, "on this MOVE", helps=helps)
            line = (
                f"{motion} {self._target(value, words[0])},{self._rate(one)},{zone_text(zone)},{TOOL}\\WObj:={_WORLD};"
            )
            yield from ("ConfJ\\Off;", line, "ConfJ\\On;") if free else (line,)

    def _target(self, value: Value, words: tuple[int, int, int, int]) -> str:
        configuration = ",".join(map(str, words))
        if isinstance(value, Pose):
            return f"[{short_pose(value.X)[1:-1]},[{configuration}],{NO_AXES}]"
        return f"{self._values.helper('TARGET AT')}({self._values.text(value)},{configuration})"

    def _rate(self, one: MoveTo) -> str:
        known = one.passages
        if len(one.targets) == 1 and known.reached and one.duration is not None:
            return within(one.duration)
        parts = []
        for speed in (known.speed * MILLIMETRES, float(np.degrees(known.turn_speed))):
            asked = scaled(one.speed, speed / NORMAL_SPEED)
            number = isinstance(asked, Number)
            parts.append(decimal(max(asked.value, LEAST_SPEED), 3) if number else self._values.text(asked))  # type: ignore[union-attr]
        return f"[{','.join(parts)},{EXTERNAL}]"


def quoted(text: str) -> str:
    """Return a text as a string of RAPID."""
    escaped = text.replace("\\", "\\\\").replace('"', '""')
    return f'"{escaped}"'


def signal_name(code: ProgramCode, address: Output, name: str, span: Span | None = None) -> str:
    """Return the name of an input or output.

    Raises:
        ExportError: it has none.
    """
    if address.signal is None:
        text = f"the cell file gives {name} a number, and RAPID knows signals by names"
        helps = ['write the name of the signal as the key `signal`, as in `signal = "doLamp"`']
        raise refusal(code.source, "E615", text, span or Span(0, 0), "it is used in this program", helps=helps)
    return address.signal


_HELPERS = {
    "TARGET AT": """\
FUNC robtarget {name}(pose place,num cf1,num cf4,num cf6,num cfx)
  RETURN [place.trans,place.rot,[cf1,cf4,cf6,cfx],{no_axes}];
ENDFUNC""",
    "DISTANCE OF": """\
FUNC num {name}(pose first,pose second)
  RETURN Distance(first.trans,second.trans);
ENDFUNC""",
} | {f"{axis} OF": f"FUNC num {{name}}(pose place)\n  RETURN place.trans.{axis};\nENDFUNC" for axis in "xyz"}
