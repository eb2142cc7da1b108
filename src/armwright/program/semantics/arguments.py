"""Arguments of a program: other values for its constants, of the same types."""

from collections.abc import Mapping
from typing import TypeAlias

from armwright.errors import InvalidValueError, UnknownNameError, shown
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import TokenKind, scan

# The values of arguments by name, as a command line or a caller writes them.
Arguments: TypeAlias = Mapping[str, str | float | bool]

# Longer texts are no messages.
_MAX_TEXT = 1000
_EXPECTED = {
    VariableKind.SCALAR: "a number, such as 80 or 25.4mm",
    VariableKind.BOOLEAN: "TRUE or FALSE",
    VariableKind.TEXT: f"one line of at most {_MAX_TEXT} characters",
}


def argument_values(
    arguments: Arguments, constants: Mapping[str, tree.Constant], types: Mapping[str, VariableType | None]
) -> dict[str, tree.Expression]:
    """Return what takes the place of the values of constants, by key.

    Args:
        arguments: by name, in any case.
        constants: of the program, by key.
        types: of each constant; None where its own value is wrong.

    Raises:
        UnknownNameError: the program has no such constant.
        InvalidValueError: two arguments are for one constant, a value is of another type than the constant, or it is
            a constant of a type that cannot be given.
    """
    values: dict[str, tree.Expression] = {}
    for name, value in arguments.items():
        key = name.upper()
        if key not in constants:
            raise UnknownNameError("constant of the program", name, [node.name.text for node in constants.values()])
        if key in values:
            raise InvalidValueError(f"argument {name}: two values are given for this constant")
        kind = types.get(key)
        if kind is not None:
            values[key] = _expression(name, value, kind.kind, constants[key].value.span)
    return values


def _expression(name: str, value: str | float | bool, kind: VariableKind, span: Span) -> tree.Expression:  # noqa: FBT001 - what is given
    if kind not in _EXPECTED:
        raise InvalidValueError(
            f"argument {name}: the constant is a {kind}; only numbers, conditions and texts can be given"
        )
    written = str(value)
    expression: tree.Expression | None = None
    if kind is VariableKind.TEXT and isinstance(value, str) and len(value) <= _MAX_TEXT:
        # As in a program, a text stands on one line.
        expression = tree.String(span, value) if len(f"{value}.".splitlines()) == 1 else None
    elif kind is VariableKind.BOOLEAN and written.upper() in ("TRUE", "FALSE"):
        one = tree.Number(span, "1", 1.0)
        expression = tree.Binary(span, "=", one, tree.Number(span, "1", float(written.upper() == "TRUE")))
    elif kind is VariableKind.SCALAR and not isinstance(value, bool):
        expression = _number(written, span)
    if expression is None:
        raise InvalidValueError(f"argument {name}: expected {_EXPECTED[kind]}, got {shown(value)}")
    return expression


def _number(text: str, span: Span) -> tree.Number | None:
    """Return a number with its sign and unit; None where the text is none."""
    scanned = scan(Source("argument", text), text)
    tokens = [token for token in scanned.tokens if token.kind is not TokenKind.END]
    sign = -1.0 if tokens and tokens[0].key == "-" else 1.0
    digits = tokens[sign < 0 :]
    if scanned.diagnostics or len(digits) != 1 or digits[0].kind is not TokenKind.NUMBER:
        return None
    unit = digits[0].text[len(digits[0].key) :].upper() or None
    return tree.Number(span, text, sign * float(digits[0].key), unit)
