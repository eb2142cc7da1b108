"""What the writers of program mode share: names, numbers, operations with their parentheses."""

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping

from armwright.arrays import Array
from armwright.cell.outputs import Output
from armwright.export.refusals import refusal
from armwright.export.translation.code import (
    Assign,
    Call,
    Count,
    FunctionCall,
    MoveTo,
    Number,
    Operation,
    Pose,
    Print,
    ProgramCode,
    Signal,
    Statement,
    Truth,
    Value,
    Variable,
    every_value,
)
from armwright.export.writers.text import identifier
from armwright.program.language.source import Span
from armwright.version import __version__

_PRECEDENCE = {"or": 1, "and": 2, "not": 3, "+": 5, "-": 5, "*": 6, "/": 6, "negative": 7}
_PRECEDENCE |= dict.fromkeys(("<", "<=", "=", "<>", ">=", ">"), 4)
_ATOM = 9
# Millimetres in a metre.
MILLIMETRES = 1e3
_WHOLE = ("+", "-", "*", "negative")


class Names:
    """The identifiers of a program in a language."""

    def __init__(self, limit: int, reserved: Collection[str]) -> None:
        """Begin with the words that are taken."""
        self._limit, self._taken, self._names = limit, {*reserved}, dict[str, str]()

    def __call__(self, key: str) -> str:
        """Return the identifier of a variable, parameter or procedure, always the same one."""
        if key not in self._names:
            self._names[key] = self.fresh(key)
        return self._names[key]

    def fresh(self, key: str) -> str:
        """Return an identifier that nothing else has."""
        name = identifier(key.lower(), self._limit, self._taken)
        self._taken.add(name.lower())
        return name


def program_heading(code: ProgramCode) -> str:
    """Return what the comment of a file says: version and hash, and nothing that others have written."""
    digest = hashlib.sha256(code.source.text.encode("utf-8", errors="backslashreplace")).hexdigest()
    return f"armwright {__version__}, program mode, program sha256 {digest}"


def program_approximations(code: ProgramCode, *, rounded: bool = True) -> Iterator[str]:
    """Give in words what differs from the run on every controller.

    Args:
        code: the program.
        rounded: whether the language rounds corners by lengths.
    """
    moves = [one for one in code.everything() if isinstance(one, MoveTo)]
    if moves:
        yield "speeds: the controller has its own profile up to the largest speeds and accelerations of the run"
    if any(len(one.targets) > 1 for one in moves):
        shape = "with rounded corners, begun no farther from a corner than in the run"
        yield f"paths past frames are lines {shape if rounded else 'at whose corners the arm stops'}"
    if any(
        isinstance(one, Print) and not all(isinstance(item, str) for item in one.items) for one in code.everything()
    ):
        yield "numbers in texts have the digits of the controller"


def whole_variables(code: ProgramCode) -> frozenset[str]:
    """Return the keys of the variables that only ever hold whole numbers."""
    given: dict[str, list[Value]] = {one.key: [one.initial] for one in code.declarations}
    for key, value in _given(code):
        given.setdefault(key, []).append(value)
    whole = {key for key in given if code.kinds.get(key) == "number"}
    while True:
        left = {key for key in whole if all(is_whole(value, whole) for value in given[key])}
        if left == whole:
            return frozenset(whole)
        whole = left


def _given(code: ProgramCode) -> Iterator[tuple[str, Value]]:
    """Give the keys of variables and parameters, each with a value that it gets."""
    parameters = {one.key: [key for key, _ in one.parameters] for one in code.procedures}
    for statement in code.everything():
        if isinstance(statement, Assign):
            yield statement.target.key, statement.value
        elif isinstance(statement, Count):
            for variable in (statement.variable, statement.counter):
                yield from ((variable.key, value) for value in (statement.first, Number(statement.step)))
            if statement.limit is not None:
                yield statement.limit.key, statement.last
        elif isinstance(statement, Call):
            yield from zip(parameters[statement.procedure], statement.arguments, strict=True)
    for value in every_value([code.statements, *(procedure.body for procedure in code.procedures)]):
        if isinstance(value, FunctionCall):
            yield from zip(parameters[value.procedure], value.arguments, strict=True)


