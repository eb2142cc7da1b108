"""Values in the language of FANUC's pendant: registers, flags, signals, and what the exporter works out."""

import re
from typing import NoReturn

from armwright.arrays import Array
from armwright.export.refusals import refusal
from armwright.export.translation.code import (
    FunctionCall,
    Number,
    Operation,
    ProgramCode,
    Signal,
    Truth,
    Value,
    Variable,
)
from armwright.export.writers.known_values import KnownValues
from armwright.export.writers.program_text import Names, ValueText, number_of, number_text
from armwright.program.language.source import Span

# The first of the registers and flags that the variables are, and the last.
FIRST_REGISTER, _LAST = 101, 200
# Characters of the name of a register.
_COMMENT_LIMIT = 16
_ARITHMETIC = ("+", "-", "*", "/", "<", "<=", "=", "<>", ">=", ">", "and", "or")
_CONTRARY = {"<": ">=", "<=": ">", "=": "<>", "<>": "=", ">=": "<", ">": "<="}


class FanucText(ValueText):
    """Values in the language of the pendant.

    Attributes:
        known: what the variables hold where the value stands.
        span: the statement there.
    """

    words = {"and": "AND", "or": "OR", "not": "!"}  # noqa: RUF012 - read alone

    def __init__(self, code: ProgramCode) -> None:
        super().__init__(code, Names(_COMMENT_LIMIT, ()))
        self.known, self.span = KnownValues.at_start(code), Span(0, 0)
        self._registers: dict[tuple[str, tuple[int, ...]], str] = {}

    def text(self, value: Value) -> str:
        """Return a value, in parentheses where it is worked out."""
        text = re.sub(r" ([-+<>=]+) ", r"\1", self._text(self.plain(value))[0])
        return text if re.fullmatch(r"[\d.]+|ON|OFF|[A-Z]+\[[^\]]*\]", text) else f"({text})"

    def condition(self, value: Value) -> str:
        """Return a condition in parentheses, in which it may be of any kind."""
        text = self.text(value)
        return text if text.startswith("(") else f"({text})"

    def register(self, name: str) -> str:
        """Return a register of the writer's own."""
        return self._register((f"{name} OWN", ()), "R")

    def refuse(self, message: str, *helps: str, code: str = "E619") -> NoReturn:
        """Refuse the statement."""
        advice = helps or ("export the run by `--mode plan`",)
        raise refusal(self.code.source, code, message, self.span, "it stands here", helps=advice)

    def plain(self, value: Value) -> Value:
        """Return a value of registers and signals alone, with what only the exporter can work out put in."""
        match value:
            case Operation("negative", (inner,)):
                return self.plain(Operation("-", (Number(0.0), inner)))
            case Operation("not", (inner,)):
                return negated(self.plain(inner))
            case Operation(name, arguments) if name in _ARITHMETIC:
                return self._short(name, tuple(map(self.plain, arguments)))
            case Operation(name, _):
                known = self.known.value(value)
                if known is None:
                    text = f"what {name.upper()} gives is known only while the program runs, and has no counterpart"
                    self.refuse(text, code="E620")
                return self.plain(known)
            case FunctionCall(procedure=key):
                known = self.known.value(value)
                if known is None:
                    self.refuse(f"a called program has no value, and that of `{key.lower()}` is known only at run time")
                return self.plain(known)
            case Number(value=number) if "e" in number_text(number):
                self.refuse(f"the number {number:g} cannot be written without an exponent, which the language has not")
        return value

    def _short(self, name: str, arguments: tuple[Value, ...]) -> Value:
        """Return an operation; what it makes of constants, where it has no others."""
        if all(isinstance(one, Number | Truth) for one in arguments):
            known = self.known.value(Operation(name, arguments))
            return Operation(name, arguments) if known is None else known
        if name in ("and", "or"):
            decides = Truth(name == "or")
            left = tuple(one for one in arguments if not isinstance(one, Truth))
            return decides if decides in arguments else left[0] if len(left) == 1 else Operation(name, left)
        return Operation(name, arguments)

    def truth(self, truth: bool) -> str:  # noqa: FBT001 - a value
        """Return a truth value."""
        return "ON" if truth else "OFF"

    def pose(self, X: Array) -> str:
        """Refuse a pose, for which the language has no value."""
        raise AssertionError(f"a pose is no value of the language: {X}")

    def variable(self, value: Variable) -> str:
        """Return the register or the flag of a variable."""
        place = self.known.place(value)
        if place is None:
            self.refuse("which element this is is known only while the program runs", code="E620")
        return self._register(place, "F" if self.code.kinds[value.key] == "truth" else "R")

    def _register(self, place: tuple[str, tuple[int, ...]], kind: str) -> str:
        if place not in self._registers:
            number = FIRST_REGISTER + sum(one.startswith(f"{kind}[") for one in self._registers.values())
            if number > _LAST:
                self.refuse(f"the program needs more than {_LAST - FIRST_REGISTER + 1} registers", code="E617")
            name = self.names("_".join((place[0], *map(str, place[1]))))
            self._registers[place] = f"{kind}[{number}:{name}]"
        return self._registers[place]

    def signal(self, value: Signal) -> str:
        """Return an input or an output."""
        number = number_of(self.code, value.address, value.name, self.span, least=1)
        return f"{'DI' if value.is_input else 'DO'}[{number}]"

    def function(self, name: str, arguments: tuple[Value, ...]) -> tuple[str, int]:
        """Refuse a function, which has been worked out before."""
        raise AssertionError(f"{name} of {arguments} has been worked out")


def negated(value: Value) -> Value:
    """Return the contrary of a condition, in which a signal or a flag alone is negated."""
    match value:
        case Operation("not", (inner,)):
            return inner
        case Operation("and" | "or" as name, arguments):
            return Operation("or" if name == "and" else "and", tuple(map(negated, arguments)))
        case Operation(name, arguments):
            return Operation(_CONTRARY[name], arguments)
        case Truth(value=truth):
            return Truth(not truth)
    return Operation("not", (value,))
