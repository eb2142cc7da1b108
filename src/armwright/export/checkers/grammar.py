"""Parsers of the languages of controllers, made of the grammars beside this file."""

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.export.checkers.actions import CheckError
from armwright.extras import import_extra

_GRAMMARS = Path(__file__).with_name("grammars")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_FIELD = re.compile(rf"([A-Za-z]\w*)\s+({_NUMBER.pattern})")


def parse(language: str, text: str) -> Any:
    """Return the syntax tree of a program.

    Args:
        language: name of its grammar, such as ``krl``.
        text: of the program.

    Raises:
        MissingExtraError: Lark is not installed.
        CheckError: the text is no program of the language; the message has the line.
    """
    lark = import_extra("lark", "checking an exported program", "export")
    try:
        return _parser(language).parse(text if text.endswith("\n") else text + "\n")
    except lark.exceptions.UnexpectedInput as error:
        raise CheckError(f"line {error.line}: this is no {language}: {error.get_context(text).strip()}") from None


@cache
def _parser(language: str) -> Any:
    lark = import_extra("lark", "checking an exported program", "export")
    grammar = (_GRAMMARS / f"{language}.lark").read_text(encoding="utf-8")
    return lark.Lark(grammar, parser="lalr", propagate_positions=True)


def vector(token: str, length: int, line: int) -> Array:
    """Return the numbers of a word such as ``[1, 2]``.

    Raises:
        CheckError: there are not so many.
    """
    numbers = np.array([float(number) for number in _NUMBER.findall(token)])
    if len(numbers) != length:
        raise CheckError(f"line {line}: expected {length} numbers, got {token}")
    return numbers


def fields(token: str) -> dict[str, float]:
    """Return the numbers of a word such as ``{X 1, Y 2}`` by name, in upper case."""
    return {name.upper(): float(number) for name, number in _FIELD.findall(token)}


def number(node: Any, line: int) -> float:
    """Return the value of a number, with or without a sign.

    Raises:
        CheckError: it is something else.
    """
    data = getattr(node, "data", None)
    if data == "number":
        return float(node.children[0])
    if data == "signed":
        sign, value = node.children
        return -number(value, line) if sign == "-" else number(value, line)
    raise CheckError(f"line {line}: expected a number")