def is_whole(value: Value, whole: Collection[str]) -> bool:
    """Whether a value is always a whole number."""
    match value:
        case Number(value=number):
            return number == round(number)
        case Variable(key=key):
            return key in whole
        case Operation(name, arguments):
            return name in _WHOLE and all(is_whole(one, whole) for one in arguments)
    return False


def scaled(value: Value, factor: float) -> Value:
    """Return a number in another unit."""
    if factor == 1.0:
        return value
    if isinstance(value, Number):
        return Number(value.value * factor)
    return Operation("*", (value, Number(factor)))


class ValueText(ABC):
    """How a language writes values.

    Attributes:
        words: of its operations, where they differ from those of RLO.
    """

    words: Mapping[str, str] = {}

    def __init__(self, code: ProgramCode, names: Names) -> None:
        """Take the program and its names."""
        self.code, self.names, self.whole = code, names, whole_variables(code)
        self.metres, self.radians = code.units.metres, code.units.radians

    def text(self, value: Value) -> str:
        """Return a value."""
        return self._text(value)[0]

    def _text(self, value: Value) -> tuple[str, int]:  # noqa: PLR0911 - one case per kind
        match value:
            case Number(value=number):
                return number_text(number), _ATOM if number >= 0 else _PRECEDENCE["negative"]
            case Truth(value=truth):
                return self.truth(truth), _ATOM
            case Pose(X):
                return self.pose(X), _ATOM
            case Variable():
                return self.variable(value), _ATOM
            case Signal():
                return self.signal(value), _ATOM
            case FunctionCall(procedure=key, arguments=arguments):
                return self.call(self.names(key), map(self.text, arguments)), _ATOM
            case Operation(name, arguments) if name in _PRECEDENCE:
                return self._operation(name, arguments), _PRECEDENCE[name]
            case Operation(name, arguments):
                return self.function(name, arguments)
        raise AssertionError(f"no value: {value}")

    def _operation(self, name: str, arguments: tuple[Value, ...]) -> str:
        strength, word = _PRECEDENCE[name], self.words.get(name, name)
        # Languages differ in what binds more of AND, OR, NOT and comparisons: parentheses say it.
        least = _ATOM if strength <= _PRECEDENCE["not"] else strength
        parts = [self._text(argument) for argument in arguments]
        if len(parts) == 1:
            text, own = parts[0]
            gap = " " if word.isalpha() else ""
            return f"{word}{gap}{text if own > least or own == _ATOM else f'({text})'}"
        (left, left_own), (right, right_own) = parts
        left = left if left_own >= least and left_own != _PRECEDENCE["negative"] else f"({left})"
        right = right if right_own > strength and right_own >= least and not right.startswith("-") else f"({right})"
        return f"{left} {word} {right}" if strength < _PRECEDENCE["*"] else f"{left}{word}{right}"

    def over(self, text: str, unit: float) -> tuple[str, int]:
        """Return a length or an angle of the controller in the unit of the program, and how strongly it binds."""
        return (text, _ATOM) if unit == 1.0 else (f"{text}/{unit:.10g}", _PRECEDENCE["/"])

    @abstractmethod
    def truth(self, truth: bool) -> str:  # noqa: FBT001 - a value
        """Return TRUE or FALSE."""

    @abstractmethod
    def pose(self, X: Array) -> str:
        """Return a pose (4, 4)."""

    @abstractmethod
    def variable(self, value: Variable) -> str:
        """Return a variable or an element."""

    @abstractmethod
    def signal(self, value: Signal) -> str:
        """Return the state of an input or output."""

    @abstractmethod
    def function(self, name: str, arguments: tuple[Value, ...]) -> tuple[str, int]:
        """Return an operation that is a function, and how strongly it binds."""

    def call(self, name: str, arguments: Iterable[str]) -> str:
        """Return the call of a function."""
        return f"{name}({', '.join(arguments)})"


