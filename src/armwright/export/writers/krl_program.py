"""Program mode in KRL: variables stand in the data list, targets are those of the world, which is the base."""

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
from armwright.export.translation.values import simplified
from armwright.export.writers.controller_file import ControllerFile
from armwright.export.writers.krl import (
    LEAST_RATE,
    NAME_LIMIT,
    REPLACED,
    TO_START,
    axes_text,
    frame_text,
    percent_text,
)
from armwright.export.writers.posture import postures, status_and_turn
from armwright.export.writers.program_text import (
    ProgramWriter,
    TextInDegrees,
    chunks_of_text,
    is_whole,
    number_of,
    program_approximations,
    program_heading,
    scaled,
)
from armwright.export.writers.reserved_words import KRL
from armwright.export.writers.text import decimal, plain_lines
from armwright.program.language.units import NORMAL_SPEED

_ATOM, _FRAMES = 9, 8
_TYPES: dict[Kind, str] = {"truth": "BOOL", "pose": "FRAME"}
# The timer that ends waits.
_TIMER = 10
# A turn that is left to the controller.
_ANY_TURN = -1


def write(code: ProgramCode) -> ControllerFile:
    """Return a program in KRL, and its data list.

    Raises:
        ExportError: an input or output has no number, or a target is reached in several postures.
    """
    return _Writer(code).file()


def short_frame(X: Array) -> str:
    """Return a pose (4, 4) as the fields of FRAME, without zeros at the ends of its numbers."""
    return re.sub(r"\.?0+(?=,|$)", "", frame_text(X))


class _Text(TextInDegrees):
    """Values in KRL."""

    words = {"=": "==", "negative": "-", "and": "AND", "or": "OR", "not": "NOT"}  # noqa: RUF012 - read alone

    def pose(self, X: Array) -> str:
        return f"{{FRAME: {short_frame(X)}}}"

    def variable(self, value: Variable) -> str:
        name = self.names(value.key)
        return f"{name}[{','.join(map(self._index, value.indices))}]" if value.indices else name

    def _index(self, value: Value) -> str:
        text = self.text(value)
        return text if is_whole(value, self.whole) else self.call(self.helper("WHOLE NUMBER"), [text])

    def signal(self, value: Signal) -> str:
        return f"${'IN' if value.is_input else 'OUT'}[{number_of(self.code, value.address, value.name, least=1)}]"

    def _operation(self, name: str, arguments: tuple[Value, ...]) -> str:
        text = super()._operation(name, arguments)
        # Whole numbers are divided as such, which RLO does not do.
        return f"1.0*{text}" if name == "/" and all(is_whole(one, self.whole) for one in arguments) else text

    def function(self, name: str, arguments: tuple[Value, ...]) -> tuple[str, int]:  # noqa: PLR0911 - one case per kind
        match name:
            case "compose":
                (first, strength), (second, other) = (self._text(one) for one in arguments)
                left = first if strength >= _FRAMES else f"({first})"
                return f"{left}:{second if other > _FRAMES else f'({second})'}", _FRAMES
            case "inverse":
                return self.call(self.helper("INVERSE OF"), map(self.text, arguments)), _ATOM
            case "xyz":
                lengths = [self.millimetres(one) for one in arguments]
                return self.call(self.helper("SHIFTED BY"), lengths), _ATOM
            case "rotx" | "roty" | "rotz" | "rpy":
                angle = [self.degrees(one) for one in arguments]
                angles = {"rotx": ("0", "0", angle[0]), "roty": ("0", angle[0], "0"), "rotz": (angle[0], "0", "0")}
                return self.call(self.helper("TURNED BY"), angles.get(name, tuple(reversed(angle)))), _ATOM
            case "dist":
                return self.over_millimetres(self.call(self.helper("DISTANCE OF"), map(self.text, arguments)))
            case "x" | "y" | "z":
                if isinstance(arguments[0], Variable):
                    return self.over_millimetres(f"{self.text(arguments[0])}.{name.upper()}")
                return self.over_millimetres(self.call(self.helper(f"{name.upper()} OF"), [self.text(arguments[0])]))
            case "sin" | "cos" | "tan":
                return self.call(name.upper(), [self.degrees(arguments[0])]), _ATOM
            case "atan2":
                return self.over(self.call("ATAN2", map(self.text, arguments)), float(np.degrees(self.radians)))
        return self.call(name.upper(), map(self.text, arguments)), _ATOM

    def type(self, key: str) -> str:
        """Return the type of a variable or parameter."""
        kind = self.code.kinds[key]
        return _TYPES[kind] if kind != "number" else "INT" if key in self.whole else "REAL"


