"""Occurrences of the names of a program and their kinds, from the tokens, so that incomplete programs have them too."""

import enum
from bisect import bisect_right
from collections.abc import Mapping, Sequence

import attrs

from armwright.program.language.kinds import VariableType
from armwright.program.language.source import Span
from armwright.program.language.words import SENSORS, statement_phrase
from armwright.program.semantics.builtins import AXES, FUNCTIONS, JOINTS, WITH_AXIS, WITH_KEY
from armwright.program.semantics.symbols import Scope, Symbols
from armwright.program.syntax.lexer import Token, TokenKind

# Behind these words and signs a statement begins.
STATEMENT_OPENERS = frozenset((";", "BEGIN", "THEN", "ELSE", "DO", "TRY", "RECOVER", "REPEAT", "COBEGIN"))
_NAME, _ARM, _KEYWORD = TokenKind.NAME, TokenKind.ARM, TokenKind.KEYWORD
# How far an index may reach before its variable is no longer taken for one that gets a value.
_MAX_INDEX_LENGTH = 50


class NameKind(enum.Enum):
    """What a name is where it stands."""

    VARIABLE = "variable"
    PROCEDURE = "procedure"
    FUNCTION = "function"
    ARM = "arm"
    DEVICE = "device"
    UNIT = "unit"
    SENSOR = "sensor"
    AXIS = "axis"
    VALUE = "value of the language"
    ERROR = "kind of error"
    WATCH = "name of a WHEN"
    TARGET = "joint target"
    TIMER = "timer"
    UNKNOWN = "unknown name"


# Not frozen, though nothing changes one: like tokens, there are many of them.
@attrs.define
class Occurrence:
    """A name in the text.

    Attributes:
        start: its first character.
        end: the one after its last.
        key: as compared.
        kind: what it is here.
        owner: the procedure whose own name it is; None for names of the program.
        type: of a variable, where it is known.
        declares: whether the name is declared here.
        writes: whether it gets a value here.
    """

    start: int
    end: int
    key: str
    kind: NameKind
    owner: str | None = None
    type: VariableType | None = None
    declares: bool = False
    writes: bool = False

    @property
    def span(self) -> Span:
        """Where it stands."""
        return Span(self.start, self.end)

    def refers_to_same(self, other: "Occurrence") -> bool:
        """Whether another occurrence is one of the same thing."""
        return (self.key, self.kind, self.owner) == (other.key, other.kind, other.owner)


@attrs.frozen
class ScopeExtents:
    """The names that are visible in each range of a text.

    Attributes:
        starts: where each range starts, in order; it ends where the next one starts.
        scopes: the names that are visible in each.
        brought: the names that modules give, as the text writes them, with their keys.
    """

    starts: Sequence[int]
    scopes: Sequence[Scope]
    brought: Mapping[str, str] = attrs.field(factory=dict)

    def meant(self, key: str, scope: Scope) -> str:
        """Return the key in the whole program of a name, which may be a field of a variable of a module."""
        parts = key.split(".")
        for count in range(len(parts), 1 if scope.is_local(parts[0]) else 0, -1):
            if (known := self.brought.get(".".join(parts[:count]))) is not None:
                return ".".join((known, *parts[count:]))
        return key

    def scope_at(self, offset: int) -> Scope:
        """Return the names that are visible at a position."""
        return self.scopes[bisect_right(self.starts, offset) - 1]


def scope_extents(symbols: Symbols, brought: Mapping[str, str]) -> ScopeExtents:
    """Return the ranges of a program in which the same names are visible: procedures, and the text between them.

    Args:
        symbols: all names.
        brought: those that modules give, as the text writes them, with their keys.
    """
    main = symbols.scope(None)
    starts, scopes = [0], [main]
    for key, procedure in sorted(symbols.procedures.items(), key=lambda item: item[1].node.span.start):
        starts += procedure.node.span
        scopes += [symbols.scope(key), main]
    return ScopeExtents(starts, scopes, brought)


# What a name behind these words is.
_NAMED = {
    **dict.fromkeys(("OPERATE", "PULSE"), NameKind.DEVICE),
    "TIMER": NameKind.TIMER,
    "WHEN": NameKind.WATCH,
}


