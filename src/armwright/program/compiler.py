"""The whole way from a text to code, in one call."""

import attrs

from armwright.program import check, flow, tree
from armwright.program.code import Code
from armwright.program.diagnostics import Diagnostic, in_order
from armwright.program.known import KnownCell
from armwright.program.numbering import without_numbers
from armwright.program.parse import parse
from armwright.program.source import Source
from armwright.program.tokens import Token, TokenKind, scan
from armwright.program.translate import translate


@attrs.frozen(kw_only=True)
class Compilation:
    """What became of a text.

    Attributes:
        source: the text.
        tokens: its words.
        tree: what it says.
        diagnostics: what is wrong or odd, in the order of the text.
        code: what it does; None when there are errors.
    """

    source: Source
    tokens: tuple[Token, ...]
    tree: tree.Program
    diagnostics: tuple[Diagnostic, ...]
    code: Code | None


def compile(source: Source, cell: KnownCell | None = None, *, strict: bool = False) -> Compilation:  # noqa: A001
    """Translate a program.

    Args:
        source: the text, in RLO-83.
        cell: what the program will act on; without one, some questions stay open.
        strict: whether an AFFIX that is only implied is an error.

    Returns:
        Tree, diagnostics and, where there are no errors, code. A wrong program raises nothing.
    """
    text, found = without_numbers(source)
    tokens, odd = scan(source, text)
    program, slips = parse(source, tokens)
    symbols, wrong = check.check(program, cell)
    spelling = {token.key: token.text for token in reversed(tokens) if token.kind is TokenKind.NAME}
    found += [*odd, *slips]
    guessed = any(one.is_syntax for one in found)
    # Where the parser had to guess, a name may seem unused, and what the statements do cannot be told.
    found += [one for one in wrong if not (guessed and one.code == "L304")]
    code = None
    if not guessed:
        course, odd_course = flow.check(program, symbols, spelling, cell, strict=strict)
        found += odd_course
        if not any(one.is_error for one in found):
            code = translate(source, program, symbols, course, spelling)
    return Compilation(source=source, tokens=tuple(tokens), tree=program, diagnostics=in_order(found), code=code)