class TextInDegrees(ValueText):
    """Values of a language that counts in millimetres and degrees, and may need functions that the file gets too.

    Attributes:
        helpers: names of these functions, in order.
    """

    def __init__(self, code: ProgramCode, names: Names) -> None:
        """Take the program and its names."""
        super().__init__(code, names)
        self.helpers: dict[str, None] = {}

    def helper(self, name: str) -> str:
        """Return the name of a function that the file gets too."""
        self.helpers[name] = None
        return self.names(name)

    def call(self, name: str, arguments: Iterable[str]) -> str:
        """Return the call of a function."""
        return f"{name}({','.join(arguments)})"

    def truth(self, truth: bool) -> str:  # noqa: FBT001 - a value
        """Return TRUE or FALSE."""
        return str(truth).upper()

    def degrees(self, value: Value) -> str:
        """Return an angle of the program in degrees."""
        return self.text(scaled(value, math.degrees(self.radians)))

    def millimetres(self, value: Value) -> str:
        """Return a length of the program in millimetres."""
        return self.text(scaled(value, self.metres * MILLIMETRES))

    def over_millimetres(self, text: str) -> tuple[str, int]:
        """Return a length of the controller in the unit of the program, and how strongly it binds."""
        return self.over(text, self.metres * MILLIMETRES)


class ProgramWriter(ABC):
    """A program while it is written: its name, its names, and its statements one after the other.

    Attributes:
        empty: what a list without statements has.
    """

    empty: tuple[str, ...] = ()

    def __init__(self, code: ProgramCode, limit: int, reserved: Collection[str], *others: str) -> None:
        """Take the program, how long names may be, and the words that are taken."""
        self._code = code
        self.name = identifier(code.name, limit, reserved)
        self._names = Names(limit, {*reserved, self.name.lower(), *others})

    def _block(self, statements: Iterable[Statement]) -> list[str]:
        return [line for statement in statements for line in self._lines(statement)]

    def _inner(self, statements: Iterable[Statement]) -> list[str]:
        return [f"  {line}" for line in self._block(statements) or self.empty]

    @abstractmethod
    def _lines(self, statement: Statement) -> Iterator[str]: ...


def number_text(value: float) -> str:
    """Return a number with the digits that it has, at most ten; whole ones have no point."""
    if value == round(value) and abs(value) < 1e9:
        return str(round(value))
    text = f"{value:.10f}".rstrip("0")
    return text if float(text) and abs(float(text) / value - 1) < 1e-9 else f"{value:.10g}"


def chunks_of_text(items: Iterable[str | Value]) -> list[str | Value]:
    """Return the items of a PRINT with the blanks between them, texts that follow one another being one."""
    parts: list[str | Value] = []
    for i, item in enumerate(items):
        for part in ([" "] if i else []) + [item]:
            if isinstance(part, str) and parts and isinstance(parts[-1], str):
                parts[-1] += part
            else:
                parts.append(part)
    return parts


def flat_index(indices: tuple[Value, ...], sizes: tuple[int, ...]) -> Value:
    """Return which element indices stand for, from 0, row by row."""
    total: Value = Number(0.0)
    for index, size in zip(indices, sizes, strict=True):
        total = _sum(_product(total, size), _sum(index, Number(-1.0)))
    return total


def _product(value: Value, factor: int) -> Value:
    return Number(value.value * factor) if isinstance(value, Number) else Operation("*", (value, Number(float(factor))))


def _sum(first: Value, second: Value) -> Value:
    if isinstance(first, Number) and isinstance(second, Number):
        return Number(first.value + second.value)
    if first == Number(0.0):
        return second
    if isinstance(second, Number) and second.value < 0:
        return Operation("-", (first, Number(-second.value)))
    return Operation("+", (first, second))


def number_of(code: ProgramCode, address: Output, name: str, span: Span | None = None, least: int = 0) -> int:
    """Return the number of an input or output.

    Raises:
        ExportError: it has none, or one that the controller does not count.
    """
    if address.number is None or address.number < least:
        text = f"the cell file gives {name} no number from {least} on, and the language knows it by its number"
        helps = ["write its number as the key `output`, or `input`"]
        raise refusal(code.source, "E615", text, span or Span(0, 0), "it is used in this program", helps=helps)
    return address.number
