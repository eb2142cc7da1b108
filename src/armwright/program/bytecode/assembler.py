"""The text form of intermediate code: written out, changed by hand if need be, and read back to the same code.

The form is described in docs/code.md. It holds everything the interpreter and its messages need, the program text
included, so that a program can be run, and its errors shown, from this file alone.
"""

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import NoReturn

import attrs

from armwright.errors import FileFormatError, closest, shown
from armwright.files.limits import limit, limit_message
from armwright.program.bytecode.instructions import (
    Code,
    Constant,
    Instruction,
    JumpTarget,
    Op,
    Operand,
    ProcedureCode,
    Text,
)
from armwright.program.bytecode.verifier import CodeError
from armwright.program.bytecode.verify import verify
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.language.units import DECLARABLE, UnitSystem, dimension
from armwright.program.language.words import Standard

HEAD = "; armwright intermediate code, form 1"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:\.[A-Za-z][A-Za-z0-9_]*)*(?:-[0-9]+)?")
_PASSING = re.compile(r"%[0-9]+")
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"')
_OPERAND_OR_COMMENT = re.compile(r'"(?:[^"\\]|\\.)*"|;.*|[^\s;]+')
_ROW = re.compile(r"(?P<at>[0-9]+)\s+(?P<span>\S+)\s+(?P<op>[A-Za-z][A-Za-z0-9]*)(?P<rest>.*)")
_SPAN = re.compile(r"(?:(?P<file>[0-9]+)/)?(?P<line>[0-9]+):(?P<column>[0-9]+)\+(?P<length>[0-9]+)(?P<begins>!?)")
_TYPE = re.compile(r"(?:ARRAY \[(?P<sizes>[0-9]+(?:,[0-9]+)*)\] OF )?(?P<kind>[A-Z]+)")
# What a file may ask for at most.
_MAX_ELEMENTS = 1_000_000


# ---- writing -------------------------------------------------------------------------------------------------------


def assembly(code: Code) -> str:
    """Return the text form of a program's code."""
    return "\n".join(_lines(code)) + "\n"


def _lines(code: Code) -> Iterator[str]:
    yield HEAD
    yield f"program {json.dumps(code.source.name, ensure_ascii=False)}"
    yield f"units {code.units.length} {code.units.angle}"
    if code.standard is not Standard.RLO_2:
        yield f"standard {code.standard.value}"
    yield from (f"name {text}" for text in code.spelling.values())
    for file, names in code.names.items():
        yield from (f"sees {file} {written} {name}" for written, name in names.items())
    for name, kind in code.types.items():
        yield f"var {name} {kind}"
    yield from (f"record {name} {kind}" for name, kind in code.records.items())
    for name, procedure in code.procedures.items():
        result = "" if procedure.result is None else f" {procedure.result}"
        yield f"procedure {name} {JumpTarget(procedure.start)}{result}"
        for own, kind in procedure.types.items():
            word = "parameter" if own in procedure.parameters else "local"
            word = "inout" if own in procedure.inout else word
            yield f"  {word} {own} {kind}"
        yield from (f"  record {own} {record}" for own, record in procedure.records.items())
    for index, value in enumerate(code.constants):
        numbers = value if isinstance(value, tuple) else (value,)
        yield f"constant {Constant(index)} {' '.join(map(repr, numbers))}"
    yield "code"
    for at, step in enumerate(code.instructions):
        source, span = code.source, step.span
        file = source.file_number(span.start)
        place = f"{source.line(span.start)}:{source.column(span.start)}+{span.end - span.start}"
        place = f"{file}/{place}" if file else place
        operands = (repr(float(part)) if isinstance(part, float | int) else str(part) for part in step.operands)
        row = f"{at:04d}  {place + ('!' if step.begins else ''):<12} {step.op:<6} {' '.join(operands)}".rstrip()
        yield f"{row:<56} ; {step.comment}" if step.comment else row
    for file in range(len(code.source.modules) + 1):
        yield f"module {json.dumps(code.source.modules[file - 1].path, ensure_ascii=False)}" if file else "source"
        lines = code.source.file_text(file).split("\n")
        yield from (f"| {json.dumps(line, ensure_ascii=False)[1:-1]}" for line in lines)


# ---- reading -------------------------------------------------------------------------------------------------------


def assemble(text: str, name: str = "code") -> Code:
    """Read the text form of code.

    Args:
        text: as ``assembly`` writes it; comments behind ``;`` and blank lines mean nothing.
        name: of the file, for messages.

    Raises:
        FileFormatError: a line makes no sense, or the code could not be run: an operand of another sort than the
            operation takes, a jump out of the program. The message has the number of the line.
    """
    return _Reader(name, text).code()