def occurrences(tokens: Sequence[Token], scopes: ScopeExtents) -> tuple[Occurrence, ...]:
    """Return the names among some tokens.

    Args:
        tokens: in order.
        scopes: the names that are visible in each range of the text.
    """
    result: list[Occurrence] = []
    in_units = in_read = in_recover = False
    previous = ""
    for index, token in enumerate(tokens):
        kind, key = token.kind, token.key
        if kind is _NAME or kind is _ARM:
            next_key = tokens[index + 1].key if index + 1 < len(tokens) else ""
            name = _occurrence(token, scopes, previous, next_key, in_units=in_units)
            result.append(name)
            if previous == "RAISE" or (in_recover and previous in ("(", ",")):
                name.kind, name.owner, name.type, name.declares = NameKind.ERROR, None, None, False
            elif (in_read and previous in ("(", ",")) or previous == "FOR":
                name.writes = True
            elif previous in STATEMENT_OPENERS or not previous:
                name.writes = next_key == "=" or (next_key == "[" and _is_assigned(tokens, index + 1))
            elif previous == "(" and index > 1:
                _classify_argument(name, tokens[index - 2].key, next_key)
        elif kind is _KEYWORD or key in (";", ")"):
            in_units = key == "UNITS"
            in_recover = key == "RECOVER"
            in_read = key == "READ" or (in_read and key not in (";", ")") and kind is not _KEYWORD)
        previous = key
    return tuple(result)


def _classify_argument(name: Occurrence, function: str, next_key: str) -> None:
    """Change what the first argument of a function is, where that takes the name of something else than a variable."""
    if name.key in AXES and function in WITH_AXIS:
        name.kind, name.owner, name.type = NameKind.AXIS, None, None
    elif function in WITH_KEY and next_key == ")":
        name.kind, name.owner, name.type = NameKind.TIMER if function == "TIMER" else NameKind.DEVICE, None, None
    elif function == JOINTS and next_key == ")" and name.kind is NameKind.UNKNOWN:
        name.kind = NameKind.TARGET


def _occurrence(token: Token, scopes: ScopeExtents, previous: str, next_key: str, *, in_units: bool) -> Occurrence:
    """Return what a name or an arm is between the tokens around it."""
    start, end, key = token.start, token.end, token.key
    if token.kind is _ARM:
        return Occurrence(start, end, key, NameKind.ARM)
    if previous == ".":
        # The field of an element of an array.
        return Occurrence(start, end, key, NameKind.UNKNOWN)
    scope = scopes.scope_at(start)
    meant = key if scope.is_local(key) else scopes.meant(key, scope)
    return _classify_name(token, meant, scope, previous, next_key, in_units=in_units)


def _classify_name(token: Token, key: str, scope: Scope, previous: str, next_key: str, *, in_units: bool) -> Occurrence:
    """Return what a name, known by its key, is between the tokens around it."""
    start, end = token.start, token.end
    procedures = scope.symbols.procedures
    is_called = next_key == "(" and not scope.is_local(key)
    if previous in ("PROCEDURE", "FUNCTION") or (is_called and key in procedures):
        procedure = procedures.get(key)
        declares = procedure is not None and procedure.node.name.span.start == start
        return Occurrence(start, end, key, NameKind.PROCEDURE, declares=declares)
    if in_units:
        return Occurrence(start, end, key, NameKind.UNIT)
    phrase = statement_phrase(previous, key, next_key)
    if phrase or (previous == "READ" and key in SENSORS):
        return Occurrence(start, end, phrase or key, NameKind.SENSOR)
    if previous in _NAMED and (previous != "WHEN" or next_key in (":", "ON", "OFF")):
        return Occurrence(start, end, key, _NAMED[previous])
    if next_key == "(" and key in FUNCTIONS:
        return Occurrence(start, end, key, NameKind.FUNCTION)
    return _classify_variable(token, key, scope)


def _classify_variable(token: Token, key: str, scope: Scope) -> Occurrence:
    """Return which variable a name, known by its key, is, if it is one."""
    symbols, local = scope.symbols, scope.procedure
    names, owner = (local, local.node.name.key) if local is not None and key in local.types else (symbols, None)
    kind, declared = names.types.get(key), names.declared.get(key)
    if owner is None and kind is None and declared is None:
        what = NameKind.PROCEDURE if key in symbols.procedures else NameKind.UNKNOWN
        what = NameKind.VALUE if scope.is_value(key) else what
        return Occurrence(token.start, token.end, key, what)
    declares = declared is not None and declared.span.start == token.start
    return Occurrence(token.start, token.end, key, NameKind.VARIABLE, owner, kind, declares)


def _is_assigned(tokens: Sequence[Token], start: int) -> bool:
    """Whether ``=`` stands behind the index that begins at a token."""
    depth = 0
    for index in range(start, min(len(tokens), start + _MAX_INDEX_LENGTH)):
        key = tokens[index].key
        depth += (key == "[") - (key == "]")
        if not depth:
            return index + 1 < len(tokens) and tokens[index + 1].key == "="
    return False