class _Writer(ProgramWriter):
    """A program while it is written."""

    def __init__(self, code: ProgramCode) -> None:
        super().__init__(code, NAME_LIMIT, KRL)
        self._values = _Text(code, self._names)
        self._own: dict[str, str] = {}

    def file(self) -> ControllerFile:
        """Return the file, with its data list."""
        code = self._code
        body = self._block(code.statements) + self._outputs_off()
        procedures = [line for one in code.procedures for line in ("", *self._procedure(one))]
        head = ["&ACCESS RVP", f"DEF {self.name}( )", f"; {program_heading(code)}", "BAS(#INITMOV,0)"]
        head += [f"$BASE={{{short_frame(code.X_CW)}}}", f"$TOOL={{{short_frame(code.mapped.X_CT)}}}", "$IPO_MODE=#BASE"]
        head += [f"BAS(#VEL_PTP,{TO_START})", f"PTP {{{axes_text(code.mapped.joints(code.placed.start))}}}"]
        # The data list keeps what a variable held when the program ran last.
        initial = [self._initial(one) for one in code.declarations if not one.sizes]
        lines = [*head, *initial, *body, "END", *procedures, *self._helpers()]
        data = ["&ACCESS RVP", f"DEFDAT {self.name}", *map(self._declaration, code.declarations)]
        data += [f"DECL {kind} {name}" for name, kind in self._own.items()]
        approximations = ["the load of the tool is that of the controller: the program does not set it"]
        approximations += ["the axis speeds of the controller at 100 % are taken to be the speed limits of the arm"]
        approximations += ["poses are computed by the controller in single precision, where they are not constant"]
        approximations += program_approximations(code)
        if any(isinstance(one, WaitUntil) and one.limit is not None for one in code.everything()):
            approximations.append(f"timer {_TIMER} of the controller is used")
        return ControllerFile(
            name=f"{self.name}.src",
            text="\n".join(lines) + "\n",
            approximations=tuple(approximations),
            others=((f"{self.name}.dat", "\n".join([*data, "ENDDAT"]) + "\n"),),
        )

    def _declaration(self, one: Declaration) -> str:
        sizes = f"[{','.join(map(str, one.sizes))}]" if one.sizes else ""
        return f"DECL {self._values.type(one.key)} {self._names(one.key)}{sizes}"

    def _initial(self, one: Declaration) -> str:
        return f"{self._names(one.key)}={self._values.text(one.initial)}"

    def _variable(self, name: str, kind: str) -> str:
        """Return a variable of the writer's own."""
        text = self._names(f"{name} OWN")
        sizes = "[80]" if kind == "CHAR" else ""
        self._own[f"{text}{sizes}"] = kind
        return text

    def _procedure(self, one: Procedure) -> list[str]:
        name, parameters = (
            self._names(one.key),
            [(self._names(key), self._values.type(key)) for key, _ in one.parameters],
        )
        listed = ",".join(f"{key}:IN" for key, _ in parameters)
        declared = [f"DECL {kind} {key}" for key, kind in parameters]
        body = [f"  {line}" for line in [*declared, *self._block(one.body)]]
        if one.result is None:
            return [f"DEF {name}({listed or ' '})", *body, "END"]
        kind = _TYPES.get(one.result, "REAL")
        return [f"DEFFCT {kind} {name}({listed or ' '})", *body, "ENDFCT"]

    def _helpers(self) -> list[str]:
        return [
            line
            for name in self._values.helpers
            for line in ("", *HELPERS[name].format(name=self._names(name)).splitlines())
        ]

    def _outputs_off(self) -> list[str]:
        return [f"$OUT[{number_of(self._code, address, name, least=1)}]=FALSE" for name, address in self._code.outputs]

    # ---- statements ------------------------------------------------------------------------------------------------

    def _lines(self, statement: Statement) -> Iterator[str]:  # noqa: C901, PLR0912 - one case per kind
        text = self._values.text
        match statement:
            case Assign(target=target, value=value):
                yield f"{text(target)}={text(value)}"
            case MoveTo():
                yield from self._move(statement)
            case Switch(name=name, address=address, on=on, pulse=pulse):
                output = f"$OUT[{number_of(self._code, address, name, statement.span, least=1)}]"
                state = self._values.truth(on)
                yield f"{output}={state}" if pulse is None else f"PULSE({output},{state},{text(pulse)})"
            case Pause(seconds=seconds):
                yield f"WAIT SEC {text(seconds)}"
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
            case Loop(condition=condition, body=body, at_end=at_end):
                yield "REPEAT" if at_end else f"WHILE {text(condition)}"
                yield from self._inner(body)
                yield f"UNTIL {text(simplified('not', (condition,)))}" if at_end else "ENDWHILE"
            case Count():
                yield from self._count(statement)
            case Call(procedure=key, arguments=arguments):
                yield self._values.call(self._names(key), map(text, arguments))
            case Return(value=value):
                yield f"RETURN {text(value)}"
            case Halt():
                yield from (*self._outputs_off(), "LOOP", "  HALT", "ENDLOOP")
            case _:
                assert_never(statement)

    def _count(self, one: Count) -> Iterator[str]:
        text, counter = self._values.text, self._values.text(one.counter)
        whole = all(is_whole(value, self._values.whole) for value in (one.first, one.last, Number(one.step)))
        body = [f"  {text(one.variable)}={counter}", *self._inner(one.body)]
        if whole:
            step = "" if one.step == 1 else f" STEP {text(Number(one.step))}"
            yield f"FOR {counter}={text(one.first)} TO {text(one.last)}{step}"
            yield from (*body, "ENDFOR")
            return
        yield f"{counter}={text(one.first)}"
        last: Value = one.last
        if one.limit is not None:
            yield f"{text(one.limit)}={text(one.last)}"
            last = one.limit
        end = Operation("+", (last, Number(one.step / 2)))
        yield f"WHILE {counter} {'<' if one.step > 0 else '>'} {text(end)}"
        yield from (*body, f"  {counter}={text(Operation('+', (one.counter, Number(one.step))))}", "ENDWHILE")

    def _wait(self, one: WaitUntil) -> Iterator[str]:
        condition = self._values.text(one.condition)
        if one.limit is None:
            yield f"WAIT FOR {condition}"
            return
        limit = self._values.text(scaled(one.limit, 1e3))
        yield from (f"$TIMER[{_TIMER}]=0", f"$TIMER_STOP[{_TIMER}]=FALSE")
        yield f"WHILE (NOT ({condition})) AND ($TIMER[{_TIMER}]<{limit})"
        yield from ("  WAIT FOR TRUE", "ENDWHILE")
        if one.late:
            yield f"IF NOT ({condition}) THEN"
            yield from (*self._inner(one.late), "ENDIF")

    def _print(self, items: Iterable[str | Value]) -> Iterator[str]:
        parts = chunks_of_text(items)
        if all(isinstance(part, str) for part in parts):
            texts = [f'"{line}"' for line in plain_lines("".join(map(str, parts)), REPLACED)]
        else:
            message, state, offset = (self._variable(*own) for own in _MESSAGE)
            shape, values = "", []
            for part in parts:
                if isinstance(part, str):
                    shape += plain_lines(part, REPLACED)[0].replace("%", "%%")
                else:
                    shape += "%d" if is_whole(part, self._values.whole) else "%g"
                    values.append(self._values.text(part))
            yield f"{offset}=0"
            yield f'SWRITE({message}[],{state},{offset},"{shape}",{",".join(values)})'
            texts = [f"{message}[]"]
        for shown in texts:
            yield from ("WAIT FOR StrClear($LOOP_MSG[])", "$LOOP_CONT=TRUE", f"$LOOP_MSG[]={shown}")

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _move(self, one: MoveTo) -> Iterator[str]:
        known = one.passages
        if not one.straight:
            yield f"BAS(#VEL_PTP,{self._percent(one)})"
            yield from self._target("PTP", one, 0)
            return
        turn = float(np.degrees(known.turn_speed))
        rates = [("$VEL.CP", known.speed), ("$VEL.ORI1", turn), ("$VEL.ORI2", turn)]
        for name, rate in rates:
            asked = scaled(one.speed, rate / NORMAL_SPEED)
            number = isinstance(asked, Number)
            yield f"{name}={decimal(max(asked.value, LEAST_RATE), 5) if number else self._values.text(asked)}"  # type: ignore[union-attr]
        yield f"$ACC.CP={decimal(max(known.acceleration, LEAST_RATE), 5)}"
        for i, zone in enumerate(known.zones):
            if zone:
                yield f"$APO.CDIS={decimal(zone * 1e3, 3)}"
            yield from self._target("LIN", one, i, " C_DIS" if zone else "")

    def _percent(self, one: MoveTo) -> str:
        asked = scaled(one.speed, one.passages.speed_part / NORMAL_SPEED)
        if isinstance(asked, Number):
            return percent_text(asked.value)
        return self._values.text(scaled(one.speed, one.passages.speed_part / NORMAL_SPEED * 100.0))

    def _target(self, motion: str, one: MoveTo, leg: int, way: str = "") -> Iterator[str]:
        """Give the lines of a motion to a target, which has its status, and its turn where that is always the same."""
        mapped, known, target = self._code.mapped, one.passages, one.targets[leg]
        words = {status_and_turn(posture) for posture in postures(mapped, known.q[:, leg])}
        states = {status for status, _ in words}
        if len(states) > 1:
            before = [status_and_turn(posture)[0] for posture in postures(mapped, known.start)]
            behind = [status_and_turn(posture)[0] for posture in postures(mapped, known.q[:, leg])]
            if motion == "PTP" and before != behind:
                text = "this MOVE ends in several postures of the arm, and its target is to have one status"
                helps = ["write it for each of them"]
                raise refusal(self._code.source, "E620", text, one.span, "on this MOVE", helps=helps)
            # Without a status the controller keeps that of before.
            yield f"{motion} {self._values.text(target)}{way}"
            return
        (status,) = states
        turn = next(iter(words))[1] if len(words) == 1 else _ANY_TURN
        if isinstance(target, Pose):
            fields = f",T {turn}" if turn != _ANY_TURN else ""
            yield f"{motion} {{{short_frame(target.X)},S {status}{fields}}}{way}"
            return
        place = self._variable("TARGET", "POS")
        arguments = [self._values.text(target), str(status), str(turn)]
        yield f"{place}={self._values.call(self._values.helper('POSTURE OF'), arguments)}"
        yield f"{motion} {place}{way}"