class _Reader:
    """One pass over the lines."""

    def __init__(self, file: str, text: str) -> None:
        self._file, self._rows, self._number = file, text.split("\n"), 0
        self._program, self._units, self._standard = "program", UnitSystem(), Standard.RLO_2
        self._spelling: dict[str, str] = {}
        self._seen_names: dict[int, dict[str, str]] = {}
        # Those of the procedure that is read, or of the program in front of all procedures.
        self._records = self._program_records = dict[str, str]()
        self._types: dict[str, VariableType] = {}
        self._procedures: dict[str, ProcedureCode] = {}
        # Those of the last procedure.
        self._own_types: dict[str, VariableType] = {}
        self._constants: list[tuple[float, ...] | float] = []
        self._instructions: list[Instruction] = []
        # Of each instruction the line in the file.
        self._numbers: list[int] = []
        self._text = Source("", "")

    def code(self) -> Code:
        body, self._text = self._split()
        words: Mapping[str, Callable[[str], None]] = {
            "program": self._read_program,
            "units": self._read_units,
            "standard": self._read_standard,
            "name": lambda rest: self._spelling.update({self._name(rest): rest}),
            "var": lambda rest: self._types.update([self._declaration(rest)]),
            "sees": self._read_seen_name,
            "record": self._read_record,
            "procedure": self._read_procedure,
            "parameter": self._read_parameter,
            "inout": self._read_inout,
            "local": lambda rest: self._own_types.update([self._declaration(rest)]),
            "constant": self._read_constant,
        }
        in_code = False
        for number, row in enumerate(body, 1):
            self._number = number
            line = row.strip()
            if not line or line.startswith(";"):
                continue
            word, _, rest = line.partition(" ")
            if in_code:
                self._read_step(line)
            elif word == "code" and not rest:
                in_code = True
            elif word in ("parameter", "inout", "local") and not self._procedures:
                self._fail(f"expected a procedure before the {word}")
            elif word in words:
                words[word](rest.strip())
            else:
                self._fail(f"unknown word {word!r}", closest(word, [*words, "code"]))
        self._number = len(body) + 1
        if not self._instructions:
            self._fail("expected at least one instruction")
        return self._verified()

    def _split(self) -> tuple[list[str], Source]:
        """Return the lines in front of the source, and the source with its modules."""
        if "source" not in self._rows:
            self._number = len(self._rows)
            self._fail("the program text is missing; expected it after a line `source`")
        at = self._rows.index("source")
        paths, texts = [""], list[list[str]]([[]])
        for number, row in enumerate(self._rows[at + 1 :], at + 2):
            self._number = number
            if not row and self._number == len(self._rows):
                break
            if row.startswith("module "):
                if len(paths) > limit("imports"):
                    self._fail(f"too many modules: {limit_message('imports')}")
                paths.append(self._string(row.removeprefix("module ").strip()))
                texts.append([])
                continue
            if not row.startswith("| ") and row != "|":
                self._fail("expected a line of the program text, which begins with `| `")
            line = _json_text(f'"{row[2:]}"')
            if line is None:
                self._fail("expected the characters of a JSON string")
            texts[-1].append(line)
        source = Source("", "\n".join(texts[0]))
        for path, lines in zip(paths[1:], texts[1:], strict=True):
            source = source.with_module(path, "\n".join(lines))
        return self._rows[:at], source

    def _read_program(self, rest: str) -> None:
        self._program = self._string(rest)

    def _read_units(self, rest: str) -> None:
        for unit in rest.split():
            if unit not in DECLARABLE:
                self._fail(f"unknown unit {unit!r}", closest(unit, DECLARABLE))
            self._units = attrs.evolve(self._units, **{dimension(unit): unit})

    def _read_standard(self, rest: str) -> None:
        known = [standard.value for standard in Standard]
        if rest not in known:
            self._fail(f"unknown standard {rest!r}, expected {' or '.join(known)}")
        self._standard = Standard(rest)

    def _read_seen_name(self, rest: str) -> None:
        file, *names = rest.split()
        if len(names) != 2 or not file.isdecimal():
            self._fail("expected the number of a file, a name and its name in the program")
        written, name = map(self._name, names)
        self._seen_names.setdefault(int(file[:9]), {})[written] = name

    def _read_record(self, rest: str) -> None:
        name, _, kind = rest.partition(" ")
        self._name(kind)
        self._records[self._name(name)] = kind

    def _read_procedure(self, rest: str) -> None:
        name, _, rest = rest.partition(" ")
        start, _, result = rest.partition(" ")
        if not re.fullmatch(r"@[0-9]{1,9}", start):
            self._fail("expected the first instruction of the procedure, such as @0012")
        self._own_types, self._records = {}, {}
        self._procedures[self._name(name)] = ProcedureCode(
            start=int(start[1:]),
            parameters=(),
            types=self._own_types,
            result=self._type(result) if result else None,
            records=self._records,
        )

    def _read_parameter(self, rest: str) -> None:
        parameter, kind = self._declaration(rest)
        self._own_types[parameter] = kind
        name, last = self._procedures.popitem()
        self._procedures[name] = attrs.evolve(last, parameters=(*last.parameters, parameter))

    def _read_inout(self, rest: str) -> None:
        self._read_parameter(rest)
        name, last = self._procedures.popitem()
        self._procedures[name] = attrs.evolve(last, inout=last.inout | {last.parameters[-1]})

    def _read_constant(self, rest: str) -> None:
        name, *numbers = rest.split() or [""]
        if name != f"c{len(self._constants)}" or len(numbers) not in (1, 12):
            self._fail(f"expected c{len(self._constants)} and 1 or 12 numbers")
        values = tuple(map(self._float, numbers))
        self._constants.append(values if len(values) > 1 else values[0])

    def _read_step(self, line: str) -> None:
        match = _ROW.fullmatch(line)
        if match is None:
            self._fail("expected an instruction: its number, its location, the operation and the operands")
        if int(match["at"][:9]) != len(self._instructions):
            self._fail(f"expected instruction {len(self._instructions):04d}")
        span = _SPAN.fullmatch(match["span"])
        if span is None:
            self._fail("expected a location such as 12:5+20")
        name = match["op"].upper()
        if name not in Op.__members__:
            self._fail(f"unknown operation {name!r}", closest(name, Op.__members__))
        words = _OPERAND_OR_COMMENT.findall(match["rest"])
        operands = tuple(self._operand(word) for word in words if word[0] != ";")
        self._numbers.append(self._number)
        at, begins = self._span(span), bool(span["begins"])
        self._instructions.append(Instruction(op=Op[name], operands=operands, span=at, begins=begins))

    def _span(self, match: re.Match[str]) -> Span:
        """Return the part of the program that a location such as 12:5+20 stands for."""
        line, column, length = (int(match[part][:9]) for part in ("line", "column", "length"))
        file, text = int((match["file"] or "0")[:9]), self._text
        if file > len(text.modules):
            self._fail(f"the program has no module {file}")
        if not 1 <= line <= text.line_count(file):
            self._fail(f"the program text has no line {line}")
        start = text.line_start(line, file) + column - 1
        if column < 1 or start + length > len(text.text):
            self._fail(f"the program text has fewer than {length} characters from {line}:{column} on")
        return Span(start, start + length)

    def _operand(self, word: str) -> Operand:
        if _STRING.fullmatch(word):
            return Text(self._string(word))
        if word[0] == "@" and word[1:].isdecimal():
            return JumpTarget(int(word[1:10]))
        if re.fullmatch(r"c[0-9]+", word):
            return Constant(int(word[1:10]))
        if _PASSING.fullmatch(word):
            return word
        if _NAME.fullmatch(word):
            return word.upper()
        return self._float(word)

    # ---- at the end ------------------------------------------------------------------------------------------------

    def _verified(self) -> Code:
        """Return what has been read, once it is known that it can be interpreted."""
        code = Code(
            instructions=tuple(self._instructions),
            constants=tuple(self._constants),
            types=self._types,
            procedures=self._procedures,
            units=self._units,
            spelling=self._spelling,
            standard=self._standard,
            records=self._program_records,
            names=self._seen_names,
            source=attrs.evolve(self._text, name=self._program),
        )
        parts: tuple[Code | ProcedureCode, ...] = (code, *code.procedures.values())
        for part in parts:
            for name in part.records:
                fields = [kind for field, kind in part.types.items() if field.rpartition(".")[0] == name]
                if not fields or any(kind.sizes != fields[0].sizes for kind in fields):
                    self._fail(f"expected variables for the fields of the record {name}, all single or all arrays")
        try:
            verify(code)
        except CodeError as error:
            self._number = self._numbers[error.instruction]
            self._fail(error.fault)
        return code

    def _declaration(self, text: str) -> tuple[str, VariableType]:
        """Return a name in upper case and its type."""
        name, _, type_name = text.partition(" ")
        kind = self._type(type_name)
        return self._name(name), kind

    def _type(self, text: str) -> VariableType:
        match = _TYPE.fullmatch(text.strip())
        if match is None or match["kind"] not in VariableKind.__members__:
            self._fail(f"unknown type {text!r}")
        sizes = tuple(int(size[:9]) for size in (match["sizes"] or "").split(",") if size)
        if sizes and not 1 <= math.prod(sizes) <= _MAX_ELEMENTS:
            self._fail(f"expected an array of 1 to {_MAX_ELEMENTS} elements")
        return VariableType(VariableKind[match["kind"]], sizes)

    def _name(self, text: str) -> str:
        if not _NAME.fullmatch(text):
            self._fail(f"expected a name, got {text!r}")
        return text.upper()

    def _string(self, text: str) -> str:
        value = _json_text(text)
        if value is None:
            self._fail(f'expected text in "", got {shown(text)}')
        return value

    def _float(self, word: str) -> float:
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self._fail(f"expected an operand, got {word!r}")
        return value

    def _fail(self, message: str, near: str | None = None) -> NoReturn:
        hint = f"; did you mean {near!r}?" if near else ""
        raise FileFormatError(self._file, self._number, "", f"{message}{hint}")


def _json_text(text: str) -> str | None:
    """Return the text that a JSON string stands for; None if it is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return None
    # JSON can write half of a surrogate pair, which no file or terminal can.
    if not isinstance(value, str) or any("\ud800" <= letter <= "\udfff" for letter in value):
        return None
    return value
