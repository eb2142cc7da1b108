"""Where blanks stand between the words of a program, and where a line that is too long may end."""

from collections.abc import Sequence

import attrs

from armwright.program.formatter.pieces import Piece
from armwright.program.syntax.lexer import TokenKind

_NAME = TokenKind.NAME
_OPERANDS = frozenset((TokenKind.NAME, TokenKind.NUMBER, TokenKind.ARM, TokenKind.STRING))
_ARITHMETIC = frozenset(("+", "-", "*", "/"))
_NOTHING_BEFORE = frozenset((",", ")", "]", "."))
_OPENING, _CLOSING = frozenset(("(", "[")), frozenset((")", "]"))
_BRACKETS = _OPENING | _CLOSING
# What lists in parentheses stand behind, beside names.
_LIST_WORDS = frozenset(("PRINT", "VIA", "LOCK", "LOG", "RECOVER"))
# Before these words a line may end, before operations too, but rather not.
_PARTS = frozenset(
    ("TO", "AT", "FROM", "STEP", "WITH", "VIA", "DIRECTLY", "STRAIGHTLY", "CIRCULARLY", "SMOOTHLY", "ON")
) | frozenset(("RIGIDLY", "NONRIGIDLY", "WITHIN"))
_OPERATOR_PENALTIES = {
    **dict.fromkeys(("AND", "OR"), 1),
    **dict.fromkeys(("<", "<=", "<>", ">=", ">"), 3),
    **dict.fromkeys(("+", "-"), 4),
    **dict.fromkeys(("*", "/"), 5),
}
_NESTING_PENALTY = 10
_GROUP_PENALTY = 2
# A matrix: twelve numbers, in groups of three.
_MATRIX_COMMAS = 11


@attrs.define
class _Bracket:
    """One that is open: whether it holds the indices of an element, or numbers that may make a matrix."""

    is_index: bool
    is_list: bool
    items: list[Piece]


def set_blanks(pieces: Sequence[Piece]) -> None:
    """Find out for each piece whether a blank comes in front of it and whether a line may end there.

    Arithmetic stands close together inside of parentheses, and the numbers of a matrix in groups of three.
    """
    brackets: list[_Bracket] = []
    before = earlier = Piece("", ";", None, 0, 0, [])
    is_behind_operator = is_behind_minus = False
    for piece in pieces:
        word, last = piece.word, before.word
        is_operand = before.kind in _OPERANDS or last in _CLOSING
        is_operator = word in _ARITHMETIC
        if last == ",":
            _behind_comma(piece, brackets)
        elif word in _NOTHING_BEFORE or last in _OPENING or last == "." or is_behind_minus:
            piece.blank = False
        elif word in _OPENING:
            piece.blank = not _is_attached(piece, before, earlier) and not (is_behind_operator and brackets)
        elif is_behind_operator and brackets:
            # Of two signs the second is that of a number; the two are kept apart.
            piece.blank = is_operator
            before.blank = before.blank or is_operator
        elif is_operator and is_operand:
            piece.blank = not brackets
        if is_operand and word in _OPERATOR_PENALTIES:
            piece.penalty = _NESTING_PENALTY * len(brackets) + _OPERATOR_PENALTIES[word]
        elif word in _PARTS and not brackets:
            piece.penalty = 0
        is_behind_minus = word == "-" and not is_operand
        is_behind_operator = is_operator and is_operand
        if word in _BRACKETS:
            _bracket(piece, before, brackets)
        earlier, before = before, piece


def _is_attached(bracket: Piece, before: Piece, earlier: Piece) -> bool:
    """Whether a bracket stands close to the word in front of it, as in calls and elements of arrays."""
    if bracket.word == "[":
        return before.word != "ARRAY"
    return before.word == "PRINT" or (before.kind is _NAME and earlier.word != "READ")


def _behind_comma(piece: Piece, brackets: list[_Bracket]) -> None:
    piece.penalty = _NESTING_PENALTY * len(brackets)
    if brackets:
        brackets[-1].items.append(piece)
        if brackets[-1].is_index:
            piece.blank, piece.penalty = False, piece.penalty + _GROUP_PENALTY


def _bracket(piece: Piece, before: Piece, brackets: list[_Bracket]) -> None:
    """Open or close a bracket; group the numbers of a matrix."""
    if piece.word in _OPENING:
        is_list = piece.word == "[" or before.kind is _NAME or before.word in _LIST_WORDS
        brackets.append(_Bracket(piece.word == "[", is_list, []))
        return
    bracket = brackets.pop()
    if bracket.is_list or len(bracket.items) != _MATRIX_COMMAS:
        return
    for index, number in enumerate(bracket.items, 1):
        if index % 3:
            number.blank = False
            number.penalty = (number.penalty or 0) + _GROUP_PENALTY
