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
_LISTS = frozenset(("PRINT", "VIA", "LOCK"))
# Before these words a line may end, before operations too, but rather not.
_PARTS = frozenset(("TO", "AT", "FROM", "STEP", "WITH", "VIA", "DIRECTLY", "STRAIGHTLY", "ON", "RIGIDLY", "NONRIGIDLY"))
_WORSE = {
    **dict.fromkeys(("AND", "OR"), 1),
    **dict.fromkeys(("<", "<=", "<>", ">=", ">"), 3),
    **dict.fromkeys(("+", "-"), 4),
    **dict.fromkeys(("*", "/"), 5),
}
_DEEPER = 10
_IN_A_GROUP = 2
# A matrix: twelve numbers, in groups of three.
_COMMAS_OF_A_MATRIX = 11


@attrs.define
class _Bracket:
    """One that is open: whether it holds the indices of an element, or numbers that may make a matrix."""

    is_index: bool
    is_list: bool
    behind_commas: list[Piece]


def set_blanks(pieces: Sequence[Piece]) -> None:
    """Find out for each piece whether a blank comes in front of it and whether a line may end there.

    Arithmetic stands close together inside of parentheses, and the numbers of a matrix in groups of three.
    """
    open_: list[_Bracket] = []
    before = earlier = Piece("", ";", None, 0, 0, [])
    joining = unary = False
    for piece in pieces:
        word, last = piece.word, before.word
        is_operand = before.kind in _OPERANDS or last in _CLOSING
        is_sign = word in _ARITHMETIC
        if last == ",":
            _behind_comma(piece, open_)
        elif word in _NOTHING_BEFORE or last in _OPENING or unary:
            piece.blank = False
        elif word in _OPENING:
            piece.blank = not _belongs(piece, before, earlier) and not (joining and open_)
        elif joining and open_:
            # Of two signs the second is that of a number; the two are kept apart.
            piece.blank = is_sign
            before.blank = before.blank or is_sign
        elif is_sign and is_operand:
            piece.blank = not open_
        if is_operand and word in _WORSE:
            piece.cut = _DEEPER * len(open_) + _WORSE[word]
        elif word in _PARTS and not open_:
            piece.cut = 0
        unary = word == "-" and not is_operand
        joining = is_sign and is_operand
        if word in _BRACKETS:
            _bracket(piece, before, open_)
        earlier, before = before, piece


def _belongs(bracket: Piece, before: Piece, earlier: Piece) -> bool:
    """Whether a bracket stands close to the word in front of it, as in calls and elements of arrays."""
    if bracket.word == "[":
        return before.word != "ARRAY"
    return before.word == "PRINT" or (before.kind is _NAME and earlier.word != "READ")


def _behind_comma(piece: Piece, open_: list[_Bracket]) -> None:
    piece.cut = _DEEPER * len(open_)
    if open_:
        open_[-1].behind_commas.append(piece)
        if open_[-1].is_index:
            piece.blank, piece.cut = False, piece.cut + _IN_A_GROUP


def _bracket(piece: Piece, before: Piece, open_: list[_Bracket]) -> None:
    """Open or close a bracket; group the numbers of a matrix."""
    if piece.word in _OPENING:
        is_list = piece.word == "[" or before.kind is _NAME or before.word in _LISTS
        open_.append(_Bracket(piece.word == "[", is_list, []))
        return
    bracket = open_.pop()
    if bracket.is_list or len(bracket.behind_commas) != _COMMAS_OF_A_MATRIX:
        return
    for index, number in enumerate(bracket.behind_commas, 1):
        if index % 3:
            number.blank = False
            number.cut = (number.cut or 0) + _IN_A_GROUP