_MESSAGE = (("MESSAGE", "CHAR"), ("STATE", "STATE_T"), ("OFFSET", "INT"))
HELPERS = {
    "SHIFTED BY": """\
DEFFCT FRAME {name}(arg_x:IN,arg_y:IN,arg_z:IN)
  DECL REAL arg_x,arg_y,arg_z
  DECL FRAME arg_f
  arg_f=$NULLFRAME
  arg_f.X=arg_x
  arg_f.Y=arg_y
  arg_f.Z=arg_z
  RETURN arg_f
ENDFCT""",
    "TURNED BY": """\
DEFFCT FRAME {name}(arg_a:IN,arg_b:IN,arg_c:IN)
  DECL REAL arg_a,arg_b,arg_c
  DECL FRAME arg_f
  arg_f=$NULLFRAME
  arg_f.A=arg_a
  arg_f.B=arg_b
  arg_f.C=arg_c
  RETURN arg_f
ENDFCT""",
    "POSTURE OF": """\
DEFFCT POS {name}(arg_f:IN,arg_s:IN,arg_t:IN)
  DECL FRAME arg_f
  DECL INT arg_s,arg_t
  DECL POS arg_p
  arg_p.X=arg_f.X
  arg_p.Y=arg_f.Y
  arg_p.Z=arg_f.Z
  arg_p.A=arg_f.A
  arg_p.B=arg_f.B
  arg_p.C=arg_f.C
  arg_p.S=arg_s
  ; without a turn the axes take the shortest way
  IF arg_t >= 0 THEN
    arg_p.T=arg_t
  ENDIF
  RETURN arg_p
ENDFCT""",
    "DISTANCE OF": """\
DEFFCT REAL {name}(arg_f:IN,arg_g:IN)
  DECL FRAME arg_f,arg_g
  DECL REAL arg_x,arg_y,arg_z
  arg_x=arg_f.X-arg_g.X
  arg_y=arg_f.Y-arg_g.Y
  arg_z=arg_f.Z-arg_g.Z
  RETURN SQRT(arg_x*arg_x+arg_y*arg_y+arg_z*arg_z)
ENDFCT""",
    "INVERSE OF": """\
DEFFCT FRAME {name}(arg_f:IN)
  DECL FRAME arg_f,arg_g
  DECL REAL nx,ny,nz,ox,oy,ax,ay,az,oz,sa,ca,sb,cb,sc,cc,level
  sa=SIN(arg_f.A)
  ca=COS(arg_f.A)
  sb=SIN(arg_f.B)
  cb=COS(arg_f.B)
  sc=SIN(arg_f.C)
  cc=COS(arg_f.C)
  nx=ca*cb
  ny=sa*cb
  nz=-sb
  ox=ca*sb*sc-sa*cc
  oy=sa*sb*sc+ca*cc
  oz=cb*sc
  ax=ca*sb*cc+sa*sc
  ay=sa*sb*cc-ca*sc
  az=cb*cc
  arg_g=$NULLFRAME
  arg_g.X=-(nx*arg_f.X+ny*arg_f.Y+nz*arg_f.Z)
  arg_g.Y=-(ox*arg_f.X+oy*arg_f.Y+oz*arg_f.Z)
  arg_g.Z=-(ax*arg_f.X+ay*arg_f.Y+az*arg_f.Z)
  level=SQRT(nx*nx+ox*ox)
  arg_g.B=ATAN2(-ax,level)
  IF level < 0.000001 THEN
    arg_g.A=ATAN2(-ny,oy)
  ELSE
    arg_g.A=ATAN2(ox,nx)
    arg_g.C=ATAN2(ay,az)
  ENDIF
  RETURN arg_g
ENDFCT""",
    "WHOLE NUMBER": """\
DEFFCT INT {name}(arg_x:IN)
  DECL REAL arg_x
  DECL INT arg_i
  arg_i=arg_x
  RETURN arg_i
ENDFCT""",
} | {
    f"{axis} OF": f"DEFFCT REAL {{name}}(arg_f:IN)\n  DECL FRAME arg_f\n  RETURN arg_f.{axis}\nENDFCT" for axis in "XYZ"
}
